"""Which of a material's current models answers who names no method, and why."""

from collections.abc import Iterable
from typing import NamedTuple

from db.records import StoredModel
from service.domain.models.stored_results import to_friction_model
from stiction_client.support import disagreement

AUTO = "auto"
"""In place of a method's name: the recommended model."""

PREFERENCE = ("hierarchical", "bayes", "ols", "robust")
"""From the one that separates grasps to those whose errors only allow for that. An exact conjugate posterior takes
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
    method, diagnostics = stored.model.method, stored.model.diagnostics
    if method == PREFERENCE[0]:
        reason = diagnostics.get("chosen_because") or "it separates scatter between grasps, between places and within"
        parts = (reason, diagnostics.get("check"), diagnostics.get("scatter_prior"))
        return f"{method}: {'; '.join(str(part) for part in parts if part)}"
    return f"{method}: the material has no {PREFERENCE[0]} model yet; ask for a fit by {AUTO}"


def disagreeing(stored: StoredModel, others: Iterable[StoredModel]) -> str | None:
    """In a sentence, which models of the same logs expect another friction than the ``stored`` one, if any does."""
    of_the_same = {
        other.model.method: to_friction_model(other.model)
        for other in others
        if other.model.method in PREFERENCE and other.id != stored.id and not other.outdated
    }
    if stored.outdated or not of_the_same:
        return None
    return disagreement(stored.model.method, to_friction_model(stored.model), of_the_same)
