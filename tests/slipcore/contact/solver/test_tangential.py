"""Tangential contact against closed forms; balance, complementarity and what it refuses."""

import numpy as np
import pytest

from slipcore.contact.elasticity.fields import rigid_displacement
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.torsion import TorsionPartialSlip, sliding_moment
from slipcore.contact.solver import tangential as compiled
from slipcore.contact.solver.projection import project
from slipcore.contact.solver.tangential import SolverControl, solve_tangential

FRICTION, FORCE = 0.4, 10.0
SLIDING = FRICTION * FORCE
WIDTHS = (2.06, 2.1, 2.17)
"""How cells lie on the contact's edge scatters errors by half; means over some widths show the order."""


def once(case, load, tolerance: float = 1e-8, friction: float = FRICTION, **options):
    """One step from rest to a load; with the part of the grid that it was solved on."""
    part, limit = case.limit(friction)
    nothing = np.zeros((2, *part.shape))
    control = options.pop("control", None) or SolverControl(np.array(load))
    operator = case.operators.on(part)
    return (
        part,
        limit,
        solve_tangential(operator, part.points(), limit, nothing, control, nothing, tolerance, **options),
    )


def l2(got: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(((got - exact) ** 2).sum() / (exact**2).sum()))


def test_cattaneo_mindlin_converges_at_first_order_in_traction_and_second_in_motion(sphere) -> None:
    errors = []
    for cells in (32, 64, 128, 256):
        for width in WIDTHS:
            case = sphere(cells, width=width)
            exact = CattaneoMindlin(case.hertz, FRICTION, 0.7 * SLIDING)
            part, _, solved = once(case, (0.7 * SLIDING, 0.0, 0.0), tolerance=1e-6)
            motion = abs(solved.motion[0] / exact.rigid_displacement - 1.0)
            errors.append((l2(solved.traction[0], exact.traction(np.hypot(*part.points()))), motion))
    traction, motion = np.array(errors).reshape(4, len(WIDTHS), 2).mean(axis=1).T
    assert traction[1] <= 0.01
    assert motion[1] <= 1e-4
    assert np.log2(traction[0] / traction[-1]) / 3 >= 0.9
    assert np.log2(motion[0] / motion[-1]) / 3 >= 1.8


def test_torsion_with_partial_slip_has_its_twist_and_traction(sphere) -> None:
    case = sphere(64, 0.3)
    moment = 0.6 * sliding_moment(case.hertz, FRICTION)
    exact = TorsionPartialSlip(case.hertz, FRICTION, moment)
    part, _, solved = once(case, (0.0, 0.0, moment))
    x, y = part.points()
    r = np.hypot(x, y)
    around = (x * solved.traction[1] - y * solved.traction[0]) / r
    assert l2(around, exact.traction(r)) <= 0.015
    assert solved.motion[2] == pytest.approx(exact.twist, rel=1e-3)
    np.testing.assert_allclose(solved.motion[:2], 0.0, atol=1e-9 * exact.twist)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("load", [(2.0, 0.0, 0.0), (1.0, -1.5, 3e-3), (0.0, 0.0, 6e-3)])
def test_balance_and_complementarity_hold(sphere, poisson: float, load: tuple[float, float, float]) -> None:
    case = sphere(48, poisson)
    _, limit, solved = once(case, load, tolerance=1e-10)
    assert solved.residual <= 1e-10
    assert solved.imbalance <= 1e-10
    size = np.hypot(*solved.traction)
    assert (size <= limit * (1.0 + 1e-12)).all()
    power = -(solved.traction * solved.slip).sum(axis=0)  # friction takes power up, all that its limit can
    scale = limit.max() * np.hypot(*solved.slip)[limit > 0.0].max()
    assert np.abs(power - limit * np.hypot(*solved.slip)).max() <= 1e-8 * scale


def test_a_given_motion_gives_back_its_load(sphere) -> None:
    case = sphere(48, 0.3)
    load = np.array([1.5, 0.5, 4e-3])
    pushed = once(case, load)[2]
    held = SolverControl(motion=pushed.motion, given=np.zeros(3, dtype=bool))
    moved = once(case, None, control=held)[2]
    np.testing.assert_allclose(moved.traction, pushed.traction, rtol=0.0, atol=1e-5 * pushed.traction.max())
    mixed = SolverControl(np.array([1.5, 0.0, 0.0]), pushed.motion, np.array([True, False, False]))
    both = once(case, None, control=mixed)[2]
    assert both.motion[0] == pytest.approx(pushed.motion[0], rel=1e-6)
    np.testing.assert_array_equal(both.motion[1:], pushed.motion[1:])


def test_moved_far_everything_slides(sphere) -> None:
    case = sphere(32, 0.3)
    control = SolverControl(motion=np.array([1e-2, 0.0, 0.0]), given=np.zeros(3, dtype=bool))
    _, limit, solved = once(case, None, control=control)
    assert solved.sliding
    np.testing.assert_allclose(np.hypot(*solved.traction), limit, rtol=1e-9)
    assert not once(case, (1.0, 0.0, 0.0))[2].sliding


