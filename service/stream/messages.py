"""What is said in the live stream: its messages, and the numbers in them."""

from array import array
from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import msgspec

from service.stream.repeated_keys import check_binary, check_text
from slipcore.errors import InvalidInput

Numbers = bytes | list[Any]
"""Numbers in a row, row-major: little-endian float32 or float64, or lists nested as they may be."""

DEEPEST = 8
"""Lists in lists of numbers; three say all there is to say."""

Number = Annotated[int, msgspec.Meta(ge=-(2**53), le=2**53)]
"""An integer that every JSON library keeps as it is."""


MOST_MATERIALS = 100
"""Among which a controller recognises a grasp's."""

UNNAMED = "stream"
"""The sensor of a stream that names none."""


class Control(msgspec.Struct, forbid_unknown_fields=True):
    """A grip controller that answers each frame: the contact of its fingertip, and its ``settings`` by name.

    ``contact_area`` m² at any force, or under ``round_at`` N of a round fingertip; ``pressure_square`` and
    ``torque_arm`` m where they are neither Hertz's nor uniform pressure's. ``known``: begin with the material's model.
    ``materials``: where it begins with none, those among which it recognises the grasp's, by name.
    """

    contact_area: float
    settings: dict[str, int | float]
    round_at: float | None = None
    pressure_square: Annotated[float, msgspec.Meta(gt=0.0)] | None = None
    torque_arm: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] | None = None
    known: bool = True
    materials: Annotated[list[str], msgspec.Meta(max_length=MOST_MATERIALS)] = []


class Open(msgspec.Struct, tag="open", tag_field="type", forbid_unknown_fields=True):
    """Begin: the sensor, its detector (None: the one that suits), whether the frames are to be kept for a log of a
    material, and whether a grip controller is to answer them.
    """

    position: Numbers
    grid: tuple[Number, Number]
    element_area: float
    detector: str | None = None
    sensor: str = UNNAMED
    material: str | None = None
    keep: bool = False
    control: Control | None = None


class Resume(msgspec.Struct, tag="resume", tag_field="type", forbid_unknown_fields=True):
    """Go on with a session; ``last`` is the number of the last answer that arrived."""

    session: str
    last: Number = -1


class FrameIn(msgspec.Struct, tag="frame", tag_field="type", forbid_unknown_fields=True):
    """A frame; numbers grow from 0. ``command``: the normal force commanded to the gripper, N, for those who watch;
    ``gripper_force`` N and its standard ``gripper_force_deviation`` N: as of a log, by which forces are reconstructed.
    """

    number: Number
    time: float
    displacement: Numbers
    force: Numbers | None = None
    object_pose: Numbers | None = None
    normal: Numbers | None = None
    command: float | None = None
    gripper_force: float | None = None
    gripper_force_deviation: float | None = None


class Finish(msgspec.Struct, tag="finish", tag_field="type", forbid_unknown_fields=True):
    """End; ``store`` the kept frames as a grasp log."""

    store: bool = False


Incoming = Open | Resume | FrameIn | Finish
_DECODE_BINARY = msgspec.msgpack.Decoder(Incoming).decode
_DECODE_TEXT = msgspec.json.Decoder(Incoming).decode


def decode_binary(content: bytes) -> Incoming:
    """A message of MessagePack; raises ``msgspec.MsgspecError``, ``RecursionError``, and ``RepeatedKey``."""
    message: Incoming = _DECODE_BINARY(content)
    check_binary(content)
    return message


def decode_text(content: bytes) -> Incoming:
    """A message of JSON; raises ``UnicodeDecodeError``, too."""
    message: Incoming = _DECODE_TEXT(content)
    check_text(content)
    return message


def packed(name: str, numbers: Numbers) -> bytes | Sequence[float]:
    """Numbers as the detectors' process takes them: bytes as they are, lists flat; raises ``InvalidInput``."""
    if isinstance(numbers, bytes):
        return numbers
    try:
        return array("d", _flat(name, numbers, DEEPEST))
    except OverflowError as error:
        raise InvalidInput(name, str(error), "numbers of double precision") from error


def packed_or_none(name: str, numbers: Numbers | None) -> bytes | Sequence[float] | None:
    """The same for what need not be there."""
    return None if numbers is None else packed(name, numbers)


def _flat(name: str, numbers: list[Any], deepest: int) -> Iterator[float]:
    for each in numbers:
        if type(each) is list and deepest > 1:
            yield from _flat(name, each, deepest - 1)
        elif type(each) in (float, int):  # True is an int, too, but of another type
            yield each
        else:
            raise InvalidInput(
                name, f"one with a {type(each).__name__} in it", f"numbers, in lists at most {DEEPEST} deep"
            )
