"""The runs of one request: their clock, their pace, what is left of the budget, and to whom to report."""

import time
from collections.abc import Iterable

import numpy as np

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.price import Pace, Size, Sizes
from slipcore.contact.tiers.probe import ContactProbe
from slipcore.frames import GraspLog


class OutOfTime(Exception):
    """A run was ended, since what is left of the budget does not hold it; ``seconds`` it would take."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        super().__init__(seconds)


class Runs:
    """Runs of plans with this contact, within ``budget`` s (inf for any time); ``strict``: a run that proves to take
    far more than what is left of it is ended.
    """

    def __init__(self, contact: ContactProbe, budget: float, progress: Progress, *, strict: bool = True) -> None:
        self._contact, self.budget, self._strict = contact, budget, strict
        self._began, self._progress, self._reported = time.perf_counter(), progress, 0.0
        self._pace, self._done, self._ahead = Pace(), 0.0, 0.0
        self._sizes: dict[float, Sizes] = {}

    @property
    def spent(self) -> float:
        """Seconds since the request."""
        return time.perf_counter() - self._began

    @property
    def left(self) -> float:
        """Seconds of the budget that are left."""
        return self.budget - self.spent

    def price(self, plan: Plan, fidelity: Fidelity) -> float:
        """Seconds that a run should take, by those until now; 0 before the first."""
        return self._pace.seconds(self._size(plan, fidelity))

    def expect(self, plan: Plan, fidelities: Iterable[Fidelity]) -> None:
        """Note which runs are to come: what ``progress`` is a part of."""
        self._ahead = sum(_work(self._size(plan, fidelity)) for fidelity in fidelities)

    def run(self, plan: Plan, fidelity: Fidelity) -> GraspLog:
        """One run; ends with ``OutOfTime`` where the budget is strict and does not hold it."""
        size, began = self._size(plan, fidelity), self.spent

        def heard(part: float) -> None:
            took = self.spent - began
            self._tell(part * _work(size), _work(size))
            late = part >= ACCURACY.telling_part and began + took / part > ACCURACY.overdrawn * self.budget
            if self._strict and part < 1.0 and (late or self.spent > ACCURACY.overdrawn * self.budget):
                raise OutOfTime(took / max(part, ACCURACY.least_part))

        log = run(plan, fidelity, heard)
        self._pace.learn(size, self.spent - began)
        self._done += _work(size)
        self._ahead -= _work(size)
        return log

    def _size(self, plan: Plan, fidelity: Fidelity) -> Size:
        """Of a run; plans differ in their frame rate alone."""
        assert plan.sampling is not None
        rate = plan.sampling.frame_rate
        if rate not in self._sizes:
            self._sizes[rate] = Sizes(plan, self._contact)
        return self._sizes[rate].of(fidelity)

    def _tell(self, now: float, whole: float) -> None:
        """Report which part of the work, or of the budget, is done: never less than before."""
        part = (self._done + now) / (self._done + ACCURACY.more_ahead * max(whole, self._ahead))
        if np.isfinite(self.budget):
            part = self.spent / self.budget
        self._reported = min(max(self._reported, part), 1.0)
        self._progress(self._reported)


def _work(size: Size) -> float:
    return size.work(ACCURACY.overhead_cells)
