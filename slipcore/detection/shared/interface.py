"""What a detection method is given, and what it decides."""

import math
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

from slipcore.defaults import ContactOptions
from slipcore.detection.shared.records import NO_POSE, Decision
from slipcore.finding import Finding
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice

State = TypeVar("State")
Options = TypeVar("Options", bound=ContactOptions)


class ObservedFrame(NamedTuple):
    """One frame as a method in numpy sees it, with what is common to all of them already worked out.

    ``interval`` s since the frame before (infinite for the first); ``displacement`` [n, m, 3] m and outward ``normal``;
    ``force`` [n, m, 3] N as measured, empty where missing; ``pressing``: the force inwards, N, or without forces the
    indentation, m, and ``tangential`` force, N, [n, m]; ``contact`` and ``stays`` (in contact now and before) [n, m];
    ``noise`` of a marker coordinate, m, and ``force_noise`` of ``pressing``, N, NaN while unknown; ``object_pose``
    [3] m, m, rad, empty where missing.
    """

    interval: float
    displacement: FloatArray
    force: FloatArray
    contact: BoolArray
    normal: FloatArray
    pressing: FloatArray
    tangential: FloatArray
    stays: BoolArray
    noise: float
    force_noise: float = math.nan
    object_pose: FloatArray = NO_POSE


class Method(NamedTuple, Generic[State, Options]):
    """A detection method: its options, and pure functions on an immutable state of its own choosing.

    ``init`` makes the state of a method that has seen nothing; ``step`` takes each frame; ``findings``: what its state,
    and the noise of a marker's coordinate (m), say is inconsistent in the frames so far; None for a method that does
    not look.
    """

    options: type[Options]
    init: Callable[[Lattice, Options], State]
    step: Callable[[State, Lattice, ObservedFrame, Options], tuple[State, Decision]]
    findings: Callable[[State, float], tuple[Finding, ...]] | None = None


class Start(NamedTuple):
    """What a compiled method begins with: its options as an array, and what it remembers (see ``records.Memory``)."""

    settings: FloatArray
    elements: FloatArray
    common: FloatArray


class CompiledMethod(NamedTuple, Generic[Options]):
    """A detection method whose whole step is one compiled call, ``run_filter`` or ``run_strain_rate``; these take and
    return the same types, as ``fold`` calls any of them by its address.

    ``revise``: the decision on a frame from the ``elements`` in its memory and in those of frames after it, and the
    settings; None for a method to which later frames say nothing. ``findings``: what its memory's ``common``, and the
    noise of a marker's coordinate (m), say is inconsistent in the frames so far; None for a method that does not look.
    """

    options: type[Options]
    start: Callable[[Lattice, Options], Start]
    run: Callable[..., tuple[float, int, int]]
    revise: Callable[[Sequence[FloatArray], FloatArray], Decision] | None = None
    findings: Callable[[FloatArray, float], tuple[Finding, ...]] | None = None
