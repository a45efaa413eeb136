"""Forces found from displacement, against the forces that an independent solver knows."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from slipcore import GraspLog, InvalidInput, UnknownScale
from slipcore.forces import Gel, Reconstruction, reconstruct
from slipcore.forces.inverse.support import better_support
from slipcore.forces.reconstruction import whole_log
from slipcore.forces.reconstruction.height import at_points
from slipcore.forces.recording import DisplacementData, least_power
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.frames import BY_FORCES, BY_MOTION
from slipcore.markers import contact_by_motion

GEL = Gel(young_modulus=1e6, poisson_ratio=0.49, thickness=5e-3)
Pressed = Callable[..., GraspLog]
LATE = [3, 6]
AROUND, MIDDLE, INSIDE, CORE = slice(3, 17), slice(4, 16), slice(6, 14), slice(7, 13)
"""Parts of the lattice: the contact and some or a little around it, most of the contact, and half of it."""


def truth(log: GraspLog) -> np.ndarray:
    assert log.force is not None
    return log.force


def relative(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


def check_resultant(log: GraspLog, found: Reconstruction, share: float) -> None:
    total = truth(log).sum(axis=(1, 2))
    size = np.linalg.norm(total, axis=1, keepdims=True)
    np.testing.assert_array_less(np.abs(found.resultant - total) / size, share)


@pytest.fixture(scope="module")
def with_depth(pressed: Pressed) -> tuple[GraspLog, Reconstruction]:
    """The whole lattice seen along all axes, and what is found of it."""
    log = pressed(LATE, noise=1e-6)
    return log, reconstruct(log, GEL, noise=1e-6)


def test_with_depth_forces_are_met(with_depth: tuple[GraspLog, Reconstruction]) -> None:
    log, found = with_depth
    check_resultant(log, found, 0.003)
    assert relative(found.force[..., :2], truth(log)[..., :2]) < 0.07
    assert relative(found.force[..., 2], truth(log)[..., 2]) < 0.03
    within = np.abs(found.force - truth(log)) < 1.96 * found.deviation
    assert within[found.contact].mean() > 0.9
    assert (found.information > 0.99).all()
    assert 0.5e-3 < found.kernel_width < 2e-3


def test_in_the_plane_alone_the_contact_is_found_and_with_it_the_normal_force_on_a_layer(pressed: Pressed) -> None:
    log = pressed(LATE, noise=1e-6, axes=2)
    found = reconstruct(log, GEL, noise=1e-6)
    check_resultant(log, found, 0.01)
    assert relative(found.force[..., :2], truth(log)[..., :2]) < 0.1
    assert relative(found.force[..., 2], truth(log)[..., 2]) < 0.3
    touching = np.hypot(*np.moveaxis(log.position[..., :2], -1, 0)) < 4e-3
    assert abs(found.contact[1].sum() / touching.sum() - 1.0) < 0.3


def test_what_may_lie_between_nodes_does_not_hide_the_contact(pressed: Pressed) -> None:
    log = pressed([2, 7], axes=2, crop=AROUND)
    found = reconstruct(log, GEL, noise=0.0)
    touching = (truth(log)[..., 2] < 0.0).sum(axis=(1, 2))
    np.testing.assert_allclose(found.contact.sum(axis=(1, 2)), touching, rtol=0.2)


def test_what_is_only_the_priors_is_said(pressed: Pressed) -> None:
    """In the plane an incompressible half-space shows nothing of pressure; a given force is then all that is known."""
    log = pressed(LATE, noise=1e-6, axes=2, crop=CORE)
    blind = Gel(1e6, 0.5)
    alone = reconstruct(log, blind, noise=1e-6)
    assert alone.information[2] < 0.01
    assert (alone.information[:2] > 0.9).all()
    assert (alone.resultant_deviation[:, 2] > 0.5).all()
    given = reconstruct(log, blind, total_force=np.array([10.0, 10.0]), noise=1e-6)
    assert given.information[2] > 0.9
    np.testing.assert_allclose(given.resultant[:, 2], -10.0, rtol=0.03)


def test_the_force_that_the_gripper_reports_is_given(pressed: Pressed) -> None:
    log = replace(pressed([6, 6], noise=1e-6, axes=2, crop=CORE), gripper_force=np.array([9.0, 9.1]))
    blind = Gel(1e6, 0.5)
    found, given = reconstruct(log, blind, noise=1e-6), reconstruct(log, blind, np.array([9.0, 9.1]), 1e-6)
    np.testing.assert_array_equal(found.force, given.force)
    np.testing.assert_array_equal(found.given, [[False, False, True]] * 2)
    np.testing.assert_allclose(found.resultant[:, 2], [-9.0, -9.1], rtol=0.03)
    silent = reconstruct(replace(log, gripper_force=np.zeros(2)), blind, noise=1e-6)
    assert not silent.given.any(), "a gripper that does not report"
    assert (silent.resultant_deviation[:, 2] > 0.5).all()


def test_a_force_that_the_gels_shape_contradicts_is_told(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, crop=INSIDE)
    alone = reconstruct(log, GEL, noise=1e-6)
    assert (alone.contradicted, np.isnan(alone.contradiction).all()) == (0.0, True)
    true = -alone.resultant[:, 2]
    assert reconstruct(replace(log, gripper_force=true), GEL, noise=1e-6).contradicted == 0.0
    wrong = reconstruct(replace(log, gripper_force=true * [1.0, 1.3]), GEL, noise=1e-6)
    assert wrong.contradicted == 0.5
    assert np.isnan(wrong.contradiction[:, :2]).all()


def test_newtons_that_are_none_are_refused(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, axes=2, crop=CORE)
    bearable = 10.0 * GEL.young_modulus * log.element_area * 36
    assert reconstruct(replace(log, gripper_force=np.full(2, 1e-9)), GEL, noise=1e-6).given.sum() == 0
    with pytest.raises(InvalidInput, match=r"total_force is up to .* \(is it in N, and of this gel\?\)"):
        reconstruct(log, GEL, total_force=np.full(2, 1.01 * bearable), noise=1e-6)
    with pytest.raises(InvalidInput, match="gripper_force is up to"):
        reconstruct(replace(log, gripper_force=np.full(2, 1.01 * bearable)), GEL, noise=1e-6)


def test_a_force_is_as_sure_as_it_is_said_to_be(pressed: Pressed) -> None:
    log = replace(pressed([6, 6], noise=1e-6, axes=2, crop=CORE), gripper_force=np.array([10.0, 10.0]))
    blind, spread = Gel(1e6, 0.5), []
    for deviation in (0.1, 1.0):
        found = reconstruct(replace(log, gripper_force_deviation=deviation), blind, noise=1e-6)
        spread.append(found.resultant_deviation[:, 2])
        np.testing.assert_array_less(np.abs(found.resultant[:, 2] + 10.0), 3.0 * spread[-1])
    np.testing.assert_array_less(0.05, spread[0])
    np.testing.assert_array_less(3.0 * spread[0], spread[1])


def test_nothing_touches_where_nothing_moves_but_noise(pressed: Pressed) -> None:
    still = replace(pressed(LATE, crop=INSIDE), displacement=np.zeros((2, 8, 8, 3)))
    noisy = replace(still, displacement=1e-6 * np.random.default_rng(1).standard_normal((2, 8, 8, 3)))
    for log, noise in ((still, 0.0), (still, None), (noisy, 1e-6)):
        found = reconstruct(log, GEL, noise=noise)
        assert not found.force.any()
        assert not found.contact.any()
        assert not found.information.any()
        assert found.force_noise == 0.0


def test_a_load_that_moves_no_marker_may_be_there_all_the_same(pressed: Pressed) -> None:
    """An incompressible half-space moves none sideways: up to what a gel bears, or as the gripper reports."""
    log = pressed(LATE, noise=1e-6, axes=2, crop=INSIDE)
    still = replace(log, displacement=np.zeros(log.displacement.shape), gripper_force=np.array([8.0, 0.0]))
    alone = reconstruct(replace(still, gripper_force=None), Gel(1e6, 0.5), noise=1e-6)
    assert not alone.resultant.any()
    assert (alone.resultant_deviation[:, 2] == alone.unnoticed[2]).all()
    assert alone.unnoticed[2] == pytest.approx(1e6 * 64 * log.element_area, rel=0.6)
    assert (alone.deviation == alone.unnoticed).all()
    given = reconstruct(still, Gel(1e6, 0.5), noise=1e-6)
    np.testing.assert_allclose(given.resultant[:, 2], [-8.0, 0.0], rtol=1e-4)
    np.testing.assert_allclose(given.resultant_deviation[0, 2], 0.08, rtol=1e-4)
    assert given.resultant_deviation[1, 2] == alone.unnoticed[2]


@pytest.mark.parametrize(("axes", "gel"), [(3, GEL), (2, GEL), (2, Gel(1e6, 0.45))])
def test_what_is_unnoticed_is_what_touches_no_marker_by_more_than_noise(pressed: Pressed, axes: int, gel: Gel) -> None:
    log = pressed([3, 3], axes=axes, crop=INSIDE)
    sensor = SensorResponse.of(log.position, log.element_area, gel, tuple(range(axes)))
    alike = np.flatnonzero(sensor.elements.any(axis=0))
    for factor, noticed in ((0.9, False), (1.1, True)):
        load = factor * sensor.unnoticed(1e-6) / sensor.load
        spread = sensor.response[:, :, alike].mean(axis=2) * load
        alone = sensor.response[:, :, alike] * load[:, None]
        moves = np.sqrt(np.mean(np.concatenate((spread[..., None], alone), axis=2) ** 2, axis=0)).min(axis=1)
        level = 1e-6 * np.sqrt(least_power(len(spread)))
        assert ((moves > level) == noticed).all()


@pytest.mark.parametrize("axes", [2, 3])
def test_noise_free_markers_are_followed(pressed: Pressed, axes: int) -> None:
    log = pressed([6, 6], axes=axes, crop=AROUND)
    check_resultant(log, reconstruct(log, GEL, noise=0.0), 0.02)


@pytest.mark.parametrize("axes", [2, 3])
def test_a_contact_that_the_lattice_cuts_is_found_beyond_its_edge(pressed: Pressed, axes: int) -> None:
    whole, cut = pressed(LATE, axes=axes), pressed(LATE, noise=1e-6, axes=axes, crop=slice(7, 20))
    total, inside = (truth(log).sum(axis=(1, 2))[:, 2] for log in (whole, cut))
    found = reconstruct(cut, GEL, noise=1e-6)
    assert (inside > 0.9 * total).all()
    element_sum = found.force[..., 2].sum(axis=(1, 2))
    np.testing.assert_allclose(element_sum, inside, rtol=0.05)


@pytest.mark.parametrize(
    "crop", [np.s_[9:10, 9:10], np.s_[4:16, 9:10], np.s_[9:11, 9:11]], ids=["one marker", "a line", "four markers"]
)
def test_few_markers_and_markers_on_a_line_give_finite_forces(pressed: Pressed, crop: tuple[slice, slice]) -> None:
    whole = pressed(LATE, noise=1e-6)
    few = replace(
        whole,
        position=whole.position[crop],
        displacement=whole.displacement[:, *crop],
        force=truth(whole)[:, *crop],
    )
    found = reconstruct(few, GEL, noise=1e-6)
    assert np.isfinite(found.force).all()
    assert (found.resultant_deviation > 0.0).all()
    assert (found.resultant[:, 2] < 0.0).all()


def test_a_gel_of_another_stiffness_gives_forces_of_that_scale(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, axes=2, crop=CORE)
    soft, stiff = (
        reconstruct(log, Gel(young, GEL.poisson_ratio, GEL.thickness), noise=1e-6).resultant for young in (1e3, 1e12)
    )
    np.testing.assert_allclose(1e9 * soft, stiff, rtol=1e-6, atol=1e-6 * np.abs(stiff).max())


def test_a_sensor_of_another_size_gives_forces_of_that_scale(pressed: Pressed) -> None:
    large = pressed([6, 6], noise=1e-6, crop=MIDDLE)
    shrink = 0.1
    small = replace(
        large,
        position=shrink * large.position,
        displacement=shrink * large.displacement,
        element_area=shrink**2 * large.element_area,
    )
    of_large = reconstruct(large, GEL, noise=1e-6).resultant
    thin = replace(GEL, thickness=shrink * GEL.thickness)
    of_small = reconstruct(small, thin, noise=shrink * 1e-6).resultant
    np.testing.assert_allclose(of_small, shrink**2 * of_large, rtol=1e-5, atol=1e-12)


def test_a_very_thick_layer_is_a_half_space(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, crop=MIDDLE)
    thick, free = (reconstruct(log, replace(GEL, thickness=h), noise=1e-6).resultant for h in (10.0, np.inf))
    np.testing.assert_allclose(thick, free, rtol=0.0, atol=2e-3 * np.abs(free).max())


def test_how_ill_conditioned_the_problem_is_is_said(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=1e-6, crop=MIDDLE)
    surface, below = (reconstruct(log, replace(GEL, marker_depth=d), noise=1e-6).condition for d in (0.0, 1e-3))
    assert 10.0 < surface < 1e3
    assert below > 1e3 * surface
    few = slice(8, 11)
    one = replace(log, position=log.position[few, few], displacement=log.displacement[:, few, few], force=None)
    assert reconstruct(one, GEL, noise=1e-6).condition == np.inf
    still = replace(log, displacement=np.zeros(log.displacement.shape))
    assert np.isnan(reconstruct(still, GEL, noise=0.0).condition)


def test_noise_alone_is_no_reason_to_seek_the_contact_again(pressed: Pressed, monkeypatch: pytest.MonkeyPatch) -> None:
    sought = []

    def counted(*arguments: Any) -> Any:
        sought.append(1)
        return better_support(*arguments)

    monkeypatch.setattr("slipcore.forces.tracking.tracker.better_support", counted)
    reconstruct(pressed([1] * 4, noise=3e-6, axes=2, crop=INSIDE), GEL, noise=3e-6)
    assert len(sought) == 1


def test_a_frame_in_which_no_marker_is_seen_has_no_forces(pressed: Pressed) -> None:
    log = pressed(LATE, noise=1e-6, crop=MIDDLE)
    observed = np.ones(log.displacement.shape[:3], dtype=bool)
    observed[0] = False
    found = reconstruct(replace(log, observed=observed), GEL, noise=1e-6)
    assert not found.force[0].any()
    assert found.contact[1].any()


def test_markers_that_are_lost_tell_nothing(pressed: Pressed) -> None:
    log = pressed(LATE, noise=1e-6, axes=2, crop=slice(2, 18))
    observed = np.random.default_rng(3).random(log.displacement.shape[:3]) > 0.1
    placeholder = np.where(observed[..., None], log.displacement, 1e-3 * np.array([1.0, 0.0, 0.0]))
    found = reconstruct(replace(log, displacement=placeholder, observed=observed), GEL, noise=1e-6)
    check_resultant(log, found, 0.02)


@pytest.mark.parametrize("criterion", ["gcv", "discrepancy"])
def test_other_criteria_find_the_resultant_too(pressed: Pressed, criterion: str) -> None:
    log = pressed(LATE, noise=3e-6, crop=MIDDLE)
    check_resultant(log, reconstruct(log, GEL, noise=3e-6, criterion=criterion), 0.02)  # type: ignore[arg-type]


def test_noise_is_estimated_where_it_is_not_given(pressed: Pressed) -> None:
    log = pressed([6] * 14, noise=3e-6, axes=2, crop=CORE)
    assert reconstruct(log, GEL).noise == pytest.approx(3e-6, rel=0.25)


def test_the_log_with_these_forces_says_where_they_come_from(pressed: Pressed) -> None:
    log = replace(pressed(LATE, crop=INSIDE), force=None)
    found = reconstruct(log, GEL, noise=1e-6)
    made = found.apply(log)
    assert made.force is not None
    assert made.metadata["force"] == "reconstructed"
    np.testing.assert_array_equal(made.force, found.force)
    assert found.force_noise > 0.0
    with pytest.raises(InvalidInput, match="log is of shape"):
        found.apply(pressed(LATE))


def test_what_does_not_fit_is_refused_by_name(pressed: Pressed) -> None:
    log = pressed(LATE, crop=INSIDE)
    with pytest.raises(UnknownScale):
        reconstruct(replace(log, metadata={"scale": "unknown"}), GEL)
    with pytest.raises(InvalidInput, match="noise is -1"):
        reconstruct(log, GEL, noise=-1.0)
    with pytest.raises(InvalidInput, match="total_force is of shape"):
        reconstruct(log, GEL, total_force=np.ones(5))
    with pytest.raises(InvalidInput, match="total_force_deviation is 0"):
        reconstruct(log, GEL, total_force=np.ones(len(log)), total_force_deviation=0.0)
    with pytest.raises(InvalidInput, match=r"total_force_deviation is 1.0; .* beside total_force"):
        reconstruct(log, GEL, total_force_deviation=1.0)
    with pytest.raises(InvalidInput, match="criterion is l-curve"):
        reconstruct(log, GEL, noise=1e-6, criterion="l-curve")  # type: ignore[arg-type]


DEPTH_ALONE = {"displacement": "along the normal"}


def heights(log: GraspLog, noise: float = 0.0) -> GraspLog:
    """What maps of height show: how high the point stands that has come to each place, and nothing along the surface.

    By a spline through the points where they have come to, through no more than thirty around.
    """
    seen = np.zeros_like(log.displacement)
    for shown, moved in zip(seen, log.displacement, strict=True):
        at, place = (log.position + moved)[..., :2].reshape(-1, 2), log.position[..., :2].reshape(-1, 2)
        shown[..., 2] = RBFInterpolator(at, moved[..., 2].ravel(), neighbors=30)(place).reshape(log.grid)
    seen[..., 2] += noise * np.random.default_rng(4).standard_normal(seen.shape[:3])
    return replace(log, displacement=seen, metadata=DEPTH_ALONE)


@pytest.mark.parametrize("noise", [1e-6, 1e-5])
def test_depth_alone_tells_the_normal_force_and_nothing_of_the_tangential(pressed: Pressed, noise: float) -> None:
    """Shear had stood for pressure: on thin gels all of the normal force was lost."""
    log = pressed(LATE)
    found = reconstruct(heights(log, noise), GEL, noise=noise)
    total = truth(log)[..., 2].sum(axis=(1, 2))
    error = found.resultant[:, 2] - total
    np.testing.assert_array_less(np.abs(error), 0.03 * np.abs(total))
    np.testing.assert_array_less(np.abs(error), 2.0 * found.resultant_deviation[:, 2])
    assert relative(found.force[..., 2], truth(log)[..., 2]) < 0.12  # shear moves points up slopes
    for deviation in (found.deviation, found.resultant_deviation):
        np.testing.assert_array_equal(deviation[..., :2], np.inf)
    np.testing.assert_array_equal(found.information[:2], 0.0)
    assert found.information[2] > 0.99


def test_heights_of_places_are_not_taken_for_those_of_points(pressed: Pressed, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a sphere presses the gel swells aside, up its slope: the normal force came out 1.9 % larger by them.

    Nor does an element that is not seen let its neighbours take it for a hole.
    """
    points = pressed([2, 2])
    log = heights(points)
    observed = np.ones(log.displacement.shape[:3], dtype=bool)
    observed[:, 9, 12] = False
    holed = replace(log, displacement=log.displacement * observed[..., None], observed=observed)
    with monkeypatch.context() as taken:
        taken.setattr(whole_log, "at_points", lambda log, *_: log.displacement)
        of_points = replace(points, displacement=points.displacement * [0.0, 0.0, 1.0], metadata=DEPTH_ALONE)
        expected = reconstruct(of_points, GEL, noise=1e-6).resultant[:, 2]
    for each in (log, holed):
        np.testing.assert_allclose(reconstruct(each, GEL, noise=1e-6).resultant[:, 2], expected, rtol=0.01)
    again = at_points(log, GEL, np.zeros_like(log.displacement))
    np.testing.assert_array_equal(again, log.displacement)  # what nothing presses has come from nowhere else


