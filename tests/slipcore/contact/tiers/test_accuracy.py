"""Accuracy on request: estimates that hold, budgets that are kept."""

import pickle
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.effects import LoadPath, NormalTangentialCoupling, SensorSampling, TangentialLoad, Torsion
from slipcore.contact.errors import Interrupted, NotConverged, OutOfReach
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.scene import Press, Scene, simulate
from slipcore.contact.tiers import accuracy, requests
from slipcore.contact.tiers.accuracy import Difference, _AccuracySearch, difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.price import Pace, Size, Sizes
from slipcore.contact.tiers.probe import ContactProbe, probe
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

SENSOR = SensorSampling((12, 12), 1e-3, 6.0)
SCENES = {
    "shear": Scene("shear", (TangentialLoad((3.2, 0.0)), SENSOR)),
    "twist": Scene("twist", (Torsion(8e-3), SENSOR)),
    "reversal": Scene("reversal", (LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 3.0, -1.0)), SENSOR)),
}


@pytest.mark.parametrize(
    ("target", "tolerance"),
    [(0.01, ACCURACY.solver_share * 0.01), (1e-9, ACCURACY.tightest), (0.0, ACCURACY.timed_tolerance)],
)
def test_the_solver_is_a_share_as_wrong_as_what_is_asked(target: float, tolerance: float) -> None:
    search = cast("_AccuracySearch", SimpleNamespace(target=target))
    assert ACCURACY.tightest <= tolerance <= ACCURACY.loosest
    assert _AccuracySearch.at(search, 20, 1).tolerance == pytest.approx(tolerance, rel=1e-12)


@pytest.mark.parametrize(("name", "accuracies"), [("shear", (0.1, 0.015)), ("twist", (0.05,)), ("reversal", (0.05,))])
def test_the_true_error_is_within_what_was_asked_and_more_takes_a_finer_grid(
    name: str, accuracies: tuple[float, ...]
) -> None:
    plan = SCENES[name].plan()
    reference = run(plan, Fidelity(60, 1, 1e-4, aligned=False))
    cells = []
    for asked in accuracies:
        found = simulate_to(plan, accuracy=asked)
        true = difference(found.log, reference)
        assert found.error.largest <= asked
        assert true.largest <= asked
        assert true.largest <= found.error.largest
        cells.append(found.fidelity.cells)
    assert cells == sorted(set(cells))


@cache
def coarse_log(name: str, cells: int, substeps: int, frame_rate: float) -> GraspLog:
    """A scene's log on a coarse grid, run once."""
    plan = SCENES[name].plan()
    assert plan.sampling is not None
    rarely = replace(plan, sampling=replace(plan.sampling, frame_rate=frame_rate))
    return run(rarely, Fidelity(cells, substeps, 1e-3, aligned=False))


class Clock:
    """Time that passes only in runs: in proportion to load steps, and in these with the cells and beside them.

    Of all fine grids the log is that of 24 cells.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, name: str = "shear", step: float = 1e-3, cell: float = 1e-6):
        self.now, self.step, self.cell, self.name, self.runs = 0.0, step, cell, name, list[Fidelity]()
        monkeypatch.setattr(requests, "time", self)
        monkeypatch.setattr(requests, "run", self.run)

    def perf_counter(self) -> float:
        return self.now

    def run(self, plan: Plan, fidelity: Fidelity, progress: Progress = no_progress) -> GraspLog:
        size, began = Sizes(plan, probe(plan)).of(fidelity), self.now
        self.runs.append(fidelity)
        for part in np.linspace(0.1, 1.0, 10):
            self.now = began + float(part) * size.steps * (self.step + self.cell * size.cells)
            progress(float(part))
        assert plan.sampling is not None
        return coarse_log(self.name, min(fidelity.cells, 24), min(fidelity.substeps, 2), plan.sampling.frame_rate)


@pytest.mark.parametrize("budget", [0.4, 1.5, 4.0])
@pytest.mark.parametrize("cell", [1e-7, 5e-7, 2e-6])
def test_a_budget_is_kept_and_used(monkeypatch: pytest.MonkeyPatch, budget: float, cell: float) -> None:
    clock = Clock(monkeypatch, cell=cell)
    found = simulate_to(SCENES["shear"].plan(), seconds=budget)
    assert clock.now <= 1.2 * budget
    assert found.seconds == clock.now
    assert clock.now >= 0.8 * budget or found.fidelity.cells == ACCURACY.finest_cells


def test_what_is_compiled_is_loaded_outside_the_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that loads takes 90 s more, as in a process that finds no kept kernels."""
    clock, loading = Clock(monkeypatch), [90.0]

    def load() -> None:
        clock.now += loading.pop() if loading else 0.0

    def first_run(*arguments: Any) -> GraspLog:
        load()
        return clock.run(*arguments)

    monkeypatch.setattr(accuracy, "load_kernels", load, raising=False)
    monkeypatch.setattr(requests, "run", first_run)
    found = simulate_to(SCENES["shear"].plan(), seconds=1.5)
    assert 0.8 * 1.5 <= found.seconds <= 1.2 * 1.5
    assert clock.now == pytest.approx(90.0 + found.seconds)


