"""How a free object moves within steps, by hand, with a solver that only tells what it is asked."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore.contact.defaults import STEP
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.solver.macro_slip import FreeObject, _between, _together, borne, moving
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.state import ContactState, StepResult
from slipcore.errors import InvalidInput

GRID = Grid((2, 2), (2e-3, 2e-3))
FREE = FreeObject(0.5, 0.1, damping=2.0)


def at_rest(**changed: Any) -> ContactState:
    field = np.zeros((2, 2, 2))
    stress: Any = SimpleNamespace(traction=field)
    plain = ContactState(
        None, stress, stress, field, field, (), np.zeros(3), field[0], field, StepLoad(4.0), np.ones(3), np.ones(4)
    )
    return replace(plain, **changed)


def result(iterations: int, slip: float, moved: bool) -> StepResult:
    field, mask = np.full((2, 2, 2), slip), np.full((2, 2), moved)
    of: Any = dict.fromkeys(StepResult.__slots__)
    return StepResult(**of | {"slip": field, "moved": mask, "iterations": iterations, "residual": slip})


@pytest.mark.parametrize(
    ("before", "surplus", "after"),
    [
        ([0.0, 0.0, 0.0], [1.0, -2.0, 0.0], [0.1 / 0.7, -0.2 / 0.7, 0.0]),
        ([0.7, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]),
        ([0.0, 0.0, 7.0], [0.0, 0.0, 0.07], [0.0, 0.0, (0.5 * 0.07 + 0.1 * 0.07) / 0.007]),
        ([0.1, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),  # it would turn back
        ([0.1, 0.0, 0.0], [-0.5, 0.3, 0.0], [0.0, 0.03 / 0.7, 0.0]),
    ],
)
def test_velocity_follows_from_surplus_mass_and_damping(
    before: list[float], surplus: list[float], after: list[float]
) -> None:
    """Semi-implicit: (m v + Δt f)/(m + Δt c) with m = 0.5 kg, c = 2 N·s/m and Δt = 0.1 s."""
    found = FREE.velocity(np.array(before), np.array(surplus), 0.1)
    np.testing.assert_allclose(found, after, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": 0.0}, "mass is 0.0; allowed: finite, and above 0"),
        ({"gyration": -0.1}, "gyration is -0.1; allowed: finite, and above 0"),
        ({"damping": -1e-9}, "damping is -1e-09; allowed: finite, and at least 0"),
        ({"damping": np.inf}, "damping is inf"),
        ({"mass": np.inf}, "mass is inf"),
        ({"mass": np.nan}, "mass is nan"),
    ],
)
def test_an_object_that_cannot_be_is_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        FreeObject(**{"mass": 1.0, "gyration": 0.1} | given)
    assert FreeObject(1.0, 0.1, damping=0.0).damping == 0.0


def test_what_a_contact_bears_is_its_traction_on_its_cells() -> None:
    """Cells of 4 mm², 1 mm from the middle each way: 1 Pa along x on the upper row, 2 Pa along y on the right."""
    traction = np.zeros((2, 2, 2))
    traction[0, 1, :], traction[1, :, 1] = 1.0, 2.0
    stress: Any = SimpleNamespace(traction=traction)
    found = borne(GRID, at_rest(stress=stress))
    np.testing.assert_allclose(found, [8e-6, 16e-6, 16e-6 * 1e-3 - 8e-6 * 1e-3], rtol=1e-12)


def test_a_load_within_a_step_lies_evenly_between_its_ends() -> None:
    before = StepLoad(2.0, tangential=np.array([1.0, 0.0, 0.0]))
    after = StepLoad(6.0, tangential=np.array([3.0, -1.0, 0.4]), duration=0.8)
    found = _between(before, after, 0.25, 4)
    assert found.normal_force == 3.0
    np.testing.assert_allclose(found.tangential, [1.5, -0.25, 0.1], rtol=1e-12)
    assert found.duration == pytest.approx(0.2, rel=1e-12)
    assert found.approach is None


def test_an_approach_that_is_given_is_reached_evenly_and_at_once_from_a_force() -> None:
    by_depth = [StepLoad(None, approach, tangential=np.zeros(3)) for approach in (1e-4, 3e-4)]
    assert _between(*by_depth, 0.5, 2).approach == pytest.approx(2e-4, rel=1e-12)
    assert _between(StepLoad(1.0, tangential=np.zeros(3)), by_depth[1], 0.5, 2).approach == 3e-4
    assert _between(by_depth[0], StepLoad(5.0, tangential=np.zeros(3)), 0.5, 2).normal_force == 5.0


def test_results_in_a_row_are_the_last_with_the_slip_of_all() -> None:
    found = _together([result(2, 1.0, True), result(3, 0.5, False), result(4, 0.25, False)])
    assert (found.iterations, found.residual) == (9, 0.25)
    np.testing.assert_array_equal(found.slip, np.full((2, 2, 2), 1.75))
    assert found.moved.all()
    assert not _together([result(1, 0.0, False)]).moved.any()


class Solver:
    """Refuses loads while asked to, and notes what it is asked."""

    def __init__(self, refused: bool) -> None:
        self.refused, self.asked = refused, list[StepLoad]()

    def __call__(self, state: ContactState, load: StepLoad) -> tuple[ContactState, StepResult]:
        if all(load.given) and self.refused:
            raise InfeasibleLoad(load.tangential, 0.5)
        self.asked.append(load)
        return replace(state, load=load), result(1, 0.1, not all(load.given))


PULL = StepLoad(4.0, tangential=np.array([1.0, 0.0, 0.0]), duration=3.0 * STEP.sliding_step)


def test_a_load_that_friction_carries_is_one_step_at_rest() -> None:
    solver = Solver(refused=False)
    state, found = moving(solver, GRID, at_rest(), PULL, FREE)
    assert len(solver.asked) == 1
    assert solver.asked[0].duration == pytest.approx(PULL.duration, rel=1e-12)
    assert found.iterations == 1
    assert not state.velocity.any()


def test_a_load_that_it_does_not_carry_moves_the_object_in_short_steps() -> None:
    """The pull grows evenly to 1 N in three; nothing is borne."""
    solver, velocity = Solver(refused=True), 0.0
    state, found = moving(solver, GRID, at_rest(), PULL, FREE)
    assert [load.given for load in solver.asked] == [(False, False, False)] * 3
    assert [load.normal_force for load in solver.asked] == [4.0] * 3
    step = STEP.sliding_step
    for load, pull in zip(solver.asked, (1.0 / 3.0, 2.0 / 3.0, 1.0), strict=True):
        assert load.duration == pytest.approx(step, rel=1e-9)
        velocity = (0.5 * velocity + step * pull) / (0.5 + 2.0 * step)
        np.testing.assert_allclose(load.motion, [step * velocity, 0.0, 0.0], rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(state.velocity, [velocity, 0.0, 0.0], rtol=1e-9)
    assert found.iterations == 3


def test_from_rest_to_motion_nothing_of_the_load_goes_on() -> None:
    solver = Solver(refused=True)
    state, _ = moving(solver, GRID, at_rest(), PULL, FREE)
    assert not state.drive.any()
    assert not state.rate.any()
    kept, _ = moving(Solver(refused=False), GRID, at_rest(), PULL, FREE)
    assert kept.drive.all()
    assert kept.rate.all()


def test_a_motion_that_is_given_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"given is .*; allowed: loads alone for an object that moves by itself"):
        moving(Solver(refused=False), GRID, at_rest(), replace(PULL, given=(True, False, True)), FREE)
