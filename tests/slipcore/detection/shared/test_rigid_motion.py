import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipcore.detection.shared.rigid_motion import RigidMotion, fit_rigid_motion

POINTS = 1e-3 * np.random.default_rng(2).standard_normal((30, 2))


def carried(points: np.ndarray, angle: float, shift: tuple[float, float]) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + shift - points


@given(st.floats(-3.1, 3.1), st.floats(-1e-2, 1e-2), st.floats(-1e-2, 1e-2))
def test_a_finite_rigid_motion_is_found_exactly(angle: float, dx: float, dy: float) -> None:
    moved = carried(POINTS, angle, (dx, dy))
    motion = fit_rigid_motion(POINTS, moved)
    assert motion.rotation == pytest.approx(angle, abs=1e-12)
    np.testing.assert_allclose(motion.displacement(POINTS), moved, rtol=0, atol=1e-16 + 1e-13 * np.abs(moved).max())


def test_a_tiny_motion_far_from_the_origin_keeps_its_digits() -> None:
    angle, points = 1e-9, POINTS + 0.5
    with mpmath.workdps(40):
        c, s = mpmath.cos(angle) - 1, mpmath.sin(angle)
        moved = np.array([[float(c * x - s * y), float(s * x + c * y)] for x, y in points.tolist()])
    motion = fit_rigid_motion(points, moved)
    assert motion.rotation == pytest.approx(angle, rel=1e-9)
    np.testing.assert_allclose(motion.displacement(points), moved, rtol=1e-12)  # cos φ − 1 would have no digit


def test_weights_pick_the_points_that_count() -> None:
    moved = carried(POINTS, 0.2, (1e-4, 0.0))
    wrong = moved.copy()
    wrong[:10] += 1e-3
    weight = np.r_[np.zeros(10), np.linspace(0.1, 2.0, 20)]
    assert fit_rigid_motion(POINTS, wrong, weight).rotation == pytest.approx(0.2, rel=1e-12)


def test_the_fit_is_the_least_squares_optimum() -> None:
    rng = np.random.default_rng(4)
    moved = carried(POINTS, 0.3, (2e-4, 1e-4)) + 1e-4 * rng.standard_normal(POINTS.shape)
    weight = rng.random(30)
    best = fit_rigid_motion(POINTS, moved, weight)

    def cost(motion: RigidMotion) -> float:
        return float(weight @ ((moved - motion.displacement(POINTS)) ** 2).sum(axis=1))

    step = 1e-6
    for other in (
        best._replace(rotation=best.rotation + 1e-3),
        best._replace(rotation=best.rotation - 1e-3),
        best._replace(dx=best.dx + step),
        best._replace(dy=best.dy - step),
    ):
        assert cost(other) > cost(best)


@pytest.mark.parametrize("points", [np.zeros((0, 2)), POINTS[:1], np.repeat(POINTS[:1], 3, axis=0)])
def test_fewer_than_two_distinct_points_leave_the_motion_unobservable(points: np.ndarray) -> None:
    assert not fit_rigid_motion(points, np.zeros_like(points)).observable


def test_points_without_weight_do_not_make_a_motion_observable() -> None:
    assert not fit_rigid_motion(POINTS, 0 * POINTS, np.r_[1.0, np.zeros(29)]).observable
    assert not fit_rigid_motion(POINTS, 0 * POINTS, np.zeros(30)).observable


def test_two_points_give_a_motion() -> None:
    moved = carried(POINTS[:2], 0.5, (0.0, 1e-4))
    assert fit_rigid_motion(POINTS[:2], moved).rotation == pytest.approx(0.5, rel=1e-12)
