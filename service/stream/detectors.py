"""Live detectors, in a worker process: one a session, fed frame by frame. Module-level functions of plain values."""

import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import estimators
import slipcore
from db.blobs import disk_errors_named
from service.domain.sensors.reconstruct import early_touch
from service.formats.reading import Description, describe
from service.stream.detector_session import (
    WINDOW,
    DetectorSession,
    MemoryLimit,
    Numbers,
    PackedFrame,
    SessionOptions,
    log_of,
)
from service.stream.friction_looks import plan_look
from service.stream.grip import Grip
from service.stream.live_frame import pack_frame
from service.stream.reconstructing import Reconstructing
from slipcore import (
    Finding,
    Frame,
    GraspLog,
    InvalidInput,
    SlipState,
    for_reconstructed_forces,
)
from slipcore.checks.recording import begun_in_contact
from slipcore.defaults import FilterOptions
from slipcore.frames import check_displacement, check_gripper_report, check_span
from slipcore.method_choice import method_with_displacement
from slipcore.warm_up import warm_up_step
from stiction_client import container

MAX_KEPT_BYTES = 64 * 2**20
"""Bytes of frames kept of one session for its log: 12 minutes of a 20×20 sensor with forces at 30 frames a second."""

MAX_MARKERS = 4096
MOST_COMMAND = 1e6
"""N, as of the planner's forces."""

_SESSIONS: dict[str, DetectorSession] = {}


class FitInProgress(Exception):
    """A session's next look for friction is due, and its last one not done: the frame may come again in a moment."""


def methods_of(method: str | None, grid: tuple[int, int]) -> tuple[str, str]:
    """The detectors of a session on so many markers: that of frames without forces, and that of frames with them."""
    without, with_forces = (method or method_with_displacement(grid, measures) for measures in (False, True))
    return without, with_forces


def prepare(*methods: str) -> None:
    """Load the kernels of these methods, or compile them, which takes minutes, so that no frame waits for them.

    Raises ``InvalidInput`` for an unknown method.
    """
    for method in dict.fromkeys(methods):
        warm_up_step(method)


def open_session(
    name: str,
    position: Numbers,
    grid: tuple[int, int],
    area: float,
    method: str | None,
    keep: bool,
    limit: MemoryLimit,
    options: SessionOptions | None = None,
) -> str | None:
    """Begin a session within the memory ``limit``; its method of detection, None where the first frame decides.

    Without a ``method`` it has the one that suits arrays of its size with such frames. Raises ``InvalidInput`` for what
    cannot be a sensor or a controller, or has no room.
    """
    control, model, gel, materials = options or SessionOptions()
    rows, columns = grid
    if not 0 < rows * columns <= MAX_MARKERS or rows < 1:
        raise InvalidInput("grid", list(grid), f"1 to {MAX_MARKERS} markers")
    at_rest = _array("position", position, (rows, columns, 3))
    held = WINDOW * 3 * at_rest.nbytes  # of the frames that are looked at, each with forces and normals
    _check_room(held, limit)
    without, with_forces = methods_of(method, (rows, columns))
    detector, moments = slipcore.SlipDetector(at_rest, area, without), estimators.Moments.empty(area)
    kept: list[Frame] | None = [] if keep else None
    grip = None if control is None else Grip(at_rest, control, model, materials)
    forces = None if gel is None else Reconstructing(gel, limit.owner)
    depends = with_forces != without  # on what frames have
    _SESSIONS[name] = DetectorSession(
        detector, at_rest, area, moments, limit, kept, depends, grip=grip, forces=forces, held_bytes=held
    )
    return None if depends else without


