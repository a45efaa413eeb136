"""Messages of Protocol Buffers, by the types that a recording defines."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message

from slipcore.errors import InvalidInput

MAX_DEFINITION_BYTES = 2**20
"""Of all types in a schema; those of Foxglove have some kilobytes."""


class Fields(Mapping[str, Any]):
    """A message as a mapping; a field that another message fills and that is not set is not there."""

    def __init__(self, message: Message) -> None:
        self._message = message

    def __getitem__(self, name: str) -> Any:
        field = self._message.DESCRIPTOR.fields_by_name[name]
        value = getattr(self._message, name)
        if field.message_type is None:
            return list(value) if field.is_repeated else value
        if field.message_type.GetOptions().map_entry:
            return {str(key): _plain(each) if isinstance(each, Message) else each for key, each in value.items()}
        if field.is_repeated:
            return [_plain(each) for each in value]
        if not self._message.HasField(name):
            raise KeyError(name)
        return _plain(value)

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._message.DESCRIPTOR.fields_by_name if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def deserializer(name: str, definition: bytes) -> Callable[[bytes], Fields]:
    """What turns the bytes of a message of this type into its fields; ``definition``: a ``FileDescriptorSet``.

    Raises ``InvalidInput`` for a definition that is none, or not of this type.
    """
    if len(definition) > MAX_DEFINITION_BYTES:
        raise InvalidInput(f"definition of {name[:100]}", f"{len(definition)} bytes", f"at most {MAX_DEFINITION_BYTES}")
    try:
        pool = descriptor_pool.DescriptorPool()
        for file in descriptor_pb2.FileDescriptorSet.FromString(definition).file:
            pool.Add(file)
        make = message_factory.GetMessageClass(pool.FindMessageTypeByName(name))
    except MemoryError:
        raise
    except Exception as error:  # the library answers a definition that is none with whatever its parts raise
        detail = f"{type(error).__name__}: {error}"[:120]
        raise InvalidInput(f"definition of {name[:100]}", f"not readable ({detail})", "a FileDescriptorSet") from error
    return lambda content: Fields(make.FromString(content))


def _plain(message: Message) -> Mapping[str, Any]:
    """A moment as ROS says it, so that it is known as one; any other message by its fields."""
    fields = Fields(message)
    if message.DESCRIPTOR.full_name == "google.protobuf.Timestamp":  # so the recording calls it: anything may be in it
        return {"sec": fields["seconds"], "nanosec": fields["nanos"]}
    return fields
