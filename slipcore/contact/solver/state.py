"""The state of a contact between two load steps, and what a step did."""

from dataclasses import dataclass, field

import numpy as np

from slipcore.contact.elasticity.operator import Count
from slipcore.contact.solver.extrapolation import Stress
from slipcore.contact.solver.normal import NormalContact
from slipcore.contact.solver.problem import StepLoad
from slipcore.contact.solver.resolution import unresolved
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ContactState:
    """What the next step depends on; fields on the whole grid.

    ``normal`` contact, ``stress`` and that of the step ``before``; ``displacement`` [2, ny, nx] m of the finger against
    the object's own surface; ``elastic`` [3, ny, nx] m, the finger's displacement without creep; ``creep`` m, one
    [3, ny, nx] a branch; ``pose`` [3] of the object (m, m, rad); ``speed`` [ny, nx] m/s of slip, where friction depends
    on it; ``slip`` [2, ny, nx] m within the last step of cells that slid in all of it, zero elsewhere; ``load``: the
    last; ``drive`` [3]: how it differed from the one before; ``rate`` [4] at which it and the pressing changed, 1/s;
    ``velocity`` [3] of an object that moves by itself (m/s, m/s, 1/s).
    """

    normal: NormalContact | None
    stress: Stress
    before: Stress
    displacement: FloatArray
    elastic: FloatArray
    creep: tuple[FloatArray, ...]
    pose: FloatArray
    speed: FloatArray
    slip: FloatArray
    load: StepLoad
    drive: FloatArray
    rate: FloatArray
    velocity: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, slots=True, eq=False)
class StepResult:
    """What happened in one step; fields on the whole grid [ny, nx], z into the finger.

    ``displacement`` [3, ny, nx] m of the finger's surface; ``force`` [3, ny, nx] N on each cell by the object, and
    ``limit`` [ny, nx] N what friction lets it be along the surface; ``slip`` [2, ny, nx] m of the finger against the
    object within this step, zero outside contact; ``contact``,
    ``at_limit`` (contact factor) and ``moved`` (kinematic slip); ``pose`` [3] and ``approach`` of the object;
    ``sliding``: nothing sticks; ``residual`` of the natural map (share of the largest limit), ``normal_residual``
    (share of the indentation), ``imbalance`` (share of μF_N); ``iterations`` (Newton steps), ``applications`` of
    operators and ``seconds`` it took.
    """

    displacement: FloatArray
    force: FloatArray
    limit: FloatArray
    slip: FloatArray
    contact: BoolArray
    at_limit: BoolArray
    moved: BoolArray
    pose: FloatArray
    approach: float
    sliding: bool
    residual: float
    normal_residual: float
    imbalance: float
    iterations: int
    applications: Count
    seconds: float

    @property
    def stick_ratio(self) -> float:
        """Stick area over contact area by contact factor (paper, eq. 37 corrected); NaN without contact."""
        touching = int(self.contact.sum())
        return float((self.contact & ~self.at_limit).sum()) / touching if touching else float("nan")

    def warnings(self) -> tuple[str, ...]:
        """What the grid is too coarse or too small for, in this step."""
        return unresolved(self.contact, self.at_limit, sheared=bool(self.force[:2].any()))
