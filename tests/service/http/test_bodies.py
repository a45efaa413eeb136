"""How many fields an object of a body may have."""

import asyncio
import json
from typing import Any

import pytest
from fastapi import Request
from starlette.exceptions import HTTPException

from service.http import bodies


def test_an_object_has_as_many_fields_as_may_be_each_once() -> None:
    pairs = [(str(number), number) for number in range(bodies.MOST_FIELDS)]
    assert bodies._few_fields(pairs) == dict(pairs)
    for wrong, told in (
        ([*pairs, ("more", 1)], f"an object of the body has more than {bodies.MOST_FIELDS} fields"),
        ([("a", 1), ("b", 2), ("a", 1)], "an object of the body has the field 'a' more than once"),
    ):
        with pytest.raises(HTTPException) as refusal:
            bodies._few_fields(wrong)
        assert (refusal.value.status_code, refusal.value.detail) == (400, told)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("application/json", "application/json"),
        ("Application/JSON; charset=utf-8", "application/json"),
        (" text/csv ;header=present", "text/csv"),
        ("", ""),
        (None, ""),
    ],
)
def test_a_media_type_is_what_stands_before_its_parameters(given: str | None, told: str) -> None:
    headers = [] if given is None else [(b"content-type", given.encode())]
    assert bodies.media_type(Request({"type": "http", "headers": headers})) == told


@pytest.mark.parametrize(
    "body", ["{}".encode("utf-8-sig"), "{}".encode("utf-16"), "{}".encode("utf-32-le"), b"\xff", b"\0"]
)
def test_json_is_utf_8_without_a_mark(body: bytes) -> None:
    with pytest.raises(json.JSONDecodeError, match="another encoding than UTF-8 without a byte order mark"):
        bodies._check_encoding(body)


def test_text_of_any_script_is_utf_8() -> None:
    bodies._check_encoding('{"μ": "摩擦"}'.encode())
    assert bodies.is_utf_8("μ".encode())
    assert not bodies.is_utf_8("μ".encode()[:1])


def of_fields(counts: list[int]) -> bytes:
    return json.dumps([{str(number): {} for number in range(count)} for count in counts]).encode()


def test_a_long_body_is_what_a_short_one_would_be() -> None:
    told = {"a": [1, 2.5, None, True, {"b": "c:d", "e\\": '":"'}], "μ": {}}
    assert bodies._parse_long(json.dumps(told).encode()) == told
    assert bodies._parse_long(b'"a:b"') == "a:b"


def test_all_objects_of_a_long_body_have_as_many_fields_as_may_be_together() -> None:
    most = bodies.MOST_FIELDS
    assert len(bodies._parse_long(of_fields([most] * 5))) == 5
    for wrong, told in (
        (of_fields([most] * 5 + [1]), f"the objects of the body have more than {5 * most} fields together"),
        (of_fields([most + 1]), f"an object of the body has more than {most} fields"),
        (b'[{"a": 1}, {"b": 1, "b": 2}]', "an object of the body has the field 'b' more than once"),
        (b'{"a": {"b": {"c": 1, "c": 1}}}', "an object of the body has the field 'c' more than once"),
    ):
        with pytest.raises(HTTPException) as refusal:
            bodies._parse_long(wrong)
        assert (refusal.value.status_code, refusal.value.detail) == (400, told)


@pytest.mark.parametrize("body", [b"{", b"[1,]", b"nan", b""])
def test_a_long_body_that_is_no_json_is_refused_as_a_short_one(body: bytes) -> None:
    with pytest.raises(json.JSONDecodeError):
        bodies._parse_long(body)


def received(pieces: list[bytes], most: int) -> list[bytes]:
    """What comes of a body in pieces where so many bytes are taken."""
    waiting = iter(pieces)

    async def receive() -> Any:
        return {"type": "http.request", "body": next(waiting)}

    async def read() -> list[bytes]:
        taken = bodies.limited(receive, most)
        return [(await taken())["body"] for _ in pieces]

    return asyncio.run(read())


def test_a_body_is_taken_up_to_its_limit_and_not_a_byte_beyond() -> None:
    assert received([b"abc", b"", b"de"], 5) == [b"abc", b"", b"de"]
    with pytest.raises(HTTPException) as refusal:
        received([b"abc", b"", b"def"], 5)
    assert (refusal.value.status_code, refusal.value.detail) == (413, "the body has more than 5 bytes")
