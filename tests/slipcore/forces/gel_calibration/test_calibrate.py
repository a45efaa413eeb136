"""A gel from presses with known forces, on the scene of an independent solver."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput, UnknownScale
from slipcore.forces import Gel, GelCalibration, GelEstimate, calibrate_gel, reconstruct
from slipcore.forces.gel_calibration import calibrate
from slipcore.forces.gel_calibration.bounded_gaussian import through
from slipcore.forces.gel_calibration.calibrate import GIVEN, HALF_SPACE
from slipcore.forces.recording import DisplacementData

FORCES = [5.0, 10.0]
"""N of the frames in which the sphere is only pressed."""
Pressed = Callable[..., GraspLog]


@pytest.fixture(scope="module")
def logs(pressed: Pressed) -> list[GraspLog]:
    return [pressed([frame] * 2, noise=1e-6, crop=slice(4, 16)) for frame in (1, 2)]


@pytest.fixture(scope="module")
def stiffness(logs: list[GraspLog]) -> GelCalibration:
    """Where the rest of the gel is known."""
    return calibrate_gel(logs[:1], FORCES[:1], poisson_ratio=0.49, thickness=5e-3, noise=1e-6)


def check_holds(estimate: GelEstimate, true: float, within: float) -> None:
    assert estimate.value == pytest.approx(true, rel=within)
    assert estimate.low <= true <= estimate.high


def test_the_modulus_is_found_and_what_is_given_stays(stiffness: GelCalibration) -> None:
    young, ratio, thickness = stiffness.estimates
    check_holds(young, 1e6, 0.01)
    assert young.high / young.low < 1.1
    assert (ratio.value, ratio.low, ratio.high, ratio.note) == (0.49, 0.49, 0.49, GIVEN)
    assert (thickness.value, thickness.information, thickness.note) == (pytest.approx(5e-3), 0.0, GIVEN)
    np.testing.assert_allclose(stiffness.force, FORCES[:1], rtol=0.02)
    assert stiffness.misfit < 1.5


def test_a_force_that_the_gripper_reports_is_known_as_well_as_it_says(
    logs: list[GraspLog], stiffness: GelCalibration
) -> None:
    """To 1 % unless it says else; one that is given counts in its place."""
    gripped = replace(logs[0], gripper_force=FORCES[:1] * 2, gripper_force_deviation=0.5)
    about: dict[str, Any] = {"poisson_ratio": 0.49, "thickness": 5e-3, "noise": 1e-6}
    found = calibrate_gel([gripped], **about)
    assert found.gel.young_modulus == pytest.approx(stiffness.gel.young_modulus, rel=1e-3)
    young = found.estimates[0]
    assert np.log(young.high / young.low) == pytest.approx(2 * 1.96 * 0.1, rel=0.05)  # of 0.5 N in 5 N
    as_usual = replace(logs[0], gripper_force=FORCES[:1] * 2)
    held = [
        calibrate._held(DisplacementData.of(as_usual, 1e-6), calibrate._known(as_usual, each), 9) for each in (None, 7)
    ]
    assert [(press.force, press.tolerance) for press in held] == [
        (5.0, pytest.approx(0.01)),
        (7.0, pytest.approx(0.01)),
    ]


def test_forces_in_another_unit_scale_the_modulus(logs: list[GraspLog], stiffness: GelCalibration) -> None:
    large = calibrate_gel(logs[:1], [1e3 * FORCES[0]], poisson_ratio=0.49, thickness=5e-3, noise=1e-6)
    assert large.gel.young_modulus == pytest.approx(1e3 * stiffness.gel.young_modulus, rel=1e-9)


@pytest.mark.long
def test_all_three_are_found_where_depth_is_seen(logs: list[GraspLog]) -> None:
    found = calibrate_gel(logs, FORCES, noise=1e-6)
    young, ratio, thickness = found.estimates
    check_holds(young, 1e6, 0.03)
    check_holds(ratio, 0.49, 0.015)
    check_holds(thickness, 5e-3, 0.03)
    assert min(ratio.information, thickness.information) > 0.9
    assert found.correlation[0, 2] != 0.0
    np.testing.assert_allclose(np.diag(found.correlation), 1.0, rtol=1e-9)


@pytest.mark.long
def test_without_any_force_thickness_and_ratio_follow_from_the_displacement(logs: list[GraspLog]) -> None:
    found = calibrate_gel(logs[1:], young_modulus=2e5, noise=1e-6)
    assert found.estimates[0].note == GIVEN
    assert found.gel.thickness == pytest.approx(5e-3, rel=0.05)
    assert found.gel.poisson_ratio == pytest.approx(0.49, abs=0.01)


@pytest.mark.long
def test_a_half_space_has_a_least_thickness_alone() -> None:
    from benchmarks.forces.scenes import Lattice, press, seen

    lattice, rng = Lattice((12, 12), 8), np.random.default_rng(2)
    truth = press("sphere", Gel(1e6, 0.48), lattice, steps=((0.5, 0.0),) * 2)
    found = calibrate_gel([seen(truth.log, 3e-6, True, rng)], [5.0], poisson_ratio=0.48, noise=3e-6)
    thickness = found.estimates[2]
    assert thickness.note == HALF_SPACE
    assert thickness.high == np.inf
    assert thickness.low > 0.05
    check_holds(found.estimates[0], 1e6, 0.03)
    assert found.to_json()["estimates"][2]["high"] is None


def friction(log: GraspLog, **changed: float) -> tuple[float, float]:
    """Normal force, and the ratio of tangential to it, by a gel."""
    gel = Gel(**{"young_modulus": 1e6, "poisson_ratio": 0.49, "thickness": 5e-3} | changed)
    x, _, z = reconstruct(log, gel, noise=1e-6).resultant[-1]
    return -z, x / -z


def test_the_modulus_cancels_in_friction_and_thickness_and_ratio_do_not(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, crop=slice(5, 15))
    normal, right = friction(log)
    stiff, same = friction(log, young_modulus=3e6)
    assert stiff == pytest.approx(3.0 * normal, rel=1e-9)
    assert same == pytest.approx(right, rel=1e-9)
    assert abs(friction(log, thickness=4e-3)[1] / right - 1.0) > 0.05
    assert abs(friction(log, poisson_ratio=0.45)[1] / right - 1.0) > 0.05


@pytest.mark.parametrize(
    ("known", "more", "message"),
    [
        ([5.0], {}, "known_force is 1 forces; allowed: one for each of 2 logs"),
        ([5.0, 0.0], {}, "known_force is 0"),
        ([5.0, -1.0], {}, "known_force is -1"),
        ([5.0, np.nan], {}, "known_force is nan"),
        ([None, None], {}, "known_force is none; allowed: at least one"),
        (None, {}, "known_force is none"),
        (FORCES, {"poisson_ratio": 0.6}, "poisson_ratio is 0.6"),
        (FORCES, {"thickness": -1.0}, "thickness is -1"),
        (FORCES, {"noise": -1.0}, "noise is -1"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(
    logs: list[GraspLog], known: Any, more: dict[str, float], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        calibrate_gel(logs, known, **more)


def test_logs_that_are_no_presses_are_refused(logs: list[GraspLog], pressed: Pressed) -> None:
    log = logs[0]
    still = replace(log, displacement=np.zeros(log.displacement.shape))
    with pytest.raises(InvalidInput, match="one in which nothing touches"):
        calibrate_gel([still], [1.0], noise=1e-6)
    with pytest.raises(InvalidInput, match="logs is none"):
        calibrate_gel([], [])
    with pytest.raises(InvalidInput, match="number 2, the same press as number 1; allowed: each press once"):
        calibrate_gel([log, log], [5.0, 5.0])
    with pytest.raises(InvalidInput, match="of several lattices"):
        calibrate_gel([log, pressed([1, 1])], FORCES)
    with pytest.raises(UnknownScale):
        calibrate_gel([replace(log, metadata={"scale": "unknown"})], [5.0])
    line = replace(log, position=log.position[:1], displacement=log.displacement[:, :1], force=None)
    with pytest.raises(InvalidInput, match="position is markers on a line"):
        calibrate_gel([line], [5.0])


def test_presses_seen_by_depth_alone_are_refused(logs: list[GraspLog]) -> None:
    alone = [replace(log, metadata={"displacement": "along the normal"}) for log in logs]
    with pytest.raises(InvalidInput, match="logs is of displacement along the normal alone"):
        calibrate_gel(alone, [2.0] * len(alone))


def test_a_gaussian_is_met_through_its_points() -> None:
    rng = np.random.default_rng(1)
    mean, precision = np.array([0.3, 2.0]), np.array([[400.0, -30.0], [-30.0, 9.0]])
    points = mean + 0.1 * rng.standard_normal((9, 2))
    values = 7.0 - 0.5 * np.einsum("ni,ij,nj->n", points - mean, precision, points - mean)
    found = through(points, values, np.array([0.0, 0.0]), np.array([1.0, 10.0]))
    covariance = np.linalg.inv(precision)
    np.testing.assert_allclose(found.mean, mean, rtol=1e-3)
    np.testing.assert_allclose(found.covariance, covariance, rtol=0.01)
    assert found.quantile(1, 0.975) == pytest.approx(2.0 + 1.96 * np.sqrt(covariance[1, 1]), rel=0.01)


def test_a_bound_cuts_a_gaussian_and_what_nothing_tells_is_spread_over_its_range() -> None:
    points = np.linspace(0.0, 0.2, 5)[:, None]
    half = through(points, -0.5 * (points[:, 0] / 0.1) ** 2, np.zeros(1), np.ones(1))
    assert half.mean[0] == pytest.approx(0.1 * np.sqrt(2.0 / np.pi), rel=0.01)
    assert half.density(0, 0.0) == 1.0
    flat = through(points, np.zeros(5), np.zeros(1), np.ones(1))
    assert flat.covariance[0, 0] == pytest.approx(1.0 / 12.0, rel=0.03)


@pytest.mark.parametrize("begin", [(0.1, 0.0), (0.3, 50.0), (0.5, 100.0)])
def test_a_search_begins_within_its_bounds_and_in_every_direction(
    begin: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also from their ends, where a corner beyond them would be moved back onto the beginning."""
    begun: list[Any] = []
    monkeypatch.setattr(calibrate, "minimize", lambda *_, options, **__: begun.append(options["initial_simplex"]))
    bounds = np.array([0.1, 0.0]), np.array([0.5, 100.0])
    search: Any = SimpleNamespace(bounds=bounds, best=begin, point=np.array, at=lambda _: 0.0)
    calibrate._GelSearch._descend(search, 0.2)
    (simplex,) = begun
    np.testing.assert_array_equal(simplex[0], begin)
    assert (bounds[0] <= simplex).all()
    assert (simplex <= bounds[1]).all()
    assert np.linalg.matrix_rank((simplex[1:] - simplex[0]) / (bounds[1] - bounds[0]), tol=0.01) == 2
