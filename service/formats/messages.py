"""Topics of messages as columns: the fields that a mapping asks for, with several topics brought together in time."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.formats.assemble import MAX_CONTENT_BYTES, as_array
from service.formats.json_text import parse
from service.formats.mapping import FieldMapping, Origin, default_origins
from service.formats.members import of_all_frames
from slipcore.errors import InvalidInput

FRAME_TOPIC, LOG_TOPIC = "/stiction/frame", "/stiction/log"
"""Where Stiction itself writes what belongs to a frame, and what to the whole log."""

RECEIVED = "@received"
"""In place of a field: when the recorder got the message."""

MAX_MESSAGES = 1_000_000

Decode = Callable[[], object]


def with_defaults(mapping: FieldMapping) -> FieldMapping:
    """The mapping with Stiction's own topics; where displacement comes from another, its messages' times are time."""
    defaults = default_origins(FRAME_TOPIC, LOG_TOPIC)
    displacement = mapping.origins.get("displacement")
    if displacement is not None and displacement.topic is not None:
        defaults["time"] = Origin((RECEIVED,), displacement.topic, explicit=False)
    for name, origin in mapping.origins.items():
        if origin.value is None and origin.topic is None:
            raise InvalidInput(f"mapping of {name}", f"{origin} of no topic", "a field with the topic it is in")
    return mapping.over(defaults)


class MessageColumns:
    """Fields gathered from messages, one at a time; a ``Recording``."""

    def __init__(self, mapping: FieldMapping) -> None:
        self._fields: dict[str, set[str]] = {LOG_TOPIC: {"grid"}}
        for origin in mapping.origins.values():
            if origin.topic is not None:
                self._fields.setdefault(origin.topic, set()).update(set(origin.fields) - {RECEIVED})
        self._received: dict[str, list[int]] = {}
        self._values: dict[tuple[str, str], list[NDArray[Any]]] = {}
        self._reference = mapping.origins["displacement"].topic
        self._tolerance = mapping.tolerance
        self._bytes = 0
        self._seen: set[str] = set()

    def wants(self, topic: str) -> bool:
        """Whether any field of this topic is asked for; notes the topic for an error's message."""
        if len(self._seen) < 1000:
            self._seen.add(topic)
        return topic in self._fields

    def add(self, topic: str, received: int, decode: Decode) -> None:
        """Take the wanted fields of a message that was ``received`` at this time, in ns."""
        received_before = self._received.setdefault(topic, [])
        if len(received_before) >= MAX_MESSAGES:
            raise InvalidInput(topic, f"of more than {MAX_MESSAGES} messages", f"at most {MAX_MESSAGES}")
        if not 0 <= received < 2**63:
            raise InvalidInput(topic, f"of a message received at {received} ns", "0 to 2⁶³ - 1 ns")
        received_before.append(received)
        message = decode()
        for field in self._fields[topic]:
            value = follow(message, field)
            if value is not None:
                self._keep(topic, field, as_array(f"{field} of {topic}", value))

    def column(self, name: str, topic: str | None, field: str, once: bool) -> NDArray[Any] | None:
        """A field of all messages of a topic, or ``once`` what all of them state; None where none has it."""
        if topic not in self._received:
            return None
        if field == RECEIVED:
            return np.array(self._received[topic], dtype=np.int64).view("datetime64[ns]")[self._places(name, topic)]
        parts = self._values.get((topic, field))
        if parts is None:
            return None
        if once:
            _check_shapes(name, parts)
            return of_all_frames(name, np.stack(parts))
        if len(parts) != len(self._received[topic]):
            value = f"in {len(parts)} of {len(self._received[topic])} messages of {topic}"
            raise InvalidInput(name, value, f"{field} in each of them")
        _check_shapes(name, parts)
        return np.stack(parts)[self._places(name, topic)]

    def grid(self) -> tuple[int, int] | None:
        """As Stiction's own topic of the log gives it."""
        values = self._values.get((LOG_TOPIC, "grid"))
        if values is None or values[0].shape != (2,) or values[0].dtype.kind not in "iu":
            return None
        return int(values[0][0]), int(values[0][1])

    def contents(self) -> str:
        """The topics."""
        return f"the topics {', '.join(sorted(self._seen))}"[:300] if self._seen else "no messages"

    def _keep(self, topic: str, field: str, array: NDArray[Any]) -> None:
        self._bytes += array.nbytes + 100  # an array's own record
        if self._bytes > MAX_CONTENT_BYTES:
            raise InvalidInput("file", f"more than {MAX_CONTENT_BYTES} bytes of fields", f"at most {MAX_CONTENT_BYTES}")
        self._values.setdefault((topic, field), []).append(np.array(array))  # a view would keep the whole message

    def _places(self, name: str, topic: str) -> NDArray[np.intp]:
        """For each frame, its message in this topic: the one received nearest to it; frames as they were received."""
        others = np.array(self._received[topic], dtype=np.int64)
        order = np.argsort(others, kind="stable")
        if topic == self._reference or self._reference not in self._received:
            return order
        frames = np.sort(np.array(self._received[self._reference], dtype=np.int64))
        right = np.clip(np.searchsorted(others[order], frames), 1, max(len(others) - 1, 1))
        pair = np.stack([right - 1, np.minimum(right, len(others) - 1)])
        distance = np.abs(others[order][pair] - frames)
        self._check_near(name, topic, frames, distance.min(axis=0))
        chosen: NDArray[np.intp] = order[pair[distance.argmin(axis=0), np.arange(len(frames))]]
        return chosen

    def _check_near(self, name: str, topic: str, frames: NDArray[np.int64], away: NDArray[np.int64]) -> None:
        tolerance = self._tolerance
        if tolerance is None:
            tolerance = 0.5e-9 * float(np.median(np.diff(frames))) if len(frames) > 1 else 0.0
        worst = int(away.argmax())
        if away[worst] * 1e-9 > tolerance:
            value = f"{away[worst] * 1e-9:.6g} s away from frame {worst} in {topic}"
            raise InvalidInput(name, value, f"a message within {tolerance:.6g} s of each frame (tolerance)")


