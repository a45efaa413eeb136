"""What every method of detection keeps to; a new one comes under these checks by being in ``METHODS``."""

import itertools
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slipcore import (
    METHODS,
    GraspLog,
    InvalidInput,
    SlipDetector,
    SlipHistory,
    SlipState,
    collect_history,
    describe_options,
    detect_slip,
)
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.defaults import DEFAULT_METHOD, ContactOptions
from slipcore.detection.batch import with_patches
from slipcore.detection.detector import init, step
from slipcore.detection.shared.interface import Decision, Method, ObservedFrame
from slipcore.gross_slip import find_gross_slip
from slipcore.patch.regimes import slips_as_a_whole
from slipcore.surface.strain import Lattice
from tests.slipcore.conftest import RECORDED

Same = Callable[[SlipHistory, SlipHistory], None]

EACH_METHOD = pytest.mark.parametrize("method", METHODS)
BY_LOAD = ("forces_only", "coarse")
"""Look at the load once it has changed by more than noise: with another estimate of it at other frames."""


def lattice() -> np.ndarray:
    i, j = np.meshgrid(np.arange(4.0), np.arange(5.0), indexing="ij")
    return 1e-3 * np.stack([i, j, 0 * i], axis=-1)


def stream(log: GraspLog, method: str) -> SlipHistory:
    """What a live sensor's loop would do, frame by frame, through the public class."""
    detector = SlipDetector(log.position, log.element_area, method)
    answers = [
        detector.step(frame.time, frame.displacement, frame.force, frame.object_pose, frame.normal)
        for frame in log.frames()
    ]
    return collect_history(answers, detector.state)


def cut_everywhere(log: GraspLog, method: str) -> tuple[SlipHistory, list[bytes]]:
    """The same stream, but its state is stored and loaded again before every frame."""
    state, answers, stored = init(log.position, log.element_area, method), [], []
    for frame in log.frames():
        stored.append(pickle.dumps(state))
        state, answer = step(pickle.loads(stored[-1]), frame)
        answers.append(answer)
    return collect_history(answers, state), stored


def resumed(log: GraspLog, stored: bytes, start: int, whole: SlipHistory, method: str) -> SlipHistory:
    """The first part of ``whole`` as it is, and the rest from a stored state."""
    detector = SlipDetector.resume(pickle.loads(stored))
    frames = list(log.frames())[start:]
    rest = [detector.step(f.time, f.displacement, f.force, f.object_pose, f.normal) for f in frames]
    tail = collect_history(rest, detector.state)
    joined = {
        name: np.concatenate([getattr(whole, name)[:start], getattr(tail, name)])
        for name in ("time", "contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip")
    }
    return replace(whole, **joined, noise=tail.noise, method=method)


AS_GIVEN = {"marker_kernel": 0.0, "force_kernel": 0.0}
"""A stream knows no smoothing that it is not told of; of a whole log it is estimated."""


