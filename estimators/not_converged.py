"""The error of a fit that stopped before its result could be trusted."""

from estimators.errors import EstimatorError
from estimators.friction_model import FrictionModel


class NotConverged(EstimatorError):
    """An iteration or a chain stopped before it could be trusted; ``model`` carries what it had reached."""

    def __init__(self, reason: str, model: FrictionModel) -> None:
        self.reason, self.model = reason, model
        super().__init__(reason, model)

    def __str__(self) -> str:
        return f"not converged: {self.reason}"
