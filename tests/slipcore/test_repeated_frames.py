"""What a recorder wrote again or interpolated, for its sensor had nothing new, changes nothing in what is found."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import GraspLog, SlipDetector, check_log, collect_friction, contact_friction, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.repeated_frames import interpolated, noise_of_own_frames, own_frames, repeated


def again(log: GraspLog, source: np.ndarray, time: np.ndarray) -> GraspLog:
    """The frames ``source`` of a log at other times."""
    fields = {
        name: None if (field := getattr(log, name)) is None else field[source]
        for name in ("displacement", "force", "normal", "observed")
    }
    return replace(log, time=time, truth=None, object_pose=None, **fields)


@pytest.mark.parametrize("lookahead", [0, 2])
@pytest.mark.parametrize("method", ["filter", "coarse", "force_ratio"])
def test_a_recorder_that_is_quicker_than_its_sensor_changes_nothing(
    short_ramp: GraspLog, method: str, lookahead: int
) -> None:
    log = replace(short_ramp, truth=None, object_pose=None)
    source = np.sort(np.append(np.repeat(np.arange(len(log)), 2), [7, 30]))  # two of them three times
    time = log.time[source] + (np.arange(len(source)) - np.searchsorted(source, source)) / 100.0
    twice = again(log, source, time)
    own, found = detect_slip(log, method, lookahead=lookahead), detect_slip(twice, method, lookahead=lookahead)
    assert own.slip.any()
    for name in ("contact", "slip", "probability", "velocity", "macro_slip", "stick_ratio"):
        np.testing.assert_array_equal(getattr(found, name), getattr(own, name)[source], strict=True)
    assert [len(getattr(found.events, name)) for name in ("onset", "end", "touch", "release")] == [
        len(getattr(own.events, name)) for name in ("onset", "end", "touch", "release")
    ]
    assert found.findings == own.findings
    for one, other in zip(own.patches, found.patches, strict=True):
        within = source[other.frames] - one.first
        np.testing.assert_array_equal(other.regime, one.regime[within])
        np.testing.assert_array_equal(
            source[[other.frames.start, other.frames.stop - 1]], [one.first, one.frames.stop - 1]
        )
    friction = contact_friction(log.time, own.patches), contact_friction(time, found.patches)
    assert friction[0] is not None
    assert friction[1] is not None
    assert friction[1].low == pytest.approx(friction[0].low, rel=0.03)


def test_repeated_frames_give_no_samples_of_their_own() -> None:
    """The frame before, by which an element is chosen, would have the same noise; and all would count twice."""
    schedule = RampSchedule(rest=0.2, press=0.3, settle=0.1, shear=1.5, hold=0.1)
    log = replace(
        tangential_ramp(points=14, pitch=1e-3, schedule=schedule, marker_noise=1e-6, force_noise=2e-3), truth=None
    )
    log = replace(log, object_pose=None)
    source = np.repeat(np.arange(len(log)), 2)
    time = log.time[source] + np.tile([0.0, 0.01], len(log))
    twice = again(log, source, time)
    own, found = (collect_friction(each, detect_slip(each)) for each in (log, twice))
    assert len(own.samples) > 20
    np.testing.assert_array_equal(found.samples.friction_coefficient, own.samples.friction_coefficient)
    np.testing.assert_array_equal(found.samples.tangential_velocity, own.samples.tangential_velocity)
    np.testing.assert_array_equal(found.samples.time, own.samples.time)
    assert found.contact == own.contact


@pytest.mark.parametrize("forces", [True, False])
def test_repeated_frames_cost_a_stream_little(short_ramp: GraspLog, forces: bool) -> None:
    """It takes each of them as a frame, and sharpens nothing."""
    assert short_ramp.truth is not None
    true = short_ramp.truth.slip_contact_factor & short_ramp.truth.contact
    f1 = []
    for times in (1, 2, 3):
        source = np.repeat(np.arange(len(short_ramp)), times)
        time = short_ramp.time[source] + np.tile(np.arange(times), len(short_ramp)) / (30.0 * times)
        log = again(short_ramp, source, time)
        log = log if forces else replace(log, force=None)
        detector = SlipDetector(log.position, log.element_area)
        found = np.array([detector.step(*frame).slip for frame in log.frames()]) & short_ramp.truth.contact[source]
        f1.append(2.0 * (found & true[source]).sum() / (found.sum() + true[source].sum()))
    assert f1[0] > 0.8
    assert min(f1) > f1[0] - 0.02  # this short ramp loses 0.015, scenes of the page on the detector 0.004 at most


def resampled(log: GraspLog, times: int) -> GraspLog:
    """With frames on the line between each two of its own, so many ``times`` as many."""
    assert log.force is not None
    at = np.arange((len(log) - 1) * times + 1) / times
    before = np.minimum(at.astype(int), len(log) - 2)
    share = (at - before)[:, None, None, None]
    displacement, force = (
        (1.0 - share) * each[before] + share * each[before + 1] for each in (log.displacement, log.force)
    )
    time = np.interp(at, np.arange(len(log)), log.time)
    return replace(log, time=time, displacement=displacement, force=force, normal=None, truth=None, object_pose=None)


@pytest.mark.parametrize("times", [2, 3])
def test_interpolated_frames_hide_no_noise(short_ramp: GraspLog, times: int) -> None:
    log = resampled(short_ramp, times)
    between = np.arange(len(log)) % times != 0
    np.testing.assert_array_equal(interpolated(log), between)
    (option,) = noise_of_own_frames(log).values()
    assert option == pytest.approx(1e-6, rel=0.1)
    given = detect_slip(log, displacement_floor=option)
    np.testing.assert_array_equal(detect_slip(log).probability, given.probability)
    assert "interpolated frames" in {each.name for each in check_log(log, given)}


def test_no_frame_of_a_sensor_is_taken_for_interpolated(short_ramp: GraspLog) -> None:
    assert not interpolated(short_ramp).any()
    still = again(short_ramp, np.full(len(short_ramp), 30), short_ramp.time)
    assert not interpolated(still).any()
    assert noise_of_own_frames(still) == {}
    assert not interpolated(short_ramp.take(slice(0, 2))).any()


def test_markers_without_noise_that_go_straight_are_not_taken_for_interpolated(short_ramp: GraspLog) -> None:
    """As simulated ones do: what is left of them would pass for noise."""
    share = np.interp(short_ramp.time, short_ramp.time[[0, 10, 40, -1]], [0.0, 0.1, 0.6, 1.0])
    field = 1e-4 * (1.0 + short_ramp.position[..., :1] / 1e-2) * np.array([1.0, 0.3, -0.2])
    straight = replace(short_ramp, displacement=share[:, None, None, None] * field, truth=None)
    assert not interpolated(straight).any()
    assert noise_of_own_frames(straight) == {}


def test_what_stands_still_for_longer_than_a_recorder_waits_stays(short_ramp: GraspLog) -> None:
    source = np.sort(np.append(np.arange(len(short_ramp)), np.full(20, 30)))
    time = short_ramp.time[0] + np.arange(len(source)) / 30.0
    still = again(short_ramp, source, time)
    assert np.count_nonzero(repeated(still)) == 20
    assert own_frames(still).all()
    assert own_frames(replace(still, time=time / 2.0)).sum() == len(short_ramp)


def test_a_marker_that_is_lost_or_found_makes_a_frame_of_its_own(short_ramp: GraspLog) -> None:
    source = np.repeat(np.arange(len(short_ramp)), 2)
    observed = np.ones((len(source), *short_ramp.grid), bool)
    observed[21, 3, 3] = False
    doubled = replace(again(short_ramp, source, np.arange(len(source)) / 60.0), observed=observed)
    own = own_frames(doubled)
    assert own[21]
    assert own[22]
    assert own.sum() == len(short_ramp) + 1
