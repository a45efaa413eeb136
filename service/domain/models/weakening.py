"""Which log did it where a planner may count on much less friction than by the model before."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from db.records import NewModel
from estimators import FrictionModel, Moments, ScatterPrior, WorkingPoint
from estimators.defaults import INFLUENCE
from estimators.influence import Influence, counted_on, most_lowering
from service.domain.models.stored_results import to_friction_model
from stiction_client.support import WEAKENING

LOG, EFFECT, BEFORE, SENSOR = "weakened_by", "weakened_by_effect", "weakened_from", "weakened_sensor"
"""Diagnostics of a model that a log weakened: its id, by which part its friction differs, what was counted on, and the
sensor whose friction fell alone.
"""


def with_weakening(
    models: Sequence[FrictionModel],
    before: Mapping[str, NewModel],
    logs: Mapping[str, Moments],
    prior: ScatterPrior,
) -> list[FrictionModel]:
    """The models, those marked by which a planner may count on less than ``before`` by more than a twentieth.

    The mark names the log, of the ``logs`` by id and oldest first, without which most of that is undone. It stays while
    this is so. What holds of a planner with any sensor is asked first, then of one with each known sensor alone. Only
    models that separate scatter between grasps are compared, and not with one of a single sensor where
    there are several since: that is what weakens it, and its own note says so (``sensor_gain``).
    """
    return [_marked(model, before.get(model.method), logs, prior) for model in models]


def _marked(
    model: FrictionModel, before: NewModel | None, logs: Mapping[str, Moments], prior: ScatterPrior
) -> FrictionModel:
    if model.scales is None or before is None or len(logs) < 2 or _is_first_of_several_sensors(model, before):
        return model
    earlier, at = to_friction_model(before), _middle(model, before)
    known = model.scales.between_sensors
    for sensor in (None, *([] if known is None else known.sensors)):
        friction, expected = counted_on(model, at, sensor), _expected(earlier, before, model, at, sensor, logs)
        if not _falls(model, at, sensor, expected):
            continue
        found = most_lowering(model, list(logs.values()), at, prior, sensor)
        if found is None or found.without - found.friction < INFLUENCE.undone * (expected - friction):
            continue
        log = list(logs)[found.place]
        marks: dict[str, float | str] = {
            LOG: log,
            EFFECT: found.effect,
            BEFORE: expected,
            WEAKENING: _sentence(log, found, at, expected, sensor),
        }
        of_it = {} if sensor is None else {SENSOR: sensor}
        return replace(model, diagnostics={**model.diagnostics, **marks, **of_it})
    return model


def _middle(model: FrictionModel, before: NewModel) -> WorkingPoint:
    """The middle of the forces before, on an element of the model."""
    return WorkingPoint(0.5 * sum(before.normal_force) * model.element_area / before.element_area)


def _expected(
    earlier: FrictionModel,
    before: NewModel,
    model: FrictionModel,
    at: WorkingPoint,
    sensor: str | None,
    logs: Mapping[str, Moments],
) -> float:
    """What a planner with this sensor counted on before, or before the log came that may weaken the model still.

    Of a sensor that the model before did not know there is nothing to compare with: 0.
    """
    diagnostics, known = before.diagnostics, None if earlier.scales is None else earlier.scales.between_sensors
    if sensor is not None and (known is None or sensor not in known.sensors):
        return 0.0
    force = at.normal_force * earlier.element_area / model.element_area
    expected = counted_on(earlier, replace(at, normal_force=force), sensor)
    if diagnostics.get(LOG) in logs and diagnostics.get(SENSOR) == sensor and not _falls(model, at, sensor, expected):
        return float(diagnostics.get(BEFORE) or 0.0)
    return expected


def _falls(model: FrictionModel, at: WorkingPoint, sensor: str | None, expected: float) -> bool:
    return counted_on(model, at, sensor) < (1.0 - INFLUENCE.fall) * expected


def _is_first_of_several_sensors(model: FrictionModel, before: NewModel) -> bool:
    several = model.scales is not None and model.scales.between_sensors is not None
    return several and (before.scales is None or before.scales.between_sensors is None)


def _sentence(log: str, found: Influence, at: WorkingPoint, expected: float, sensor: str | None) -> str:
    way = "less" if found.effect < 0.0 else "more"
    left = f"{found.friction:.2g}" if found.friction > 0.0 else "none"
    who = "a planner" if sensor is None else f"a planner with the sensor {sensor!r}"
    return (
        f"by log {log}, of {abs(found.effect):.0%} {way} friction than the material's, {who} may count on {left} "
        f"at a slip probability of {at.quantile:g}, on {found.without:.2g} without it ({expected:.2g} before): look at "
        "it, and withdraw it if something was wrong; if not, record more grasps"
    )
