"""Cells that touch within a load step: loads that grow together against their closed form, pressing by convergence."""

from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver import quasi_static
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.normal import NormalContact
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.step_equations import StepEquations
from slipcore.contact.solver.touching import from_touch
from slipcore.frames import FloatArray

FRICTION, FORCE = 0.4, 10.0


def ball(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray((x**2 + y**2) / (2.0 * 15e-3))


def half_space() -> QuasiStatic:
    return QuasiStatic(
        ContactProblem((HalfSpace.from_young(1e6, 0.0),), FRICTION, heights=(ball,)), Grid.square(24, 11.5e-3)
    )


def layer(cells: int) -> QuasiStatic:
    bodies = (HalfSpace.from_young(1e6, 0.49), LayerBase(5e-3, 1e6, 0.49))
    problem = ContactProblem(bodies, FRICTION, heights=(ball,), coupled=True)
    return QuasiStatic(problem, Grid.square(cells, 8.5e-3))


def load(normal: float, x: float = 0.0, y: float = 0.0, moment: float = 0.0) -> StepLoad:
    return StepLoad(normal, tangential=np.array([x, y, moment]))


@pytest.mark.parametrize("steps", [3, 12])
def test_loads_that_grow_in_proportion_leave_traction_in_proportion_to_pressure(steps: int) -> None:
    """Nothing slips as long as F_T < μF_N (Mindlin and Deresiewicz 1953); on any grid and in any number of steps."""
    forces = FORCE * np.linspace(1e-4, 1.0, steps + 1)
    for result in half_space().run([load(force, 0.2 * force, 0.1 * force) for force in forces]):
        for axis, share in ((0, 0.2), (1, 0.1)):
            rounding = 1e-5 * result.force[2].max()
            np.testing.assert_allclose(result.force[axis], share * result.force[2], rtol=0.0, atol=rounding)
        assert result.stick_ratio == 1.0
        assert not result.moved.any()


def test_shear_that_begins_and_turns_while_pressing_goes_on_shares_out_as_pressure_does() -> None:
    """q = Σ (dF_T/dF_N) Δp as long as nothing slips (Jäger, Arch. Appl. Mech. 68 (1998) 91)."""
    path = [(3.0, 0.0, 0.0), (5.0, 0.0, 0.0), (6.0, 0.3, 0.0), (8.0, 0.9, 0.0), (9.0, 0.9, 0.2), (12.0, 0.9, 0.8)]
    results = list(half_space().run([load(*now) for now in path]))
    pressed = [result.force[2] for result in results]
    rounding = 1e-5 * pressed[-1].max()
    np.testing.assert_allclose(results[-1].force[0], 0.3 * (pressed[3] - pressed[1]), rtol=0.0, atol=rounding)
    np.testing.assert_allclose(results[-1].force[1], 0.2 * (pressed[5] - pressed[3]), rtol=0.0, atol=rounding)


def test_pressing_a_bonded_layer_is_of_second_order_in_steps_of_radius() -> None:
    """Against more steps, on another way through the loads; of first order they would end 3e-2 off."""

    def pressed(steps: int, power: int) -> FloatArray:
        loads = FORCE * (np.arange(1, steps + 1) / steps) ** power
        return list(layer(16).run(map(load, loads)))[-1].force[:2]

    fine = pressed(160, power=2)
    errors = [np.linalg.norm(pressed(steps, power=3) - fine) / np.linalg.norm(fine) for steps in (15, 60)]
    assert errors[1] <= 1e-3
    assert np.log2(errors[0] / errors[1]) / 2.0 >= 1.5


def test_no_cell_that_touches_is_missed_in_fine_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solution that is too coarse to show that a cell touches leaves it with an error that the steps do not cure."""
    counted: list[bool] = []

    def noted(equations: StepEquations, last: NormalContact, guess: Stress) -> tuple[StepEquations, Stress, FloatArray]:
        corrected, nearer, made = from_touch(equations, last, guess)
        counted.append(corrected.offset is not equations.offset)
        return corrected, nearer, made

    monkeypatch.setattr(quasi_static, "from_touch", noted)
    contacts = [result.contact for result in layer(16).run(map(load, FORCE * (np.arange(1, 161) / 160) ** 3))]
    touches = [bool((now & ~before).any()) for before, now in pairwise(contacts)]
    assert [needed for needed, done in zip(touches, counted, strict=True) if needed and not done] == []


def test_what_the_cells_before_bear_is_a_nearer_guess(monkeypatch: pytest.MonkeyPatch) -> None:
    guesses: list[tuple[Stress, Stress]] = []

    def noted(equations: StepEquations, last: NormalContact, guess: Stress) -> tuple[StepEquations, Stress, FloatArray]:
        corrected, nearer, made = from_touch(equations, last, guess)
        guesses.append((guess, nearer))
        return corrected, nearer, made

    monkeypatch.setattr(quasi_static, "from_touch", noted)
    solver = layer(16)
    results = list(solver.run(load(force) for force in (2.0, 4.0, 6.0)))[1:]
    for result, (guess, nearer) in zip(results, guesses, strict=True):
        force = result.force / solver.grid.cell_area
        before, after = (np.linalg.norm([*g.traction, g.pressure] - force) for g in (guess, nearer))
        assert after <= 0.1 * before


def test_a_load_that_only_the_new_cells_make_bearable_is_borne() -> None:
    solver = half_space()
    state, first = solver.step(solver.start(), load(1e-4))
    assert first.contact.sum() <= 4
    _, result = solver.step(state, load(FORCE, 0.0, 0.0, 2e-3))
    assert result.imbalance <= 1e-10


def test_slip_that_ends_as_other_cells_touch_stays_as_far_as_it_had_come() -> None:
    """Rows of cells slip at the edge until the next ones touch; lost slip would leave an order of 1.1, and 2e-5."""
    problem = ContactProblem((HalfSpace.from_young(1e6, 0.49),), FRICTION, heights=(ball,))

    def forces(steps: int) -> FloatArray:
        solver = QuasiStatic(problem, Grid.square(14, 6.4e-3), 1e-7, 1e-9, second_order=True)
        shares = np.arange(1, steps + 1) / steps
        loads = (
            StepLoad(2.0 + 4.0 * share, tangential=np.array([0.1 + 1.47 * share, 0.0, 0.0]), duration=1.0 / steps)
            for share in shares
        )
        return list(solver.run([load(2.0), load(2.0, 0.1), *loads]))[-1].force[:2]

    fine = forces(1024)
    errors = [np.linalg.norm(forces(steps) - fine) / np.linalg.norm(fine) for steps in (32, 256)]
    assert errors[1] <= 5e-6
    assert np.log2(errors[0] / errors[1]) / 3.0 >= 1.5
