"""Live detectors, without the process and the network around them."""

import json
import re
import struct
from contextlib import suppress
from threading import Event
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from service.processes.fair_executor import FairExecutor
from service.stream import detectors
from service.stream.detectors import PackedFrame
from slipcore import GraspLog, InvalidInput, collect_samples, detect_slip

ROOM = detectors.MemoryLimit("me", 2**30)


def unpacked(content: bytes) -> tuple[dict[str, Any], NDArray[np.uint8]]:
    """The header of a frame as it is shown, and the state of its elements."""
    (length,) = struct.unpack_from("<I", content)
    header = json.loads(content[4 : 4 + length])
    (state,) = header["arrays"]
    return header, np.frombuffer(content, np.uint8, state["length"], 4 + length + state["offset"])


def whole_frame(log: GraspLog, k: int) -> PackedFrame:
    assert log.force is not None
    return PackedFrame(k, float(log.time[k]), log.displacement[k].tobytes(), log.force[k].tobytes())


def step(given: PackedFrame, *, is_shown: bool = False) -> tuple[dict[str, Any], bytes | None]:
    """What the session says, once it has looked at the frames before."""
    with suppress(detectors.FitInProgress):
        return detectors.step("one", given, is_shown)
    session = detectors._SESSIONS["one"]
    before = session.detector.state, session.until_look, session.last
    assert session.look is not None
    session.look.result()
    assert (session.detector.state, session.until_look, session.last) == before
    return detectors.step("one", given, is_shown)


def feed(log: GraspLog, *, wait: bool) -> dict[str, object] | None:
    """All frames, with time for the looks between them or only at their end; the friction that was found."""
    position = log.position.tobytes()
    detectors.open_session("one", position, log.grid, log.element_area, "filter", keep=False, limit=ROOM)
    session = detectors._SESSIONS["one"]
    for k in range(len(log)):
        step(whole_frame(log, k))
        if wait and session.look is not None:
            session.look.result()
    assert session.look is not None
    session.look.result()
    detectors.drop("one")
    return session.friction


def test_looks_once_a_second_find_the_samples_of_the_whole_log(ramp: GraspLog) -> None:
    samples = collect_samples(ramp, detect_slip(ramp))
    looked_until = ramp.time[
        detectors.WINDOW - 1 + (len(ramp) - detectors.WINDOW) // detectors.STRIDE * detectors.STRIDE
    ]
    expected = np.count_nonzero(samples.time < looked_until)
    friction = feed(ramp, wait=True)
    assert friction is not None
    assert friction["samples"] == pytest.approx(expected, rel=0.1, abs=2)  # each look estimates the noise anew
    assert np.all(np.isfinite(friction["coefficients"]))


def test_frames_that_come_faster_than_looks_are_looked_at_all_the_same(ramp: GraspLog) -> None:
    assert feed(ramp, wait=False) == feed(ramp, wait=True)


def test_a_look_that_fails_costs_the_stream_nothing_but_its_friction(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(detectors, "collect_samples", fail)
    assert feed(ramp, wait=True) is None
    assert "a look for friction failed" in caplog.text


def test_who_watches_sees_each_element_the_forces_and_the_command(ramp: GraspLog) -> None:
    assert ramp.force is not None
    history = detect_slip(ramp)
    position = ramp.position.tobytes()
    detectors.open_session("one", position, ramp.grid, ramp.element_area, "filter", keep=False, limit=ROOM)
    for k, time in enumerate(ramp.time.tolist()):
        arrays = (ramp.displacement, ramp.force, ramp.object_pose, ramp.normal)
        given = [None if array is None else array[k].tobytes() for array in arrays]
        frame = PackedFrame(k, time, *given, command=2.5)  # type: ignore[arg-type]
        answer, content = step(frame, is_shown=True)
        assert content is not None
        header, state = unpacked(content)
        np.testing.assert_array_equal(state.reshape(ramp.grid) == 2, (history.slip & history.contact)[k])
        np.testing.assert_array_equal(state.reshape(ramp.grid) > 0, history.contact[k])
        assert (header["number"], header["stick_ratio"], header["command"]) == (k, answer["stick_ratio"], 2.5)
        assert header["normal_force"] == pytest.approx(abs(ramp.force[k, ..., 2].sum()), rel=1e-9)
    assert detectors.step("one", frame, is_shown=True) == (answer, None)  # it comes twice and is shown once
    session = detectors._SESSIONS["one"]
    assert session.look is not None
    session.look.result()
    expected = session.expected
    assert expected is not None
    assert expected["low"] < expected["mean"] < expected["high"]
    assert expected["mean"] == pytest.approx(0.4, abs=0.1)
    detectors.drop("one")


@pytest.mark.parametrize("command", [-1.0, float("nan"), float("inf")])
def test_a_command_that_is_no_force_is_refused_before_the_frame_is_taken(ramp: GraspLog, command: float) -> None:
    position = ramp.position.tobytes()
    detectors.open_session("one", position, ramp.grid, ramp.element_area, "filter", keep=False, limit=ROOM)
    frame = PackedFrame(0, 0.0, ramp.displacement[0].tobytes(), command=command)
    with pytest.raises(InvalidInput, match="command"):
        detectors.step("one", frame)
    assert detectors.step("one", frame._replace(command=None))[0]["type"] == "state"
    detectors.drop("one")


def test_who_goes_takes_the_looks_along_that_have_not_begun(ramp: GraspLog, monkeypatch: pytest.MonkeyPatch) -> None:
    executor, may_go = FairExecutor(), Event()
    monkeypatch.setattr(detectors, "_LOOKS", executor)
    executor.of("another").submit(may_go.wait, 30.0)
    detectors.open_session("one", ramp.position.tobytes(), ramp.grid, ramp.element_area, "filter", False, ROOM)
    session = detectors._SESSIONS["one"]
    due = detectors.WINDOW + detectors.STRIDE - 1
    for k in range(due):
        detectors.step("one", whole_frame(ramp, k))
    with pytest.raises(detectors.FitInProgress):
        detectors.step("one", whole_frame(ramp, due))
    detectors.drop("one")
    assert session.look is not None
    assert session.look.cancelled()
    may_go.set()


def test_a_frame_is_taken_in_each_length_that_a_refusal_allows() -> None:
    with pytest.raises(InvalidInput) as refusal:
        detectors._array("force", b"12345", (2, 3))
    lengths = [int(length) for length in re.findall(r"\d+", refusal.value.allowed.partition(":")[0])]
    assert len(lengths) == 2
    for length in lengths:
        assert detectors._array("force", bytes(length), (2, 3)).tolist() == [[0.0] * 3] * 2
    with pytest.raises(InvalidInput, match=r"5 numbers.*6: \[2, 3\]"):
        detectors._array("force", [1.0] * 5, (2, 3))
