"""What compiled steps take and fill, as named tuples of plain arrays; a field that a frame does not have is empty."""

from typing import NamedTuple

from slipcore.compilation import compiled
from slipcore.frames import BoolArray, FloatArray


class Sensor(NamedTuple):
    """What stays the same over a stream: the lattice (see ``strain.Lattice``), what an element needs to touch
    (``contact.Touch`` as an array) and the method's options as an array.
    """

    position: FloatArray
    rest_steps: FloatArray
    inverse_jacobian: FloatArray
    orientation: float
    touch: FloatArray
    settings: FloatArray


class FrameArrays(NamedTuple):
    """One frame: ``time`` s, ``displacement`` [n, m, 3] m, ``force`` [n, m, 3] N, ``object_pose`` [3], outward
    ``normal`` [n, m, 3] and known ``contact`` [n, m]; none of them is written to.
    """

    time: float
    displacement: FloatArray
    force: FloatArray
    object_pose: FloatArray
    normal: FloatArray
    contact: BoolArray


class Memory(NamedTuple):
    """What a detector remembers between two frames beside the frame itself.

    ``contact``, ``slip`` and its ``probability`` [n, m]; state of the ``noise`` estimate (see
    ``noise.step_noise``); the method's own ``elements`` [rows, n, m] and ``common`` [k] of all of them.
    """

    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    noise: FloatArray
    elements: FloatArray
    common: FloatArray


class Surface(NamedTuple):
    """What all methods see in a frame: outward ``normal`` [n, m, 3]; ``pressing`` force inwards and ``tangential``
    force, N, [n, m] (without forces: indentation, m, and zero); which elements ``stay`` in contact, now and before,
    [n, m]; noise of a marker coordinate, m, and of ``pressing``, NaN while unknown.
    """

    normal: FloatArray
    pressing: FloatArray
    tangential: FloatArray
    stays: BoolArray
    marker_noise: float
    pressing_noise: float


class Decision(NamedTuple):
    """Slip of each element [n, m] and its probability [n, m]; only looked at where an element stays in contact."""

    slip: BoolArray
    probability: FloatArray


@compiled
def named(
    sensor: Sensor, last: FrameArrays, frame: FrameArrays, before: Memory, after: Memory
) -> tuple[Sensor, FrameArrays, FrameArrays, Memory, Memory]:
    """The same with names: from Python, plain tuples reach a kernel four times as fast as named ones."""
    return Sensor(*sensor), FrameArrays(*last), FrameArrays(*frame), Memory(*before), Memory(*after)
