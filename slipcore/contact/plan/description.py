"""What a scene is made of: a finger, a press, friction and the effects that it calls for; and its plan."""

from dataclasses import dataclass, field, is_dataclass
from typing import Any

import numpy as np

from slipcore.arguments import of_kind, shown
from slipcore.contact.defaults import RAMP, SCENE
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.plan.entries import check_finite, check_own_types, check_seed
from slipcore.contact.plan.plan import Effect, Plan, ramp
from slipcore.contact.solver.problem import ContactProblem, HeightField
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, FrictionLaw
from slipcore.references import EFFECTS, cited


@dataclass(frozen=True, slots=True)
class Finger:
    """A gel fingertip: ``radius`` m (inf for a flat one), ``young_modulus`` Pa, ``poisson_ratio``, ``thickness`` m of
    the gel.

    The gel is a half-space to the solver unless the scene has a bonded layer; its thickness says whether it should.
    """

    radius: float = RAMP.sphere_radius
    young_modulus: float = RAMP.young_modulus
    poisson_ratio: float = RAMP.poisson_ratio
    thickness: float = float("inf")

    def __post_init__(self) -> None:
        check_own_types(self)
        for name in ("radius", "thickness"):
            if not getattr(self, name) > 0.0:
                raise InvalidInput(f"{name} of the finger", getattr(self, name), "above 0 m, inf for none")
        if not 0.0 < self.young_modulus < np.inf:
            raise InvalidInput("young_modulus of the finger", self.young_modulus, "finite and above 0 Pa")
        if not 0.0 <= self.poisson_ratio <= 0.5:
            raise InvalidInput("poisson_ratio of the finger", self.poisson_ratio, "0 to 0.5")

    def height(self) -> HeightField:
        """Gap to a flat object."""
        half = 0.5 / self.radius

        def paraboloid(x: FloatArray, y: FloatArray) -> FloatArray:
            return half * (x**2 + y**2)

        return paraboloid


@dataclass(frozen=True, slots=True)
class Press:
    """Normal ``force`` N, reached within ``duration`` s from the begin, then held."""

    force: float = RAMP.normal_force
    duration: float = SCENE.press_duration

    def __post_init__(self) -> None:
        check_own_types(self)
        if not 0.0 <= self.force < np.inf:
            raise InvalidInput("press.force", self.force, "finite and at least 0 N")
        if not 0.0 < self.duration < np.inf:
            raise InvalidInput("press.duration", self.duration, "finite and above 0 s")


@dataclass(frozen=True, slots=True)
class SceneDescription:
    """A grasp to simulate: ``friction`` is the Coulomb coefficient, ``duration`` s covers press and all that follows.

    What is not among the ``effects`` does not happen: no tangential load, a rigid flat object, a half-space, friction
    that is the same everywhere, a log of every cell and step. Raises ``InvalidInput``.
    """

    name: str
    effects: tuple[Effect, ...] = ()
    finger: Finger = field(default_factory=Finger)
    friction: float = RAMP.friction
    press: Press = field(default_factory=Press)
    duration: float = SCENE.duration
    description: str = ""

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.name.strip():
            raise InvalidInput("name of the scene", shown(self.name), "one that is not blank")
        of_kind("finger", self.finger, Finger)
        of_kind("press", self.press, Press)
        if not 0.0 < self.duration < np.inf:
            raise InvalidInput("duration", self.duration, "finite and above 0 s")
        _check_effects(self.effects)
        self.plan()

    def plan(self, seed: int = 0) -> Plan:
        """The scene with all its effects added, in an order that does not depend on how they are listed.

        Raises ``InvalidInput``, for a ``seed`` that is no whole number of at least 0 as well.
        """
        check_seed(seed)
        finger = self.finger
        body = HalfSpace.from_young(finger.young_modulus, finger.poisson_ratio)
        plan = Plan(
            problem=ContactProblem((body,), self.friction, heights=(finger.height(),)),
            duration=self.duration,
            histories=(ramp("normal_force", self.press.force, 0.0, self.press.duration),),
            law=FrictionLaw((self.friction, 0.0, 0.0)),
            young_modulus=finger.young_modulus,
            poisson_ratio=finger.poisson_ratio,
            seed=seed,
        )
        for effect in sorted(self.present(), key=lambda effect: (type(effect).__name__, repr(effect))):
            plan = effect.extend(plan)
        return plan.check()

    def present(self) -> tuple[Effect, ...]:
        """The effects that have any strength."""
        return tuple(effect for effect in self.effects if not effect.absent)

    @property
    def references(self) -> tuple[str, ...]:
        """The papers behind the effects that are present; none of an effect that this package does not know."""
        return cited(*(EFFECTS.get(type(effect).__name__, ()) for effect in self.present()))


def _check_effects(effects: Any) -> None:
    """What is no effect is refused, and so is an effect whose entries are not what they must be."""
    if not isinstance(effects, tuple | list):
        raise InvalidInput("effects", shown(effects), "a tuple of effects, such as (Torsion(0.01),)")
    for effect in effects:
        if isinstance(effect, type) or not (hasattr(effect, "absent") and hasattr(effect, "why")):
            raise InvalidInput("effect", shown(effect), "an object such as Torsion(0.01)")
        if is_dataclass(effect):
            check_own_types(effect)
            check_finite(effect)
