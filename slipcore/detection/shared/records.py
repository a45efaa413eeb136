"""What compiled steps take and fill, as named tuples of plain arrays; a field that a frame does not have is empty."""

from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import borrowed, compiled
from slipcore.defaults import NOISE
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.log_normals import normals_at_rest
from slipcore.surface.strain import Lattice

Scalar = TypeVar("Scalar", bound=np.generic)
Plain: TypeAlias = Any
"""A named tuple of these, at any depth, as a plain one."""

_SERIES, _ROWS = max(NOISE.series, NOISE.memory), 18


def read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """The same data, not to be written to: users can't change what a detector remembers, kernels see one type."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.setflags(write=False)  # half as slow as by ``flags``
    return view


NO_FIELD, NO_MASK, NO_POSE = (read_only(np.empty(s, t)) for s, t in (((0, 0, 3), float), ((0, 0), bool), (0, float)))
"""Stand for what a frame does not have."""


class DetectorSetup(NamedTuple):
    """What stays the same over a stream: the lattice (see ``strain.Lattice``), its ``normal`` at rest [n, m, 3], what
    an element needs to touch by force and by shape (``ContactThreshold`` as arrays) and the method's options as one.
    """

    position: FloatArray
    rest_steps: FloatArray
    inverse_jacobian: FloatArray
    orientation: float
    normal: FloatArray
    touch_by_force: FloatArray
    touch_by_shape: FloatArray
    settings: FloatArray


def for_setup(lattice: Lattice) -> tuple[FloatArray, FloatArray, FloatArray, float, FloatArray]:
    """What ``DetectorSetup`` has of a lattice: copies that can be written to, as unpickled ones can, for kernels are
    compiled for one type.
    """
    position, steps, inverse = map(np.array, (lattice.position, lattice.steps, lattice.inverse_jacobian))
    return position, steps, inverse, lattice.orientation, normals_at_rest(lattice.position)


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
    ``observe.step_noise``, ``lasting_noise``); the method's own ``elements`` [rows, n, m] and ``common`` [k] of all.
    """

    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    noise: FloatArray
    elements: FloatArray
    common: FloatArray


def unwritten(frame: FrameArrays) -> FrameArrays:
    """The same frame: unpickled arrays can be written to, and kernels are compiled for one type."""
    if not frame.displacement.flags.writeable:
        return frame
    return FrameArrays(
        frame.time,
        read_only(frame.displacement),
        read_only(frame.force),
        read_only(frame.object_pose),
        read_only(frame.normal),
        read_only(frame.contact),
    )


def empty_like(memory: Memory) -> Memory:
    """Arrays to fill, of the same shapes."""
    return Memory(
        np.empty_like(memory.contact),
        np.empty_like(memory.slip),
        np.empty_like(memory.probability),
        np.empty_like(memory.noise),
        np.empty_like(memory.elements),
        np.empty_like(memory.common),
    )


class Surface(NamedTuple):
    """What all methods see in a frame: outward ``normal`` [n, m, 3]; ``pressing`` force inwards and ``tangential``
    force, N, [n, m] (without forces: indentation, m, and zero); which elements ``stay`` in contact, now and before,
    [n, m]; ``noise`` [2] of a marker coordinate, m, and of ``pressing``, NaN while unknown.
    """

    normal: FloatArray
    pressing: FloatArray
    tangential: FloatArray
    stays: BoolArray
    noise: FloatArray


class Decision(NamedTuple):
    """Slip of each element [n, m] and its probability [n, m]; only looked at where an element stays in contact."""

    slip: BoolArray
    probability: FloatArray


class Workspace(NamedTuple):
    """Arrays that a step fills on its way; nothing in them outlasts a frame.

    An array that is allocated for a frame costs more than what is done to it where elements are few, and the counting
    of references to all others in the same function as much again: numba only leaves that out where it frees nothing.
    Where elements are many, fresh memory is worse still: on 200 × 200 the operating system took longer to hand out 10
    MB for each frame than the step took.
    ``weight`` [n, m]: how surely each element sticks before and after. ``series`` [2, k]: values to take medians of.
    Of the elements that a method looks at one by one: their ``places`` [n·m, 2] and ``rows`` [18, n·m] of numbers, and
    how far their markers are from their anchors, ``offsets`` [2, n, m] m.
    """

    surface: Surface
    decision: Decision
    weight: FloatArray
    series: FloatArray
    places: NDArray[np.int64]
    rows: FloatArray
    offsets: FloatArray


def workspace(n: int, m: int) -> Workspace:
    """Room for frames of n × m elements."""
    shape = n, m
    surface = Surface(np.empty((n, m, 3)), np.empty(shape), np.empty(shape), np.empty(shape, bool), np.empty(4))
    decision, series = Decision(np.empty(shape, bool), np.empty(shape)), np.empty((2, _SERIES))
    places, rows = np.empty((n * m, 2), np.int64), np.empty((_ROWS, n * m))
    return Workspace(surface, decision, np.empty(shape), series, places, rows, np.empty((2, n, m)))


def plain(room: Workspace) -> Plain:
    """The same as plain tuples."""
    return tuple(tuple(part) if isinstance(part, tuple) else part for part in room)


@lru_cache(maxsize=2)
def shared_workspace(n: int, m: int) -> Plain:
    """Room as plain tuples for steps that are one compiled call, the same for all detectors: such a call keeps the
    interpreter's lock, so that no two of them are in it at once.
    """
    return plain(workspace(n, m))


@compiled
def named(
    sensor: DetectorSetup, last: FrameArrays, frame: FrameArrays, before: Memory, after: Memory, room: Workspace
) -> tuple[DetectorSetup, FrameArrays, FrameArrays, Memory, Memory, Workspace]:
    """The same with names: from Python, plain tuples reach a kernel four times as fast as named ones."""
    frames = FrameArrays(*borrowed(last)), FrameArrays(*borrowed(frame))
    memories = Memory(*borrowed(before)), Memory(*borrowed(after))
    surface, decision, weight, series, places, rows, offsets = borrowed(room)
    made = Workspace(Surface(*surface), Decision(*decision), weight, series, places, rows, offsets)
    return DetectorSetup(*borrowed(sensor)), *frames, *memories, made
