"""Which topic, field or column of a file becomes which member of a grasp log, in which unit (docs/formats.md)."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from service.formats import presets
from service.formats import rest as rests
from service.formats.json_text import parse_object
from service.formats.members import DTYPES, MARKS, ONCE
from slipcore.errors import InvalidInput

MAX_MAPPING_BYTES = 64 * 1024
"""Bytes of a mapping's JSON: enough for the rest positions of 30 × 30 markers given as a value."""

LENGTH = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
ANGLE = {"rad": 1.0, "deg": math.pi / 180.0}
FORCE = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6}
UNITS: dict[str, Mapping[str, float]] = {
    "time": TIME,
    "position": LENGTH,
    "displacement": LENGTH,
    "element_area": {"m²": 1.0, "m2": 1.0, "mm²": 1e-6, "mm2": 1e-6},
    "force": FORCE,
    "gripper_force": FORCE,
    "gripper_force_deviation": FORCE,
    "height": LENGTH,
}
"""Factors to SI of what may be given otherwise."""
COMPONENTS = {
    "object_pose": (LENGTH, LENGTH, ANGLE),
    **{name: (UNITS[name],) * 3 for name in ("position", "displacement", "force")},
    "height": (LENGTH,),
}
"""Those of what may have a unit a component; one that begins with a minus turns that axis."""

PRESSURE_ALONE = (
    "three components of force an element, or displacement of markers: pressure alone has no tangential force, "
    "from which neither slip nor friction can be found. Record a sensor of shear beside it, or the displacement of "
    "markers in its skin"
)
"""What is asked of an array of pressures."""
LARGEST = 1e300
"""Of any number: a whole one may have more digits than a float can hold."""

PIXELS = (1e-9, 0.1)
"""m, of which a pixel of a map of height may be wide; sensors' are 10 to 100 µm."""

_ORIGIN_KEYS = {"field", "topic", "unit", "value"}
_ALLOWED_ORIGIN = "a field, a list of fields, or an object of field or value, topic and unit"
MAPPED = (*DTYPES, "height")
"""What a mapping may name: the members of a log, and maps of height, of which its displacement along z is made."""
_SETTINGS = ("topic", "grid", "pitch", "pixel", "pixels", "tolerance", "episode", "element", "rest", "notes")


@dataclass(frozen=True, slots=True)
class Origin:
    """Where one member comes from: the ``fields`` of a topic (several are stacked as components), or a ``value``.

    ``factors`` bring it, or its components, to SI; None where it is in SI. ``explicit`` origins must be there.
    """

    fields: tuple[str, ...] = ()
    topic: str | None = None
    factors: tuple[float, ...] | None = None
    value: Any = None
    explicit: bool = True

    def __str__(self) -> str:
        named = ", ".join(self.fields)
        return f"{named} of {self.topic}" if self.topic else named


@dataclass(frozen=True, slots=True)
class FieldMapping:
    """Origin of each member, and what the file may lack: lattice, pitch (m), the side of a height map's ``pixel`` (m),
    rows and columns of its ``pixels``, tolerance (s), episode, and the column that numbers the elements where a table
    has a row for each, and the frame or file at ``rest``, whose displacement is 0.

    ``text`` is the mapping as it was given, empty where none was. ``notes`` are fields kept in the metadata, by
    name. A ``preset`` may have ``alternatives``, of which the first whose fields are there is taken.
    """

    origins: Mapping[str, Origin]
    grid: tuple[int, int] | None = None
    pitch: float | None = None
    pixel: float | None = None
    pixels: tuple[int, int] | None = None
    tolerance: float | None = None
    episode: int | None = None
    element: str | None = None
    rest: str | rests.SensorAlone | None = None
    text: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    alternatives: "tuple[FieldMapping, ...]" = ()
    preset: bool = False

    @property
    def particular_entries(self) -> dict[str, object]:
        """What of it not every format has a use for, by name, where it is given."""
        topic = next((origin.topic for origin in self.origins.values() if origin.topic is not None), None)
        entries = {"notes": self.notes or None, "element": self.element, "episode": self.episode, "topic": topic}
        return {name: value for name, value in entries.items() if value is not None}

    @property
    def is_of_places(self) -> bool:
        """Whether displacement and position are the same fields: these are places of the markers then."""
        moved, at = (self.origins.get(name, Origin()) for name in ("displacement", "position"))
        return (moved.topic, moved.fields) == (at.topic, at.fields) and moved.fields != ()

    def at_rest(self, rest: str | rests.SensorAlone | None) -> "FieldMapping":
        """This mapping, in each of its alternatives, with another frame or file at rest, unless that is None."""
        if rest is None:
            return self
        return replace(self, rest=rest, alternatives=tuple(replace(each, rest=rest) for each in self.alternatives))

    def over(self, defaults: Mapping[str, Origin]) -> "FieldMapping":
        """This mapping with ``defaults`` for the members that it does not name."""
        return replace(self, origins={**defaults, **self.origins})


