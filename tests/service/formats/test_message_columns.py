"""Columns that are gathered from messages, one at a time, without a file."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from service.formats import messages as module
from service.formats.mapping import parse
from service.formats.messages import (
    FRAME_TOPIC,
    LOG_TOPIC,
    RECEIVED,
    MessageColumns,
    decode_json,
    follow,
    with_defaults,
)
from slipcore.errors import InvalidInput

SKIN, FORCE = ({"field": field, "topic": topic} for field, topic in (("moved", "/skin"), ("f", "/force")))
MAPPED = parse(json.dumps({"displacement": SKIN, "force": FORCE, "time": {"field": "at", "topic": "/skin"}}))


@dataclass
class Header:
    """A moment of ROS."""

    sec: Any
    nanosec: Any = None
    nsec: Any = None


def gathered(*messages: tuple[str, int, Any], mapping: Any = MAPPED) -> MessageColumns:
    columns = MessageColumns(with_defaults(mapping))
    for topic, received, content in messages:
        assert columns.wants(topic)
        columns.add(topic, received, lambda content=content: content)
    return columns


def test_fields_of_two_topics_are_brought_together_by_the_message_received_nearest() -> None:
    frames = [("/skin", at, {"moved": [float(at)]}) for at in (1000, 2000, 3000)]
    forces = [("/force", at, {"f": float(at)}) for at in (2100, 900, 1400, 3400, 1600)]
    columns = gathered(*frames, *forces)
    np.testing.assert_array_equal(columns.column("displacement", "/skin", "moved", False), [[1000], [2000], [3000]])
    np.testing.assert_array_equal(columns.column("force", "/force", "f", False), [900, 2100, 3400])


def test_of_two_that_are_as_near_the_earlier_one_counts() -> None:
    columns = gathered(
        *(("/skin", at, {"moved": 0.0}) for at in (1000, 3000)),
        *(("/force", at, {"f": float(at)}) for at in (500, 1500, 2500, 3500)),
    )
    np.testing.assert_array_equal(columns.column("force", "/force", "f", False), [500, 2500])


def test_frames_are_in_the_order_in_which_they_were_received() -> None:
    columns = gathered(*(("/skin", at, {"moved": float(at)}) for at in (3000, 1000, 2000)))
    np.testing.assert_array_equal(columns.column("displacement", "/skin", "moved", False), [1000, 2000, 3000])
    times = columns.column("time", "/skin", RECEIVED, False)
    np.testing.assert_array_equal(times, np.array([1000, 2000, 3000], "datetime64[ns]"))


def test_one_message_stands_for_the_one_frame_that_it_was_received_with() -> None:
    columns = gathered(("/skin", 7, {"moved": 0.0}), ("/force", 7, {"f": 2.0}))
    np.testing.assert_array_equal(columns.column("force", "/force", "f", False), [2.0])


@pytest.mark.parametrize(("late", "is_near"), [(500, True), (501, False)])
def test_without_a_tolerance_half_the_time_between_frames_is_near(late: int, is_near: bool) -> None:
    frames = [("/skin", at, {"moved": 0.0}) for at in (0, 1000, 2000, 9000)]
    columns = gathered(*frames, *(("/force", at, {"f": 1.0}) for at in (0, 1000, 2000, 9000 + late)))
    if is_near:
        assert columns.column("force", "/force", "f", False) is not None
        return
    with pytest.raises(
        InvalidInput, match=r"force is 5.01e-07 s away from frame 3 in /force; allowed: a message within 5e-07"
    ):
        columns.column("force", "/force", "f", False)


@pytest.mark.parametrize(("late", "is_near"), [(2_000_000, True), (2_000_001, False)])
def test_a_tolerance_is_in_seconds(late: int, is_near: bool) -> None:
    told = parse(json.dumps({"displacement": SKIN, "force": FORCE, "tolerance": 0.002}))
    columns = gathered(("/skin", 0, {"moved": 0.0}), ("/force", late, {"f": 1.0}), mapping=told)
    if is_near:
        assert columns.column("force", "/force", "f", False) is not None
        return
    with pytest.raises(InvalidInput, match=r"away from frame 0 in /force; allowed: a message within 0.002 s of each"):
        columns.column("force", "/force", "f", False)


def test_what_no_message_has_is_no_column() -> None:
    columns = gathered(("/skin", 0, {"moved": 0.0}))
    assert columns.column("force", "/force", "f", False) is None
    assert columns.column("time", "/skin", "at", False) is None


def test_a_field_that_only_some_messages_have_is_refused_with_how_many() -> None:
    columns = gathered(("/skin", 0, {"moved": 0.0}), ("/skin", 1, {}), ("/skin", 2, {"moved": None}))
    with pytest.raises(
        InvalidInput, match="displacement is in 1 of 3 messages of /skin; allowed: moved in each of them"
    ):
        columns.column("displacement", "/skin", "moved", False)
    np.testing.assert_array_equal(columns.column("displacement", "/skin", "moved", True), 0.0)


@pytest.mark.parametrize("other", [[1.0, 2.0, 3.0], [[1.0, 2.0]], ["a", "b"], [1, 2]])
@pytest.mark.parametrize("once", [True, False])
def test_a_field_of_another_shape_or_kind_is_refused_with_its_frame(other: Any, once: bool) -> None:
    columns = gathered(*(("/skin", at, {"moved": value}) for at, value in enumerate([[0.0, 0.0], [0.0, 0.0], other])))
    with pytest.raises(InvalidInput, match=r"at frame 2; allowed: float64 of shape \[2\], as at frame 0"):
        columns.column("displacement", "/skin", "moved", once)


@pytest.mark.parametrize("received", [-1, 2**63])
def test_a_moment_is_of_63_bits(received: int) -> None:
    with pytest.raises(InvalidInput, match=rf"/skin is of a message received at {received} ns; allowed: 0 to 2⁶³ - 1"):
        gathered(("/skin", received, {}))
    gathered(("/skin", 0, {}), ("/skin", 2**63 - 1, {}))


def test_messages_of_a_topic_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_MESSAGES", 2)
    gathered(*(("/skin", at, {}) for at in range(2)), *(("/force", at, {}) for at in range(2)))
    with pytest.raises(InvalidInput, match="/skin is of more than 2 messages; allowed: at most 2"):
        gathered(*(("/skin", at, {}) for at in range(3)))


def test_bytes_of_all_fields_are_counted_together_with_each_array_s_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_CONTENT_BYTES", 2 * (16 + 100))
    gathered(("/skin", 0, {"moved": [1.0, 2.0]}), ("/force", 0, {"f": [1.0, 2.0]}))
    with pytest.raises(InvalidInput, match="file is more than 232 bytes of fields; allowed: at most 232"):
        gathered(("/skin", 0, {"moved": [1.0, 2.0]}), ("/force", 0, {"f": [1.0, 2.0, 3.0]}))


@pytest.mark.parametrize(
    ("grid", "told"),
    [([20, 30], (20, 30)), ([20.0, 30.0], None), ([20, 30, 1], None), ([[20, 30]], None), (None, None)],
)
def test_the_grid_is_two_whole_numbers_of_stiction_s_own_topic(grid: Any, told: tuple[int, int] | None) -> None:
    assert gathered((LOG_TOPIC, 0, {"grid": grid}), mapping=parse("{}")).grid() == told


def test_what_a_recording_holds_is_told_by_its_topics() -> None:
    columns = MessageColumns(with_defaults(MAPPED))
    assert columns.contents() == "no messages"
    assert not columns.wants("/odometry")
    assert columns.wants("/skin")
    assert columns.contents() == "the topics /odometry, /skin"
    for number in range(2000):
        columns.wants(f"/other/{number:04}")
    assert len(columns.contents()) == 300
    assert len(columns._seen) == 1000


def test_where_displacement_comes_from_another_topic_its_messages_times_are_time() -> None:
    told = with_defaults(parse(json.dumps({"displacement": SKIN}))).origins
    assert (told["time"].topic, told["time"].fields) == ("/skin", (RECEIVED,))
    own = with_defaults(parse("{}")).origins
    assert {own[name].topic for name in ("time", "displacement")} == {FRAME_TOPIC}
    assert own["position"].topic == LOG_TOPIC


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("a", 1),
        ("b.c", "text"),
        ("d.e", [1.0, 2.0]),
        ("d.g", None),
        ("b.c.x", None),
        ("none.c", None),
        ("f.sec", 3),
    ],
)
def test_a_dotted_path_leads_through_messages_and_lists(path: str, value: Any) -> None:
    entries = [{"e": 1.0, "g": 1}, {"e": 2.0, "g": None}]
    assert follow({"a": 1, "b": {"c": "text"}, "d": entries, "none": None, "f": Header(3)}, path) == value


@pytest.mark.parametrize(
    ("told", "moment"),
    [
        (Header(3, 5), 3_000_000_005),
        (Header(3, nsec=7), 3_000_000_007),
        (Header(-1, 5), -999_999_995),
        ({"sec": 2, "nanosec": 2**32 + 1}, 2_000_000_001),
        (Header(2**33 - 1, 0), (2**33 - 1) * 10**9),
    ],
)
def test_a_moment_of_ros_is_one_in_nanoseconds(told: Any, moment: int) -> None:
    assert follow({"stamp": told}, "stamp") == np.datetime64(moment, "ns")
    assert follow({"stamps": [told, told]}, "stamps") == [np.datetime64(moment, "ns")] * 2


@pytest.mark.parametrize(
    "told", [Header(3), Header(3.0, 5), Header(3, 5.0), Header(2**33, 0), Header(-(2**33), 0), Header(True, 0)]
)
def test_what_only_looks_like_a_moment_stays_as_it_is(told: Header) -> None:
    assert follow({"stamp": told}, "stamp") is told


def test_a_message_of_json_is_read_or_refused_as_such() -> None:
    assert decode_json(b'{"a": [1, 2.5]}') == {"a": [1, 2.5]}
    with pytest.raises(InvalidInput, match=r"message is .*; allowed: JSON, as its channel says"):
        decode_json(b"{")