def test_where_nothing_touches_depth_alone_tells_no_tangential_force(pressed: Pressed) -> None:
    log = pressed([0, 0], noise=1e-6)
    seen = replace(log, displacement=1e-9 * log.displacement * [0.0, 0.0, 1.0], metadata=DEPTH_ALONE)
    deviation = reconstruct(seen, GEL, noise=1e-6).resultant_deviation
    np.testing.assert_array_equal(deviation[:, :2], np.inf)
    assert np.isfinite(deviation[:, 2]).all()


def test_noise_of_depth_alone_is_that_of_depth(pressed: Pressed) -> None:
    log = pressed([6] * 12, noise=2e-6)
    seen = replace(log, displacement=log.displacement * [0.0, 0.0, 1.0], metadata=DEPTH_ALONE)
    assert DisplacementData.of(seen, None).noise == pytest.approx(2e-6, rel=0.2)


def test_the_log_tells_how_unsure_its_reconstructed_forces_are(with_depth: tuple[GraspLog, Reconstruction]) -> None:
    log, found = replace(with_depth[0], force=None), with_depth[1]
    known = found.apply(log)
    assert known.force_deviation == pytest.approx(found.force_noise, rel=1e-3)
    assert known.contact is not None
    np.testing.assert_array_equal(known.contact, found.contact)
    again = replace(found, contact=np.zeros_like(found.contact)).apply(known)
    assert again.contact is not None
    assert not again.contact.any(), "of a log reconstructed before no contact is kept"
    assert (log.force_deviation, log.of_samples) == (0.0, {})
    assert known.of_samples == pytest.approx(found.of_samples, rel=1e-3)
    for told in ("no number", "-1", "nan", "inf", "1e9"):
        assert replace(known, metadata={**known.metadata, "force_noise": told}).of_samples == {}
    assert replace(known, metadata={**known.metadata, "force": "measured"}).of_samples == {}
    for told in ("no number", "-1", "nan", "inf"):
        assert replace(known, metadata={**known.metadata, "force_deviation": told}).force_deviation == 0.0


