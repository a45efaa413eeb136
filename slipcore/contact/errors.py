"""What the contact simulator refuses or could not do."""

from slipcore.errors import InvalidInput, SlipcoreError
from slipcore.frames import FloatArray


class InfeasibleLoad(InvalidInput):
    """A tangential load outside the limit surface of friction; ``factor`` (below 1) times it would be on it."""

    def __init__(self, load: FloatArray, factor: float) -> None:
        self.load, self.factor = load, factor
        times = 1.0 / factor if factor > 0.0 else float("inf")
        value = f"F = ({load[0]:.6g}, {load[1]:.6g}) N, M = {load[2]:.6g} N·m, {times:.12g} times what friction carries"
        InvalidInput.__init__(self, "tangential load", value, "inside the limit surface (a factor of at most 1)")

    def __reduce__(self) -> tuple[type, tuple[FloatArray, float]]:
        return type(self), (self.load, self.factor)


class NotConverged(SlipcoreError):
    """A solver stopped at its iteration bound; ``residual`` is what it reached and ``tolerance`` what was asked."""

    def __init__(self, what: str, residual: float, tolerance: float, iterations: int) -> None:
        self.what, self.residual, self.tolerance, self.iterations = what, residual, tolerance, iterations
        super().__init__(what, residual, tolerance, iterations)

    def __str__(self) -> str:
        return (
            f"{self.what}: residual {self.residual:.3g} after {self.iterations} iterations, asked {self.tolerance:.3g}"
        )
