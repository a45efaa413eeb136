"""Types of ROS messages as a recording defines them.

``rosbags`` compiles each definition to Python code in which names stand as they are: a type's name must be proven
plain before it gets there, or a file could run code of its own.
"""

import re
from collections.abc import Callable

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from slipcore.errors import InvalidInput

MAX_DEFINITION_CHARACTERS = 64 * 1024
MAX_ARRAY_LENGTH = 10_000_000
"""Entries of one array in a message, by its definition or by what the message claims."""

_TYPE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,99}(/msg)?/[A-Za-z][A-Za-z0-9_]{0,99}")
_LONG_ARRAY = re.compile(r"\[(?:<=)?\s*(\d{8,})\s*\]")

Deserialize = Callable[[bytes], object]


def check_type_name(name: str) -> str:
    """The name of a ROS type, proven to be one; raises ``InvalidInput``."""
    if not _TYPE_NAME.fullmatch(name):
        raise InvalidInput("message type", repr(name[:100]), "package/msg/Name, of letters, digits and _")
    return name if "/msg/" in name else name.replace("/", "/msg/")


def deserializer(name: str, definition: str, *, ros1: bool) -> Deserialize:
    """What turns a message's bytes into an object; without a ``definition`` the type must be one of ROS's own.

    Raises ``InvalidInput`` for a definition that is none.
    """
    plain = check_type_name(name)
    store = _store(plain, definition) if definition else get_typestore(Stores.ROS2_HUMBLE)
    if plain not in store.fielddefs:
        raise InvalidInput("message type", plain, "defined in the file, or one of ROS's own")
    deserialize = store.deserialize_ros1 if ros1 else store.deserialize_cdr
    return lambda content: deserialize(content, plain)


def _store(name: str, definition: str) -> Typestore:
    if len(definition) > MAX_DEFINITION_CHARACTERS or _LONG_ARRAY.search(definition):
        allowed = f"at most {MAX_DEFINITION_CHARACTERS} characters, arrays of at most {MAX_ARRAY_LENGTH} entries"
        raise InvalidInput(f"definition of {name}", f"{len(definition)} characters", allowed)
    try:
        types = get_types_from_msg(definition, name)
        for defined in types:
            check_type_name(defined)
        store = get_typestore(Stores.EMPTY)  # knows moments and durations, which definitions leave out
        store.max_sequence_length = MAX_ARRAY_LENGTH
        store.register(types)
    except InvalidInput:
        raise
    except (MemoryError, OSError):
        raise
    except Exception as error:  # the library answers a definition that is none with whatever its parts raise
        detail = f"{type(error).__name__}: {error}"[:120]
        raise InvalidInput(f"definition of {name}", f"not readable ({detail})", "ROS message definitions") from error
    return store


def decoded(deserialize: Deserialize, topic: str, content: bytes) -> object:
    """A message; raises ``InvalidInput`` named for its topic."""
    try:
        return deserialize(content)
    except (InvalidInput, MemoryError):
        raise
    except Exception as error:  # compiled by the library from the definition: it fails in any way
        detail = f"{type(error).__name__}: {error}"[:120]
        raise InvalidInput(topic, f"a message that does not fit its type ({detail})", "a complete message") from error