@pytest.mark.parametrize(("thickness", "shown"), [(5e-3, True), (np.inf, False)])
def test_a_log_seen_in_the_plane_is_given_the_contact_that_was_found_unless_it_knows_it(
    pressed: Pressed, thickness: float, shown: bool
) -> None:
    """On a half-space pressure hardly moves markers sideways, so that the contact is where they show shear."""
    log = replace(pressed(LATE, noise=1e-6, axes=2, crop=CORE), force=None)
    found = reconstruct(log, replace(GEL, thickness=thickness), [9.0, 9.0], noise=1e-6)
    assert found.shows_pressure == shown
    assert found.contact.any()
    by_motion = contact_by_motion(log.time, log.displacement)
    for unknown in (log, replace(log, contact=by_motion, metadata={"contact": BY_MOTION})):
        told = found.apply(unknown)
        assert told.contact is not None
        np.testing.assert_array_equal(told.contact, found.contact)
        assert told.metadata["contact"] == BY_FORCES
    known = found.apply(replace(log, contact=~by_motion))
    np.testing.assert_array_equal(known.contact, ~by_motion)
    assert "contact" not in known.metadata


def test_the_moment_is_that_of_the_elements_about_the_frames_z(with_depth: tuple[GraspLog, Reconstruction]) -> None:
    """Elsewhere in the frame by as much as the resultant then has an arm."""
    log, found = with_depth
    (x, y), force = np.moveaxis(log.position[..., :2], -1, 0), truth(log)
    total = (x * force[..., 1] - y * force[..., 0]).sum(axis=(1, 2))
    size = 3e-3 * np.linalg.norm(force.sum(axis=(1, 2))[:, :2], axis=1)
    np.testing.assert_array_less(np.abs(found.moment - total), 0.02 * size)
    np.testing.assert_array_less(np.abs(found.moment - total), 2.5 * found.moment_deviation)
    np.testing.assert_array_less(found.moment_deviation, 0.02 * size)
    away = np.array([0.3, -0.2, 0.0])
    elsewhere = reconstruct(replace(log, position=log.position + away), GEL, noise=1e-6)
    armed = away[0] * found.resultant[:, 1] - away[1] * found.resultant[:, 0]
    np.testing.assert_allclose(elsewhere.moment, found.moment + armed, rtol=1e-6, atol=1e-8)
    assert (elsewhere.moment_deviation > 10.0 * found.moment_deviation).all()