def follow(value: Any, path: str) -> Any:
    """What a dotted path leads to in a message or document, through lists entry by entry; None where it ends."""
    for step in path.split("."):
        value = _step(value, step)
        if value is None:
            return None
    return _stamp(value)


def _step(value: Any, step: str) -> Any:
    if isinstance(value, list):
        parts = [_step(entry, step) for entry in value]
        return None if any(part is None for part in parts) else parts
    if isinstance(value, Mapping):
        return value.get(step)
    return getattr(value, step) if step in getattr(value, "__dataclass_fields__", ()) else None


def _stamp(value: Any) -> Any:
    """A ROS time as a moment in ns."""
    if isinstance(value, list):
        return [_stamp(entry) for entry in value] if value and not isinstance(value[0], int | float | list) else value
    seconds = _step(value, "sec") if not isinstance(value, np.ndarray | str | int | float) else None
    if seconds is None:
        return value
    nanoseconds = _step(value, "nanosec")
    nanoseconds = _step(value, "nsec") if nanoseconds is None else nanoseconds
    if type(seconds) is not int or type(nanoseconds) is not int or not abs(seconds) < 2**33:
        return value
    return np.datetime64(seconds * 10**9 + nanoseconds % 2**32, "ns")


def decode_json(content: bytes) -> object:
    """A message in JSON; raises ``InvalidInput``."""
    return parse("message", content, "JSON, as its channel says")


def _check_shapes(name: str, parts: list[NDArray[Any]]) -> None:
    for frame, part in enumerate(parts):
        if part.shape != parts[0].shape or part.dtype.kind != parts[0].dtype.kind:
            value = f"{part.dtype} of shape {list(part.shape)} at frame {frame}"
            raise InvalidInput(name, value, f"{parts[0].dtype} of shape {list(parts[0].shape)}, as at frame 0")
