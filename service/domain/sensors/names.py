"""Names of sensors: which may be given, and which of them say nothing of where a log comes from."""

from sqlalchemy.orm import Session

from db.repositories import sensors
from service.domain.errors import InvalidValue
from slipcore.frames import UNNAMED

NAMELESS = (UNNAMED, "stream")
"""Sensors of logs and streams that name none: any sensor's may be among them."""

CALIBRATIONS = "/calibrations"
"""What follows a sensor's name where its calibrations are asked for."""


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
