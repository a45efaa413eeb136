"""What a run on a free grid costs, before it is made: load steps on cells, at the pace of the runs so far."""

from dataclasses import dataclass, field

import numpy as np

from slipcore.contact.defaults import ACCURACY, PROBE
from slipcore.contact.plan.plan import Plan
from slipcore.contact.tiers.boundary_elements import Fidelity, step_growth
from slipcore.contact.tiers.free_grid import sides
from slipcore.contact.tiers.load_steps import LoadSteps
from slipcore.contact.tiers.probe import ContactProbe
from slipcore.contact.tiers.sampling import frame_times


@dataclass(frozen=True, slots=True)
class Size:
    """Load ``steps`` of a run and ``cells`` of its whole grid."""

    steps: int
    cells: int

    def work(self, overhead: float) -> float:
        """In steps on one cell, each step with as much beside its cells as ``overhead`` of them cost."""
        return self.steps * (_load(overhead) + _load(self.cells))


def _load(cells: float) -> float:
    """What cells cost in a step: more than in proportion, since transforms do, and iterations."""
    return float(cells**ACCURACY.cost_order)


class Sizes:
    """Of runs of a plan with a sensor, whose contact is known."""

    def __init__(self, plan: Plan, contact: ContactProbe) -> None:
        assert plan.sampling is not None
        self._sampling, self._reach = plan.sampling, PROBE.room * contact.reach
        self._growths = LoadSteps(plan, contact).growths(frame_times(plan))

    def of(self, fidelity: Fidelity) -> Size:
        """Of a run at a fidelity: ``LoadSteps`` are as many but for rounding."""
        nx, ny = sides(self._sampling, self._reach, fidelity.cells)
        parts, moves = fidelity.substeps, self._growths / step_growth(fidelity)
        # Each part of a frame is cut by itself: half a step more than its share, on average.
        steps = np.where(moves > parts, np.ceil(moves + 0.5 * (parts - 1)), parts)
        return Size(int(steps.sum()), nx * ny)


@dataclass(slots=True)
class Pace:
    """Seconds of runs: what the finest took, and what steps and cells took of it where grids differ."""

    _runs: list[tuple[Size, float]] = field(default_factory=list)

    def learn(self, size: Size, seconds: float) -> None:
        """Note what a run took."""
        self._runs.append((size, seconds))

    @property
    def overhead(self) -> float:
        """Cells that cost as much in a step as all that does not grow with them."""
        usual = ACCURACY.overhead_cells
        if len(self._runs) < 2:
            return usual
        small = min(self._runs, key=lambda run: run[0].cells)
        large = max(self._runs, key=lambda run: run[0].cells)
        if large[0].cells < ACCURACY.telling_growth * small[0].cells:
            return usual
        first, last = (seconds / size.steps for size, seconds in (small, large))
        slope = (last - first) / (_load(large[0].cells) - _load(small[0].cells))
        spread = ACCURACY.overhead_spread
        if slope <= 0.0:
            return usual * spread
        beside = float(max(last / slope - _load(large[0].cells), 0.0) ** (1.0 / ACCURACY.cost_order))
        return min(max(beside, usual / spread), usual * spread)

    def seconds(self, size: Size) -> float:
        """What a run should take; 0 before the first."""
        if not self._runs:
            return 0.0
        overhead = self.overhead
        most, took = max(self._runs, key=lambda run: run[0].work(overhead))
        return took * size.work(overhead) / most.work(overhead)
