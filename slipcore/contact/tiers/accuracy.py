"""Accuracy on request: how far a log is from a finer one, and which fidelity brings that below what is asked."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipcore.contact.defaults import ACCURACY, PROBE
from slipcore.contact.errors import NotConverged
from slipcore.contact.plan.plan import Plan, SamplingPlan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.tiers.boundary_elements import Fidelity, contact_reach, run
from slipcore.contact.tiers.sampling import sensor_grid
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, GraspLog


@dataclass(frozen=True, slots=True)
class Difference:
    """How far two logs of a scene are apart.

    ``stick_ratio``: largest absolute difference over time; ``displacement``, ``force``: relative L2 over time at the
    sensor's points.
    """

    stick_ratio: float
    displacement: float
    force: float

    def times(self, factor: float) -> "Difference":
        """All three multiplied."""
        return Difference(factor * self.stick_ratio, factor * self.displacement, factor * self.force)

    @property
    def largest(self) -> float:
        """The largest of the three: what ``accuracy`` means."""
        return max(self.stick_ratio, self.displacement, self.force)


def difference(log: GraspLog, reference: GraspLog) -> Difference:
    """Difference of a log from a reference at the same points and frames; both with truth, before observation."""
    if log.truth is None or reference.truth is None or log.force is None or reference.force is None:
        raise InvalidInput("log", "without truth or forces", "a simulated log")
    ratios = np.abs(log.truth.stick_ratio - reference.truth.stick_ratio)
    return Difference(
        stick_ratio=float(np.nanmax(ratios, initial=0.0)),
        displacement=_relative(log.displacement, reference.displacement),
        force=_relative(log.force, reference.force),
    )


def _relative(values: FloatArray, reference: FloatArray) -> float:
    size = float(np.sqrt(np.sum(reference**2)))
    return float(np.sqrt(np.sum((values - reference) ** 2))) / size if size > 0.0 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A log, what it was made with, and its estimated error (a ``Difference`` from the unknown limit)."""

    log: GraspLog
    fidelity: Fidelity
    error: Difference
    seconds: float


def simulate_to(
    plan: Plan, accuracy: float | None = None, seconds: float | None = None, progress: Progress = no_progress
) -> Refined:
    """The cheapest log that is estimated to be as accurate as asked, or the best one within about ``seconds``.

    ``progress`` is told from the first estimate on: before that nobody knows what the accuracy will take.

    Raises ``NotConverged`` where the finest grid does not reach the accuracy asked.
    """
    for name, value in (("accuracy", accuracy), ("seconds", seconds)):
        if value is not None and not 0.0 < value < np.inf:
            raise InvalidInput(name, value, "finite and above 0")
    began, target = time.perf_counter(), 0.0 if accuracy is None else accuracy
    budget = np.inf if seconds is None else seconds
    forecast = _Forecast(began, budget, progress)
    for found in _refinements(_sampled(plan), target, forecast):
        if found.error.largest <= target or time.perf_counter() - began + _next_seconds(found, target) > budget:
            break
    if seconds is None and found.error.largest > target:
        raise NotConverged("accuracy", found.error.largest, target, found.fidelity.cells)
    return replace(found, seconds=time.perf_counter() - began)


def refinements(plan: Plan, seconds: float, progress: Progress = no_progress) -> Iterator[Refined]:
    """Ever finer logs, as long as the next one fits into about ``seconds``; theirs are what a request for that accuracy
    takes, those of all coarser ones among them.
    """
    if not 0.0 < seconds < np.inf:
        raise InvalidInput("seconds", seconds, "finite and above 0")
    began = time.perf_counter()
    for found in _refinements(_sampled(plan), 0.0, _Forecast(began, seconds, progress)):
        spent = time.perf_counter() - began
        yield replace(found, seconds=spent)
        if spent + _next_seconds(found, 0.0) > seconds:
            return


@dataclass(frozen=True, slots=True)
class _Forecast:
    """Tells ``progress`` the part of the seconds since ``began`` and of those that are left, within a ``budget``."""

    began: float
    budget: float
    progress: Progress

    def of_next(self, last: Refined, target: float) -> Progress:
        """Whom the run after the ``last`` one tells how far it is."""
        spent, takes = time.perf_counter() - self.began, _next_seconds(last, target)
        total = min(spent + max(takes, _seconds_left(last, target)), self.budget)
        return lambda part: self.progress(min((spent + part * takes) / total, 1.0))


