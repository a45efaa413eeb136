import numpy as np
import pytest

from benchmarks.control.episodes import least_force, world_of
from benchmarks.control.strategies import model_of
from benchmarks.control.tasks import lift
from benchmarks.end_to_end import grip as end_to_end_grip
from benchmarks.end_to_end.grip import Trial, row, trial
from slipcore.contact.reduced import GRAVITY, Load


@pytest.mark.parametrize(("share", "held"), [(0.95, False), (1.05, True)])
def test_a_grasp_holds_what_the_least_force_holds(share: float, held: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the grid of the boundary elements, of which 21 cells touch under 2 N."""
    world = world_of(lift(1.0 / GRAVITY, 0.45), 0)
    force = share * least_force(world, Load(1.0 / GRAVITY))
    answer = type("Answer", (), {"normal_force": force})
    monkeypatch.setattr(end_to_end_grip, "required_normal_force", lambda *_, **__: answer)
    found = trial(model_of(0.45, world), 0.45, 1.0, 1e-2, 0)
    assert found.held is held
    assert found.force / found.least == pytest.approx(share)


def test_a_row_counts_what_was_not_answered() -> None:
    found = [Trial(0.3, 1.0, 1e-2, 0, force, 4.0, force > 4.0) for force in (4.4, 5.2, 3.0, np.nan)]
    assert row(found) == ["μ 0.3, 1 N", "0.01", "2/4", "3/4", 1.1, 0.75, pytest.approx(1.3)]
