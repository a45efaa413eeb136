"""Answer what to record next of a material."""

from dataclasses import asdict, dataclass

import estimators
from db.records import StoredModel
from estimators.defaults import DESIGN
from estimators.errors import InvalidSamples
from service.domain.errors import InvalidValue
from service.domain.models.stored_results import to_friction_model
from stiction_client.support import OUTDATED, Kind


@dataclass(frozen=True, slots=True)
class RecordNext:
    """The grasp to record; see ``estimators.next_grasp``. ``support`` and ``advice`` are of the friction known now,
    ``notes`` what else is to be known of the model.
    """

    material: str
    method: str
    version: int
    normal_force: float
    slip_length: float
    speed: float
    direction: float
    seconds: float
    uncertainty: float
    after: float
    conservative_friction: float
    beyond: str | None
    support: Kind
    advice: str
    notes: tuple[str, ...]


def record_next(
    stored: StoredModel,
    normal_force: float | None,
    tangential_velocity: float,
    quantile: float = DESIGN.quantile,
    elements: int = DESIGN.elements,
    load: float = 0.0,
    drop_probability: float = DESIGN.drop_probability,
    sensor: str | None = None,
) -> RecordNext:
    """The grasp that most narrows a material's friction where a planner asks for it; raises ``InvalidValue``.

    Without a ``normal_force`` in the middle of the data; as the ``sensor`` shows it, where one is named.
    """
    model = to_friction_model(stored.model)
    model = model if sensor is None else model.on_sensor(sensor)
    force = 0.5 * sum(model.domain.normal_force) if normal_force is None else normal_force
    recorded = model.diagnostics.get("clusters", 1.0) if model.diagnostics.get("cluster_kind") == "grasp" else 1.0
    try:
        asked = estimators.WorkingPoint(force, tangential_velocity, quantile, elements)
        probing = estimators.Probing(load=load, drop_probability=drop_probability)
        found = estimators.next_grasp(model, asked, probing, int(float(recorded)))
    except InvalidSamples as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
    stale = OUTDATED if stored.outdated else None
    support = model.support_at(tangential_velocity, force, stale)
    return RecordNext(
        stored.material,
        stored.model.method,
        stored.version,
        **asdict(found),
        support=support.kind,
        advice=support.advice,
        notes=model.notes,
    )