def test_a_load_on_the_limit_surface_slides(sphere) -> None:
    case = sphere(32)
    _, limit, solved = once(case, (SLIDING, 0.0, 0.0))
    assert solved.sliding
    np.testing.assert_allclose(solved.traction[0], limit, rtol=1e-9)
    exact = CattaneoMindlin(case.hertz, FRICTION, SLIDING)
    assert solved.motion[0] == pytest.approx(exact.rigid_displacement, rel=1e-2)


@pytest.mark.parametrize(("load", "times"), [((1.2 * SLIDING, 0.0, 0.0), 1.2), ((0.0, -3.0 * SLIDING, 0.0), 3.0)])
def test_loads_beyond_the_limit_surface_are_refused_with_how_far(sphere, load, times: float) -> None:
    with pytest.raises(InfeasibleLoad, match="times what friction carries") as error:
        once(sphere(32), load)
    assert 1.0 / error.value.factor == pytest.approx(times, rel=1e-9)


def test_without_friction_any_load_is_refused_and_none_moves_nothing(sphere) -> None:
    case = sphere(32)
    with pytest.raises(InfeasibleLoad):
        once(case, (1e-9, 0.0, 0.0), friction=0.0)
    assert not once(case, (0.0, 0.0, 0.0), friction=0.0)[2].traction.any()


def test_an_iteration_bound_that_is_too_small_is_an_error_not_an_answer(sphere) -> None:
    with pytest.raises(NotConverged, match="residual"):
        once(sphere(32), (2.0, 0.0, 0.0), tolerance=1e-12, max_iterations=2)


def test_applications_stay_few(sphere) -> None:
    for cells in (32, 64, 128):
        case = sphere(cells)
        once(case, (2.8, 0.0, 0.0))
        assert case.operators.count.tangential <= 80  # on all grids together


def test_fused_loops_of_a_newton_round_are_what_numpy_makes_of_them() -> None:
    traction, displacement, offset, arm = np.random.default_rng(0).normal(size=(4, 2, 9, 11))
    limit, slip, nearest = np.abs(arm[0]), np.empty_like(traction), np.empty_like(traction)
    constraints = limit.ravel(), arm.reshape(2, -1), np.array([0.3, -0.2, 0.7]), np.ones(3, dtype=bool)
    here = traction, displacement, offset, slip, nearest
    dual, change = compiled._natural_map(here, constraints, 0.7, np.zeros(3), 0.0)
    gradient = displacement + offset
    point = traction - 0.7 * gradient
    expected = project(point.reshape(2, -1), *constraints)
    np.testing.assert_allclose(nearest, expected.traction.reshape(2, 9, 11), rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(dual, expected.motion, rtol=1e-12)
    np.testing.assert_allclose(slip, gradient - rigid_displacement(arm, dual / 0.7), rtol=0.0, atol=1e-14)
    assert change == pytest.approx(np.abs(nearest - traction).max(), rel=1e-15)
    slides = np.empty(limit.shape, dtype=bool)
    assert not compiled._slides(traction, slip, limit, 0.7, slides)
    np.testing.assert_array_equal(slides, np.hypot(*(traction - 0.7 * slip)) > limit)
    assert compiled._slides(traction, slip, np.where(slides, limit, 0.0), 0.7, slides)
    way, response = point, offset
    sums = (slip * way).sum(), (way * response).sum()
    np.testing.assert_allclose(compiled._slopes(slip, way, response), sums, rtol=1e-12)
    assert compiled._work(slip, limit.ravel()) == pytest.approx((np.hypot(*slip) * limit).sum(), rel=1e-12)


def test_systems_are_solved_the_further_the_faster_newton_converges() -> None:
    forcing = 0.1, 1e-3, 0.3
    assert compiled._share_left(np.inf, 1e-2, 1e-12, forcing) == 0.1
    assert compiled._share_left(0.2, 1e-2, 1e-12, forcing) == pytest.approx(0.05**2)
    assert compiled._share_left(1e9, 1e-2, 1e-12, forcing) == 1e-3
    assert compiled._share_left(0.2, 1e-2, 1e-3, forcing) == pytest.approx(0.3 * 0.1)  # no further than is asked
    assert compiled._share_left(0.2, 1e-2, 9e-3, forcing) == 0.1


def test_the_extent_and_the_limits_of_a_contact_are_found_at_once() -> None:
    points, limit = np.random.default_rng(1).normal(size=(2, 99)), np.zeros(99)
    limit[20:60] = np.linspace(1.0, 3.0, 40)
    extent, largest, capacity = compiled._extent(points, limit)
    assert extent == pytest.approx(0.5 * np.hypot(*np.ptp(points[:, 20:60], axis=1)), rel=1e-14)
    assert (largest, capacity) == (3.0, pytest.approx(limit.sum(), rel=1e-14))
    limit[30] = np.nan
    assert np.isnan(compiled._extent(points, limit)[1:]).all()