def step(name: str, given: PackedFrame, is_shown: bool = False) -> tuple[dict[str, Any], bytes | None]:
    """Take a frame; the answer, and what those who watch see of it if it ``is_shown``.

    The same frame again is answered as before. Raises ``InvalidInput``, and ``FitInProgress`` where frames come faster
    than they can be looked at: nothing is changed then.
    """
    session = _SESSIONS[name]
    if given.number == session.last[0]:
        return session.last[1], None
    if session.until_look == 1 and session.look is not None and not session.look.done():
        raise FitInProgress
    frame = _frame(session, given)
    size = 0 if session.kept is None else _kept_bytes(session, frame)
    if session.chooses_detector and session.begun is None:
        _choose_detector(session, frame.force is not None)
    with_forces, force_report = _with_forces(session, frame, given)
    state, command = _detected(session, with_forces)
    if session.begun is None:
        session.findings = list(begun_in_contact(state.contact))
    session.begun = frame.time if session.begun is None else session.begun
    _keep(session, frame, given, size)
    plan_look(session, with_forces, state)
    answer = _answer(session, given.number, state)
    if force_report is not None:
        answer["force"] = force_report
    if command is not None:
        answer["command"] = command
    session.last = (given.number, answer)
    if not is_shown:
        return answer, None
    pressed = answer.get("command", {}).get("normal_force") if given.command is None else given.command
    return answer, pack_frame(given.number, state, with_forces.force, pressed, session.expected)


def _choose_detector(session: DetectorSession, measures_force: bool) -> None:
    """The one that suits the session's first frame, of which nothing is computed yet."""
    method = method_with_displacement(session.position.shape[:2], measures_force)
    if method != session.method:  # after a frame that was refused
        session.detector = slipcore.SlipDetector(session.position, session.element_area, method)


def _keep(session: DetectorSession, frame: Frame, given: PackedFrame, size: int) -> None:
    """Keep a frame of this size for the log, where one is wanted, and in any case how much its gripper reported."""
    session.most_reported = max(session.most_reported, given.gripper_force or 0.0)
    if session.kept is None:
        return
    session.kept.append(frame)
    session.reported.append(given.gripper_force)
    session.held_bytes += size
    if given.gripper_force_deviation is not None:
        session.report_deviation = max(session.report_deviation or 0.0, given.gripper_force_deviation)


def _detected(session: DetectorSession, frame: Frame) -> tuple[SlipState, dict[str, Any] | None]:
    """The slip state after a frame, and what is then commanded; the session is as it was where one is refused."""
    before = session.detector.state
    if session.forces is not None and isinstance(before.setup.options, FilterOptions):
        session.detector.set_options(**for_reconstructed_forces(session.forces.deviation))
    state = session.detector.step(*frame)
    try:
        if session.grip is None:
            return state, None
        sampled = None if session.forces is None else session.forces.sampled
        return state, session.grip.step(frame._replace(normal=session.detector.normals), state, sampled)
    except InvalidInput:
        session.detector.state = before
        raise


def _with_forces(session: DetectorSession, frame: Frame, given: PackedFrame) -> tuple[Frame, dict[str, Any] | None]:
    """The frame with reconstructed forces where it has none and its sensor's gel is known, and a report on them."""
    if session.forces is None:
        return frame, None
    if session.begun is None:
        session.forces.begin(
            frame, session.position, session.element_area, lambda size: _check_room(size, session.limit)
        )
    with_forces, force_report = session.forces.step(frame, given.gripper_force, given.gripper_force_deviation)
    if session.grip is not None and with_forces.force is None:
        raise InvalidInput("force", None, f"the elements' forces, for none are reconstructed: {session.forces.refused}")
    return with_forces, force_report


def _frame(session: DetectorSession, given: PackedFrame) -> Frame:
    """The frame, if a log could have it: one that could not would spoil what is kept."""
    shape, command = session.position.shape, given.command
    if command is not None and not 0.0 <= command <= MOST_COMMAND:
        raise InvalidInput("command", command, f"a normal force of 0 to {MOST_COMMAND:g} N")
    if session.grip is not None and given.force is None and session.forces is None:
        raise InvalidInput("force", None, "the elements' forces, by which the grip is controlled")
    check_gripper_report(given.gripper_force, given.gripper_force_deviation, session.most_reported)
    check_span(given.time if session.begun is None else session.begun, given.time)
    displacement = _array("displacement", given.displacement, shape)
    check_displacement(displacement, session.position)
    return Frame(
        given.time,
        displacement,
        None if given.force is None else _array("force", given.force, shape),
        None if given.object_pose is None else _array("object_pose", given.object_pose, (3,)),
        None if given.normal is None else _array("normal", given.normal, shape),
    )


