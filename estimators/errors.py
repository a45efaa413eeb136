"""The exceptions of estimators: one small tree."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from estimators.friction_model import FrictionModel


class EstimatorError(Exception):
    """Whatever an estimator refuses to do."""


class InvalidSamples(EstimatorError, ValueError):
    """Samples or an option that cannot be used: ``name`` of the thing, its ``value``, what is ``allowed``."""

    def __init__(self, name: str, value: object, allowed: str) -> None:
        self.name, self.value, self.allowed = name, str(value), allowed
        super().__init__(name, self.value, allowed)

    def __str__(self) -> str:
        return f"{self.name} is {self.value}; allowed: {self.allowed}"


class TooFewSamples(InvalidSamples):
    """Not enough (distinct) samples to fit the model: no slip was seen, or hardly any."""


class NotConverged(EstimatorError):
    """An iteration or a chain stopped before it could be trusted; ``model`` carries what it had reached."""

    def __init__(self, reason: str, model: "FrictionModel") -> None:
        self.reason, self.model = reason, model
        super().__init__(reason, model)

    def __str__(self) -> str:
        return f"not converged: {self.reason}"