UNMAPPED = FieldMapping({})


def chosen_over(given: FieldMapping | None, own: FieldMapping | None) -> FieldMapping:
    """The mapping that was ``given``, or a file's ``own`` where none was, with the frame at rest that was given."""
    if given is not None and given.text:
        return given
    return (own or UNMAPPED).at_rest(None if given is None else given.rest)


def parse(text: str) -> FieldMapping:
    """A mapping from its JSON, or from a preset's name; raises ``InvalidInput`` naming the entry that is wrong."""
    if len(text.encode(errors="replace")) > MAX_MAPPING_BYTES:
        raise InvalidInput("mapping", f"{len(text)} characters", f"at most {MAX_MAPPING_BYTES} bytes")
    if text.strip() in presets.PRESETS:
        text = json.dumps({"preset": text.strip()})
    given = parse_object("mapping", text, f"a JSON object, or {' or '.join(presets.PRESETS)}")
    first, *others = [_parsed(each, given) for each in presets.alternatives(given)]
    return replace(first, alternatives=tuple(others))


def _parsed(given: Mapping[str, Any], original: Mapping[str, Any]) -> FieldMapping:
    """The mapping that is ``given``, which may have been made of an ``original`` that names a preset."""
    unknown = sorted(given.keys() - {*MAPPED, *_SETTINGS})
    if "pressure" in unknown:
        raise InvalidInput("pressure", "mapped", PRESSURE_ALONE)
    if unknown:
        raise InvalidInput("mapping", f"of the unknown {unknown[0][:60]!r}", ", ".join((*MAPPED, *_SETTINGS)))
    topic = _text("topic", given["topic"]) if "topic" in given else None
    origins = {name: _origin(name, given[name], topic) for name in MAPPED if name in given}
    return FieldMapping(
        origins={name: _required(name, original, origin) for name, origin in origins.items()},
        grid=_grid("grid", given["grid"], "markers") if "grid" in given else None,
        pitch=_positive("pitch", given["pitch"]) if "pitch" in given else None,
        pixel=_pixel(given["pixel"]) if "pixel" in given else None,
        pixels=_grid("pixels", given["pixels"], "pixels") if "pixels" in given else None,
        tolerance=_positive("tolerance", given["tolerance"]) if "tolerance" in given else None,
        episode=_episode(given["episode"]) if "episode" in given else None,
        element=_text("element", given["element"]) if "element" in given else None,
        rest=rests.check(str(given["rest"])) if "rest" in given else None,
        text=json.dumps(original, sort_keys=True, ensure_ascii=False),
        notes=_notes(given["notes"]) if "notes" in given else {},
        preset="preset" in original,
    )


def _required(name: str, original: Mapping[str, Any], origin: Origin) -> Origin:
    """An origin that must be there, unless a preset alone names the contact: not all firmware reports it."""
    return replace(origin, explicit=name != "contact" or "preset" not in original or name in original)