def test_more_seconds_buy_a_finer_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = []
    for budget in (0.2, 1.0, 5.0):
        Clock(monkeypatch)
        cells.append(simulate_to(SCENES["shear"].plan(), seconds=budget).fidelity.cells)
    assert cells[0] < min(cells[1:])  # the third has more load steps, too


def test_seconds_below_the_cheapest_are_refused_with_its_price(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = SCENES["shear"].plan()
    clock = Clock(monkeypatch)
    with pytest.raises(OutOfReach, match="seconds") as refused:
        simulate_to(plan, seconds=0.02)
    assert clock.now <= 0.03
    Clock(monkeypatch)
    assert simulate_to(plan, seconds=1.3 * refused.value.least).error.largest < 0.5


@pytest.mark.parametrize("asked", [1e-9, 1e-5])
def test_an_accuracy_out_of_reach_is_refused_after_the_coarsest_runs(
    monkeypatch: pytest.MonkeyPatch, asked: float
) -> None:
    clock = Clock(monkeypatch, "reversal")
    with pytest.raises(OutOfReach, match=r"accuracy .* or more, which takes about") as refused:
        simulate_to(SCENES["reversal"].plan(), accuracy=asked)
    assert isinstance(refused.value, NotConverged)  # as callers caught it before requests were refused
    assert refused.value.residual == refused.value.least
    assert asked < refused.value.least < 0.02
    assert refused.value.seconds > clock.now
    assert max(fidelity.cells for fidelity in clock.runs) <= 20
    assert {fidelity.substeps for fidelity in clock.runs} == {1}
    assert str(pickle.loads(pickle.dumps(refused.value))) == str(refused.value)


@pytest.mark.parametrize(("target", "name"), [(0.05, "shear"), (0.02, "shear"), (0.03, "twist"), (0.02, "reversal")])
def test_the_time_left_is_known_to_a_factor_of_five(monkeypatch: pytest.MonkeyPatch, target: float, name: str) -> None:
    clock, told = Clock(monkeypatch, name), list[tuple[float, float]]()
    simulate_to(SCENES[name].plan(), accuracy=target, progress=lambda part: told.append((clock.now, part)))
    until_half = [(now, part) for now, part in told if now <= 0.5 * clock.now]
    assert until_half
    for now, part in until_half:
        left = now * (1.0 / part - 1.0)
        assert 0.2 <= left / (clock.now - now) <= 5.0
    assert all(part < 1.0 for now, part in told if now < clock.now)


def test_progress_of_a_run_is_the_share_of_its_load_steps() -> None:
    """A coupled press takes many in a frame, and runs are ended by how far they are after a while."""
    scene, told = Scene("pressed", (NormalTangentialCoupling(), SensorSampling((8, 8), 1e-3, 2.0))), list[float]()
    log = run(scene.plan(), Fidelity(8, 1, 1e-3, aligned=False), told.append)
    assert len(told) == int(log.metadata["steps"]) > 2 * len(log)
    assert told == pytest.approx(np.arange(1, len(told) + 1) / len(told))


class Fronts(Clock):
    """Logs whose stick ratio differs by ``on_grid``/cells, by ``flips``/cells² in steps of other than a frame, as where
    a front goes by one cell more or less, and by ``in_steps``·(length of a step, frames)^``order`` in all.
    """

    on_grid, flips, in_steps, order = 0.0, 0.0, 0.0, 2.0

    def run(self, plan: Plan, fidelity: Fidelity, progress: Progress = no_progress) -> GraspLog:
        log = super().run(plan, fidelity, progress)
        assert plan.sampling is not None
        assert log.truth is not None
        length = SENSOR.frame_rate / plan.sampling.frame_rate / fidelity.substeps
        error = self.on_grid / fidelity.cells + self.in_steps * length**self.order
        error += self.flips / fidelity.cells**2 * (length != 1.0)
        return replace(log, truth=replace(log.truth, stick_ratio=np.full(len(log), 0.5 + error)))


def test_steps_are_measured_anew_on_a_fine_grid_where_a_coarse_one_shows_flips(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of one cell on the front: on twelve across a ring of eight is a tenth of a contact's area."""
    clock = Fronts(monkeypatch)
    clock.on_grid, clock.flips = 0.5, 14.0
    found = simulate_to(SCENES["shear"].plan(), accuracy=0.03)
    assert found.fidelity.substeps == 1
    assert 0.5 / found.fidelity.cells <= found.error.largest <= 0.03
    assert found.fidelity.cells <= 60


@pytest.mark.parametrize("rate", [SENSOR.frame_rate, 3.0])
def test_a_log_whose_steps_are_too_long_is_made_in_shorter_ones(monkeypatch: pytest.MonkeyPatch, rate: float) -> None:
    """Of many frames, and of so few that half of them show nothing."""
    plan = replace(SCENES["shear"].plan(), sampling=replace(SCENES["shear"].plan().sampling, frame_rate=rate))
    clock = Fronts(monkeypatch)
    clock.on_grid, clock.in_steps = 0.1, 0.08 * (rate / SENSOR.frame_rate) ** 2
    found = simulate_to(plan, accuracy=0.03)
    assert found.fidelity.substeps > 1
    true = 0.1 / found.fidelity.cells + 0.08 / found.fidelity.substeps**2
    assert 0.5 * true <= found.error.largest <= 0.03


def test_a_budget_measures_steps_anew_where_they_seem_to_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the grid between the first and the last: with half of the frames, too."""
    clock = Fronts(monkeypatch)
    clock.on_grid, clock.flips = 0.1, 14.0
    simulate_to(SCENES["shear"].plan(), seconds=1.0)
    between = clock.runs[2]
    assert ACCURACY.coarsest_cells < between.cells < clock.runs[-1].cells
    assert clock.runs.count(between) == 2


def test_prices_of_larger_grids_follow_from_smaller_ones() -> None:
    """Steps of 2 ms, and of 1 µs a cell, as much longer with the cells as scenes of the library have it."""
    pace = Pace()
    for cells in (40**2, 80**2):
        pace.learn(Size(20, cells), 20 * (2e-3 + 3e-7 * cells**ACCURACY.cost_order))
    expected = 50 * (2e-3 + 3e-7 * 40_000**ACCURACY.cost_order)
    assert pace.seconds(Size(50, 40_000)) == pytest.approx(expected, rel=0.02)


def test_progress_is_told_from_the_first_run_and_never_goes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    for asked in ({"accuracy": 0.05}, {"seconds": 1.0}):
        Clock(monkeypatch)
        told: list[float] = []
        simulate_to(SCENES["shear"].plan(), progress=told.append, **asked)
        assert 0.0 < told[0] < 0.2
        assert told == sorted(told)
        assert told[-1] <= 1.0


def test_ctrl_c_keeps_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)

    def until(count: int) -> Progress:
        def heard(_: float) -> None:
            if len(clock.runs) == count:
                raise KeyboardInterrupt

        clock.runs.clear()
        return heard

    with pytest.raises(Interrupted) as kept:
        simulate(SCENES["shear"], accuracy=0.004, progress=until(4))
    assert kept.value.log.metadata["stopped"] == "interrupted"
    assert float(kept.value.log.metadata["estimated accuracy"]) > 0.004
    with pytest.raises(KeyboardInterrupt) as nothing:
        simulate(SCENES["shear"], accuracy=0.004, progress=until(1))
    assert not isinstance(nothing.value, Interrupted)


def test_the_error_is_told_under_a_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    Clock(monkeypatch)
    log = simulate(SCENES["shear"], seconds=0.2)
    assert 0.0 < float(log.metadata["estimated accuracy"]) < 0.5
    for name in ("scene", "tier", "grid", "steps", "tolerance", "seconds"):
        assert log.metadata[name]


def test_a_scene_without_a_sensor_gets_points_that_do_not_change_with_the_grid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(accuracy, "ACCURACY", replace(ACCURACY, frames=10))
    found = simulate_to(Scene("bare", press=Press(5.0)).plan(), accuracy=0.1)
    assert found.log.grid == (32, 32)


def test_difference_is_what_it_says() -> None:
    log = run(SCENES["shear"].plan(), Fidelity(12))
    assert difference(log, log) == Difference(0.0, 0.0, 0.0)
    assert Difference(0.1, 0.3, 0.2).largest == 0.3
    assert Difference(0.1, 0.3, 0.2).times(2.0) == Difference(0.2, 0.6, 0.4)


@pytest.mark.parametrize("asked", [{"accuracy": 0.0}, {"accuracy": np.nan}, {"seconds": -1.0}, {"seconds": np.inf}])
def test_impossible_requests_are_refused(asked: dict[str, float]) -> None:
    with pytest.raises(InvalidInput):
        simulate(SCENES["shear"], **asked)


def test_a_fidelity_beside_an_accuracy_is_refused() -> None:
    with pytest.raises(InvalidInput, match="fidelity"):
        simulate(SCENES["shear"], accuracy=0.1, fidelity=Fidelity(12))


def test_a_finest_grid_that_falls_short_is_an_error_not_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy, "ACCURACY", replace(ACCURACY, finest_cells=20))
    monkeypatch.setattr(_AccuracySearch, "refuse_the_unreachable", lambda *_: None)
    with pytest.raises(NotConverged, match="accuracy"):
        simulate_to(SCENES["shear"].plan(), accuracy=0.005)


def test_shorter_steps_that_never_leave_little_enough_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Fronts(monkeypatch)
    clock.on_grid, clock.in_steps, clock.order = 0.1, 0.45, 0.1
    with pytest.raises(OutOfReach) as refusal:
        simulate_to(SCENES["shear"].plan(), accuracy=0.01)
    assert refusal.value.asked == 0.01
    assert refusal.value.least > 0.01


def test_a_run_tells_which_part_of_it_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all the work that is to come, in proportion to steps and cells."""
    told: list[float] = []
    plan, coarse, fine = SCENES["shear"].plan(), Fidelity(10, 1), Fidelity(20, 1)

    def ran(_: Plan, __: Fidelity, heard: Progress) -> None:
        for part in (0.25, 0.5, 1.0):
            heard(part)

    monkeypatch.setattr(requests, "run", ran)
    runs = requests.Runs(ContactProbe(5e-3), np.inf, told.append)
    works = [requests._work(runs._size(plan, fidelity)) for fidelity in (coarse, fine)]
    runs.expect(plan, (coarse, fine))
    runs.run(plan, coarse)
    ahead = ACCURACY.more_ahead  # a request may want more than the runs that it expects
    assert told == pytest.approx(np.array([0.25, 0.5, 1.0]) * works[0] / sum(works) / ahead)
    runs.expect(plan, (fine,))
    runs.run(plan, fine)
    whole = works[0] + ahead * works[1]
    assert told[3:] == pytest.approx((works[0] + np.array([0.25, 0.5, 1.0]) * works[1]) / whole)
