"""What is known of sensors: the mechanics of their gels, from which forces are reconstructed."""

import math
from dataclasses import asdict

from db.records import Gel, Sensor
from db.repositories import sensors
from service.domain.access import quotas
from service.domain.access.changes import record
from service.domain.access.principal import Principal
from service.domain.errors import InsufficientScope, InvalidValue
from service.domain.resources.context import Context
from service.domain.sensors.names import check_name, check_spelling
from slipcore.errors import InvalidInput


def find(context: Context, name: str) -> Sensor:
    """One sensor; raises ``NotFound``."""
    with context.database.read() as session:
        return sensors.get(session, name)


def describe(context: Context, name: str, gel: Gel, principal: Principal) -> Sensor:
    """Store the mechanics of a sensor's gel: forces of logs that come in from then on follow from it.

    All keys' logs of that sensor do, and say so where it was neither theirs nor an admin's (``described_by_another``):
    whoever may upload may describe it once, and only admins otherwise; one who says the same vouches for it. Raises
    ``InvalidValue``, also for a gel that is too thin for the sensor's markers where their distance is known,
    ``InsufficientScope``, and ``QuotaExceeded`` for a key that has changed as much as it may.
    """
    check_name(name)
    with context.database.write() as session:
        check_spelling(session, name)
        known = sensors.hold(session, name)
        vouches = principal.is_admin and known.described_by is not None
        if known.gel == gel and not vouches:
            return known
        if known.gel is not None and not principal.is_admin:
            raise InsufficientScope("upload", "admin")
        _check_beside(gel, sensors.element_area(session, known.id))
        quotas.check_change(session, context.settings, principal.key_id)
        record(session, principal, "sensor.described", name, asdict(gel))
        return sensors.describe(session, name, gel, None if principal.is_admin else principal.key_id)


def _check_beside(gel: Gel, element_area: float | None) -> None:
    """Raises ``InvalidValue`` where the gel is too thin for elements of this area, m²; None: the area is not known."""
    if element_area is None:
        return
    from slipcore.forces import Gel as Mechanics  # which loads numerics

    try:
        Mechanics.from_json(asdict(gel)).check_beside(math.sqrt(element_area))
    except InvalidInput as error:
        raise InvalidValue(error.name, error.value, error.allowed) from error
