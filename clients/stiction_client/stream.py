"""A live stream of tactile frames to the service: slip states and friction come back (extra ``stream``)."""

import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import msgspec
import numpy as np
from numpy.typing import ArrayLike
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect

from stiction_client import json_values
from stiction_client.address import authorization, service_address
from stiction_client.arguments import as_array, of_kind, shown, within
from stiction_client.controller import ControlSettings, gains
from stiction_client.elementwise import FloatArray
from stiction_client.errors import AnswerTimedOut, ConnectionFailed, InvalidArgument, StreamEnded, UnexpectedAnswer
from stiction_client.records import Finding

RESUMABLE = (1001, 1006, 1012, 4503)
"""Codes of a connection after whose end its session goes on: the server stops or cannot store now."""

IN_USE = 4409
"""Code of a session that has a connection, as of one whose end the service has not noticed yet."""

IN_USE_PAUSES = (0.05, 0.2, 1.0)
"""s after which it is asked for again."""

MOST_FORCE = 1e4
"""N that a gripper may report."""

ANSWER_TIMEOUT = 30.0
"""s; the first session of a service starts its detectors' process."""


class SlipStream:
    """One grasp, frame by frame; use it as a context manager.

    ``url`` and ``key``: by default those of ``STICTION_URL`` and ``STICTION_KEY``. ``position`` [n, m, 3] m at rest,
    ``element_area`` m². Without a ``detector`` the service takes the one that suits such frames. With ``keep`` the
    frames can be stored as a grasp log of ``material`` when they end (``finish``).

    ``control``, the settings of a grip controller: each answer then has the ``command`` of a controller that runs in
    the service. It begins with the ``material``'s model, unless ``known`` is false; where it has none it recognises
    which of ``materials`` this is. Frames then need forces, or a ``sensor`` whose gel the service knows.

    A connection that breaks is taken up again, with the frames that were not answered. Raises ``InvalidArgument`` for
    what cannot be sent, ``ConnectionFailed`` with the service's reason where it refuses, and ``AnswerTimedOut`` where
    an answer is late: it may be waited for again.
    """

    def __init__(
        self,
        url: str | None,
        position: ArrayLike,
        element_area: float,
        *,
        key: str | None = None,
        detector: str | None = None,
        sensor: str = "stream",
        material: str | None = None,
        keep: bool = False,
        control: ControlSettings | None = None,
        known: bool = True,
        materials: Sequence[str] = (),
    ) -> None:
        rest = _numbers("position", position)
        self._url = f"{str(service_address(url)).rstrip('/').replace('http', 'ws', 1)}/v1/stream"
        self._headers = authorization(key)
        self._open = ExitStack()
        self._session, self._number, self._answered = "", 0, -1
        self._detector: str | None = None
        self._findings: tuple[Finding, ...] = ()
        self._waiting: deque[tuple[int, bytes]] = deque()
        opening: dict[str, Any] = {"type": "open", "position": rest.tobytes(), "grid": rest.shape[:2]}
        opening |= {"element_area": within("element_area", element_area, 0.0, 1.0, "m²")}
        opening |= {"sensor": sensor, "material": material, "keep": keep}
        if detector is not None:
            opening["detector"] = detector
        if isinstance(materials, str):
            raise InvalidArgument("materials", shown(materials), "a list of names")
        if control is not None:
            of_kind("control", control, ControlSettings)
            opening["control"] = _control(control) | {"known": known}
            if materials:
                opening["control"] |= {"materials": list(materials)}
        self._connection = self._connect(opening)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def session(self) -> str:
        """The session's name; the service shows it to people at ``/live/`` and this."""
        return self._session

    @property
    def detector(self) -> str | None:
        """Method of detection; None until the first frame's answer, where only that frame shows which one suits."""
        return self._detector

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is to be known of the sensor's gel, by which forces are reconstructed where frames have none."""
        return self._findings

    def close(self) -> None:
        """End the connection; the session waits a minute for another."""
        self._open.close()

    def send(
        self,
        time: float,
        displacement: ArrayLike,
        force: ArrayLike | None = None,
        object_pose: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        command: float | None = None,
        gripper_force: float | None = None,
        gripper_force_deviation: float | None = None,
    ) -> int:
        """Send a frame (s, m, N; m, m, rad; outward unit normals) and return its number.

        ``command``: the normal force commanded to the gripper, N; who watches the stream sees it. ``gripper_force``:
        the one that it reports, N, with its standard ``gripper_force_deviation`` N: forces that the service
        reconstructs add up to it. Raises ``InvalidArgument`` for a value that is no number or array of numbers, or a
        force out of range; nothing is sent then, and the stream goes on.
        """
        frame: dict[str, Any] = {"type": "frame", "number": self._number, "time": _number("time", time)}
        frame["displacement"] = _numbers("displacement", displacement).tobytes()
        for name, value in {"force": force, "object_pose": object_pose, "normal": normal}.items():
            if value is not None:
                frame[name] = _numbers(name, value).tobytes()
        if command is not None:
            frame["command"] = _number("command", command)
        reports = {"gripper_force": gripper_force, "gripper_force_deviation": gripper_force_deviation}
        for name, reported in reports.items():
            if reported is not None:
                frame[name] = within(name, reported, -MOST_FORCE, MOST_FORCE, "N")
        self._waiting.append((self._number, msgspec.msgpack.encode(frame)))
        self._number += 1
        self._try(lambda: self._connection.send(self._waiting[-1][1]))
        return self._number - 1

    def receive(self, timeout: float = ANSWER_TIMEOUT) -> dict[str, Any]:
        """The next answer: of type "state" (stick_ratio, slip, friction …) or, for a refused frame, "error".

        Raises ``AnswerTimedOut`` after ``timeout`` s, and ``UnexpectedAnswer`` for one to no frame that waits for it.
        """
        answer: dict[str, Any] = self._try(lambda: self._read(timeout))
        number = answer.get("number")
        if not isinstance(number, int) or not self._answered < number < self._number or not _has_sound_command(answer):
            raise self._unexpected(answer)
        self._answered, self._detector = number, answer.get("detector", self._detector)
        while self._waiting and self._waiting[0][0] <= self._answered:
            self._waiting.popleft()
        return answer

    def step(
        self,
        time: float,
        displacement: ArrayLike,
        force: ArrayLike | None = None,
        object_pose: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        command: float | None = None,
        gripper_force: float | None = None,
        gripper_force_deviation: float | None = None,
    ) -> dict[str, Any]:
        """Send a frame and wait for its answer."""
        given = force, object_pose, normal, command, gripper_force, gripper_force_deviation
        number = self.send(time, displacement, *given)
        while (answer := self.receive())["number"] != number:
            pass
        return answer

    def answers(self) -> Iterator[dict[str, Any]]:
        """All answers that are due."""
        while self._waiting:
            yield self.receive()

    def finish(self, store: bool = False) -> dict[str, Any] | None:
        """End the session; with ``store``, the stored grasp log with its job.

        Raises ``ConnectionFailed``. Where that is because nothing can be stored now (4503), it may be tried again.
        """
        for _ in self.answers():
            pass
        log: dict[str, Any] | None = self._try(lambda: self._finish(store))["grasp_log"]
        self.close()
        return log

    def _finish(self, store: bool) -> dict[str, Any]:
        self._connection.send(msgspec.msgpack.encode({"type": "finish", "store": store}))
        answer = self._read(ANSWER_TIMEOUT)
        if answer.get("type") != "finished" or "grasp_log" not in answer:
            raise self._unexpected(answer)
        return answer

    def _connect(self, opening: dict[str, Any]) -> ClientConnection:
        try:
            opened = connect(self._url, additional_headers=self._headers, compression=None, max_size=2**22)
            connection = self._open.enter_context(opened)
            connection.send(msgspec.msgpack.encode(opening))
            answer = self._decoded(connection.recv(ANSWER_TIMEOUT, decode=False))
        except ConnectionClosed as error:
            raise _refused(error) from error
        except (OSError, InvalidHandshake) as error:
            raise ConnectionFailed(f"{self._url}: {error}") from error
        session = answer.get("session")
        if answer.get("type") != "opened" or not isinstance(session, str):
            raise self._unexpected(answer)
        try:
            self._findings = tuple(Finding.from_json(each) for each in answer.get("findings", ()))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise self._unexpected(answer) from error
        self._session, self._detector = session, answer.get("detector", self._detector)
        return connection

    def _try(self, do: Any) -> Any:
        """Do something; where the connection breaks, again on a new one, after the frames that were not answered."""
        try:
            return do()
        except ConnectionClosed as error:
            if error.rcvd is not None and error.rcvd.code not in RESUMABLE:  # the service said why
                raise _refused(error) from error
        self._connection = self._resume()
        try:
            for _, content in self._waiting:
                self._connection.send(content)
            return do()
        except ConnectionClosed as error:
            raise _refused(error) from error

    def _resume(self) -> ClientConnection:
        """A new connection of the session, where the last one broke."""
        opening = {"type": "resume", "session": self._session, "last": self._answered}
        for pause in IN_USE_PAUSES:
            self.close()
            try:
                return self._connect(opening)
            except ConnectionFailed as error:
                closed = error.__cause__
                if not isinstance(closed, ConnectionClosed) or closed.rcvd is None or closed.rcvd.code != IN_USE:
                    raise
            time.sleep(pause)
        self.close()
        return self._connect(opening)

    def _read(self, timeout: float) -> dict[str, Any]:
        try:
            content = self._connection.recv(timeout, decode=False)
        except TimeoutError as error:
            raise AnswerTimedOut(f"{self._url}: no answer within {timeout:g} s; the session goes on") from error
        return self._decoded(content)

    def _decoded(self, content: bytes) -> dict[str, Any]:
        """A message; raises ``UnexpectedAnswer`` for what is none of a service's."""
        try:
            return msgspec.msgpack.decode(content, type=dict[str, Any])
        except (msgspec.MsgspecError, RecursionError) as error:
            raise self._unexpected(content) from error

    def _unexpected(self, answer: Any) -> UnexpectedAnswer:
        return UnexpectedAnswer(f"{self._url} answered {str(answer)[:80]}")


