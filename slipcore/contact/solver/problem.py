"""What the solver solves: a contact problem, to which each effect of a scene adds its own part."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import ElasticBody
from slipcore.contact.solver.tangential import SolverControl
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray

HeightField = Callable[[FloatArray, FloatArray], FloatArray]
"""Gap m between undeformed bodies at points x, y m; infinite where there is no surface."""
FrictionField = Callable[[FloatArray, FloatArray], FloatArray]
"""What a place (x, y m) adds to the friction coefficient."""
FrictionTerm = Callable[[FloatArray], FloatArray]
"""What a pressure (Pa) or a slip velocity (m/s) adds to the friction coefficient."""


@dataclass(frozen=True, slots=True)
class MaxwellBranch:
    """One term of a Prony series of the creep compliance: J(t) = J_0 [1 + Σ strength (1 − exp(−t / time))]."""

    strength: float
    time: float

    def __post_init__(self) -> None:
        if not (0.0 <= self.strength < np.inf and 0.0 < self.time < np.inf):
            raise InvalidInput("Maxwell branch", self, "strength at least 0, time above 0 s")


@dataclass(frozen=True, slots=True)
class ContactProblem:
    """Bodies, shapes, friction and history of one contact; all tuples are sums.

    ``finger``, ``obstacle``: compliances, the obstacle rigid if empty; ``heights``: gap between undeformed surfaces;
    ``friction``: Coulomb coefficient, to which ``friction_fields``, ``pressure_laws`` and ``velocity_laws`` add;
    ``spread``: whether pressure moves the surface sideways; ``coupled``: and traction in and out, too; ``creep``: of
    the finger.
    """

    finger: tuple[ElasticBody, ...]
    friction: float
    obstacle: tuple[ElasticBody, ...] = ()
    heights: tuple[HeightField, ...] = ()
    friction_fields: tuple[FrictionField, ...] = ()
    pressure_laws: tuple[FrictionTerm, ...] = ()
    velocity_laws: tuple[FrictionTerm, ...] = ()
    coupled: bool = False
    spread: bool = False
    creep: tuple[MaxwellBranch, ...] = ()

    def __post_init__(self) -> None:
        if not 0.0 <= self.friction < np.inf:
            raise InvalidInput("friction coefficient", self.friction, "finite and at least 0")

    def height(self, grid: Grid) -> FloatArray:
        """Gap between the undeformed surfaces [ny, nx] m."""
        x, y = grid.points()
        return sum((height(x, y) for height in self.heights), start=np.zeros(grid.shape))

    def static_friction(self, grid: Grid) -> FloatArray:
        """Friction coefficient [ny, nx] before pressure and velocity change it, never below zero."""
        x, y = grid.points()
        fields = (part(x, y) for part in self.friction_fields)
        friction = sum(fields, start=np.full(grid.shape, self.friction))
        if not np.isfinite(friction).all():
            raise InvalidInput("friction coefficient", "not finite in places", "finite everywhere")
        return np.maximum(friction, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class StepLoad:
    """What is prescribed at the end of one step of ``duration`` s.

    ``normal_force`` N or else ``approach`` m; ``tangential``: F_x N, F_y N, M N·m on the finger, total, where
    ``given``; elsewhere ``motion``: dx m, dy m, dφ rad of the object within the step.
    """

    normal_force: float | None = None
    approach: float | None = None
    tangential: FloatArray = field(default_factory=lambda: np.zeros(3))
    motion: FloatArray = field(default_factory=lambda: np.zeros(3))
    given: tuple[bool, bool, bool] = (True, True, True)
    duration: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.duration < np.inf:
            raise InvalidInput("duration of a step", self.duration, "finite and above 0 s")
        self.control()  # refuses what is not finite

    def control(self) -> SolverControl:
        """What drives the object tangentially."""
        return SolverControl(self.tangential, self.motion, np.array(self.given))
