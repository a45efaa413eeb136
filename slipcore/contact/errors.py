"""What the contact simulator refuses or could not do."""

import math

from slipcore.errors import InvalidInput, SlipcoreError
from slipcore.frames import FloatArray, GraspLog


class NotConverged(SlipcoreError):
    """A solver stopped at its iteration bound; ``residual`` is what it reached and ``tolerance`` what was asked."""

    def __init__(self, what: str, residual: float, tolerance: float, iterations: int) -> None:
        self.what, self.residual, self.tolerance, self.iterations = what, residual, tolerance, iterations
        super().__init__(what, residual, tolerance, iterations)

    def __str__(self) -> str:
        return (
            f"{self.what}: residual {self.residual:.3g} after {self.iterations} iterations, asked {self.tolerance:.3g}"
        )


class InfeasibleLoad(InvalidInput):
    """A tangential load outside the limit surface of friction; ``factor`` (below 1) times it would be on it."""

    def __init__(self, load: FloatArray, factor: float) -> None:
        self.load, self.factor = load, factor
        times = 1.0 / factor if factor > 0.0 else float("inf")
        value = f"F = ({load[0]:.6g}, {load[1]:.6g}) N, M = {load[2]:.6g} N·m, {times:.12g} times what friction carries"
        InvalidInput.__init__(self, "tangential load", value, "inside the limit surface (a factor of at most 1)")

    def __reduce__(self) -> tuple[type, tuple[FloatArray, float]]:
        return type(self), (self.load, self.factor)


class OutOfReach(InvalidInput, NotConverged):
    """A request that is refused before it is tried: ``least`` of its ``name`` can be asked for.

    ``seconds`` is what that takes: by the runs that were made, on this machine. It is a ``NotConverged``, too,
    with ``least`` for its ``residual``: that is what an accuracy out of reach raised before it was refused.
    """

    def __init__(self, name: str, asked: float, least: float, seconds: float) -> None:
        self.asked, self.least, self.seconds = asked, least, seconds
        self.what, self.residual, self.tolerance, self.iterations = name, least, asked, 0
        takes = "" if name == "seconds" else f", which takes about {_duration(seconds)}"
        least_told = f"{_duration(least) if name == 'seconds' else f'{rounded_up(least):g}'} or more"
        InvalidInput.__init__(self, name, f"{asked:g}", least_told + takes)

    def __reduce__(self) -> tuple[type, tuple[str, float, float, float]]:
        return type(self), (self.name, self.asked, self.least, self.seconds)


class ManyRuns(InvalidInput):
    """An explanation that takes many ``runs``, about ``seconds`` in all, which must be asked for."""

    def __init__(self, runs: int, seconds: float) -> None:
        self.runs, self.seconds = runs, seconds
        takes = f"{runs}, about {_duration(seconds)} in all"
        InvalidInput.__init__(
            self, "coarse runs to explain", takes, "so many where they are asked for: all_runs, --yes"
        )

    def __reduce__(self) -> tuple[type, tuple[int, float]]:
        return type(self), (self.runs, self.seconds)


def rounded_up(value: float) -> float:
    """To two digits, so that what is asked by it is no less than what can be had."""
    nearest = float(f"{value:.2g}")
    if nearest >= value:
        return nearest
    return float(f"{nearest + 10.0 ** (math.floor(math.log10(value)) - 1):.2g}")


def _duration(seconds: float) -> str:
    """Never less than it is."""
    if seconds < 100.0:
        return f"{rounded_up(seconds):g} s"
    return f"{math.ceil(seconds / 60)} min" if seconds < 6000.0 else f"{math.ceil(seconds / 3600)} h"


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a request; ``log`` is the best that was made until then, its metadata give its accuracy."""

    def __init__(self, log: GraspLog) -> None:
        self.log = log
        KeyboardInterrupt.__init__(self, "interrupted")