def test_samples_go_by_forces_averaged_alike(with_depth: tuple[GraspLog, Reconstruction]) -> None:
    log, found = with_depth
    sampled = found.for_samples(found.apply(log))
    np.testing.assert_array_equal(truth(sampled), found.alike)
    assert sampled.has_reconstructed_force
    assert 0.0 < relative(found.alike, found.force) < 0.1


def test_by_all_frames_of_a_load_at_rest_noise_counts_less(pressed: Pressed) -> None:
    """With 10 µm, against what is found without noise: of sixteen frames a quarter, and what the contact leaves."""
    log = replace(pressed([6] * 16, noise=10e-6, crop=slice(4, 16)), force=None)
    without = reconstruct(pressed([6] * 2, crop=slice(4, 16)), GEL, noise=1e-7).resultant[0]
    alone, by_all = (reconstruct(log, GEL, noise=10e-6, over_time=over_time) for over_time in (False, True))
    single, together = (np.abs(found.resultant - without).mean(axis=0) for found in (alone, by_all))
    assert (together < 0.6 * single).all()
    assert (by_all.resultant_deviation < alone.resultant_deviation).all()
    assert (np.abs(by_all.resultant - without) < 3.0 * by_all.resultant_deviation).all()
    np.testing.assert_array_equal(by_all.contact.shape, alone.contact.shape)


