"""Which log did it where a planner may count on much less friction than by the model before."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from db.records import NewModel
from estimators import FrictionModel, Moments, ScatterPrior, WorkingPoint
from estimators.defaults import INFLUENCE
from estimators.influence import Influence, counted_on, most_lowering
from service.domain.stored_results import to_friction_model
from stiction_client.support import WEAKENING

LOG, EFFECT, BEFORE = "weakened_by", "weakened_by_effect", "weakened_from"
"""Diagnostics of a model that a log weakened: its id, by which part its friction differs, and what was counted on."""


def with_weakening(
    models: Sequence[FrictionModel],
    before: Mapping[str, NewModel],
    logs: Mapping[str, Moments],
    prior: ScatterPrior,
) -> list[FrictionModel]:
    """The models, those marked by which a planner may count on less than ``before`` by more than a twentieth.

    The mark names the log, of the ``logs`` by id and oldest first, without which most of that is undone. It stays while
    this is so. Only models that separate scatter between grasps are compared, and not with one of a single sensor where
    there are several since: that is what weakens it, and its own note says so (``sensor_gain``).
    """
    return [_marked(model, before.get(model.method), logs, prior) for model in models]


def _marked(
    model: FrictionModel, before: NewModel | None, logs: Mapping[str, Moments], prior: ScatterPrior
) -> FrictionModel:
    if model.scales is None or before is None or len(logs) < 2 or _is_first_of_several_sensors(model, before):
        return model
    area = model.element_area / before.element_area
    at = WorkingPoint(0.5 * sum(before.normal_force) * area)
    friction = counted_on(model, at)
    expected = counted_on(to_friction_model(before), replace(at, normal_force=at.normal_force / area))
    if not friction < (1.0 - INFLUENCE.fall) * expected and before.diagnostics.get(LOG) in logs:
        expected = float(before.diagnostics.get(BEFORE) or 0.0)  # before the log came that may weaken the model still
    if not friction < (1.0 - INFLUENCE.fall) * expected:
        return model
    found = most_lowering(model, list(logs.values()), at, prior)
    if found is None or found.without - found.friction < INFLUENCE.undone * (expected - friction):
        return model
    log = list(logs)[found.place]
    told: dict[str, float | str] = {
        LOG: log,
        EFFECT: found.effect,
        BEFORE: expected,
        WEAKENING: _sentence(log, found, at, expected),
    }
    return replace(model, diagnostics={**model.diagnostics, **told})


def _is_first_of_several_sensors(model: FrictionModel, before: NewModel) -> bool:
    several = model.scales is not None and model.scales.between_sensors is not None
    return several and (before.scales is None or before.scales.between_sensors is None)


def _sentence(log: str, found: Influence, at: WorkingPoint, expected: float) -> str:
    way = "less" if found.effect < 0.0 else "more"
    left = f"{found.friction:.2g}" if found.friction > 0.0 else "none"
    return (
        f"by log {log}, of {abs(found.effect):.0%} {way} friction than the material's, a planner may count on {left} "
        f"at a slip probability of {at.quantile:g}, on {found.without:.2g} without it ({expected:.2g} before): look at "
        "it, and withdraw it if something was wrong; if not, record more grasps"
    )
