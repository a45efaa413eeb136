"""The exceptions of estimators: one small tree."""


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
    """Not enough (distinct) samples to fit the model: no slip gave any, or hardly any."""
