"""An object that slides, against rigid-body motion under Coulomb friction."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipcore.contact.errors import InfeasibleLoad
from slipcore.contact.solver.macro_slip import FreeObject, borne
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import ContactState
from slipcore.errors import InvalidInput
from tests.slipcore.contact.solver.test_quasi_static import FORCE, FRICTION, SLIDING, shear, sphere_on

MASS, GYRATION = 0.2, 0.03


@pytest.fixture
def solver(sphere) -> QuasiStatic:
    return QuasiStatic(sphere_on(0.3), sphere(16).grid, 1e-3, 1e-5)


def pressed(solver: QuasiStatic) -> ContactState:
    return solver.step(solver.start(), shear(FORCE, 0.0))[0]


def test_what_friction_does_not_carry_accelerates_the_object(solver: QuasiStatic) -> None:
    """At (T − μN)/m once all slides; with damping it goes towards (T − μN)/c."""
    load, free = shear(FORCE, 1.25 * SLIDING, duration=0.02), FreeObject(MASS, GYRATION)
    state, result = solver.step(pressed(solver), load, free)
    assert result.sliding
    assert result.stick_ratio == 0.0
    for _ in range(2):
        before = state
        state, result = solver.step(state, load, free)
        gained = 0.25 * SLIDING / MASS * load.duration
        assert state.velocity == pytest.approx([before.velocity[0] + gained, 0.0, 0.0], rel=1e-4, abs=1e-6)
        middle = result.slip[0][result.contact].mean()
        assert middle == pytest.approx(-load.duration * (before.velocity[0] + 0.5 * gained), rel=0.05)
    damped = FreeObject(MASS, GYRATION, damping=20.0)
    for _ in range(3):
        state, _ = solver.step(state, load, damped)
    assert state.velocity[0] == pytest.approx(0.25 * SLIDING / 20.0, rel=0.02)  # e^(-6) of it is left


def test_an_object_that_spins_is_braked_by_the_torque_of_a_sliding_contact(solver: QuasiStatic, sphere) -> None:
    """M = 3π/16 μNa of a Hertzian contact (Lubkin 1951), and then it rests."""
    torque = 3.0 * math.pi / 16.0 * SLIDING * sphere(16).hertz.contact_radius
    slowing = torque / (MASS * GYRATION**2)
    state = replace(pressed(solver), velocity=np.array([0.0, 0.0, 10.0]))
    free, load = FreeObject(MASS, GYRATION), shear(FORCE, 0.0, duration=0.02)
    state, _ = solver.step(state, load, free)  # within which all comes to slide
    for _ in range(2):
        before, (state, result) = state, solver.step(state, load, free)
        assert (before.velocity[2] - state.velocity[2]) / load.duration == pytest.approx(slowing, rel=0.06)  # 16 cells
    assert result.sliding
    while state.velocity.any():
        assert state.velocity[2] > 0.0
        state, _ = solver.step(state, load, free)
    assert borne(solver.grid, state) == pytest.approx(np.zeros(3), abs=1e-3 * SLIDING)


def test_what_slides_is_caught_by_a_harder_grip_and_rests_as_if_it_had_never_moved(solver: QuasiStatic) -> None:
    free, load = FreeObject(MASS, GYRATION), 1.25 * SLIDING
    state, _ = solver.step(pressed(solver), shear(FORCE, load, duration=0.02), free)
    for _ in range(4):
        state, result = solver.step(state, shear(2.0 * FORCE, load, duration=0.02), free)
    assert not state.velocity.any()
    assert borne(solver.grid, state) == pytest.approx([load, 0.0, 0.0], abs=1e-3 * load)
    _, resting = solver.step(state, shear(2.0 * FORCE, load, duration=0.02), free)
    assert not resting.moved.any()
    assert resting.stick_ratio == pytest.approx(result.stick_ratio, abs=0.02)


def test_what_friction_carries_is_as_without_a_free_object(solver: QuasiStatic) -> None:
    state = pressed(solver)
    _, alone = solver.step(state, shear(FORCE, 0.7 * SLIDING))
    _, free = solver.step(state, shear(FORCE, 0.7 * SLIDING), FreeObject(MASS, GYRATION))
    np.testing.assert_array_equal(free.force, alone.force)
    with pytest.raises(InfeasibleLoad):
        solver.step(state, shear(FORCE, 1.25 * SLIDING))


def test_what_cannot_be_is_refused_by_name(solver: QuasiStatic) -> None:
    for wrong, name in (({"mass": 0.0}, "mass"), ({"gyration": math.nan}, "gyration"), ({"damping": -1.0}, "damping")):
        with pytest.raises(InvalidInput, match=name):
            FreeObject(**{"mass": MASS, "gyration": GYRATION} | wrong)
    moved = StepLoad(FORCE, motion=np.array([1e-3, 0.0, 0.0]), given=(False, True, True))
    with pytest.raises(InvalidInput, match="given"):
        solver.step(pressed(solver), moved, FreeObject(MASS, GYRATION))


def test_forces_of_a_friction_that_slides_are_its_limit(solver: QuasiStatic) -> None:
    state, _ = solver.step(pressed(solver), shear(FORCE, 2.0 * SLIDING, duration=0.03), FreeObject(MASS, GYRATION))
    assert borne(solver.grid, state)[0] == pytest.approx(FRICTION * FORCE, rel=1e-6)
