"""Accuracy on request: how far a log is from a finer one, and which fidelity brings that below what is asked."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipcore.contact.defaults import ACCURACY, PROBE
from slipcore.contact.errors import NotConverged, OutOfReach
from slipcore.contact.plan.plan import Plan, SamplingPlan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.solver.warm_up import load_kernels
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.choice import check_request
from slipcore.contact.tiers.difference import Difference as Difference
from slipcore.contact.tiers.difference import difference as difference
from slipcore.contact.tiers.extrapolation import grid_error, on_finer
from slipcore.contact.tiers.probe import probe
from slipcore.contact.tiers.requests import OutOfTime, Runs
from slipcore.contact.tiers.sampling import frame_times
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """A log, what it was made with, and its estimated error (a ``Difference`` from the unknown limit)."""

    log: GraspLog
    fidelity: Fidelity
    error: Difference
    seconds: float


class Stopped(KeyboardInterrupt):
    """Ctrl-C during a request; ``found`` is the best until then."""

    def __init__(self, found: Refined) -> None:
        self.found = found
        KeyboardInterrupt.__init__(self, "interrupted")


def simulate_to(
    plan: Plan, accuracy: float | None = None, seconds: float | None = None, progress: Progress = no_progress
) -> Refined:
    """The cheapest log that is estimated to be as accurate as asked, or the best one within ``seconds``, which it uses.

    ``progress`` is called from the first run on.

    Raises ``OutOfReach`` for an accuracy that neither the finest grid nor the most load steps would reach, and for
    seconds in which nothing can be made whose error is known: both as soon as the coarsest runs show it.
    ``NotConverged`` where the finest grid falls short after all; ``Stopped`` with the best log where Ctrl-C comes after
    the first.
    """
    check_request(accuracy, seconds)
    search = _AccuracySearch(
        plan, 0.0 if accuracy is None else accuracy, np.inf if seconds is None else seconds, progress
    )
    best: Refined | None = None
    try:
        for found in search.logs():
            best = found
            if found.error.largest <= search.target:
                break
    except OutOfTime as ended:
        if best is None:
            raise search.too_short(ended.seconds) from ended
    except KeyboardInterrupt as stopped:
        if best is None:
            raise
        raise Stopped(replace(best, seconds=search.runs.spent)) from stopped
    assert best is not None  # there is a first log, or an error
    if seconds is None and best.error.largest > search.target:
        raise NotConverged("accuracy", best.error.largest, search.target, best.fidelity.cells)
    return replace(best, seconds=search.runs.spent)


def refinements(plan: Plan, seconds: float, progress: Progress = no_progress) -> Iterator[Refined]:
    """Ever finer logs, as long as the next one fits into about ``seconds``; theirs are what a request for that accuracy
    takes, those of all coarser ones among them. There is a first one, whatever it takes.
    """
    check_request(seconds=seconds)
    search = _AccuracySearch(plan, 0.0, seconds, progress, every=True)
    for found in search.logs():
        yield replace(found, seconds=search.runs.spent)


class _AccuracySearch:
    """Ever finer logs of a plan, up to the ``target`` or within a budget; with ``every``, in equal growth."""

    def __init__(self, plan: Plan, target: float, budget: float, progress: Progress, *, every: bool = False) -> None:
        load_kernels()  # no part of the budget, nor of the first run's pace
        contact = probe(plan)
        self.plan, self.target, self.every = _sampled(plan, contact.reach), target, every
        self.limited = bool(np.isfinite(budget))
        self.shows_steps = len(frame_times(self.plan)) >= ACCURACY.fewest_frames
        self.rarely = _half_the_frames(self.plan)
        self.runs = Runs(contact, budget, progress, strict=not every)
        coarsest, second = self.least()
        self.runs.expect(self.plan, (coarsest, *self.ahead(second, ACCURACY.coarsest_cells, None)))

    def at(self, cells: int, substeps: int) -> Fidelity:
        """A fidelity, at the solver's tolerance that the target asks for."""
        asked = ACCURACY.solver_share * self.target if self.target > 0.0 else ACCURACY.timed_tolerance
        return Fidelity(cells, substeps, float(np.clip(asked, ACCURACY.tightest, ACCURACY.loosest)), aligned=False)

    def least(self) -> tuple[Fidelity, Fidelity]:
        """The runs without which there is no estimate, beside one in longer steps."""
        cells = ACCURACY.coarsest_cells
        return self.at(cells, 1), self.at(_even(cells * ACCURACY.least_growth), 1)

    def ahead(self, following: Fidelity, cells: int, grid: Difference | None) -> tuple[Fidelity, ...]:
        """The runs to come, by the error of a grid with so many cells (None: not known yet): the next one, and the
        last where that is not.
        """
        if self.target == 0.0:
            return (following,)
        error = ACCURACY.coarsest_error if grid is None else grid.largest
        growth = max(error / ((1.0 - ACCURACY.step_share) * self.target), 1.0) ** (1.0 / ACCURACY.usual_ratio_order)
        enough = _even(min(growth * cells, ACCURACY.finest_cells))
        return (following, replace(following, cells=enough)) if enough > following.cells else (following,)

    def price(self, cells: int, substeps: int) -> float:
        """Seconds that a run should take."""
        return self.runs.price(self.plan, self.at(cells, substeps))

    def logs(self) -> Iterator[Refined]:
        """Logs with their estimated errors; the first one shows what can be reached."""
        coarsest, steps = self.coarsest()
        made, substeps = [(ACCURACY.coarsest_cells, coarsest)], 1
        grid: Difference | None = None
        while (following := self.following(made[-1][0], substeps, grid, steps)) is not None:
            fidelity = self.at(*following)
            self.runs.expect(self.plan, self.ahead(fidelity, made[-1][0], grid))
            made.append((fidelity.cells, self.runs.run(self.plan, fidelity)))
            grid = _grid_error(made)
            steps, substeps = steps.times(substeps / fidelity.substeps), fidelity.substeps
            yield Refined(made[-1][1], fidelity, grid.plus(steps), self.runs.spent)
            self.refuse_the_unreachable(fidelity, grid, steps)
            if self.limited:
                steps = self.measured_again(made[-1][1], fidelity, grid, steps)
            elif grid.largest <= (1.0 - ACCURACY.step_share) * self.target:
                yield from self.shorter_steps(made, fidelity, grid)

    def coarsest(self) -> tuple[GraspLog, Difference]:
        """A log on the coarsest grid at a load step a frame, and what these steps leave."""
        one = self.least()[0]
        if not self.shows_steps:
            log = self.runs.run(self.plan, one)
            self.refuse_the_too_short()
            return log, _left_by(log, self.runs.run(self.plan, replace(one, substeps=2)))
        longer = self.runs.run(self.rarely, one)
        self.refuse_the_too_short()
        log = self.runs.run(self.plan, one)
        return log, _left_by_half(longer, log)

    def measured_again(self, log: GraspLog, fidelity: Fidelity, grid: Difference, steps: Difference) -> Difference:
        """What the steps of a log leave, measured on its own grid where that matters and takes a small part of what is
        left of the budget: on a coarse grid a front moves by a whole cell, or not at all.
        """
        if not self.shows_steps or steps.largest <= ACCURACY.step_share * grid.largest:
            return steps
        if self.runs.price(self.rarely, fidelity) > ACCURACY.scouting_share * self.runs.left:
            return steps
        return _left_by_half(self.runs.run(self.rarely, fidelity), log)

    def shorter_steps(
        self, made: list[tuple[int, GraspLog]], fidelity: Fidelity, grid: Difference
    ) -> Iterator[Refined]:
        """The last of some logs, whose grid is fine enough, with what its steps leave on the grid before and on its
        own; then in ever shorter steps, until these are short enough, too.
        """
        allowed, log = ACCURACY.step_share * self.target, made[-1][1]
        steps = Difference(np.inf, np.inf, np.inf)
        for cells, own in made[1:][-2:] if self.shows_steps else ():
            steps = _left_by_half(self.runs.run(self.rarely, replace(fidelity, cells=cells)), own)
            yield Refined(log, fidelity, grid.plus(steps), self.runs.spent)
        while steps.largest > allowed:
            shorter = replace(fidelity, substeps=2 * fidelity.substeps)
            self.runs.expect(self.plan, (shorter,))
            finer = self.runs.run(self.plan, shorter)
            steps, log, fidelity = _left_by(log, finer).times(0.5), finer, shorter
            yield Refined(log, fidelity, grid.plus(steps), self.runs.spent)
            reached = steps.times((fidelity.substeps / ACCURACY.most_substeps) ** ACCURACY.step_order).largest
            if reached > allowed:
                takes = self.price(fidelity.cells, ACCURACY.most_substeps)
                raise OutOfReach("accuracy", self.target, reached / ACCURACY.step_share, takes)

    def following(
        self, cells: int, substeps: int, grid: Difference | None, steps: Difference
    ) -> tuple[int, int] | None:
        """Cells and load steps of the next run; None where there is none."""
        if cells >= ACCURACY.finest_cells:
            return None
        if self.every:
            finer = _even(min(cells * ACCURACY.first_growth, ACCURACY.finest_cells))
            fits = grid is None or self.price(finer, substeps) <= self.runs.left
            return (finer, substeps) if fits else None
        if self.target > 0.0:
            finer = _enough_cells(cells, grid, self.target - min(steps.largest, ACCURACY.step_share * self.target))
            if self.price(finer, substeps) <= self.runs.left:
                return finer, substeps
        return self.affordable(cells, substeps, grid, steps)

    def affordable(
        self, cells: int, substeps: int, grid: Difference | None, steps: Difference
    ) -> tuple[int, int] | None:
        """Cells and load steps that use up what is left and should err least; where that is a long way from the last
        run, one between, to measure by.
        """
        held_back = 0.0 if grid is None else ACCURACY.held_back
        left = self.runs.left - held_back * self.runs.budget
        often = [substeps]
        while grid is not None and 2 * often[-1] <= ACCURACY.most_substeps:
            often.append(2 * often[-1])
        choices = [(self.finest_within(left, count), count) for count in often]
        least = ACCURACY.least_growth if grid is None else ACCURACY.last_growth
        choices = [choice for choice in choices if choice[0] >= least * cells]
        if not choices and grid is None:
            raise self.too_short(0.0)
        if not choices:
            return None

        def errs(choice: tuple[int, int]) -> float:
            on_grid = 0.0 if grid is None else on_finer(grid, choice[0] / cells).largest
            return on_grid + steps.times(substeps / choice[1]).largest

        finest, count = min(choices, key=errs)
        if finest > ACCURACY.largest_growth * cells:
            between = self.finest_within(ACCURACY.scouting_share * left, count)
            growth = np.clip(between / cells, ACCURACY.least_growth, ACCURACY.largest_growth)
            finest = _even(growth * cells)
        return finest, count

    def finest_within(self, seconds: float, substeps: int) -> int:
        """The most cells across, an even number, that so many seconds allow; 0 where there are none."""
        low, high = 1, ACCURACY.finest_cells // 2
        while low < high:
            middle = (low + high + 1) // 2
            if middle > 1 and self.price(2 * middle, substeps) > seconds:
                high = middle - 1
            else:
                low = middle
        return 2 * low if low > 1 else 0

    def cheapest(self) -> float:
        """Seconds since the request at which there would be a first log with its error, at the soonest."""
        return self.runs.spent + sum(self.runs.price(self.plan, fidelity) for fidelity in self.least())

    def refuse_the_too_short(self) -> None:
        """Raise ``OutOfReach`` where the budget holds no log whose error is known."""
        if self.limited and not self.every and self.cheapest() > self.runs.budget:
            raise self.too_short(0.0)

    def too_short(self, seconds: float) -> OutOfReach:
        """The refusal of a budget, which a run of so many seconds would have overdrawn."""
        known = self.cheapest()
        least = max(known, ACCURACY.runs_at_least * seconds)
        return OutOfReach("seconds", self.runs.budget, least, least)

    def refuse_the_unreachable(self, fidelity: Fidelity, grid: Difference, steps: Difference) -> None:
        """Raise ``OutOfReach`` where neither the finest grid nor the most load steps would meet the target."""
        if self.limited or self.target == 0.0 or grid.plus(steps).largest <= self.target:
            return
        left = steps.times((fidelity.substeps / ACCURACY.most_substeps) ** ACCURACY.step_order)
        reached = on_finer(grid, max(ACCURACY.finest_cells / fidelity.cells, 1.0)).plus(left).largest
        if reached > self.target:
            raise OutOfReach("accuracy", self.target, reached, self.price(ACCURACY.finest_cells, fidelity.substeps))