def write(name: str, target: Path, sensor: str) -> Description:
    """Write a session's log to ``target``; raises ``InvalidInput`` for too few frames, ``StorageUnavailable``."""
    session = _SESSIONS[name]
    frames = session.kept or []
    if len(frames) < 2:
        raise InvalidInput("frames", len(frames), "at least 2, for a log")
    log = _with_reports(session, log_of(session, frames, sensor, {"session": name}))
    with disk_errors_named():
        container.write(log, target)
    return describe("stream", log)


def _with_reports(session: DetectorSession, log: GraspLog) -> GraspLog:
    """With the gripper's force, where any frame gave it; of others 0, which says nothing. It is as sure as the least
    sure.
    """
    if all(force is None for force in session.reported):
        return log
    reported = np.array([0.0 if force is None else force for force in session.reported])
    return replace(log, gripper_force=reported, gripper_force_deviation=session.report_deviation)


def drop(name: str) -> None:
    """Forget a session, and what was to be looked for in it."""
    session = _SESSIONS.pop(name, None)
    if session is None:
        return
    if session.look is not None:
        session.look.cancel()
    if session.forces is not None:
        session.forces.end()


def _kept_bytes(session: DetectorSession, frame: Frame) -> int:
    """What a frame takes that is to be kept; raises ``InvalidInput`` where there is no room for it."""
    size = frame.displacement.nbytes * (1 + (frame.force is not None) + (frame.normal is not None))
    count = len(session.kept or ()) + 1
    if count * size > MAX_KEPT_BYTES:
        raise InvalidInput("frames", count, f"{MAX_KEPT_BYTES // size} of this size, where they are kept")
    _check_room(size, session.limit)
    return size


def _check_room(size: int, limit: MemoryLimit) -> None:
    own, others = (
        sum(each.all_bytes for each in _SESSIONS.values() if (each.limit.owner == limit.owner) is is_own)
        for is_own in (True, False)
    )
    most = (limit.most_bytes - others) // 2
    if own + size > most:
        allowed = (
            f"{most} of one client's live streams, half of what others leave; finish one, or set STICTION_STREAM_BYTES"
        )
        raise InvalidInput("bytes", own + size, allowed)


def _answer(session: DetectorSession, number: int, state: SlipState) -> dict[str, Any]:
    return {
        "type": "state",
        "number": number,
        "detector": session.method,
        "time": state.time,
        "stick_ratio": None if math.isnan(state.stick_ratio) else float(state.stick_ratio),
        "macro_slip": bool(state.macro_slip),
        "contact": int(state.contact.sum()),
        "slip": np.flatnonzero(state.slip).tolist(),
        "friction": session.friction,
        "findings": [asdict(finding) for finding in _findings(session)],
    }


def _findings(session: DetectorSession) -> list[Finding]:
    stream = None if session.forces is None else session.forces.stream
    return [early_touch()] if stream is not None and stream.touched_early else session.findings


def _array(name: str, numbers: Numbers, shape: tuple[int, ...]) -> NDArray[np.float64]:
    count = math.prod(shape)
    if isinstance(numbers, bytes):
        if len(numbers) not in (4 * count, 8 * count):
            raise InvalidInput(
                name, f"{len(numbers)} bytes", f"{4 * count} or {8 * count}: {list(shape)} as float32 or 64"
            )
        return np.frombuffer(numbers, "<f4" if len(numbers) == 4 * count else "<f8").astype(np.float64).reshape(shape)
    if len(numbers) != count:
        raise InvalidInput(name, f"{len(numbers)} numbers", f"{count}: {list(shape)}")
    return np.array(numbers, dtype=np.float64).reshape(shape)
