"""Ways to simulate a scene that cost less than boundary elements, where they hold; the cheapest first."""

from typing import Protocol

from slipcore.arguments import shown
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Plan
from slipcore.contact.reference.checks import check_range
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


def check_request(accuracy: float | None = None, seconds: float | None = None, tier: str | None = None) -> None:
    """Raises ``InvalidInput`` for an accuracy or ``seconds`` that are no finite number above 0, and an unknown tier."""
    if accuracy is not None:
        check_range("accuracy", accuracy, above=0.0)
    if seconds is not None:
        check_range("seconds", seconds, above=0.0, unit="s")
    names = [*(each.NAME for each in TIERS), BOUNDARY_ELEMENTS]
    if tier is not None and tier not in names:
        raise InvalidInput("tier", tier if isinstance(tier, str) else shown(tier), ", ".join(names))


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
    check_request(tier=name)
    tier = next((each for each in TIERS if name == each.NAME), None)
    if tier is None:
        return None
    reached = tier.accuracy(scene, plan)
    if reached is None or (accuracy is not None and accuracy < reached):
        wanted = "" if reached is None else f" to {accuracy:g} (this one to {reached:g})"
        raise InvalidInput("tier", name, f"one that holds for scene {scene.name}{wanted}, as {BOUNDARY_ELEMENTS} does")
    return tier