def _grid_error(made: list[tuple[int, GraspLog]]) -> Difference:
    """What the last of some grids leaves, by their cells and logs: from the next two that are coarser by enough."""
    cells, finest = made[-1]
    coarser = [entry for entry in made[:-1] if cells >= ACCURACY.least_growth * entry[0]]
    return grid_error([(cells / count, difference(log, finest)) for count, log in coarser[-2:]])


def _half_the_frames(plan: Plan) -> Plan:
    """The plan with every other frame, and load steps of two."""
    assert plan.sampling is not None  # of ``_sampled``
    return replace(plan, sampling=replace(plan.sampling, frame_rate=0.5 * plan.sampling.frame_rate))


def _left_by_half(longer: GraspLog, log: GraspLog) -> Difference:
    """What the load steps of a log leave, by one of half the frames: it falls in proportion to them at least."""
    return difference(longer, log.take(slice(0, None, 2)))


def _left_by(log: GraspLog, shorter: GraspLog) -> Difference:
    """What the load steps of a log leave, by one in half of them."""
    return difference(log, shorter).times(2.0)


def _enough_cells(cells: int, grid: Difference | None, allowed: float) -> int:
    """Cells across at which the grid's error should meet what is allowed; never too far at once."""
    least, most = ACCURACY.first_growth, ACCURACY.largest_growth
    growth = least
    if grid is not None:
        falls = ACCURACY.overshoot * grid.largest / max(allowed, ACCURACY.step_share * grid.largest)
        growth = float(np.clip(falls, ACCURACY.least_growth, most))
    return min(_even(cells * growth), ACCURACY.finest_cells)


def _even(cells: float) -> int:
    """The even number above: the centre then lies alike in all grids."""
    return 2 * int(np.ceil(0.5 * cells - ACCURACY.rounding))


def _sampled(plan: Plan, reach: float) -> Plan:
    """The plan with points that do not change with the grid; without a sensor they cover the contact."""
    if plan.sampling is not None:
        return plan
    pitch = 2.0 * PROBE.room * reach / ACCURACY.points
    rate = ACCURACY.frames / plan.duration
    return replace(plan, sampling=SamplingPlan((ACCURACY.points, ACCURACY.points), pitch, rate))
