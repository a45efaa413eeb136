"""Live detectors, without the process and the network around them."""

import json
import re
import struct
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from service import formats
from service.processes.fair_executor import FairExecutor
from service.stream import detector_session, detectors, friction_looks
from service.stream.detector_session import STRIDE, WINDOW, PackedFrame
from slipcore import GraspLog, InvalidInput, collect_samples, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.frames import UNNAMED
from tests.service.report.test_material import MODEL

ROOM = detector_session.MemoryLimit("me", 2**30)


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
    looked_until = ramp.time[WINDOW - 1 + (len(ramp) - WINDOW) // STRIDE * STRIDE]
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

    monkeypatch.setattr(friction_looks, "collect_samples", fail)
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
    monkeypatch.setattr(friction_looks, "_LOOKS", executor)
    executor.of("another").submit(may_go.wait, 30.0)
    detectors.open_session("one", ramp.position.tobytes(), ramp.grid, ramp.element_area, "filter", False, ROOM)
    session = detectors._SESSIONS["one"]
    due = WINDOW + STRIDE - 1
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


GRID, AREA = (2, 3), 1e-6
PLACES = np.stack([*np.meshgrid(1e-3 * np.arange(2.0), 1e-3 * np.arange(3.0), indexing="ij"), np.zeros(GRID)], axis=-1)
AT_REST = PLACES.ravel().tolist()
HELD = WINDOW * 3 * PLACES.nbytes
"""Bytes of the frames that are looked at."""


@pytest.fixture
def sessions(monkeypatch: pytest.MonkeyPatch) -> dict[str, detector_session.DetectorSession]:
    """All that there are, none at first."""
    none = dict[str, detector_session.DetectorSession]()
    monkeypatch.setattr(detectors, "_SESSIONS", none)
    return none


def begin(name: str = "one", most: int = 2**30, owner: str = "me", keep: bool = False, grid: Any = GRID) -> None:
    detectors.open_session(name, AT_REST, grid, AREA, "filter", keep, detector_session.MemoryLimit(owner, most))


def plain_frame(number: int, **more: Any) -> PackedFrame:
    return PackedFrame(number, 0.1 * number, [0.0] * len(AT_REST), **more)


@pytest.mark.parametrize("grid", [(0, 3), (2, 0), (-2, -3), (1, 4097), (4097, 1)])
def test_a_sensor_has_one_marker_at_least_and_not_any_number(grid: tuple[int, int]) -> None:
    with pytest.raises(InvalidInput, match=rf"grid is \[{grid[0]}, {grid[1]}\]; allowed: 1 to 4096 markers"):
        begin(grid=grid)


def test_a_client_has_half_of_what_others_leave(sessions: dict[str, detector_session.DetectorSession]) -> None:
    begin("mine", most=2 * HELD)
    with pytest.raises(InvalidInput) as refusal:
        begin("another of mine", most=4 * HELD - 2)
    assert (refusal.value.name, refusal.value.value) == ("bytes", str(2 * HELD))
    assert refusal.value.allowed.startswith(f"{2 * HELD - 1} of one client's live streams, half of what others leave")
    begin("another of mine", most=4 * HELD)
    with pytest.raises(InvalidInput, match=f"allowed: {HELD - 1} of one client's"):
        begin("yours", most=4 * HELD - 1, owner="you")
    begin("yours", most=4 * HELD, owner="you")
    assert list(sessions) == ["mine", "another of mine", "yours"]


def test_kept_frames_take_room_by_what_they_hold(
    sessions: dict[str, detector_session.DetectorSession], monkeypatch: pytest.MonkeyPatch
) -> None:
    begin("plain", keep=True)
    begin(keep=True)
    detectors.step("plain", plain_frame(0))
    whole = {"force": [0.0] * len(AT_REST), "normal": [0.0, 0.0, 1.0] * 6}
    detectors.step("one", plain_frame(0, **whole))
    assert sessions["plain"].held_bytes == HELD + PLACES.nbytes
    assert sessions["one"].held_bytes == HELD + 3 * PLACES.nbytes
    monkeypatch.setattr(detectors, "MAX_KEPT_BYTES", 6 * PLACES.nbytes)
    detectors.step("one", plain_frame(1, **whole))
    with pytest.raises(InvalidInput, match="frames is 3; allowed: 2 of this size, where they are kept"):
        detectors.step("one", plain_frame(2, **whole))
    assert len(sessions["one"].kept or ()) == 2


@pytest.mark.usefixtures("sessions")
def test_the_same_frame_again_is_answered_as_before_and_taken_once() -> None:
    begin(keep=True)
    answer, _ = detectors.step("one", plain_frame(0))
    assert detectors.step("one", plain_frame(0, command=-1.0)) == (answer, None)
    assert (answer["type"], answer["number"], answer["contact"], answer["slip"]) == ("state", 0, 0, [])
    assert (answer["stick_ratio"], answer["macro_slip"], answer["friction"]) == (None, False, None)


@pytest.mark.parametrize("command", [0.0, detectors.MOST_COMMAND])
@pytest.mark.usefixtures("sessions")
def test_a_command_may_be_any_force_of_a_planner(command: float) -> None:
    begin()
    assert detectors.step("one", plain_frame(0, command=command))[0]["number"] == 0
    with pytest.raises(InvalidInput, match=r"command is 1000000\.1; allowed: a normal force of 0 to 1e\+06 N"):
        detectors.step("one", plain_frame(1, command=1e6 + 0.1))


@pytest.mark.usefixtures("sessions")
def test_a_log_of_kept_frames_has_what_all_of_them_had(tmp_path: Path) -> None:
    begin(keep=True)
    force = np.linspace(-1.0, 0.0, len(AT_REST)).tolist()
    detectors.step("one", plain_frame(0, force=force, gripper_force=2.0, gripper_force_deviation=0.25))
    with pytest.raises(InvalidInput, match="frames is 1; allowed: at least 2, for a log"):
        detectors.write("one", tmp_path / "log.npz", "left")
    detectors.step("one", plain_frame(1, force=force, object_pose=[0.0, 0.0, 0.0]))
    detectors.step("one", plain_frame(2, force=force, gripper_force=3.0, gripper_force_deviation=0.125))
    told = detectors.write("one", tmp_path / "log.npz", "left")
    log = formats.read(tmp_path / "log.npz")
    assert (told.frames, log.sensor, log.metadata) == (3, "left", {"session": "one"})
    np.testing.assert_allclose(log.time, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(np.asarray(log.force)[2].ravel(), force)
    assert (log.object_pose, log.normal) == (None, None)
    np.testing.assert_array_equal(log.gripper_force, [2.0, 0.0, 3.0])
    assert log.gripper_force_deviation == 0.25  # as the least sure


@pytest.mark.usefixtures("sessions")
def test_a_log_whose_gripper_said_nothing_says_nothing_of_it(tmp_path: Path) -> None:
    begin(keep=True)
    for number in range(2):
        detectors.step("one", plain_frame(number))
    detectors.write("one", tmp_path / "log.npz", "")
    log = formats.read(tmp_path / "log.npz")
    assert (log.gripper_force, log.gripper_force_deviation, log.sensor) == (None, None, UNNAMED)


def test_whoever_is_not_there_is_dropped_without_a_word(sessions: dict[str, detector_session.DetectorSession]) -> None:
    detectors.drop("nobody")
    begin()
    detectors.drop("one")
    assert sessions == {}


def test_expected_friction_is_that_under_the_middle_of_the_forces_seen() -> None:
    found = friction_looks._expected(cast("Any", MODEL))
    low, high = (float(MODEL.predict(0.0, 0.07, quantile=level)) for level in (0.05, 0.95))
    expected = {"mean": float(MODEL.predict(0.0, 0.07)), "low": low, "high": high, "normal_force": 0.07}
    assert found == pytest.approx(expected)
    unsure = replace(MODEL, covariance=np.full((3, 3), np.inf))
    assert friction_looks._expected(cast("Any", unsure)) is None
    told = friction_looks._summary(cast("Any", MODEL))
    assert told["coefficients"] == [0.45, 0.1, -0.02]
    assert told["standard_errors"] == pytest.approx([0.02, 1.0, 2.0])
    assert (told["scale"], told["samples"]) == (0.02, 200)
    assert friction_looks._summary(cast("Any", unsure))["standard_errors"] == [None] * 3


@pytest.mark.parametrize(("first", "told"), [(0, []), (30, ["76 elements touch in the first frame"])])
@pytest.mark.usefixtures("sessions")
def test_a_stream_that_begins_in_touch_says_so(ramp: GraspLog, first: int, told: list[str]) -> None:
    detectors.open_session("one", ramp.position.tobytes(), ramp.grid, ramp.element_area, "filter", False, ROOM)
    for k in (first, first + 1):
        answer, _ = detectors.step("one", whole_frame(ramp, k))
        assert [finding["evidence"] for finding in answer["findings"]] == told


def few(shear: float = 1.0, hold: float = 0.0) -> GraspLog:
    """A sphere on 4 × 4 elements, pressed by 6 N and pulled by 0.6 of friction."""
    schedule = RampSchedule(rest=0.5, press=0.5, settle=0.3, shear=shear, hold=hold)
    load = {"normal_force": 6.0, "tangential_force": 0.6, "frame_rate": 200.0}
    noise = {"marker_noise": 5e-6, "force_noise": 1e-2, "seed": 3}
    return tangential_ramp(points=4, pitch=3e-3, schedule=schedule, **load, **noise)


def opened(log: GraspLog, method: str | None = None) -> str | None:
    return detectors.open_session("one", log.position.tobytes(), log.grid, log.element_area, method, False, ROOM)


def displacement_frame(log: GraspLog, k: int) -> PackedFrame:
    return whole_frame(log, k)._replace(force=None)


@pytest.mark.usefixtures("looks_at_once")
def test_few_elements_with_forces_that_are_held_do_not_slip_where_no_detector_is_named() -> None:
    """By ``filter`` all of them slip (tests/slipcore/test_method_choice.py)."""
    held = few(hold=4.0)
    history = detect_slip(held, "coarse")
    assert opened(held) is None
    for k in range(len(held)):
        answer, _ = detectors.step("one", whole_frame(held, k))
        assert answer["detector"] == "coarse"
        assert answer["slip"] == np.flatnonzero(history.slip[k]).tolist()
    assert answer["contact"] > 0
    assert not history.slip[held.time > 2.5].any()


@pytest.mark.parametrize(
    ("method", "said", "with_forces", "without"),
    [(None, None, "coarse", "filter"), ("filter", "filter", "filter", "filter"), ("coarse", "coarse", *["coarse"] * 2)],
)
@pytest.mark.usefixtures("sessions")
def test_the_first_frame_that_is_taken_decides_on_a_detector_that_is_not_named(
    method: str | None, said: str | None, with_forces: str, without: str
) -> None:
    log = few()
    for make, expected in ((whole_frame, with_forces), (displacement_frame, without)):
        assert opened(log, method) == said
        other = whole_frame if make is displacement_frame else displacement_frame
        with pytest.raises(InvalidInput, match="command"):
            detectors.step("one", other(log, 0)._replace(command=-1.0))
        with pytest.raises(InvalidInput, match="object_pose"):
            detectors.step("one", other(log, 0)._replace(object_pose=[1e9, 0.0, 0.0]))  # after the choice
        assert [detectors.step("one", make(log, k))[0]["detector"] for k in range(2)] == [expected] * 2
        with pytest.raises(InvalidInput, match="force"):
            detectors.step("one", other(log, 2))
        detectors.drop("one")


@pytest.mark.usefixtures("sessions")
def test_many_elements_have_the_filter_from_the_start(ramp: GraspLog) -> None:
    assert opened(ramp) == "filter"
    assert detectors.step("one", whole_frame(ramp, 0))[0]["detector"] == "filter"


@pytest.mark.usefixtures("sessions")
def test_a_stream_without_a_detector_has_that_of_the_log_that_it_becomes(tmp_path: Path) -> None:
    log = few()
    for make in (whole_frame, displacement_frame):
        detectors.open_session("one", log.position.tobytes(), log.grid, log.element_area, None, True, ROOM)
        for k in range(2):
            answer, _ = detectors.step("one", make(log, k))
        assert detectors.write("one", tmp_path / "log.npz", "left").method == answer["detector"]
        detectors.drop("one")


def test_what_a_first_frame_waits_for_is_prepared_by_the_methods_that_it_may_have() -> None:
    assert detectors.methods_of(None, (3, 3)) == ("filter", "coarse")
    assert detectors.methods_of("rigid_fit", (3, 3)) == ("rigid_fit", "rigid_fit")
    detectors.prepare("rigid_fit", "rigid_fit")
    with pytest.raises(InvalidInput, match="method is guess"):
        detectors.prepare("guess")
