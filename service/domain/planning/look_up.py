"""Answer a planner: the friction coefficient of a material where it is to be held."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from service.domain.models.model_cache import KnownModel
from stiction_client.support import OUTDATED, Kind

Averaged = Literal["element", "contact"]
"""Whose friction is asked for: the scatter of a contact's elements averages out."""


@dataclass(frozen=True, slots=True)
class FrictionQuery:
    """Tangential velocity m/s, normal force of an element N, and a quantile in (0, 1) or None for the mean.

    ``of``: one "element", or the mean over the ``elements`` of a "contact". ``sensor``: the name of that which grasps;
    of one whose own gain the model does not know, and without any, the answer allows for any gain. ``element_area``:
    m² of the element that bears the force; where None, the sensor's own or, without any, the model's.
    """

    tangential_velocity: float
    normal_force: float
    quantile: float | None
    of: Averaged = "element"
    elements: int = 1
    sensor: str | None = None
    element_area: float | None = None


class Friction(NamedTuple):
    """Friction coefficient of a material at a tangential velocity m/s and a normal force N of an element of an area m².

    ``friction_coefficient``: the quantile that was asked for, or the mean, at least 0; ``mean``: of the linear law,
    which may fall below 0 far outside of the data; ``within_domain``: the samples reach there; ``support`` and
    ``advice``: what the answer rests on, and what to do about it; ``notes``: what else is to be known of the model.
    """

    material: str
    method: str
    version: int
    tangential_velocity: float
    normal_force: float
    quantile: float | None
    of: Averaged
    elements: int
    friction_coefficient: float
    mean: float
    within_domain: bool
    chosen_because: str | None
    warning: str | None
    support: Kind
    advice: str
    notes: tuple[str, ...]
    element_area: float


def look_up(known: KnownModel, question: FrictionQuery) -> Friction:
    """The answer of a material's current model."""
    stored = known.stored
    v, f_n = question.tangential_velocity, question.normal_force
    model = known.model if question.sensor is None else known.model.on_sensor(question.sensor)
    model = model if question.element_area is None else model.at_element_area(question.element_area)
    mean = float(model.predict(v, f_n))
    asked = (
        mean
        if question.quantile is None
        else float(model.predict(v, f_n, question.quantile, question.of, question.elements))
    )
    outside = model.extrapolation(v, f_n)
    support = model.support_at(v, f_n, OUTDATED if stored.outdated else None)
    outdated = f"the model is outdated: {OUTDATED}" if stored.outdated and support.kind != "stale" else None
    is_unknown = asked <= 0.0 < mean  # of a mean that is not above 0 either, support speaks
    nothing = "the answer is not above 0: nothing is known of the friction there" if is_unknown else None
    return Friction(
        material=stored.material,
        method=stored.model.method,
        version=stored.version,
        tangential_velocity=v,
        normal_force=f_n,
        quantile=question.quantile,
        of=question.of,
        elements=question.elements,
        friction_coefficient=max(asked, 0.0),
        mean=mean,
        within_domain=outside is None,
        chosen_because=known.because,
        warning=support.warning(outside, nothing, known.disagreement, outdated),
        support=support.kind,
        advice=support.advice,
        notes=model.notes,
        element_area=model.element_area,
    )
