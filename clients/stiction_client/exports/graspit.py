"""Friction for GraspIt! (graspit-simulator/graspit, World::readSettings in src/world.cpp of version 2.1)."""

from dataclasses import dataclass
from typing import Unpack

from stiction_client.arguments import of_kind
from stiction_client.errors import InvalidArgument
from stiction_client.exports.coulomb import QUANTILE, Terms, conservative_friction
from stiction_client.linear_friction import LinearFriction, check_model

GRASPIT_MATERIALS = ("frictionless", "glass", "metal", "plastic", "wood", "rubber", "stone")
"""The materials of GraspIt!, by their number. It reads no names of others, so that a pair must be of these."""


@dataclass(frozen=True, slots=True)
class GraspitFriction:
    """Friction between two ``materials`` of GraspIt!: ``static_friction`` ≥ ``dynamic_friction``."""

    materials: tuple[str, str]
    static_friction: float
    dynamic_friction: float

    def settings(self) -> dict[str, float]:
        """What GraspIt! reads at its start, by QSettings' keys: ``cof`` at rest and ``kcof`` in motion.

        The keys end in the numbers of the two materials, the smaller first; other pairs keep what they have.
        """
        first, second = sorted(GRASPIT_MATERIALS.index(name) for name in self.materials)
        return {
            f"GraspIt/World/cof{first}{second}": self.static_friction,
            f"GraspIt/World/kcof{first}{second}": self.dynamic_friction,
        }

    def to_ini(self) -> str:
        """The same as lines of the file in which QSettings keeps them, where that is no registry."""
        entries = {key.removeprefix("GraspIt/").replace("/", "\\"): value for key, value in self.settings().items()}
        return "\n".join(["[GraspIt]", *(f"{key}={value:.9g}" for key, value in entries.items())])


def graspit_friction(
    model: LinearFriction,
    materials: tuple[str, str],
    normal_force: float,
    quantile: float = QUANTILE,
    *,
    sliding_velocity: float | None = None,
    **terms: Unpack[Terms],
) -> GraspitFriction:
    """Friction of the pair of ``materials`` that fingertip and object have in GraspIt!, ``normal_force`` N an element.

    Static at rest, which its grasp quality goes by; dynamic at ``sliding_velocity`` m/s (by default the fastest
    observed), never above it. Raises ``InvalidArgument`` for a material that GraspIt! doesn't have, or whose name
    promises no friction.
    """
    check_model(model)
    of_kind("materials", materials, tuple | list)
    for name in materials:
        if name not in GRASPIT_MATERIALS[1:]:
            raise InvalidArgument("materials", repr(name), f"two of {', '.join(GRASPIT_MATERIALS[1:])}")
    if len(materials) != 2:
        raise InvalidArgument("materials", f"{len(materials)} names", "two: the fingertip's and the object's")
    velocity = model.domain.tangential_velocity[1] if sliding_velocity is None else sliding_velocity
    static = conservative_friction(model, normal_force, quantile, **terms)
    moving = conservative_friction(model, normal_force, quantile, tangential_velocity=velocity, **terms)
    return GraspitFriction((materials[0], materials[1]), static, min(static, moving))
