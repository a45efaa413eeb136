"""Ways to simulate a scene that cost less than boundary elements, where they hold; the cheapest first."""

from typing import Protocol

from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Plan
from slipcore.contact.tiers import beam_lattice, closed_form
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

BOUNDARY_ELEMENTS = "boundary elements"


class Tier(Protocol):
    """A module that simulates some scenes, under its ``NAME``."""

    NAME: str

    def accuracy(self, scene: SceneDescription, plan: Plan) -> float | None:
        """Largest error to expect, as ``simulate`` counts it; None for a scene of which the tier knows nothing."""

    def run(self, scene: SceneDescription, plan: Plan) -> GraspLog:
        """The log of a scene of which the tier knows the accuracy, before observation effects."""


TIERS: tuple[Tier, ...] = (closed_form, beam_lattice)


def cheapest(scene: SceneDescription, plan: Plan, accuracy: float) -> Tier | None:
    """The cheapest tier that is as accurate as asked; None where that takes boundary elements."""
    for tier in TIERS:
        known = tier.accuracy(scene, plan)
        if known is not None and known <= accuracy:
            return tier
    return None


def named(name: str, scene: SceneDescription, plan: Plan, accuracy: float | None = None) -> Tier | None:
    """The tier of that name, None for boundary elements.

    Raises ``InvalidInput`` for a scene that it cannot do, or not as accurately as asked.
    """
    known: dict[str, Tier | None] = {**{tier.NAME: tier for tier in TIERS}, BOUNDARY_ELEMENTS: None}
    if name not in known:
        raise InvalidInput("tier", name, ", ".join(known))
    tier = known[name]
    if tier is None:
        return None
    reached = tier.accuracy(scene, plan)
    if reached is None or (accuracy is not None and accuracy < reached):
        wanted = "" if reached is None else f" to {accuracy:g} (this one to {reached:g})"
        raise InvalidInput("tier", name, f"one that holds for scene {scene.name}{wanted}, as {BOUNDARY_ELEMENTS} does")
    return tier
