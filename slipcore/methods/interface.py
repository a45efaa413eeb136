"""What a detection method is given, and what it answers."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from slipcore.defaults import ContactOptions
from slipcore.element_forces import ElementForces
from slipcore.frames import BoolArray, FloatArray
from slipcore.strain import Lattice

State = TypeVar("State")
Options = TypeVar("Options", bound=ContactOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One frame as every method sees it, with what is common to all of them already worked out.

    ``time`` s; ``interval`` s since the frame before; ``displacement`` [n, m, 3] m and its ``steps`` along the lattice
    [2, 3, n, m] m; ``normal`` [n, m, 3] outward;
    ``forces`` split at the surface, or None; ``contact`` and ``touched`` (in contact now, not before) [n, m];
    ``object_pose`` [3] or None; ``noise`` of a marker coordinate, m, and ``pressing_noise`` of an element's normal
    force, N (without forces of its indentation, m), NaN while unknown; ``force`` [n, m, 3] N as measured, or None.
    """

    time: float
    interval: float
    displacement: FloatArray
    steps: FloatArray
    normal: FloatArray
    forces: ElementForces | None
    contact: BoolArray
    touched: BoolArray
    object_pose: FloatArray | None
    noise: float
    pressing_noise: float = math.nan
    force: FloatArray | None = None


class Decision(NamedTuple):
    """Slip of each element [n, m] and its probability [n, m]; outside the contact it is not looked at."""

    slip: BoolArray
    probability: FloatArray


class Method(NamedTuple, Generic[State, Options]):
    """A detection method: its options, and pure functions on an immutable state of its own choosing.

    ``init`` takes the first frame, on which every element sticks; ``step`` takes each later one.
    """

    options: type[Options]
    init: Callable[[Lattice, Observation, Options], State]
    step: Callable[[State, Lattice, Observation, Options], tuple[State, Decision]]
