"""Stiction's own two ROS messages: what belongs to a frame, and what to the whole log."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

from service.formats.members import DTYPES, FLAG, ONCE, TEXT
from service.formats.messages import FRAME_TOPIC, LOG_TOPIC
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from stiction_client.container import members

FRAME_TYPE, LOG_TYPE = "stiction_msgs/msg/Frame", "stiction_msgs/msg/GraspLog"


NUMBERS = ("time", "element_area", "gripper_force", "gripper_force_deviation", "truth_stick_ratio")
"""Members of which a frame or log has one number."""


def definition(once: bool, present: set[str]) -> str:
    """The definition of a message with the ``present`` members: those of the log (``once``), or of a frame."""
    lines = [f"{_kind(name)} {name}" for name in DTYPES if name in present and (name in ONCE) is once]
    return "\n".join(lines + ["uint32[2] grid"] * once)


def messages(log: GraspLog) -> Iterator[tuple[str, str, str, int, bytes]]:
    """Topic, type, definition, time in ns and content of each message of a log, the log's own message first."""
    arrays = members(log)
    store = Typestore()
    texts = {LOG_TYPE: definition(True, set(arrays)), FRAME_TYPE: definition(False, set(arrays))}
    for name, text in texts.items():
        store.register(get_types_from_msg(text, name))
    moments = [nanoseconds(time) for time in log.time]
    once = {name: _value(name, arrays[name]) for name in ONCE if name in arrays}
    whole = store.types[LOG_TYPE](**once, grid=np.array(log.grid, dtype=np.uint32))
    yield LOG_TOPIC, LOG_TYPE, texts[LOG_TYPE], moments[0], bytes(store.serialize_cdr(whole, LOG_TYPE))
    names = [name for name in DTYPES if name in arrays and name not in ONCE]
    for k, moment in enumerate(moments):
        frame = store.types[FRAME_TYPE](**{name: _value(name, arrays[name][k]) for name in names})
        yield FRAME_TOPIC, FRAME_TYPE, texts[FRAME_TYPE], moment, bytes(store.serialize_cdr(frame, FRAME_TYPE))


def _kind(name: str) -> str:
    """A member as a field: numbers of one frame or log in a row, row-major."""
    if DTYPES[name] == TEXT:
        return "string"
    if name in NUMBERS:
        return "float64"
    return "bool[]" if DTYPES[name] == FLAG else "float64[]"


def _value(name: str, array: NDArray[Any]) -> Any:
    kind = _kind(name)
    if kind in ("string", "float64"):
        return array.item()
    return np.ascontiguousarray(array.reshape(-1), dtype=np.bool_ if kind == "bool[]" else np.float64)


def nanoseconds(time: float) -> int:
    """A time of a log, s, as recordings count it; raises ``InvalidInput``."""
    moment = round(float(time) * 1e9)
    if not 0 <= moment < 2**63:
        raise InvalidInput("time", f"{time:g} s", "0 to 9.2e9 s, for a recording counts nanoseconds from 0")
    return moment
