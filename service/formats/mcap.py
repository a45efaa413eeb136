"""MCAP recordings of messages of ROS 2, ROS 1, Protocol Buffers or JSON (docs/formats.md)."""

import struct
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from service.formats import mapping as mappings
from service.formats import protobuf
from service.formats.assemble import assemble
from service.formats.mapping import FieldMapping
from service.formats.messages import Decode, MessageColumns, decode_json, with_defaults
from service.formats.ros_types import Deserialize, decoded, deserializer
from service.formats.stiction_messages import messages
from service.formats.unpack import BoundedFile, Unpacker
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

MAPPING_RECORD = "stiction"
"""Name of the metadata record whose entry ``mapping`` may hold the mapping."""

_ROS = {("cdr", "ros2msg"): False, ("ros1", "ros1msg"): True}
_DAMAGE = (McapError, struct.error, UnicodeDecodeError, ValueError, KeyError, OverflowError)


def read(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from an MCAP file. Raises ``InvalidInput`` naming the member or topic that is wrong."""
    chosen = with_defaults(mappings.chosen_over(mapping, _own_mapping(path)))
    columns = MessageColumns(chosen)
    gather(path, columns)
    return assemble(columns, chosen)


def write(log: GraspLog, path: Path) -> None:
    """Write a grasp log as an MCAP of two ROS 2 topics that ``read`` turns into the same log bit for bit."""
    channels: dict[str, int] = {}
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="stiction")
        for number, (topic, kind, definition, moment, content) in enumerate(messages(log)):
            if topic not in channels:
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], moment, content, moment, number)
        writer.finish()  # type: ignore[no-untyped-call]


def gather(path: Path, columns: MessageColumns) -> None:
    """Hand the messages of the topics that ``columns`` want to them."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    deserializers: dict[int, Deserialize] = {}
    unpacker = Unpacker()
    for record in (part for whole in _records(path) for part in _parts(whole, unpacker)):
        if isinstance(record, Schema):
            schemas.setdefault(record.id, record)
        elif isinstance(record, Channel):
            channels.setdefault(record.id, record)
        elif isinstance(record, Message):
            channel = channels.get(record.channel_id)
            if channel is None:
                raise InvalidInput("file", f"a message of the unknown channel {record.channel_id}", "a complete MCAP")
            if columns.wants(channel.topic):
                if channel.id not in deserializers:
                    deserializers[channel.id] = _deserializer(channel, schemas.get(channel.schema_id))
                decode: Decode = partial(decoded, deserializers[channel.id], channel.topic, record.data)
                columns.add(channel.topic, record.log_time, decode)


def _own_mapping(path: Path) -> FieldMapping:
    found = [
        record.metadata["mapping"]
        for record in _records(path)
        if isinstance(record, Metadata) and record.name == MAPPING_RECORD and "mapping" in record.metadata
    ]
    if len(found) > 1:
        raise InvalidInput("mapping", f"in {len(found)} metadata records {MAPPING_RECORD!r}", "one of them")
    return mappings.parse(found[0]) if found else mappings.UNMAPPED


def _records(path: Path) -> Iterator[McapRecord]:
    with BoundedFile(path) as stream:
        try:
            yield from StreamReader(stream, emit_chunks=True, record_size_limit=stream.size).records
        except _DAMAGE as error:
            raise _damaged(error) from error


def _parts(record: McapRecord, unpacker: Unpacker) -> list[McapRecord]:
    """A chunk's records, unpacked within bounds; any other record by itself."""
    if not isinstance(record, Chunk):
        return [record]
    content = unpacker.unpack(record.data, record.compression, record.uncompressed_size)
    record.compression, record.data = "", content
    try:
        return breakup_chunk(record, validate_crc=True)
    except _DAMAGE as error:
        raise _damaged(error) from error


def _deserializer(channel: Channel, schema: Schema | None) -> Deserialize:
    if channel.message_encoding == "json":
        return decode_json
    encodings = channel.message_encoding, schema.encoding if schema else "no"
    if schema is not None and encodings == ("protobuf", "protobuf"):
        return protobuf.deserializer(schema.name, schema.data)
    ros1 = _ROS.get(encodings)
    if schema is None or ros1 is None:
        value = f"{encodings[0]} messages of {encodings[1]} schema"
        raise InvalidInput(channel.topic, value[:100], "json; cdr with ros2msg; ros1 with ros1msg; protobuf")
    return deserializer(schema.name, schema.data.decode("utf-8", "replace"), ros1=ros1)


def _damaged(error: Exception) -> InvalidInput:
    detail = str(error)[:80] or type(error).__name__
    return InvalidInput("file", f"a truncated or damaged MCAP ({detail})", "a complete MCAP")
