"""Elements that no marker tells of, and contact that is known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import METHODS, GraspLog, InvalidInput, SlipDetector, detect_slip


def lost(log: GraspLog, observed: np.ndarray) -> GraspLog:
    """The log with a placeholder of the last displacement seen, as a tracker might leave it."""
    displacement = log.displacement.copy()
    for k in range(1, len(log)):
        displacement[k][~observed[k]] = displacement[k - 1][~observed[k]]
    return replace(log, displacement=displacement, observed=observed)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_is_said_of_an_element_that_is_not_observed(short_ramp: GraspLog, method: str) -> None:
    observed = np.random.default_rng(3).random(short_ramp.displacement.shape[:3]) < 0.9
    history = detect_slip(lost(short_ramp, observed), method)
    assert history.observed is not None
    np.testing.assert_array_equal(history.observed, observed)
    assert not (history.contact | history.slip)[~observed].any()
    assert not history.probability[~observed].any()
    assert np.isnan(history.velocity[~observed]).all()
    assert history.contact[observed].any()
    before = np.vstack([np.ones_like(observed[:1]), observed[:-1]])
    assert np.isnan(history.velocity[~before]).all()  # where it was half an interval of placeholder


def test_what_was_not_observed_can_be_filled_from_its_neighbours(short_ramp: GraspLog) -> None:
    observed = np.broadcast_to(np.random.default_rng(5).random((12, 12)) < 0.9, short_ramp.displacement.shape[:3])
    whole = detect_slip(short_ramp)
    history = detect_slip(replace(short_ramp, observed=observed.copy()))
    full = history.filled()
    assert full.observed is history.observed
    for name in ("contact", "slip", "probability"):
        np.testing.assert_array_equal(getattr(full, name)[observed], getattr(history, name)[observed], err_msg=name)
    missed = whole.contact & ~observed
    assert (full.contact == whole.contact)[missed].mean() > 0.8
    assert (full.slip == whole.slip)[missed].mean() > 0.9
    assert np.isnan(full.velocity[~observed]).all()
    touched = full.contact.any(axis=(1, 2))
    sticks = 1.0 - full.slip[touched].sum(axis=(1, 2)) / full.contact[touched].sum(axis=(1, 2))
    np.testing.assert_array_equal(full.stick_ratio[touched], sticks)
    assert whole.filled() is whole


def test_a_frame_without_any_marker_is_not_filled(short_ramp: GraspLog) -> None:
    observed = np.ones(short_ramp.displacement.shape[:3], bool)
    observed[40:43] = False
    full = detect_slip(replace(short_ramp, observed=observed)).filled()
    assert not full.contact[40:43].any()
    assert np.isnan(full.stick_ratio[40:43]).all()


def test_all_observed_is_the_same_as_no_mask(short_ramp: GraspLog) -> None:
    whole, masked = (
        detect_slip(log, "filter")
        for log in (short_ramp, replace(short_ramp, observed=np.ones(short_ramp.displacement.shape[:3], bool)))
    )
    assert whole.observed is None
    for name in ("contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(masked, name), err_msg=name)


def test_a_marker_that_is_lost_for_a_while_does_not_forget_its_slip(short_ramp: GraspLog) -> None:
    whole = detect_slip(short_ramp, "filter")
    frame = int(np.argmax(whole.slip.sum(axis=(1, 2))))
    observed = np.ones_like(whole.slip)
    observed[frame - 3 : frame] = ~whole.slip[frame - 3 : frame]
    seen = detect_slip(replace(short_ramp, observed=observed), "filter")
    np.testing.assert_array_equal(seen.slip[frame:], whole.slip[frame:])
    assert not (seen.slip & whole.slip)[frame - 1].any()


def test_a_frame_without_any_marker_has_no_stick_ratio_and_no_events(short_ramp: GraspLog) -> None:
    observed = np.ones(short_ramp.displacement.shape[:3], bool)
    observed[40:43] = False
    history = detect_slip(lost(short_ramp, observed), "filter")
    assert np.isnan(history.stick_ratio[40:43]).all()
    assert not history.macro_slip[40:43].any()
    times = short_ramp.time[40:44]
    for kind in (history.events.onset, history.events.end, history.events.touch, history.events.release):
        assert not np.isin(kind.time, times).any()


def test_contact_that_is_known_is_taken_as_it_is(short_ramp: GraspLog) -> None:
    flat = replace(short_ramp, force=None, displacement=short_ramp.displacement * [1.0, 1.0, 0.0])
    assert not detect_slip(flat, "filter").contact.any()  # seen from above, without forces: nothing tells it
    assert short_ramp.truth is not None
    known = detect_slip(replace(flat, contact=short_ramp.truth.contact), "filter")
    np.testing.assert_array_equal(known.contact, short_ramp.truth.contact)
    true = short_ramp.truth.slip_contact_factor & short_ramp.truth.contact
    assert 2 * (known.slip & true).sum() / (known.slip.sum() + true.sum()) > 0.7


@pytest.mark.parametrize("name", ["contact", "observed"])
def test_a_mask_of_another_shape_is_refused(short_ramp: GraspLog, name: str) -> None:
    detector = SlipDetector(short_ramp.position, short_ramp.element_area)
    with pytest.raises(InvalidInput, match=rf"{name} is bool of shape \[3\]"):
        detector.step(0.0, short_ramp.displacement[0], **{name: np.ones(3, bool)})
