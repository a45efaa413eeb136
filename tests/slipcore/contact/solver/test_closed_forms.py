"""The figures that the solver promises against closed forms, at 64 × 64 cells and their orders from 32 to 256."""

from itertools import pairwise

import numpy as np
import pytest

from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic
from slipcore.contact.solver.state import StepResult

FORCE, FRICTION = 10.0, 0.4
SLIDING = FORCE * FRICTION
WIDTHS = (2.06, 2.1, 2.17)
"""How cells lie on the contact's edge scatters errors by half; means over some widths show the order."""


def norm_errors(got: np.ndarray, exact: np.ndarray, case) -> tuple[float, float]:
    """Error of a traction as a share of its own norm, and of that of its limits."""
    error = float(np.linalg.norm(got - exact))
    return error / float(np.linalg.norm(exact)), error / float(np.linalg.norm(FRICTION * case.exact_pressure))


def solver_of(case, tolerance: float = 1e-8) -> QuasiStatic:
    problem = ContactProblem(case.operators.bodies, FRICTION, heights=(lambda x, y: (x**2 + y**2) / 30e-3,))
    return QuasiStatic(problem, case.grid, tolerance, 1e-2 * tolerance)


def at(normal: float, along_x: float = 0.0, moment: float = 0.0) -> StepLoad:
    return StepLoad(normal, tangential=np.array([along_x, 0.0, moment]))


def last(case, *loads: StepLoad, tolerance: float = 1e-8) -> StepResult:
    return list(solver_of(case, tolerance).run(loads))[-1]


def radius(case) -> np.ndarray:
    return np.hypot(*case.grid.points())


def test_contact_area_of_hertz_is_met(sphere) -> None:
    case = sphere(64)
    area = last(case, at(FORCE)).contact.sum() * case.grid.cell_area
    assert area / (np.pi * case.hertz.contact_radius**2) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9])
def test_cattaneo_mindlin_is_met(sphere, share: float) -> None:
    errors = []
    for width in WIDTHS:
        case = sphere(64, width=width)
        result, exact = (
            last(case, at(FORCE), at(FORCE, share * SLIDING)),
            CattaneoMindlin(case.hertz, FRICTION, share * 4),
        )
        traction = norm_errors(result.force[0] / case.grid.cell_area, exact.traction(radius(case)), case)
        motion = abs(result.pose[0] / exact.rigid_displacement - 1.0)
        errors.append((*traction, motion, abs(result.stick_ratio - exact.stick_ratio)))
    own, traction, motion, stick = np.mean(errors, axis=0)
    assert traction <= 0.01
    assert own <= 0.01 or share < 0.7  # a small traction has a narrow slip zone and a small norm
    assert motion <= 1e-4
    assert stick <= 0.01


@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_torsion_with_partial_slip_is_met(sphere, share: float) -> None:
    errors = []
    for width in WIDTHS:
        case = sphere(64, width=width)
        moment = share * sliding_moment(case.hertz, FRICTION)
        exact = TorsionPartialSlip(case.hertz, FRICTION, moment)
        result = last(case, at(FORCE), at(FORCE, moment=moment))
        x, y = case.grid.points()
        around = (x * result.force[1] - y * result.force[0]) / radius(case) / case.grid.cell_area
        traction = norm_errors(around, exact.traction(radius(case)), case)
        errors.append((*traction, abs(result.pose[2] / exact.twist - 1.0)))
    own, traction, twist = np.mean(errors, axis=0)
    assert traction <= 0.015
    assert own <= 0.015 or share < 0.6
    assert twist <= 1e-3


def test_orders_of_torsion(sphere) -> None:
    errors = []
    for cells in (32, 64, 128, 256):
        for width in WIDTHS:
            case = sphere(cells, width=width)
            moment = 0.6 * sliding_moment(case.hertz, FRICTION)
            exact = TorsionPartialSlip(case.hertz, FRICTION, moment)
            errors.append(
                abs(last(case, at(FORCE), at(FORCE, moment=moment), tolerance=1e-6).pose[2] / exact.twist - 1.0)
            )
    twist = np.array(errors).reshape(4, len(WIDTHS)).mean(axis=1)
    assert np.log2(twist[0] / twist[-1]) / 3 >= 1.5


def test_unloading_and_the_reversal_loop_are_met(sphere) -> None:
    case = sphere(64)
    solver, exact = solver_of(case, 1e-6), MindlinDeresiewicz(case.hertz, FRICTION)
    path = [0.0, 1.2, 2.4, 3.6, 1.8, 0.0, -1.8, -3.6, -1.8, 0.0, 1.8, 3.6]
    largest, worst, work, exact_work = 0.0, 0.0, [], []
    for result, force in zip(solver.run(at(FORCE, f) for f in path), path, strict=True):
        exact = exact.load(FORCE, force)
        traction = exact.traction(radius(case))
        largest = max(largest, float(np.linalg.norm(traction)))
        worst = max(worst, float(np.linalg.norm(result.force[0] / case.grid.cell_area - traction)))
        work.append(result.pose[0])
        exact_work.append(exact.rigid_displacement)
        assert result.imbalance <= 1e-10
    assert worst / largest <= 0.02
    np.testing.assert_allclose(work, exact_work, rtol=0.0, atol=5e-4 * max(exact_work))
    area, exact_area = (
        sum(0.5 * (f + g) * (b - a) for (f, a), (g, b) in pairwise(zip(path[3:], loop[3:], strict=True)))
        for loop in (work, exact_work)
    )
    assert area == pytest.approx(exact_area, rel=0.02)