def test_a_step_of_the_load_stays_one_by_all_frames(pressed: Pressed) -> None:
    """By 2 %, too little to seek the contact again: less than a tenth of it is found a frame early or late."""
    log = pressed([6] * 16, crop=slice(4, 16))
    step = np.where(np.arange(16) < 8, 1.0, 0.98)[:, None, None, None]
    noise = 1e-6 * np.random.default_rng(1).standard_normal(log.displacement.shape)
    shown = replace(log, displacement=step * log.displacement + noise, force=None)
    found = -reconstruct(shown, GEL, noise=1e-6, over_time=True).resultant[:, 2]
    height = found[:8].mean() - found[8:].mean()
    assert height == pytest.approx(0.02 * found[0], rel=0.1)
    assert np.abs(found[[6, 7]] - found[:6].mean()).max() < 0.1 * height
    assert np.abs(found[[8, 9]] - found[10:].mean()).max() < 0.1 * height


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_by_all_frames_forces_scale_with_the_unit_of_force(pressed: Pressed, factor: float) -> None:
    log = replace(pressed([6] * 4, noise=3e-6, crop=slice(6, 14)), force=None)
    first = replace(GEL, young_modulus=1e8 if factor < 1.0 else 1e6)
    gels = (first, replace(first, young_modulus=factor * first.young_modulus))
    found, scaled = (reconstruct(log, gel, noise=3e-6, over_time=True) for gel in gels)
    largest = np.abs(found.force).max()
    np.testing.assert_allclose(scaled.force / factor, found.force, rtol=0.0, atol=1e-9 * largest)
