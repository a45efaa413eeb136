"""Mappings of vendors' tables by name (docs/formats.md): from public documentation and loggers, not from the vendors.

A preset has alternatives, for the same array is logged under several names; the first whose columns are there is taken.
``{array}`` is the number of the sensor where a table has several, ``{again}`` what its repeated names end in.
"""

import re
from collections.abc import Callable, Collection, Mapping
from typing import Any

from slipcore.errors import InvalidInput

AXES = "XYZ"
PRESSED = ["N", "N", "-N"]
"""Sensors of vendors give pressure as positive; here z points outwards."""


def papillarray(array: int) -> list[dict[str, Any]]:
    """Contactile's PapillArray: nine pillars, mm and N, in the names of its logger, its ROS message, and recorders."""
    again = f".{array}" if array else ""

    def named(pattern: str, contact: str, time: Any, notes: dict[str, str]) -> dict[str, Any]:
        return {
            "grid": [3, 3],
            "pitch": 7e-3,
            "time": time,
            "displacement": {"field": [pattern.format("d" + axis) for axis in AXES], "unit": "mm"},
            "force": {"field": [pattern.format("f" + axis) for axis in AXES], "unit": PRESSED},
            "contact": contact,
            "notes": notes,
        }

    logger = named("P*_{}" + again, "P*_isInContact" + again, {"field": "T_us", "unit": "us"}, {})
    logger |= {
        "displacement": {"field": [f"P*_D{axis}{again}" for axis in AXES], "unit": "mm"},
        "force": {"field": [f"P*_F{axis}{again}" for axis in AXES], "unit": PRESSED},
        "notes": {"slip_state": f"P*_slipState{again}", "friction_est": f"FrictionEst{again}"},
    }
    message = named(
        "field.pillars*.{}",
        "field.pillars*.in_contact",
        {"field": "field.tus", "unit": "us"},
        {"slip_state": "field.pillars*.slip_state", "friction_est": "field.friction_est"},
    )
    notes = {"slip_state": f"{array}_slipstate_*", "friction_est": f"{array}_friction_est"}
    return [logger, message, named(f"{array}_{{}}_*", f"{array}_incontact_*", "timestamp", notes)]


def uskin(array: int) -> list[dict[str, Any]]:
    """XELA's uSkin: calibrated forces in N and no displacement, in the names of its server's ROS message."""
    field = [f"field.sensors{array}.forces*.{axis}" for axis in "xyz"]
    force = {"field": field, "unit": PRESSED}
    return [{"grid": [4, 4], "pitch": 4.7e-3, "time": {"field": "%time", "unit": "ns"}, "force": force}]


PRESETS: Mapping[str, Callable[[int], list[dict[str, Any]]]] = {"papillarray": papillarray, "uskin": uskin}


def alternatives(given: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The mappings that a given one stands for: its preset's, each with what else it says, or itself."""
    if "preset" not in given:
        return [dict(given)]
    name, array = given["preset"], given.get("array", 0)
    if not isinstance(name, str) or name not in PRESETS:
        raise InvalidInput("preset", repr(name)[:60], ", ".join(PRESETS))
    if type(array) is not int or not 0 <= array < 100:
        raise InvalidInput("array", repr(array)[:60], "0 to 99, the number of a sensor in the table")
    chosen = {key: value for key, value in given.items() if key not in ("preset", "array")}
    return [{**each, **chosen} for each in PRESETS[name](array)]


def instead(names: Collection[str], otherwise: str) -> str:
    """What is allowed of a table with columns of these ``names`` that no mapping explains: the preset whose forces they
    are, where there is one, or else what is allowed ``otherwise``.
    """
    for preset, made in PRESETS.items():
        patterns = ([_numbered(field) for field in each["force"]["field"]] for each in made(0))
        if any(all(any(map(pattern.fullmatch, names)) for pattern in of_forces) for of_forces in patterns):
            return f"mapping {preset}, which reads such columns, or {otherwise}"
    return otherwise


def _numbered(field: str) -> re.Pattern[str]:
    """Names of a field with a number for its ``*``, in either case."""
    return re.compile(re.escape(field).replace(r"\*", r"\d{1,6}"), re.ASCII | re.IGNORECASE)