def _refinements(plan: Plan, target: float, forecast: _Forecast) -> Iterator[Refined]:
    """Ever finer logs, each with an error estimated from its difference from the one before."""
    reach = PROBE.room * contact_reach(plan)
    tolerance = min(ACCURACY.loosest, ACCURACY.solver_share * target) if target > 0.0 else ACCURACY.timed_tolerance
    fidelity, step_error, coarse = _steps(plan, Fidelity(ACCURACY.coarsest_cells, 1, tolerance), target)
    cells, error = _across(plan, reach, ACCURACY.coarsest_cells), np.inf
    tell: Progress = no_progress
    while error == np.inf or cells < ACCURACY.finest_cells:
        fidelity = replace(fidelity, cells=_next_cells(cells, error, target))
        began = time.perf_counter()
        fine = run(plan, fidelity, tell)
        spent, finer = time.perf_counter() - began, _across(plan, reach, fidelity.cells)
        estimate = _extrapolated(difference(coarse, fine), finer / cells, step_error)
        found = Refined(fine, fidelity, estimate, spent)
        yield found
        coarse, cells, error, tell = fine, finer, estimate.largest, forecast.of_next(found, target)


def _steps(plan: Plan, fidelity: Fidelity, target: float) -> tuple[Fidelity, Difference, GraspLog]:
    """Fidelity with enough load steps a frame, the error that they leave, and its log, all on the coarsest grid.

    The error of steps falls in proportion to them: halving them shows it.
    """
    log = run(plan, fidelity)
    while True:
        halved = replace(fidelity, substeps=2 * fidelity.substeps)
        finer = run(plan, halved)
        left = difference(log, finer)
        if 2.0 * left.largest <= ACCURACY.step_share * target or target == 0.0:
            return fidelity, left.times(2.0), log
        if left.largest <= ACCURACY.step_share * target or halved.substeps >= ACCURACY.most_substeps:
            return halved, left, finer
        fidelity, log = halved, finer


def _extrapolated(change: Difference, ratio: float, step_error: Difference) -> Difference:
    """Error of the finer of two grids whose cells are ``ratio`` apart, at first order, with that of the steps."""
    grid = change.times(ACCURACY.safety / (ratio - 1.0))
    return Difference(
        grid.stick_ratio + step_error.stick_ratio,
        grid.displacement + step_error.displacement,
        grid.force + step_error.force,
    )


def _next_cells(cells: int, error: float, target: float) -> int:
    """Cells across at which an error that falls with their size should meet the target; never too far at once."""
    least, most = ACCURACY.first_growth, ACCURACY.largest_growth
    growth = least if not np.isfinite(error) else ACCURACY.overshoot * error / target if target > 0.0 else most
    return int(np.ceil(cells * min(max(growth, least), most)))


def _next_seconds(last: Refined, target: float) -> float:
    """Seconds that the next grid would take."""
    growth = _next_cells(last.fidelity.cells, last.error.largest, target) / last.fidelity.cells
    return last.seconds * float(growth**ACCURACY.cost_order)


def _seconds_left(last: Refined, target: float) -> float:
    """Seconds that all further grids would take, by the last and finest of them."""
    finest = ACCURACY.finest_cells / last.fidelity.cells
    growth = min(ACCURACY.overshoot * last.error.largest / target, finest) if target > 0.0 else finest
    return last.seconds * float(growth**ACCURACY.cost_order)


def _across(plan: Plan, reach: float, cells: int) -> int:
    """Cells that a fidelity really has across the contact, after rounding to the sensor's pitch."""
    return int(2.0 * reach / sensor_grid(plan.sampling, reach, cells).grid.pitch[0])


def _sampled(plan: Plan) -> Plan:
    """The plan with points that do not change with the grid; without a sensor they cover the contact."""
    if plan.sampling is not None:
        return plan
    pitch = 2.0 * PROBE.room * contact_reach(plan) / ACCURACY.points
    rate = ACCURACY.frames / plan.duration
    return replace(plan, sampling=SamplingPlan((ACCURACY.points, ACCURACY.points), pitch, rate))
