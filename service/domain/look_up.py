"""Answer a planner: the friction coefficient of a material where it is to be held."""

from dataclasses import dataclass

from service.domain.model_cache import KnownModel
from service.http.schemas.models import Averaged, FrictionOut

OUTDATED = "the model is outdated: the material's logs are others since, and it was not fitted again by this method"


@dataclass(frozen=True, slots=True)
class Question:
    """Tangential velocity m/s, normal force of an element N, and a quantile in (0, 1) or None for the mean.

    ``of``: one "element", or the mean over the ``elements`` of a "contact".
    """

    tangential_velocity: float
    normal_force: float
    quantile: float | None
    of: Averaged = "element"
    elements: int = 1


def look_up(known: KnownModel, question: Question) -> FrictionOut:
    """The answer of a material's current model."""
    v, f_n = question.tangential_velocity, question.normal_force
    stored, model = known.stored, known.model
    mean = float(model.predict(v, f_n))
    asked = float(model.predict(v, f_n, question.quantile, question.of, question.elements))
    outside = model.extrapolation(v, f_n)
    outdated = OUTDATED if stored.outdated else None
    nothing = "the answer is not above 0: nothing is known of the friction there" if asked <= 0.0 else None
    return FrictionOut(
        material=stored.material,
        method=stored.model.method,
        version=stored.version,
        tangential_velocity=v,
        normal_force=f_n,
        quantile=question.quantile,
        of=question.of,
        elements=question.elements,
        friction_coefficient=asked,
        mean=mean,
        within_domain=outside is None,
        chosen_because=known.because,
        warning="; ".join(filter(None, (outside, nothing, outdated))) or None,
    )
