"""Accuracy on request: estimates that hold, budgets that are kept."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.effects import LoadPath, SensorSampling, TangentialLoad, Torsion
from slipcore.contact.errors import NotConverged
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.scene import Press, Scene, simulate
from slipcore.contact.tiers import accuracy
from slipcore.contact.tiers.accuracy import Difference, difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

SENSOR = SensorSampling((12, 12), 1e-3, 6.0)
SCENES = {
    "shear": Scene("shear", (TangentialLoad((3.2, 0.0)), SENSOR)),
    "twist": Scene("twist", (Torsion(8e-3), SENSOR)),
    "reversal": Scene("reversal", (LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 3.0, -1.0)), SENSOR)),
}


@pytest.mark.parametrize("name", SCENES)
def test_the_true_error_is_within_what_was_asked(name: str) -> None:
    plan = SCENES[name].plan()
    reference = run(plan, Fidelity(80, 2, 1e-6))
    for asked in (0.1, 0.03):
        found = simulate_to(plan, accuracy=asked)
        true = difference(found.log, reference)
        assert found.error.largest <= asked
        assert true.largest <= asked
        assert true.displacement <= found.error.displacement
        assert true.force <= found.error.force


def test_more_accuracy_takes_a_finer_grid() -> None:
    plan = SCENES["shear"].plan()
    assert simulate_to(plan, accuracy=0.1).fidelity.cells < simulate_to(plan, accuracy=0.01).fidelity.cells


class Clock:
    """Time that passes only in runs, as they take on an idle machine: in proportion to cells and load steps."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now

    def run(self, plan: Plan, fidelity: Fidelity, progress: Progress = no_progress) -> GraspLog:
        log = run(plan, fidelity, progress)
        self.now += (fidelity.cells / 100.0) ** ACCURACY.cost_order * fidelity.substeps
        return log


def test_a_budget_is_kept_and_used(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = []
    for budget in (0.3, 1.0, 3.0):
        clock = Clock()
        monkeypatch.setattr(accuracy, "time", clock)
        monkeypatch.setattr(accuracy, "run", clock.run)
        cells.append(simulate_to(SCENES["shear"].plan(), seconds=budget).fidelity.cells)
        assert clock.now <= budget
    assert cells == sorted(cells)
    assert cells[-1] > cells[0]


def test_the_error_is_told_under_a_budget() -> None:
    log = simulate(SCENES["shear"], seconds=0.2)
    assert 0.0 < float(log.metadata["estimated accuracy"]) < 0.5
    for name in ("scene", "tier", "grid", "steps", "tolerance", "seconds"):
        assert log.metadata[name]


def test_a_scene_without_a_sensor_gets_points_that_do_not_change_with_the_grid() -> None:
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


def test_an_accuracy_out_of_reach_is_an_error_not_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy, "ACCURACY", replace(ACCURACY, finest_cells=20))
    with pytest.raises(NotConverged, match="accuracy"):
        simulate_to(SCENES["shear"].plan(), accuracy=0.005)
