"""What is known of sensors: the mechanics of their gels, from which forces are reconstructed."""

from dataclasses import asdict

from db.records import Gel, Sensor
from db.repositories import sensors
from service.domain import quotas
from service.domain.changes import record
from service.domain.context import Context
from service.domain.errors import InsufficientScope
from service.domain.principal import Principal


def find(context: Context, name: str) -> Sensor:
    """One sensor; raises ``NotFound``."""
    with context.database.read() as session:
        return sensors.get(session, name)


def describe(context: Context, name: str, gel: Gel, principal: Principal) -> Sensor:
    """Store the mechanics of a sensor's gel: forces of logs that come in from then on follow from it.

    All keys' logs of that sensor do: whoever may upload may describe it once, and only admins otherwise. Raises
    ``InsufficientScope``, and ``QuotaExceeded`` for a key that has changed as much as it may.
    """
    with context.database.write() as session:
        known = sensors.hold(session, name)
        if known.gel == gel:
            return known
        if known.gel is not None and not principal.is_admin:
            raise InsufficientScope("upload", "admin")
        quotas.check_change(session, context.settings, principal.key_id)
        record(session, principal, "sensor.described", name, asdict(gel))
        return sensors.describe(session, name, gel)
