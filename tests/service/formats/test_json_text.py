"""JSON that somebody sent, with what is wrong of it by name."""

import pytest

from service.formats.json_text import parse, parse_object
from slipcore.errors import InvalidInput


def test_what_it_says_is_read_from_text_or_bytes() -> None:
    assert parse("file", b'[1, "\xc3\xa9"]') == [1, "é"]
    assert parse_object("file", '{"a": {"b": null}}') == {"a": {"b": None}}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '{"a": 1, "b": {"c": 1, "c": 2}}',
            "file is with the key 'c' more than once; allowed: each key of an object once",
        ),
        ("{", r"file is not JSON \(Expecting property name .*\); allowed: a JSON object"),
        (b"\xff", "file is not JSON"),
        ("[" * 100_000, "file is not JSON"),
        ("[1]", "file is JSON of a list; allowed: a JSON object"),
        ('"text"', "file is JSON of a str; allowed"),
        ("null", "file is JSON of a NoneType; allowed"),
    ],
)
def test_what_is_no_object_is_refused_by_its_name(text: str | bytes, told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        parse_object("file", text)


def test_what_else_is_allowed_is_said_where_it_is() -> None:
    with pytest.raises(InvalidInput, match=r"mapping is not JSON .*; allowed: a preset"):
        parse("mapping", "oops", "a preset")