def _numbers(name: str, value: ArrayLike) -> FloatArray:
    """The array as a message has it; raises ``InvalidArgument`` for anything else, for which the service would end the
    stream.
    """
    found = as_array(name, value)
    if found.dtype.kind not in "iuf" or not found.ndim:
        raise InvalidArgument(name, shown(value), "an array of numbers")
    return found.astype("<f8")


def _number(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InvalidArgument(name, shown(value), "a number")
    return float(value)


def _has_sound_command(answer: Mapping[str, Any]) -> bool:
    """Whether the command of an answer, if it has one, is a force that a gripper can press with."""
    if answer.get("command") is None:
        return True
    try:
        json_values.number("normal_force", answer["command"]["normal_force"], least=0.0)
    except (TypeError, KeyError, ValueError):
        return False
    return True


def _control(settings: ControlSettings) -> dict[str, Any]:
    """A controller's settings as the service takes them."""
    contact = settings.contact
    return {
        "contact_area": float(contact.area),
        "round_at": contact.reference_force,
        "pressure_square": float(contact.pressure_square),
        "torque_arm": float(contact.torque_arm),
        "settings": {name: getattr(settings, name) for name in gains()},
    }


def _refused(error: ConnectionClosed) -> ConnectionFailed:
    received = error.rcvd
    return StreamEnded(received.code, received.reason) if received else ConnectionFailed(str(error))
