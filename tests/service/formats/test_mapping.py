"""What a mapping may say, and what it then means."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from service import formats
from service.formats import assemble, mapping
from service.formats.mapping import UNMAPPED, Origin, chosen_over, default_origins, parse
from service.formats.members import DTYPES, MARKS
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
        ("force", "uN", 1e-6),
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


@pytest.mark.parametrize(
    ("moved", "at", "are_places"),
    [
        ("p", "p", True),
        (["x", "y"], ["x", "y"], True),
        ({"field": "p", "topic": "/a"}, {"field": "p", "topic": "/a"}, True),
        ({"field": "p", "topic": "/a"}, {"field": "p", "topic": "/b"}, False),
        (["x", "y"], ["y", "x"], False),
        ("d", "p", False),
        ({"value": [0.0]}, {"value": [0.0]}, False),
    ],
)
def test_displacement_and_position_of_the_same_fields_are_places(moved: Any, at: Any, are_places: bool) -> None:
    assert parsed(displacement=moved, position=at).is_of_places is are_places
    assert not parsed(position=at).is_of_places
    assert not parsed().is_of_places


def test_another_rest_is_that_of_all_alternatives() -> None:
    first, second = parsed(force="f"), parsed(force="g", rest="3")
    both = replace(first, alternatives=(second,))
    assert both.at_rest(None) is both
    changed = both.at_rest("2")
    assert (changed.rest, [each.rest for each in changed.alternatives]) == ("2", ["2"])
    assert changed.alternatives[0].origins == second.origins
    assert both.rest is None


def test_a_mapping_that_is_given_goes_before_the_file_s_own() -> None:
    given, own = parsed(force="f"), parsed(force="g", rest="first")
    assert chosen_over(given, own) is given
    assert chosen_over(None, own) is own
    assert chosen_over(None, None) is UNMAPPED
    assert chosen_over(given, None) is given


def test_a_rest_alone_that_is_given_goes_with_the_file_s_own_mapping() -> None:
    rest_alone, own = UNMAPPED.at_rest("2"), parsed(force="g", rest="first")
    assert chosen_over(rest_alone, own) == replace(own, rest="2")
    assert chosen_over(rest_alone, None) == replace(UNMAPPED, rest="2")


def test_members_are_usually_under_their_own_names_in_the_topic_of_frames_or_of_the_log() -> None:
    usual = default_origins("/frame", "/log")
    assert usual["time"] == Origin(("time",), "/frame", explicit=False)
    assert usual["position"] == Origin(("position",), "/log", explicit=False)
    assert usual.keys() == DTYPES.keys()


def test_entries_of_some_formats_alone_are_told_where_they_are_given() -> None:
    assert parsed(force="f").particular_entries == {}
    assert parsed(
        force={"field": "f", "topic": "/a"}, episode=0, element="id", notes={"a": "b"}
    ).particular_entries == {
        "notes": {"a": "b"},
        "element": "id",
        "episode": 0,
        "topic": "/a",
    }


@pytest.mark.parametrize("width", [1e-9, 0.1])
def test_a_pixel_is_as_wide_as_any_sensor_s(width: float) -> None:
    assert parsed(pixel=width).pixel == width
    for wrong in (0.99 * min(width, 0.05), 1.01 * max(width, 0.1)):
        if not 1e-9 <= wrong <= 0.1:
            with pytest.raises(InvalidInput, match=rf"pixel is {wrong:g} m; allowed: 1e-09 to 0.1 m \(is it in m\?\)"):
                parsed(pixel=wrong)


def test_pixels_are_two_whole_numbers() -> None:
    assert parsed(pixels=[1, 10_000]).pixels == (1, 10_000)
    with pytest.raises(InvalidInput, match=r"pixels is \[0, 3\]; allowed: two whole numbers of pixels, 1 to 10000"):
        parsed(pixels=[0, 3])
    with pytest.raises(InvalidInput, match=r"grid is \[0, 3\]; allowed: two whole numbers of markers, 1 to 10000"):
        parsed(grid=[0, 3])


def test_the_text_of_a_mapping_is_the_same_in_whatever_order_it_was_given() -> None:
    assert parsed(time="τ", force="f").text == parsed(force="f", time="τ").text == '{"force": "f", "time": "τ"}'


@pytest.mark.parametrize(
    ("unit", "allowed"),
    [
        ({"displacement": ["m", "m"]}, 'one a component, such as ["mm", "mm", "deg"]'),
        ({"time": ["s"]}, "one unit"),
        ({"time": "min"}, "s, ms, us, µs, ns"),
        ({"normal": "m"}, "none: it has no unit"),
    ],
)
def test_a_unit_that_is_none_is_refused_with_those_that_are(unit: dict[str, Any], allowed: str) -> None:
    ((name, given),) = unit.items()
    with pytest.raises(InvalidInput) as refusal:
        parsed(**{name: {"field": "x", "unit": given}})
    assert (refusal.value.name, refusal.value.value, refusal.value.allowed) == (f"unit of {name}", repr(given), allowed)


def test_each_component_may_be_turned_by_a_minus() -> None:
    assert parsed(force={"field": "f", "unit": ["-N", "mN", "-mN"]}).origins["force"].factors == (-1.0, 1e-3, -1e-3)
    assert parsed(force={"field": "f", "unit": "-mN"}).origins["force"].factors == (-1e-3,)


def test_there_are_a_hundred_notes_at_most() -> None:
    notes = {str(number): "f" for number in range(100)}
    assert parsed(notes=notes).notes == notes
    with pytest.raises(InvalidInput, match=r"notes is .*; allowed: an object of names and fields, 100 at most"):
        parsed(notes=notes | {"more": "f"})


def test_what_is_wrong_is_repeated_only_in_part() -> None:
    with pytest.raises(InvalidInput) as refusal:
        parsed(**{"y" * 100: 1})
    assert refusal.value.value == f"of the unknown {'y' * 60!r}"
    for wrong in ({"force": {"z": "x" * 100}}, {"grid": "x" * 100}, {"force": {"field": "f", "unit": "x" * 100}}):
        with pytest.raises(InvalidInput) as refusal:
            parsed(**wrong)
        assert len(refusal.value.value) == 60
