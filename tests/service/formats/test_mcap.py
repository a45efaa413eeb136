"""Recordings in chunks: which messages are read, by which encodings, and what is damaged."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from service.formats import mcap
from service.formats.mapping import parse
from service.formats.messages import MessageColumns, with_defaults
from slipcore import GraspLog, InvalidInput

MAPPING = parse(json.dumps({"topic": "/t", "displacement": "u", "pitch": 1e-3}))


def written(path: Path, messages: list[tuple[str, int, bytes]], encoding: tuple[str, str] = ("json", "jsonschema"),
            records: tuple[dict[str, str], ...] = (), **options: Any) -> Path:  # fmt: skip
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start()
        schema = writer.register_schema("pkg/msg/T", encoding[1], b"float64 a")
        channels = {topic: writer.register_channel(topic, encoding[0], schema) for topic, *_ in messages}
        for topic, moment, content in messages:
            writer.add_message(channels[topic], moment, content, moment)
        for record in records:
            writer.add_metadata("stiction", record)
        writer.finish()
    return path


def frames(count: int) -> list[tuple[str, int, bytes]]:
    moved = [[[[1e-6 * k, 0.0, 0.0]] * 2] * 2 for k in range(count)]
    return [("/t", k * 10**8, json.dumps({"u": each}).encode()) for k, each in enumerate(moved)]


@pytest.mark.parametrize(
    "options", [{}, {"use_chunking": False}, {"compression": CompressionType.LZ4, "chunk_size": 64}]
)
def test_messages_are_read_in_their_order_from_chunks_or_without(tmp_path: Path, options: dict[str, Any]) -> None:
    log = mcap.read(written(tmp_path / "log", frames(4), **options), MAPPING)
    assert np.allclose(log.time, [0.0, 0.1, 0.2, 0.3])
    assert np.allclose(log.displacement[:, 0, 1, 0], 1e-6 * np.arange(4))


def test_topics_that_nobody_asks_for_are_passed_over_whatever_they_are(tmp_path: Path) -> None:
    others = [("/other", 5, b"\xff\xff")] * 3
    assert len(mcap.read(written(tmp_path / "log", [*others, *frames(2)]), MAPPING)) == 2


def test_the_mapping_in_a_file_is_one(tmp_path: Path) -> None:
    told = {"mapping": json.dumps({"topic": "/t", "displacement": "u", "pitch": 2e-3})}
    log = mcap.read(written(tmp_path / "log", frames(2), records=({"other": "x"}, told)))
    assert log.position[1, 1].tolist() == pytest.approx([1e-3, 1e-3, 0.0])
    with pytest.raises(InvalidInput, match="mapping is in 2 metadata records 'stiction'; allowed: one of them"):
        mcap.read(written(tmp_path / "log", frames(2), records=(told, told)))


@pytest.mark.parametrize(
    ("encoding", "told"),
    [
        (
            ("cdr", "ros1msg"),
            "cdr messages of ros1msg schema; allowed: json; cdr with ros2msg; ros1 with ros1msg; protobuf",
        ),
        (("protobuf", "jsonschema"), "protobuf messages of jsonschema schema; allowed: json"),
        (("cbor", ""), "cbor messages of  schema; allowed: json"),
    ],
)
def test_messages_in_another_encoding_are_named_with_those_that_are_read(
    tmp_path: Path, encoding: tuple[str, str], told: str
) -> None:
    with pytest.raises(InvalidInput, match=f"^/t is {told}"):
        mcap.read(written(tmp_path / "log", frames(2), encoding), MAPPING)


@pytest.mark.parametrize("kept", [0, 4, 100, -1, -40])
def test_a_recording_that_is_cut_is_damaged(tmp_path: Path, kept: int) -> None:
    path = written(tmp_path / "log", frames(20))
    content = path.read_bytes()
    path.write_bytes(content[:kept] if kept else b"")
    with pytest.raises(InvalidInput, match=r"file is a truncated or damaged MCAP \(.*\); allowed: a complete MCAP"):
        mcap.gather(path, MessageColumns(with_defaults(MAPPING)))


def test_a_log_is_written_as_two_topics_and_read_back(tmp_path: Path, log: GraspLog) -> None:
    mcap.write(log, tmp_path / "log")
    back = mcap.read(tmp_path / "log")
    np.testing.assert_array_equal(back.displacement, log.displacement)
    np.testing.assert_array_equal(back.time, log.time)
    assert (back.sensor, back.element_area) == (log.sensor, log.element_area)
