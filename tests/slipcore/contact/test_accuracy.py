"""Accuracy on request: estimates that hold, budgets that are kept."""

import time

import numpy as np
import pytest

from slipcore.contact.accuracy import Difference, difference, simulate_to
from slipcore.contact.boundary_elements import Fidelity, run
from slipcore.contact.effects import LoadPath, SensorSampling, TangentialLoad, Torsion
from slipcore.contact.errors import NotConverged
from slipcore.contact.scene import Press, Scene
from slipcore.contact.simulate import simulate
from slipcore.errors import InvalidInput

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


def test_a_budget_is_kept_and_the_error_told() -> None:
    began = time.perf_counter()
    log = simulate(SCENES["shear"], seconds=1.0)
    assert time.perf_counter() - began < 6.0  # a stop watch on a shared machine
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
    monkeypatch.setattr("slipcore.contact.accuracy.FINEST_CELLS", 20)
    with pytest.raises(NotConverged, match="accuracy"):
        simulate_to(SCENES["shear"].plan(), accuracy=0.005)
