"""Refuses messages of the live stream that repeat a key: their decoders would silently take the last value."""

import json

import msgspec

from service.json_objects import unique

_MAPS = {0xDE: 2, 0xDF: 4}
"""Bytes of the count behind the first byte of a longer map of MessagePack; a short one has it in that byte."""

_FIELDS = msgspec.json.Decoder(dict[str, msgspec.Raw]).decode
_ENTRIES = msgspec.msgpack.Decoder(list[msgspec.Raw]).decode
_KEY = msgspec.msgpack.Decoder(str).decode


def check_text(message: bytes) -> None:
    """Raises ``RepeatedKey`` for a JSON object, already decoded once, or one nested in it (not in a list)."""
    if _may_repeat(message):
        json.loads(message, object_pairs_hook=unique)


def _may_repeat(content: bytes) -> bool:
    """Whether an object, or one within it, has more colons than distinct fields: a cheap test before parsing again."""
    values = [bytes(value) for value in _FIELDS(content).values()]
    colons = content.count(b":") - sum(value.count(b":") for value in values)
    return colons > len(values) or any(_may_repeat(value) for value in values if value.startswith(b"{"))


def check_binary(message: bytes) -> None:
    """Raises ``RepeatedKey`` for a map of MessagePack, already decoded once, or one nested in it."""
    entries = _ENTRIES(_as_list(message))
    fields = unique([(_KEY(key), value) for key, value in zip(entries[::2], entries[1::2], strict=True)])
    for value in map(bytes, fields.values()):
        if _is_map(value):
            check_binary(value)


def _is_map(content: bytes) -> bool:
    return content[0] & 0xF0 == 0x80 or content[0] in _MAPS


def _as_list(content: bytes) -> bytes:
    """A map's keys and values in turn, as a list: in MessagePack the two differ in their first bytes only."""
    size = _MAPS.get(content[0], 0)
    count = int.from_bytes(content[1 : 1 + size]) if size else content[0] & 0x0F
    return b"\xdd" + (2 * count).to_bytes(4) + content[1 + size :]
