"""Which of a material's current models answers who names no method, and why."""

from collections.abc import Iterable
from typing import NamedTuple

from db.records import StoredModel

AUTO = "auto"
"""In place of a method's name: the recommended model."""

PREFERENCE = ("hierarchical", "bayes", "ols", "robust")
"""From the one that tells grasps apart to those whose errors only allow for that. An exact conjugate posterior takes
all samples for independent, and is never recommended."""


class Recommended(NamedTuple):
    """A model, and the sentence that says why it is this one."""

    stored: StoredModel
    because: str


def recommended(models: Iterable[StoredModel]) -> Recommended | None:
    """The recommended one of a material's current models; None where there is none that may be."""
    by_method = {stored.model.method: stored for stored in models}
    for method in PREFERENCE:
        if method in by_method:
            return Recommended(by_method[method], _because(by_method[method]))
    return None


def _because(stored: StoredModel) -> str:
    method, told = stored.model.method, stored.model.diagnostics
    if method == PREFERENCE[0]:
        reason = told.get("chosen_because") or "it tells scatter between grasps, between places and within apart"
        checked = told.get("check")
        return f"{method}: {reason}" + (f"; {checked}" if checked else "")
    return f"{method}: the material has no {PREFERENCE[0]} model yet; ask for a fit by {AUTO}"
