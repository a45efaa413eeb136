"""Ways to simulate a scene that cost less than boundary elements, where they hold; the cheapest first."""

from typing import Protocol

from slipcore.contact.plan import Plan
from slipcore.contact.scene import Scene
from slipcore.contact.tiers import closed_form
from slipcore.frames import GraspLog


class Tier(Protocol):
    """A module that simulates some scenes."""

    def accuracy(self, scene: Scene, plan: Plan) -> float | None:
        """Largest error to expect, as ``simulate`` counts it; None for a scene of which the tier knows nothing."""

    def run(self, scene: Scene, plan: Plan) -> GraspLog:
        """The log of a scene of which the tier knows the accuracy, before observation effects."""


TIERS: tuple[Tier, ...] = (closed_form,)


def cheapest(scene: Scene, plan: Plan, accuracy: float) -> Tier | None:
    """The cheapest tier that is as accurate as asked; None where that takes boundary elements."""
    for tier in TIERS:
        known = tier.accuracy(scene, plan)
        if known is not None and known <= accuracy:
            return tier
    return None
