"""Traps that other solvers fell into; each test fails where the solver falls into it."""

import inspect

import numpy as np
import pytest

from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.solver.normal import solve_normal
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.projection import project
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.tangential import SolverControl, solve_tangential

FORCE, FRICTION = 10.0, 0.4
SLIDING = FORCE * FRICTION


def sheared(case, share: float, tolerance: float = 1e-6):
    problem = ContactProblem(case.operators.bodies, FRICTION, heights=(lambda x, y: (x**2 + y**2) / 30e-3,))
    solver = QuasiStatic(problem, case.grid, tolerance, 1e-2 * tolerance)
    load = StepLoad(FORCE, tangential=np.array([share * SLIDING, 0.0, 0.0]))
    return list(solver.run([StepLoad(FORCE), load]))[-1]


def test_an_empty_first_contact_set_fills(sphere) -> None:
    """A start without pressure, and one where nothing touches, once made every later iterate NaN."""
    case = sphere(48)
    outside = np.where(case.height > 0.9 * case.height.max(), 1e3, 0.0)
    for start in (np.zeros(case.grid.shape), np.full(case.grid.shape, -1.0), outside):
        solved = solve_normal(case.operators, case.grid, case.height, force=FORCE, start=start, tolerance=1e-8)
        assert solved.approach == pytest.approx(case.hertz.approach, rel=1e-3)


def test_an_approach_that_barely_touches_is_found(sphere) -> None:
    case = sphere(33)  # one cell on the axis
    solved = solve_normal(case.operators, case.grid, case.height, approach=1e-12)
    assert (solved.pressure > 0.0).sum() == 1
    assert solved.residual <= 1e-8


def test_a_rigid_motion_far_larger_than_the_slip_does_not_drown_the_residual(sphere) -> None:
    """With the rigid multiplier left in the gradient, dot products cancel and solvers stall near 1e-6."""
    case = sphere(48, 0.3)
    part, limit = case.limit()
    operator, start = case.operators.on(part), np.zeros((2, *part.shape))
    control = SolverControl(np.array([0.7 * SLIDING, 0.3, 2e-3]))
    plain = solve_tangential(operator, part.points(), limit, start, control, start, tolerance=1e-12)
    for carried in (1.0, 100.0):  # m, of contacts that move 0.4 mm
        offset = start + carried * case.hertz.approach
        moved = solve_tangential(operator, part.points(), limit, offset, control, start, tolerance=1e-10)
        assert moved.residual <= 1e-10
        np.testing.assert_allclose(moved.traction, plain.traction, rtol=0.0, atol=1e-9 * limit.max())


@pytest.mark.parametrize("lacking", [1e-4, 1e-8, 1e-11])
def test_force_projection_needs_few_steps_up_to_full_slip(lacking: float) -> None:
    """Near full slip the imbalance hardly falls until the end: a search that asks it to fall takes tiny steps."""
    rng = np.random.default_rng(2)
    radius, arm = rng.uniform(0.0, 1.0, 3000), rng.uniform(-1.0, 1.0, (2, 3000))
    for direction in ((1.0, 0.0), (0.6, -0.8)):
        force = (1.0 - lacking) * radius.sum() * np.array(direction)
        across = arm[0] * direction[1] - arm[1] * direction[0]
        moment = (1.0 - lacking) * float(radius @ across)
        found = project(
            0.3 * rng.standard_normal((2, 3000)), radius, arm, np.array([*force, moment]), np.ones(3, dtype=bool)
        )
        assert found.feasible
        assert found.iterations <= 40
        assert np.abs(found.imbalance).max() <= 1e-13 * radius.sum()


@pytest.mark.parametrize("cells", [128, 256])
@pytest.mark.parametrize("share", [0.3, 0.7, 0.99])
def test_force_projection_of_equal_tractions_meets_its_tolerance(cells: int, share: float) -> None:
    """A plain sum over many equal cells rounds one way and never balances: it once went on to its bound, for 1.5 s."""
    x, y = np.meshgrid(*2 * [np.linspace(-1.0, 1.0, cells)])
    radius = np.sqrt(np.clip(1.0 - x**2 - y**2, 0.0, None)).ravel()
    target = np.array([share * radius.sum(), 0.0, 0.0])
    arm = np.stack((x.ravel(), y.ravel()))
    found = project(np.zeros_like(arm), radius, arm, target, np.ones(3, dtype=bool))
    assert found.iterations <= 10


def test_a_thin_slip_annulus_is_warned_of_and_its_error_falls_with_the_grid(sphere) -> None:
    """At F_T = 0.05 μF_N the annulus is 0.5 cells wide on 64 × 64 cells: tractions are off by a tenth, in silence."""
    errors, said = [], []
    for cells in (64, 256):
        case = sphere(cells)
        result = sheared(case, 0.05)
        exact = CattaneoMindlin(case.hertz, FRICTION, 0.05 * SLIDING).traction(np.hypot(*case.grid.points()))
        errors.append(float(np.linalg.norm(result.force[0] / case.grid.cell_area - exact) / np.linalg.norm(exact)))
        said.append(result.warnings())
    assert errors[0] > 0.05
    assert errors[1] < 0.3 * errors[0]
    assert "slip zone" in said[0][0]
    assert said[1] == ()
    assert sheared(sphere(64), 0.5).warnings() == ()


def test_a_contact_of_few_cells_is_warned_of(sphere) -> None:
    assert any("radius" in sentence for sentence in sheared(sphere(8, width=3.0), 0.5).warnings())


def test_a_contact_that_leaves_the_grid_is_warned_of(sphere) -> None:
    assert any("edge of the grid" in sentence for sentence in sheared(sphere(32, width=1.0), 0.5).warnings())


def test_default_tolerances_are_tight_enough_to_trust() -> None:
    """Success at a loose default is the quietest of wrong answers."""
    for solver, largest in ((solve_normal, 1e-8), (solve_tangential, 1e-8), (QuasiStatic, 1e-5)):
        assert inspect.signature(solver).parameters["tolerance"].default <= largest


def test_default_tolerances_give_the_answer_of_tight_ones(sphere) -> None:
    case = sphere(48, 0.3)
    problem = ContactProblem(case.operators.bodies, FRICTION, heights=(lambda x, y: (x**2 + y**2) / 30e-3,))
    loads = [StepLoad(FORCE, tangential=np.array([k, 0.0, 1e-3 * k])) for k in (0.0, 1.0, 2.5, -1.0)]
    usual = list(QuasiStatic(problem, case.grid).run(loads))[-1]
    tight = list(QuasiStatic(problem, case.grid, 1e-10, 1e-11).run(loads))[-1]
    assert usual.pose[0] == pytest.approx(tight.pose[0], rel=1e-5)
    np.testing.assert_allclose(usual.force, tight.force, rtol=0.0, atol=1e-4 * tight.force[0].max())


def test_a_tolerance_out_of_reach_is_an_error_that_tells_what_was_reached(sphere) -> None:
    with pytest.raises(NotConverged, match="residual"):
        sheared(sphere(32, 0.3), 0.5, tolerance=1e-18)


def test_full_slip_is_not_taken_for_an_infeasible_load_nor_the_other_way_round(sphere) -> None:
    """Both have tiny residuals; only the balance tells them apart."""
    case = sphere(32, 0.3)
    assert sheared(case, 1.0).sliding
    assert sheared(case, 1.0 - 1e-7).imbalance <= 1e-10
    with pytest.raises(InfeasibleLoad):
        sheared(case, 1.0 + 1e-7)
