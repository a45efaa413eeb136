"""What is known of sensors: the mechanics of their gels, from which forces are reconstructed."""

from dataclasses import asdict

from sqlalchemy.orm import Session

from db.records import Gel, Sensor
from db.repositories import sensors
from service.domain import quotas
from service.domain.changes import record
from service.domain.context import Context
from service.domain.errors import InsufficientScope, InvalidValue
from service.domain.principal import Principal
from slipcore.frames import UNNAMED

NAMELESS = (UNNAMED, "stream")
"""Sensors of logs and streams that name none: any sensor's may be among them."""

CALIBRATIONS = "/calibrations"
"""What follows a sensor's name where its calibrations are asked for."""


def find(context: Context, name: str) -> Sensor:
    """One sensor; raises ``NotFound``."""
    with context.database.read() as session:
        return sensors.get(session, name)


def describe(context: Context, name: str, gel: Gel, principal: Principal) -> Sensor:
    """Store the mechanics of a sensor's gel: forces of logs that come in from then on follow from it.

    All keys' logs of that sensor do, and say so where it was neither theirs nor an admin's (``described_by_another``):
    whoever may upload may describe it once, and only admins otherwise; one who says the same vouches for it. Raises
    ``InvalidValue``, ``InsufficientScope``, and ``QuotaExceeded`` for a key that has changed as much as it may.
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
        quotas.check_change(session, context.settings, principal.key_id)
        record(session, principal, "sensor.described", name, asdict(gel))
        return sensors.describe(session, name, gel, None if principal.is_admin else principal.key_id)


def grasping(name: str) -> str:
    """The sensor that a log counts as in its material's fit: without a name all are one, however they came."""
    return UNNAMED if name in NAMELESS else name


def as_found(session: Session, name: str) -> str:
    """The sensor that a log names itself: without spaces at its ends, which nobody sees, unless it is stored so."""
    if name == name.strip() or sensors.find(session, name) is not None:
        return name
    return name.strip() or UNNAMED


def check_spelling(session: Session, name: str) -> None:
    """Raises ``InvalidValue`` for a new name with spaces at its ends or what cannot be printed: two would seem one."""
    if as_found(session, name) != name:
        raise InvalidValue("sensor", repr(name), "a name without spaces at its ends")
    if not name.isprintable() and sensors.find(session, name) is None:
        raise InvalidValue("sensor", repr(name), "printable characters, as uploads have them")


def check_name(name: str) -> None:
    """Raises ``InvalidValue`` for a name of which not one sensor alone can be described or calibrated."""
    if name in NAMELESS:
        allowed = (
            "a name of one sensor, which its uploads and streams give by `sensor`; logs without one share this name"
        )
        raise InvalidValue("sensor", repr(name), allowed)
    if name.endswith(CALIBRATIONS) or f"{CALIBRATIONS}/" in name:
        raise InvalidValue("sensor", repr(name), f"a name without {CALIBRATIONS}, where calibrations are found")
