"""Messages of Protocol Buffers as mappings: what is set, and moments as ROS says them."""

from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, text_format, timestamp_pb2

from service.formats import protobuf
from slipcore.errors import InvalidInput
from tests.service.formats.conftest import TACTILE_PROTO


@pytest.fixture
def types() -> descriptor_pb2.FileDescriptorSet:
    found = descriptor_pb2.FileDescriptorSet()
    timestamp_pb2.DESCRIPTOR.CopyToProto(found.file.add())
    text_format.Parse(TACTILE_PROTO, found.file.add())
    return found


@pytest.fixture
def sent(types: descriptor_pb2.FileDescriptorSet) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for file in types.file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.Tactile"))()


def read(types: descriptor_pb2.FileDescriptorSet, sent: Any) -> protobuf.Fields:
    return protobuf.deserializer("lab.Tactile", types.SerializeToString())(sent.SerializeToString())


def test_a_message_that_is_not_set_is_not_there_and_a_list_is(
    types: descriptor_pb2.FileDescriptorSet, sent: Any
) -> None:
    message = read(types, sent)
    assert (list(message), len(message)) == (["markers"], 1)
    assert message["markers"] == []
    for name in ("stamp", "none"):
        with pytest.raises(KeyError):
            message[name]
    assert "stamp" not in message


def test_a_moment_is_seconds_and_nanoseconds(types: descriptor_pb2.FileDescriptorSet, sent: Any) -> None:
    sent.stamp.seconds, sent.stamp.nanos = 7, 250
    marker = sent.markers.add(force=[0.5, 0.25])
    marker.moved.x = 2.0
    message = read(types, sent)
    assert (list(message), len(message)) == (["stamp", "markers"], 2)
    assert message["stamp"] == {"sec": 7, "nanosec": 250}
    (told,) = message["markers"]
    assert told["force"] == [0.5, 0.25]
    assert (told["moved"]["x"], told["moved"]["y"]) == (2.0, 0.0)


def test_a_definition_is_as_long_as_may_be(
    types: descriptor_pb2.FileDescriptorSet, sent: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    length = len(types.SerializeToString())
    monkeypatch.setattr(protobuf, "MAX_DEFINITION_BYTES", length)
    assert len(read(types, sent)) == 1
    monkeypatch.setattr(protobuf, "MAX_DEFINITION_BYTES", length - 1)
    told = f"definition of lab.Tactile is {length} bytes; allowed: at most {length - 1}"
    with pytest.raises(InvalidInput, match=told):
        read(types, sent)
    with pytest.raises(InvalidInput, match=r"definition of x{100} is"):
        protobuf.deserializer("x" * 200, b"0" * length)


def test_a_type_that_is_not_defined_is_told_by_its_name(types: descriptor_pb2.FileDescriptorSet) -> None:
    with pytest.raises(
        InvalidInput, match=r"definition of lab\.None is not readable \(KeyError.*\); allowed: a FileDes"
    ):
        protobuf.deserializer("lab.None", types.SerializeToString())