def _notes(given: Any) -> dict[str, str]:
    if not isinstance(given, dict) or len(given) > 100:
        raise InvalidInput("notes", repr(given)[:60], "an object of names and fields, 100 at most")
    taken = given.keys() & MARKS
    if taken:
        raise InvalidInput("notes", f"of the name {min(taken)!r}", f"names other than {', '.join(MARKS)}")
    return {_text("notes", name): _text(f"notes, {name[:60]}", each) for name, each in given.items()}


def default_origins(frame_topic: str | None = None, once_topic: str | None = None) -> dict[str, Origin]:
    """Each member under its own name, in SI; in messages, those of a frame and those of the log in a topic each."""
    return {name: Origin((name,), once_topic if name in ONCE else frame_topic, explicit=False) for name in DTYPES}


def _origin(name: str, given: Any, topic: str | None) -> Origin:
    entry = given if isinstance(given, dict) else {"field": given}
    if not entry or entry.keys() - _ORIGIN_KEYS or ("value" in entry) == ("field" in entry):
        raise InvalidInput(f"mapping of {name}", repr(given)[:60], _ALLOWED_ORIGIN)
    factors = _factors(name, entry["unit"]) if "unit" in entry else None
    if "value" in entry:
        if entry["value"] is None:
            raise InvalidInput(f"mapping of {name}", "a value of null", "a value, or no mapping of this member")
        return Origin(value=entry["value"], factors=factors)
    fields = entry["field"] if isinstance(entry["field"], list) else [entry["field"]]
    if not fields or len(fields) > 10_000:
        raise InvalidInput(f"mapping of {name}", f"{len(fields)} fields", "1 to 10000 fields")
    chosen = _text(f"topic of {name}", entry["topic"]) if "topic" in entry else topic
    return Origin(tuple(_text(f"mapping of {name}", field) for field in fields), chosen, factors)


def _factors(name: str, unit: Any) -> tuple[float, ...]:
    kinds = COMPONENTS.get(name, ())
    if isinstance(unit, list) or name == "object_pose":
        if not isinstance(unit, list) or len(unit) != len(kinds):
            allowed = 'one a component, such as ["mm", "mm", "deg"]' if kinds else "one unit"
            raise InvalidInput(f"unit of {name}", repr(unit)[:60], allowed)
        return tuple(_factor(name, part, kind, may_turn=True) for part, kind in zip(unit, kinds, strict=True))
    return (_factor(name, unit, UNITS.get(name, {}), may_turn=bool(kinds)),)


def _factor(name: str, unit: Any, units: Mapping[str, float], *, may_turn: bool) -> float:
    turns = may_turn and isinstance(unit, str) and unit.startswith("-")
    plain = unit[1:] if turns else unit
    if not isinstance(plain, str) or plain not in units:
        raise InvalidInput(f"unit of {name}", repr(unit)[:60], ", ".join(units) or "none: it has no unit")
    return -units[plain] if turns else units[plain]


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= 500:
        raise InvalidInput(name, repr(value)[:60], "a text of 1 to 500 characters")
    return value


def _grid(name: str, value: Any, of: str) -> tuple[int, int]:
    sides = value if isinstance(value, list) else []
    if len(sides) != 2 or not all(type(side) is int and 1 <= side <= 10_000 for side in sides):
        raise InvalidInput(name, repr(value)[:60], f"two whole numbers of {of}, 1 to 10000")
    return sides[0], sides[1]


def _positive(name: str, value: Any) -> float:
    if type(value) not in (int, float) or not 0.0 < value <= LARGEST:
        raise InvalidInput(name, repr(value)[:60], "a number above 0")
    return float(value)


def _pixel(value: Any) -> float:
    if _positive("pixel", value) < PIXELS[0] or value > PIXELS[1]:
        raise InvalidInput("pixel", f"{value:g} m", f"{PIXELS[0]:g} to {PIXELS[1]:g} m (is it in m?)")
    return float(value)


def _episode(value: Any) -> int:
    if type(value) is not int or not 0 <= value < 2**63:
        raise InvalidInput("episode", repr(value)[:60], "a whole number, at least 0")
    return value
