"""What a mapping may say, and what it then means."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from service import formats
from service.formats import assemble, mapping
from service.formats.mapping import Origin, parse
from service.formats.members import MARKS
from slipcore import InvalidInput


def parsed(**entries: Any) -> mapping.FieldMapping:
    return parse(json.dumps(entries))


@pytest.mark.parametrize(
    ("name", "unit", "factor"),
    [
        ("time", "s", 1.0),
        ("time", "ms", 1e-3),
        ("time", "us", 1e-6),
        ("time", "µs", 1e-6),
        ("time", "ns", 1e-9),
        ("position", "m", 1.0),
        ("position", "mm", 1e-3),
        ("displacement", "um", 1e-6),
        ("displacement", "µm", 1e-6),
        ("element_area", "m²", 1.0),
        ("element_area", "m2", 1.0),
        ("element_area", "mm²", 1e-6),
        ("element_area", "mm2", 1e-6),
        ("force", "N", 1.0),
        ("force", "mN", 1e-3),
    ],
)
def test_units_are_brought_to_si(name: str, unit: str, factor: float) -> None:
    found = parsed(**{name: {"field": "x", "unit": unit}}).origins
    assert found == {name: Origin(("x",), factors=(factor,))}


def test_a_pose_has_a_unit_a_component() -> None:
    found = parsed(object_pose={"field": ["x", "y", "yaw"], "unit": ["mm", "m", "deg"]}).origins["object_pose"]
    assert found == Origin(("x", "y", "yaw"), factors=(1e-3, 1.0, math.pi / 180.0))
    in_si = parsed(object_pose={"field": "pose", "unit": ["m", "m", "rad"]}).origins["object_pose"]
    assert in_si.factors == (1.0, 1.0, 1.0)


def test_a_value_needs_no_field_and_may_have_a_unit() -> None:
    assert parsed(element_area={"value": 2.5, "unit": "mm2"}).origins == {
        "element_area": Origin(value=2.5, factors=(1e-6,))
    }


def test_a_topic_of_all_goes_behind_that_of_one() -> None:
    found = parsed(topic="/all", time="t", force={"field": "f", "topic": "/own"}).origins
    assert (found["time"].topic, found["force"].topic) == ("/all", "/own")
    assert (str(found["time"]), str(Origin(("a", "b")))) == ("t of /all", "a, b")


def test_what_a_file_may_not_tell_is_taken_over() -> None:
    found = parsed(grid=[1, 10_000], pitch=2, tolerance=1e-3, episode=0)
    assert (found.grid, found.pitch, found.tolerance, found.episode) == ((1, 10_000), 2.0, 1e-3, 0)
    assert json.loads(found.text) == {"grid": [1, 10_000], "pitch": 2, "tolerance": 1e-3, "episode": 0}
    assert parsed(episode=2**63 - 1).episode == 2**63 - 1


def test_what_is_named_goes_before_what_is_usual() -> None:
    found = parsed(time="clock").over({"time": Origin(("time",)), "force": Origin(("force",))})
    assert {name: origin.fields for name, origin in found.origins.items()} == {"time": ("clock",), "force": ("force",)}


@pytest.mark.parametrize(
    ("entries", "name"),
    [
        ({"grid": [0, 5]}, "grid"),
        ({"grid": [5, 10_001]}, "grid"),
        ({"grid": [5]}, "grid"),
        ({"grid": [5.0, 5]}, "grid"),
        ({"grid": "5x5"}, "grid"),
        ({"pitch": 0}, "pitch"),
        ({"pitch": math.inf}, "pitch"),
        ({"pitch": 10**400}, "pitch"),
        ({"tolerance": 10**400}, "tolerance"),
        ({"pitch": "1"}, "pitch"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"episode": -1}, "episode"),
        ({"episode": 1.0}, "episode"),
        ({"episode": True}, "episode"),
        ({"episode": 2**63}, "episode"),
        ({"topic": ""}, "topic"),
        ({"topic": "x" * 501}, "topic"),
        ({"time": []}, "mapping of time"),
        ({"time": {}}, "mapping of time"),
        ({"time": {"field": "a", "value": 1}}, "mapping of time"),
        ({"time": {"unit": "s"}}, "mapping of time"),
        ({"time": {"value": None}}, "mapping of time"),
        ({"time": {"field": "a", "units": "s"}}, "mapping of time"),
        ({"time": ["a"] * 10_001}, "mapping of time"),
        ({"time": {"field": "a", "unit": "min"}}, "unit of time"),
        ({"normal": {"field": "a", "unit": "m"}}, "unit of normal"),
        ({"object_pose": {"field": "a", "unit": "m"}}, "unit of object_pose"),
        ({"object_pose": {"field": "a", "unit": ["m", "m"]}}, "unit of object_pose"),
        ({"object_pose": {"field": "a", "unit": ["m", "m", "m"]}}, "unit of object_pose"),
        ({"force": {"field": "a", "unit": ["N", "N"]}}, "unit of force"),
        ({"force": {"field": "a", "unit": ["N", "N", 1]}}, "unit of force"),
        ({"force": {"field": "a", "unit": "--N"}}, "unit of force"),
        ({"time": {"field": "a", "unit": "-s"}}, "unit of time"),
        ({"time": {"field": "a", "unit": ["s"]}}, "unit of time"),
        ({"speed": "v"}, "mapping"),
        ({"notes": {"rest": "state"}}, "notes"),
        ({"notes": {"mapping": "state"}}, "notes"),
    ],
)
def test_what_is_wrong_is_named(entries: dict[str, Any], name: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        parsed(**entries)
    assert caught.value.name == name


@pytest.mark.parametrize("text", ["", "[]", "{", "[" * 100_000, '"x"', " " * mapping.MAX_MAPPING_BYTES + "{}"])
def test_what_is_no_object_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="mapping"):
        parse(text)


@pytest.mark.parametrize("text", ['{"pitch": 1, "pitch": 2}', '{"time": {"field": "a", "f\\u0069eld": "b"}}'])
def test_a_key_that_stands_twice_is_refused_by_name(text: str) -> None:
    """The last would count, without a word."""
    with pytest.raises(InvalidInput, match=r"mapping is with the key '(pitch|field)' more than once; allowed: each"):
        parse(text)


def test_a_readers_own_marks_are_named_where_notes_are_checked() -> None:
    """The reader says in the metadata what it did: a noted column of that name would say something else."""
    told = re.findall(r'metadata\["(\w+)"\] =', Path(assemble.__file__).read_text(encoding="utf-8"))
    assert {*told, "mapping"} == set(MARKS)


def test_as_many_fields_and_bytes_as_are_allowed_are_taken() -> None:
    assert len(parsed(topic="x" * 500, time=["a"] * 10_000).origins["time"].fields) == 10_000
    assert parse("{}".ljust(mapping.MAX_MAPPING_BYTES)).origins == {}


@pytest.mark.parametrize(
    ("name", "entry", "value"),
    [
        ("frame table", "topic", "/tactile"),
        ("frame table", "episode", 1),
        ("parquet", "topic", "/tactile"),
        ("hdf5", "notes", {"state": "slip"}),
        ("mcap", "notes", {"state": "slip"}),
        ("json", "element", "taxel"),
        ("rosbag2", "episode", 1),
    ],
)
def test_an_entry_of_another_kind_of_format_is_refused_by_name(name: str, entry: str, value: object) -> None:
    entries = {"displacement": {"field": "moved"}}
    formats.check_settings(name, {"mapping": json.dumps(entries)})
    with pytest.raises(InvalidInput, match=f"mapping {entry} is .* with {name}; allowed: only for"):
        formats.check_settings(name, {"mapping": json.dumps(entries | {entry: value})})
