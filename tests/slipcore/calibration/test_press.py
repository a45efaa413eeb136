"""Which frames of a press are free, held and pressed, and what makes it impure."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.calibration.press import PressLog, _noise, find_press, load_terms, marker_motion, press_fault
from slipcore.frames import GraspLog
from tests.slipcore.calibration.straight_press import DEPTH, LOAD, STEP, places, press, shares, straight


def test_frames_of_a_press_are_told_by_its_load() -> None:
    seen = press()
    touched = np.flatnonzero(LOAD > 0.0)
    near = np.zeros(len(LOAD), bool)
    near[touched[0] - 1 : touched[-1] + 2] = True  # a frame beside contact is neither
    np.testing.assert_array_equal(seen.free, ~near)
    np.testing.assert_array_equal(seen.held, LOAD == 1.0)
    np.testing.assert_array_equal(seen.pressed, LOAD >= 0.3)
    assert seen.depth == pytest.approx(DEPTH, rel=1e-12)
    assert seen.zero is not None


def test_the_footprint_carries_more_than_a_twentieth_of_the_peak() -> None:
    seen = press(tangential=(0.1, -0.2))
    footprint = shares() >= 0.05 * shares().max()
    np.testing.assert_array_equal(seen.footprint, footprint)
    normal = 2.0 * LOAD * shares()[footprint].sum()
    np.testing.assert_allclose(seen.normal_force, normal, rtol=0.0, atol=1e-12, err_msg="rounding")
    expected = normal[:, None] * [0.1, -0.2]
    np.testing.assert_allclose(seen.tangential_force, expected, rtol=0.0, atol=1e-12, err_msg="rounding")


@pytest.mark.parametrize(("width", "reaches"), [(1e-3, False), (2e-3, True)])
def test_a_wide_contact_reaches_the_edge(width: float, reaches: bool) -> None:
    assert press(share=shares(width)).reaches_edge is reaches


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("row", "reaches"), [(0, True), (1, False), (6, False), (7, True)])
def test_only_the_outermost_elements_are_the_edge(axis: int, row: int, reaches: bool) -> None:
    share = np.zeros((8, 8))
    share[row, 2:6] = 0.25
    assert press(share=np.moveaxis(share, 0, axis)).reaches_edge is reaches


def test_without_depth_the_forces_tell_the_level() -> None:
    flat = replace(straight(), displacement=np.zeros_like(straight().displacement))
    seen = find_press(flat)
    assert seen.depth == 0.0
    np.testing.assert_array_equal(seen.free, press().free)
    np.testing.assert_array_equal(seen.held, LOAD == 1.0)


def test_without_forces_the_level_is_the_load() -> None:
    seen = find_press(replace(straight(), force=None))
    assert seen.split is None
    assert seen.zero is None
    np.testing.assert_array_equal(seen.normal_force, seen.level)
    assert not seen.tangential_force.any()
    assert press_fault(seen) is None


def tilted(log: GraspLog) -> GraspLog:
    """On a slope of 3 in 5 along x: what presses straight down there has a part along x."""
    normal = np.broadcast_to([0.6, 0.0, 0.8], log.displacement.shape)
    assert log.force is not None
    return replace(log, normal=normal, force=-log.force[..., 2:] * -normal)


def test_pressing_force_is_that_against_the_normal() -> None:
    seen = find_press(tilted(straight()))
    assert seen.split is not None
    np.testing.assert_allclose(seen.split[..., :2], 0.0, rtol=0.0, atol=1e-12, err_msg="rounding")
    np.testing.assert_allclose(seen.split[..., 2], 2.0 * LOAD[:, None, None] * shares(), rtol=0.0, atol=1e-12)


def test_motion_of_markers_is_told_by_mean_and_turn() -> None:
    """A turn by an angle moves the rim by it times the radius of gyration."""
    log, angle = straight(), 2e-3
    across = (
        angle * LOAD[:, None, None, None] * np.stack([-places()[..., 1], places()[..., 0], 0.0 * places()[..., 0]], -1)
    )
    moved = log.displacement + across + LOAD[:, None, None, None] * np.array([3e-5, -4e-5, 0.0])
    seen = find_press(replace(log, displacement=moved))
    mean, turn = marker_motion(seen)
    np.testing.assert_allclose(mean, LOAD[seen.pressed, None] * [3e-5, -4e-5], rtol=1e-9)  # rounding
    radius = np.sqrt((places()[seen.footprint][:, :2] ** 2).sum(axis=1).mean())
    np.testing.assert_allclose(turn, angle * radius * LOAD[seen.pressed], rtol=1e-9)  # rounding


def bent(share: float) -> PressLog:
    """Load along x in the middle of the hold, as a share of the largest normal load over the footprint."""
    load = np.zeros((len(LOAD), 1, 1, 3))
    load[18:20, ..., 0] = share * 2.0 * shares()[shares() >= 0.05 * shares().max()].sum()
    return press(added=load * (shares() * (shares() >= 0.05 * shares().max()))[..., None] / shares().max())


def test_load_sideways_beyond_a_twentieth_is_impure() -> None:
    seen = bent(1.0)
    terms, load = load_terms(seen)
    stray = load - terms @ np.linalg.lstsq(terms, load)[0]
    size = float(np.abs(stray).max() / seen.normal_force.max())  # of a load of 1; all is linear
    assert press_fault(bent(0.049 / size)) is None
    assert "the load sideways changes by" in str(press_fault(bent(0.051 / size)))


@pytest.mark.parametrize(("share", "is_pure"), [(0.099, True), (0.101, False)])
def test_motion_sideways_beyond_a_tenth_is_impure(share: float, is_pure: bool) -> None:
    found = press_fault(press(moved=(0.6 * share, 0.8 * share)))
    assert (found is None) is is_pure
    assert is_pure or f"{1e3 * share:.3g} µm sideways" in str(found)


def test_terms_of_the_load_are_those_that_free_frames_tell() -> None:
    terms, load = load_terms(press())
    known = press().free | press().pressed
    np.testing.assert_allclose(terms[:, 2], STEP * np.flatnonzero(known), rtol=1e-12)  # rounding
    assert terms.shape == (known.sum(), 3)
    assert load.shape == (known.sum(), 2)
    assert load_terms(press(load=LOAD[:-12]))[0].shape[1] == 2
    assert load_terms(press(load=LOAD[13:23]))[0].shape[1] == 1


def test_a_press_within_its_noise_is_none() -> None:
    noise = np.zeros((len(LOAD), 8, 8, 3))
    noise[..., 2] = 0.04 * np.random.default_rng(1).standard_normal(noise.shape[:3])
    assert "nothing presses: " in str(press_fault(press(added=noise)))
    assert press_fault(press(added=0.02 * noise)) is None
    assert press_fault(press(load=0.0 * LOAD)) == "nothing presses"


def test_noise_is_told_by_second_differences() -> None:
    rng = np.random.default_rng(6)
    assert _noise(3.0 * rng.standard_normal((4, 5000))) == pytest.approx(3.0, rel=0.03)
    assert _noise(np.arange(10.0)) == 0.0  # a ramp is no noise
    assert _noise(np.array([1.0, -1.0])) == 0.0


def test_motion_sideways_is_told_in_micrometres_beside_the_depth() -> None:
    told = str(press_fault(press(moved=(0.3, 0.4))))
    assert "markers go 500 µm sideways while they are pressed 1e+03 µm in" in told
    x, y = np.moveaxis(places()[..., :2], -1, 0)
    turned = 0.2 * LOAD[:, None, None, None] * np.stack([-y, x, np.zeros_like(x)], axis=-1)
    log = straight()
    seen = find_press(replace(log, displacement=log.displacement + turned))
    radius = np.sqrt((places()[seen.footprint][:, :2] ** 2).sum(axis=1).mean())
    assert f"markers turn by {1e6 * 0.2 * radius:.3g} µm at the rim of the contact" in str(press_fault(seen))
