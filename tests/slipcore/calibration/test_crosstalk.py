"""Shares of the normal force that appear as tangential force."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.calibration.crosstalk import crosstalk, inward_share
from slipcore.calibration.estimate import PressEstimate
from slipcore.calibration.press import PressLog, find_press
from slipcore.calibration.zero import NO_ZERO
from tests.slipcore.calibration.straight_press import LOAD, STEP, places, press, straight


@pytest.mark.parametrize(("x", "y"), [(0.08, -0.05), (-0.02, 0.0)])
def test_a_share_is_found_beside_offset_and_drift(x: float, y: float) -> None:
    time = STEP * np.arange(len(LOAD))[:, None, None, None]
    found = crosstalk(press(tangential=(x, y), added=[1e-3, 2e-3, 3e-3] + time * [1e-4, 2e-4, -3e-4]))
    assert [each[0] for each in found] == pytest.approx([x, y], abs=1e-9)
    assert [each[1] for each in found] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_motion_sideways_leaves_room_for_a_load_that_leans() -> None:
    """By the markers' mean motion over the depth, in the stiffness of Mindlin's contact."""
    seen = press(moved=(0.03, -0.06))
    found = crosstalk(seen)
    mean = LOAD[seen.pressed].mean()
    assert [each[1] for each in found] == pytest.approx([0.67 * 0.03 * mean, 0.67 * 0.06 * mean], rel=1e-9)


def test_noise_of_forces_is_in_the_error() -> None:
    """As that of a slope beside offset and drift: of (AᵀA)⁻¹."""
    noise = np.zeros((len(LOAD), 8, 8, 3))
    noise[..., 0] = 1e-4 * np.where(np.arange(len(LOAD)) % 2, 1.0, -1.0)[:, None, None]
    seen = press(added=noise)
    known = seen.free | seen.pressed
    terms = np.stack([seen.normal_force, np.ones(len(LOAD)), STEP * np.arange(len(LOAD))], axis=1)[known]
    values = seen.tangential_force[known, 0]
    residual = values - terms @ np.linalg.lstsq(terms, values)[0]
    variance = residual @ residual / (len(values) - 1) * np.linalg.inv(terms.T @ terms)[0, 0]
    assert crosstalk(seen)[0][1] == pytest.approx(np.sqrt(variance), rel=1e-6)


def test_without_forces_or_depth_there_is_no_share() -> None:
    assert crosstalk(find_press(replace(straight(), force=None))) == ["the log has no forces"] * 2
    flat = replace(straight(), displacement=np.zeros_like(straight().displacement))
    assert ["a load that leans" in str(each) for each in crosstalk(find_press(flat))] == [True] * 2
    assert inward_share(find_press(replace(straight(), force=None))) == "the log has no forces"


def test_without_a_frame_at_rest_the_sum_of_zeros_would_look_like_a_share() -> None:
    seen = press(tangential=(0.05, 0.0), added=np.array([1e-3, 0.0, 0.0]))
    pressed = PressLog(seen.log, seen.level, np.zeros_like(seen.free))
    assert crosstalk(pressed) == [NO_ZERO] * 2
    assert inward_share(pressed) == NO_ZERO


@pytest.mark.parametrize("kept", [slice(0, 26), slice(12, None)])
def test_a_drift_that_one_side_leaves_open_is_in_what_more_presses_do_not_average_out(kept: slice) -> None:
    drift = 1e-4 * STEP * np.arange(len(LOAD))[:, None, None, None] * np.array([1.0, 0.0, 0.0])
    seen = find_press(straight(tangential=(0.05, 0.0), added=drift).take(kept))
    assert seen.zero is not None
    assert not seen.zero.around
    found, across = crosstalk(seen)
    assert isinstance(found, PressEstimate)
    assert isinstance(across, PressEstimate)
    assert abs(found.value - 0.05) > 1e-3
    assert abs(found.value - 0.05) < 1.96 * found.shared
    assert across.shared == pytest.approx(0.0, abs=1e-12)
    assert crosstalk(press(tangential=(0.05, 0.0), added=drift))[0][2] == 0.0


@pytest.mark.parametrize("share", [0.1, -0.04])
def test_force_towards_the_middle_is_found(share: float) -> None:
    log = straight()
    assert log.force is not None
    inward = -places()[..., :2] / np.linalg.norm(places()[..., :2], axis=-1, keepdims=True)
    tangential = -share * log.force[..., 2:] * inward
    force = np.concatenate([tangential, log.force[..., 2:]], axis=-1)
    found = inward_share(find_press(replace(log, force=force)))
    assert isinstance(found, PressEstimate)
    assert found.value == pytest.approx(share, rel=1e-9)
    assert found.error == pytest.approx(0.0, abs=1e-9)


def test_the_error_of_inward_force_is_that_of_the_elements_zeros() -> None:
    noise = np.zeros((len(LOAD), 8, 8, 3))
    free = np.flatnonzero(LOAD == 0.0)
    noise[free, ..., :2] = 1e-3 * np.where(np.arange(len(free)) % 2, 1.0, -1.0)[:, None, None, None]
    seen = press(added=noise)
    found = inward_share(seen)
    assert isinstance(found, PressEstimate)
    assert seen.split is not None
    still = seen.split[seen.free][:, seen.footprint, :2].std()
    normal = np.maximum(seen.split[seen.pressed][:, seen.footprint, 2], 0.0).sum(axis=1).mean()
    expected = still * np.sqrt(seen.footprint.sum() / seen.free.sum()) / normal
    assert still == pytest.approx(1e-3, rel=0.02)  # the fitted drift takes a little off
    assert found.error == pytest.approx(expected, rel=0.05)  # beside rounding, the change of the drift that was fitted
