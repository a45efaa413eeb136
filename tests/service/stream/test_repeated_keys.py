"""Keys that stand twice in a message of the live stream."""

import json
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from service.json_objects import RepeatedKey
from service.stream.messages import decode_binary, decode_text

CONTROL = {"contact_area": 6e-5, "settings": {"least_force": 1.0, "most_force": 9.0}}
OPEN: dict[str, Any] = {"type": "open", "position": [0.0] * 40, "grid": [1, 1], "element_area": 1e-6, "sensor": 'a":1'}
FRAME: dict[str, Any] = {"type": "frame", "number": 1, "time": 0.1, "displacement": [[1.0, {"a": {"b": 2}}]]}
MESSAGES = [OPEN, OPEN | {"control": CONTROL}, FRAME, FRAME | {"force": b"x" * 24}, {"type": "finish", "store": True}]


def twice(message: dict[str, Any], key: str) -> dict[str, Any]:
    """The message with the key once more, as another one of the same length, which is to be replaced."""
    assert key in message
    return message | {"~" * len(key): message[key]}


def as_binary(message: dict[str, Any], key: str) -> bytes:
    return msgspec.msgpack.encode(message).replace(b"~" * len(key), key.encode())


def as_text(message: dict[str, Any], key: str) -> bytes:
    told = {name: "AAAA" if type(value) is bytes else value for name, value in message.items()}
    return json.dumps(told).encode().replace(b"~" * len(key), key.encode())


Form = Callable[[dict[str, Any], str], bytes]
FORMS = pytest.mark.parametrize(("form", "decode"), [(as_binary, decode_binary), (as_text, decode_text)])


@FORMS
@pytest.mark.parametrize("message", MESSAGES)
def test_a_message_with_each_key_once_is_taken(form: Form, decode: Any, message: dict[str, Any]) -> None:
    assert msgspec.to_builtins(decode(form(message, "type")))["type"] == message["type"]


@FORMS
@pytest.mark.parametrize("number", range(len(MESSAGES)))
def test_a_key_that_stands_twice_is_refused_by_name(form: Form, decode: Any, number: int) -> None:
    for key in MESSAGES[number].keys() - {"type"}:
        with pytest.raises(RepeatedKey, match=f"the key '{key}' more than once"):
            decode(form(twice(MESSAGES[number], key), key))


@FORMS
def test_a_key_of_what_is_within_stands_once_too(form: Form, decode: Any) -> None:
    for inner in (twice(CONTROL, "contact_area"), CONTROL | {"settings": twice(CONTROL["settings"], "least_force")}):  # type: ignore[arg-type]
        key = "contact_area" if "~" * len("contact_area") in inner else "least_force"
        with pytest.raises(RepeatedKey, match=key):
            decode(form(OPEN | {"control": inner}, key))


def test_a_long_map_is_looked_through() -> None:
    """A head of three bytes, as of more than 15 entries, and one of five, which short ones may have as well."""
    settings = {f"setting {number}": 1.0 for number in range(20)}
    for many in (settings, settings | {"~" * len("setting 7"): 1.0}):
        content = as_binary(OPEN | {"control": CONTROL | {"settings": many}}, "setting 7")
        if len(many) == 20:
            decode_binary(content)
        else:
            with pytest.raises(RepeatedKey, match="setting 7"):
                decode_binary(content)
    long = b"\xdf\x00\x00\x00\x03" + msgspec.msgpack.encode({"type": "finish", "store": True, "~~~~~": True})[1:]
    with pytest.raises(RepeatedKey, match="store"):
        decode_binary(long.replace(b"~~~~~", b"store"))
