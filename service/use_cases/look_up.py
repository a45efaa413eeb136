"""Answer a planner: the friction coefficient of a material where it is to be held."""

from dataclasses import dataclass

from db.records import StoredModel
from db.repositories import friction_models, materials
from service.context import Context
from service.problems import NO_MODEL, Problem
from service.schemas import FrictionOut
from service.stored_results import to_friction_model


@dataclass(frozen=True, slots=True)
class Question:
    """Tangential velocity m/s, normal force of an element N, and a quantile in (0, 1) or None for the mean."""

    tangential_velocity: float
    normal_force: float
    quantile: float | None


def look_up(context: Context, material: str, method: str, question: Question) -> FrictionOut:
    """The answer of the material's current model; raises ``NotFound``, and ``Problem`` where no model is fitted."""
    with context.database.read() as session:
        stored = friction_models.current(session, material, method)
        if stored is None:
            materials.find_id(session, material)
            detail = f"material {material!r} has no model fitted by {method!r} yet"
            raise Problem(NO_MODEL, detail, name="method", value=method, allowed="a method that was fitted")
    return _answer(stored, question)


def _answer(stored: StoredModel, question: Question) -> FrictionOut:
    v, f_n = question.tangential_velocity, question.normal_force
    model = to_friction_model(stored.model)
    mean = float(model.predict(v, f_n))
    asked = mean if question.quantile is None else float(model.predict(v, f_n, quantile=question.quantile))
    outside = model.extrapolation(v, f_n)
    outdated = "a log behind the model was withdrawn, and the fit without it is not there" if stored.outdated else None
    nothing = "the answer is not above 0: nothing is known of the friction there" if asked <= 0.0 else None
    return FrictionOut(
        material=stored.material,
        method=stored.model.method,
        version=stored.version,
        tangential_velocity=v,
        normal_force=f_n,
        quantile=question.quantile,
        friction_coefficient=asked,
        mean=mean,
        within_domain=outside is None,
        warning="; ".join(filter(None, (outside, nothing, outdated))) or None,
    )
