"""The projection on disks and resultants, and the limit surface, against plain numpy and known answers."""

import numpy as np
import pytest
from scipy.optimize import minimize

from slipcore.contact.elasticity.fields import resultants, rigid_displacement
from slipcore.contact.limit_load import limit_load
from slipcore.contact.solver.projection import nearest_tractions, project
from slipcore.contact.solver.sliding import sliding_traction

GIVEN = np.ones(3, dtype=bool)


def disks(cells: int = 24, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radii of a Hertz-like contact, arms and random wishes; ``cells`` squared of them."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, cells), np.linspace(-1.0, 1.0, cells))
    radius = np.sqrt(np.maximum(1.0 - (x**2 + y**2) / 0.9, 0.0)).ravel()
    point = np.random.default_rng(seed).normal(size=(2, cells**2))
    return radius, np.stack((x.ravel(), y.ravel())), point


def on_disks(point: np.ndarray, radius: np.ndarray) -> np.ndarray:
    size = np.hypot(*point)
    return point * np.minimum(1.0, radius / np.where(size > 0.0, size, 1.0))


def dual(motion: np.ndarray, point: np.ndarray, radius: np.ndarray, arm: np.ndarray, target: np.ndarray) -> float:
    """The dual function, in plain numpy."""
    size = np.hypot(*(point + rigid_displacement(arm, motion)))
    value = np.where(size <= radius, 0.5 * size**2, radius * size - 0.5 * radius**2)
    return float(value.sum() - target @ motion)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_projection_meets_its_optimality_conditions(share: float) -> None:
    radius, arm, point = disks()
    target = np.array([share, -0.1, 0.2]) * 0.7 * radius.sum()
    got = project(point, radius, arm, target, GIVEN)
    assert got.feasible
    np.testing.assert_allclose(resultants(got.traction, arm), target, rtol=0.0, atol=1e-12 * radius.sum())
    expected = on_disks(point + rigid_displacement(arm, got.motion), radius)
    np.testing.assert_allclose(got.traction, expected, rtol=0.0, atol=1e-14)


def test_projection_minimises_the_dual_that_numpy_minimises() -> None:
    radius, arm, point = disks(10)
    target = np.array([0.5, 0.1, 0.1]) * radius.sum()
    got = project(point, radius, arm, target, GIVEN)
    reference = minimize(dual, np.zeros(3), args=(point, radius, arm, target), method="BFGS", tol=1e-9)
    np.testing.assert_allclose(got.motion, reference.x, rtol=1e-5, atol=1e-6)  # BFGS with numerical gradients


@pytest.mark.parametrize("slack", [1e-2, 1e-5])
def test_a_dual_that_may_be_off_is_so_by_no_more(slack: float) -> None:
    radius, arm, point = disks()
    target, traction = np.array([0.5, -0.1, 0.1]) * radius.sum(), np.empty_like(point)
    exact = project(point, radius, arm, target, GIVEN)
    motion, _, steps, feasible = nearest_tractions(
        (point, radius, arm, target, GIVEN), np.zeros(3), traction, (slack, 60)
    )
    assert feasible
    assert steps < exact.iterations
    assert np.abs(motion - exact.motion).max() <= 1.5 * slack
    np.testing.assert_allclose(traction, on_disks(point + rigid_displacement(arm, motion), radius), atol=1e-14)


def test_compiled_projection_is_the_interpreted_one() -> None:
    from slipcore.contact.solver import projection

    radius, arm, point = disks(8)
    target, traction = np.array([0.6, 0.0, 0.1]) * radius.sum(), np.empty_like(point)
    gradient, hessian = np.empty(3), np.empty((3, 3))
    motion = np.array([0.4, -0.2, 0.7])
    constraints = projection.Constraints(point, radius, arm, target, GIVEN)
    projection._evaluate(constraints, motion, projection.Evaluation(traction, gradient, hessian))
    expected = on_disks(point + rigid_displacement(arm, motion), radius)
    np.testing.assert_allclose(traction, expected, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(gradient, resultants(expected, arm) - target, rtol=0.0, atol=1e-13)
    step = 1e-6
    for k, e in enumerate(np.eye(3) * step):
        ahead = resultants(on_disks(point + rigid_displacement(arm, motion + e), radius), arm)
        behind = resultants(on_disks(point + rigid_displacement(arm, motion - e), radius), arm)
        np.testing.assert_allclose(hessian[k], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-9, 1e-12])
def test_projection_holds_close_to_full_sliding(short: float) -> None:
    radius, arm, point = disks()
    target = np.array([(1.0 - short) * radius.sum(), 0.0, 0.0])
    got = project(0.1 * point, radius, arm, target, GIVEN)
    assert got.feasible
    assert got.iterations <= 45
    assert np.abs(got.imbalance).max() <= 1e-13 * radius.sum()


@pytest.mark.parametrize("axis", [0, 1])
def test_disks_that_are_all_left_along_one_axis_are_projected_on(axis: int) -> None:
    """φ has no curvature along that axis at first, to the last digit, and its slope there is large."""
    radius, arm, _ = disks()
    point, load = np.zeros((2, radius.size)), np.zeros(3)
    radius *= 1e6
    point[axis], load[axis] = -2e6, 0.5 * radius.sum()
    got = project(point, radius, arm, load, GIVEN)
    assert got.feasible
    assert got.iterations <= 10
    np.testing.assert_allclose(got.traction, on_disks(point + rigid_displacement(arm, got.motion), radius), rtol=1e-12)
    assert np.abs(got.imbalance).max() <= 1e-13 * radius.sum()


@pytest.mark.parametrize("load", [(1.001, 0.0, 0.0), (0.8, 0.0, 0.4), (0.0, 0.0, 2.0), (-3.0, 4.0, 0.0)])
def test_loads_outside_the_limit_surface_are_recognised(load: tuple[float, float, float]) -> None:
    radius, arm, point = disks()
    target = np.array(load) * radius.sum()
    assert not project(0.1 * point, radius, arm, target, GIVEN).feasible
    assert limit_load(radius, arm, target, GIVEN).factor < 1.0


def test_a_held_motion_leaves_its_load_free() -> None:
    radius, arm, point = disks()
    given = np.array([True, False, False])
    target = np.array([0.4 * radius.sum(), 0.0, 0.0])
    got = project(point, radius, arm, target, given)
    assert got.motion[1] == got.motion[2] == 0.0
    assert got.traction[0].sum() == pytest.approx(target[0], abs=1e-12 * radius.sum())
    assert abs(got.traction[1].sum()) > 1e-3


def test_limit_surface_in_pure_force_and_pure_moment() -> None:
    radius, arm, _ = disks(200)
    total = radius.sum()
    assert limit_load(radius, arm, np.array([total, 0.0, 0.0]), GIVEN).factor == pytest.approx(1.0, rel=1e-12)
    moment = (radius * np.hypot(*arm)).sum()
    assert limit_load(radius, arm, np.array([0.0, 0.0, moment]), GIVEN).factor == pytest.approx(1.0, rel=1e-9)
    # Hertz: the mean arm of √(a² − r²) is 3π/16 a
    assert moment / total == pytest.approx(3.0 * np.pi / 16.0 * np.sqrt(0.9), rel=1e-3)


def test_the_factor_brings_a_load_exactly_to_the_surface() -> None:
    radius, arm, point = disks()
    load = np.array([0.5, 0.3, 0.4]) * radius.sum()
    factor, motion = limit_load(radius, arm, load, GIVEN)
    np.testing.assert_allclose(
        resultants(sliding_traction(radius, arm, motion), arm), factor * load, rtol=0.0, atol=1e-6 * radius.sum()
    )
    assert project(point, radius, arm, (1.0 - 1e-6) * factor * load, GIVEN).feasible
    assert not project(point, radius, arm, (1.0 + 1e-6) * factor * load, GIVEN).feasible


def test_no_load_has_no_limit() -> None:
    radius, arm, _ = disks()
    assert limit_load(radius, arm, np.zeros(3), GIVEN).factor == np.inf