def check_streaming_is_batch(log: GraspLog, method: str, same_history: Same) -> None:
    batch = detect_slip(log, method, **(AS_GIVEN if method == DEFAULT_METHOD else {}))
    streamed = stream(log, method)
    same_history(with_patches(log, streamed), batch)
    cut, stored = cut_everywhere(log, method)
    same_history(cut, streamed)
    for start in (1, len(log) // 3, len(log) - 1):
        same_history(resumed(log, stored[start], start, streamed, method), streamed)


@EACH_METHOD
def test_streaming_equals_batch_and_a_cut_stream_goes_on_as_if_it_were_whole(
    short_ramp: GraspLog, method: str, same_history: Same
) -> None:
    check_streaming_is_batch(short_ramp, method, same_history)
    check_streaming_is_batch(replace(short_ramp, force=None, object_pose=None, normal=None), method, same_history)


@EACH_METHOD
def test_a_stream_that_goes_on_elsewhere_needs_no_kernel_of_its_own(short_ramp: GraspLog, method: str) -> None:
    """Compiling another takes 15 s, in the middle of a grasp."""
    run = getattr(METHODS[method], "run", None)
    if run is None:
        pytest.skip("a method in numpy")
    first, second = itertools.islice(short_ramp.frames(), 2)
    state, _ = step(init(short_ramp.position, short_ramp.element_area, method), first)
    known = list(run.signatures)
    step(pickle.loads(pickle.dumps(state)), second)
    assert run.signatures == known


@pytest.mark.parametrize(
    ("method", "recording"),
    [
        pytest.param(method, name, marks=[] if number % 3 == other else pytest.mark.long)
        for number, method in enumerate(METHODS)
        for other, name in enumerate(RECORDED)
    ],
    indirect=["recording"],
)
def test_streaming_equals_batch_on_real_recordings_cut_at_every_frame(
    recording: GraspLog, method: str, same_history: Same
) -> None:
    """Each method on one of them, and in long tests on all."""
    check_streaming_is_batch(recording, method, same_history)


@EACH_METHOD
def test_a_history_keeps_its_invariants_on_real_recordings(recording: GraspLog, method: str) -> None:
    check_invariants(recording, detect_slip(recording, method))


@EACH_METHOD
def test_a_history_keeps_its_invariants_on_a_ramp(short_ramp: GraspLog, method: str) -> None:
    check_invariants(short_ramp, detect_slip(short_ramp, method))


def check_invariants(log: GraspLog, history: SlipHistory) -> None:
    touching = history.contact.any(axis=(1, 2))
    assert not (history.slip & ~history.contact).any()
    assert ((history.probability >= 0.0) & (history.probability <= 1.0)).all()
    assert not history.probability[~history.contact].any()
    np.testing.assert_array_equal(np.isnan(history.stick_ratio), ~touching)
    of_elements = find_gross_slip(history.contact, history.slip)
    np.testing.assert_array_equal(history.macro_slip, of_elements | slips_as_a_whole(history.patches, len(log)))
    touched = history.contact[1:] & ~history.contact[:-1]
    assert not (history.slip[1:] & touched).any()
    known = np.isfinite(history.velocity).all(axis=-1)
    assert not (known[1:] & ~(history.contact[1:] & history.contact[:-1])).any()
    assert not known[0].any()
    check_events(log, history)


def check_events(log: GraspLog, history: SlipHistory) -> None:
    """Replaying the events on the first frame gives every later frame."""
    contact, slip = history.contact[0].ravel().copy(), history.slip[0].ravel().copy()
    for k in range(1, len(log)):
        now = {name: getattr(history.events, name) for name in ("touch", "release", "onset", "end")}
        at = {name: events.element[events.time == log.time[k]] for name, events in now.items()}
        contact[at["touch"]], contact[at["release"]] = True, False
        slip[at["release"]], slip[at["onset"]], slip[at["end"]] = False, True, False
        np.testing.assert_array_equal(contact, history.contact[k].ravel())
        np.testing.assert_array_equal(slip, history.slip[k].ravel())


@EACH_METHOD
def test_the_same_log_gives_the_same_history_to_the_last_bit_and_stays_as_it_was(
    short_ramp: GraspLog, method: str, same_history: Same
) -> None:
    before = pickle.dumps(short_ramp)
    same_history(detect_slip(short_ramp, method), detect_slip(pickle.loads(before), method))
    assert pickle.dumps(short_ramp) == before


@EACH_METHOD
def test_what_is_not_finite_is_refused_by_name_and_the_detector_goes_on_as_if_it_had_not_come(method: str) -> None:
    at_rest, pose = np.zeros((4, 5, 3)), np.zeros(3)
    for bad in (np.nan, np.inf):
        detector = SlipDetector(lattice(), 1e-6, method)
        before = pickle.dumps(detector.state)
        field = at_rest.copy()
        field[1, 2, 0] = bad
        for name, given in {
            "time": (bad, at_rest, at_rest, pose),
            "displacement": (0.0, field, at_rest, pose),
            "force": (0.0, at_rest, field, pose),
            "object_pose": (0.0, at_rest, at_rest, pose + bad),
        }.items():
            with pytest.raises(InvalidInput, match=rf"^{name} is .*(nan|inf)"):
                detector.step(*given)
        assert pickle.dumps(detector.state) == before


@EACH_METHOD
def test_a_log_in_other_units_of_force_slips_at_the_same_elements(short_ramp: GraspLog, method: str) -> None:
    """By a power of two, so that rounding is the same. Options in N and in m are absolute: only those without any."""
    if any(option.unit in {"N", "1/N"} for option in describe_options(METHODS[method].options).values()):
        pytest.skip("a method with options in N")
    assert short_ramp.force is not None
    stronger = replace(short_ramp, force=4.0 * short_ramp.force, truth=None)
    expected, found = detect_slip(short_ramp, method), detect_slip(stronger, method)
    assert np.mean(found.slip != expected.slip) < 1e-3


@EACH_METHOD
def test_a_huge_gap_is_survived(short_ramp: GraspLog, method: str) -> None:
    late = short_ramp.time + np.where(np.arange(len(short_ramp)) >= 40, 1e7, 0.0)
    history = detect_slip(replace(short_ramp, time=late, truth=None), method)
    check_invariants(replace(short_ramp, time=late), history)
    assert np.abs(history.velocity[40][history.contact[40] & history.contact[39]]).max() < 1e-9


@EACH_METHOD
def test_without_contact_there_is_no_stick_ratio_no_slip_and_no_event(method: str) -> None:
    rng = np.random.default_rng(14)
    log = GraspLog(
        time=np.arange(30) / 30.0,
        position=lattice(),
        displacement=1e-7 * rng.standard_normal((30, 4, 5, 3)),
        element_area=1e-6,
        force=np.zeros((30, 4, 5, 3)),
    )
    for forces in (log.force, None):
        history = detect_slip(replace(log, force=forces), method)
        assert not history.contact.any()
        assert not history.slip.any()
        assert not history.macro_slip.any()
        assert np.isnan(history.stick_ratio).all()
        assert np.isnan(history.velocity).all()
        assert all(len(getattr(history.events, kind)) == 0 for kind in ("onset", "end", "touch", "release"))


@EACH_METHOD
def test_with_every_element_in_contact_and_none_moving_all_stick(method: str) -> None:
    force = np.zeros((30, 4, 5, 3))
    force[..., 2] = -0.1
    log = GraspLog(np.arange(30) / 30.0, lattice(), np.zeros_like(force), 1e-6, force)
    history = detect_slip(log, method)
    assert history.contact.all()
    np.testing.assert_array_equal(history.stick_ratio, 1.0)
    np.testing.assert_array_equal(history.velocity[1:], 0.0)
    assert np.isnan(history.noise)


def test_no_method_can_make_slip_of_a_fresh_touch_or_out_of_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    def everything_slips(state: None, _: Lattice, seen: ObservedFrame, __: ContactOptions) -> tuple[None, Decision]:
        return state, Decision(np.ones(seen.contact.shape, bool), np.ones(seen.contact.shape))

    reckless = Method(ContactOptions, lambda *_: None, everything_slips)
    monkeypatch.setitem(METHODS, "reckless", reckless)
    log = tangential_ramp(points=8, schedule=RampSchedule(0.1, 0.3, 0.0, 0.0, 0.1))
    history = detect_slip(log, "reckless")
    check_invariants(log, history)
    assert history.macro_slip[-1]


@EACH_METHOD
def test_a_single_frame_sticks_where_it_touches(short_ramp: GraspLog, method: str) -> None:
    detector = SlipDetector(short_ramp.position, short_ramp.element_area, method)
    frame = list(short_ramp.frames())[-1]
    state = detector.step(frame.time, frame.displacement, frame.force)
    assert state.contact.any()
    assert not state.slip.any()
    assert state.stick_ratio == 1.0
    assert np.isnan(state.velocity).all()
    assert np.isnan(detector.noise)


@EACH_METHOD
@pytest.mark.parametrize("blind", [False, True], ids=["seeing", "displacement alone"])
@pytest.mark.parametrize("change", ["rows for columns", "mirrored", "clock set"])
def test_how_the_lattice_lies_and_what_the_clock_says_changes_nothing(
    short_ramp: GraspLog, method: str, change: str, blind: bool
) -> None:
    """To the elements that the noise is estimated from: evenly chosen along the lattice, so others in another order."""
    log = replace(short_ramp, truth=None)
    log = replace(log, force=None, object_pose=None, normal=None) if blind else log
    other, back = changed(log, change)
    expected, found = detect_slip(log, method), detect_slip(other, method)
    np.testing.assert_array_equal(back(found.contact), expected.contact)
    assert np.mean(back(found.slip) != expected.slip) < (4e-3 if method in BY_LOAD else 1e-3)


def changed(log: GraspLog, change: str) -> tuple[GraspLog, Callable[[np.ndarray], np.ndarray]]:
    """The same grasp told otherwise, and what brings its masks back into the order of the log."""
    if change == "clock set":
        return replace(log, time=log.time + 1e6), lambda mask: mask
    if change == "rows for columns":
        return arranged(log, lambda field: np.swapaxes(field, -3, -2)), lambda mask: np.swapaxes(mask, 1, 2)
    pose = None if log.object_pose is None else log.object_pose * [-1.0, 1.0, -1.0]
    mirrored = arranged(log, lambda field: field[..., ::-1, :, :] * [-1.0, 1.0, 1.0])
    return replace(mirrored, object_pose=pose), lambda mask: mask[:, ::-1]


def arranged(log: GraspLog, arrange: Callable[[np.ndarray], np.ndarray]) -> GraspLog:
    fields = {name: getattr(log, name) for name in ("position", "displacement", "force", "normal")}
    return replace(log, **{name: arrange(field) for name, field in fields.items() if field is not None})


@EACH_METHOD
def test_streams_of_one_lattice_that_take_turns_are_those_of_each_alone(short_ramp: GraspLog, method: str) -> None:
    logs = [replace(short_ramp, truth=None, displacement=share * short_ramp.displacement) for share in (1.0, 0.5)]
    detectors = [SlipDetector(log.position, log.element_area, method) for log in logs]
    found: list[list[SlipState]] = [[], []]
    for frames in zip(*(log.frames() for log in logs), strict=True):
        for detector, frame, states in zip(detectors, frames, found, strict=True):
            states.append(detector.step(*frame))
    for log, states in zip(logs, found, strict=True):
        alone = stream(log, method)
        np.testing.assert_array_equal([state.probability for state in states], alone.probability)
        np.testing.assert_array_equal([state.velocity for state in states], alone.velocity)
