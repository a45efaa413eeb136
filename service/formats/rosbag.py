"""ROS recordings: rosbag1 files, and rosbag2 as its storage file or as its folder zipped (docs/formats.md).

Of a rosbag2 folder only the storage files are read; ``metadata.yaml`` repeats what they say.
"""

import bz2
import errno
import shutil
import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path, PurePosixPath

import apsw
import lz4.frame
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag1 import Reader as Bag1
from rosbags.rosbag1 import ReaderError as Bag1Error
from rosbags.rosbag2.errors import ReaderError as Bag2Error
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from service.formats import STORAGE, mcap
from service.formats import mapping as mappings
from service.formats.archive import open_archive
from service.formats.assemble import assemble
from service.formats.mapping import FieldMapping
from service.formats.messages import MessageColumns, with_defaults
from service.formats.ros_types import Deserialize, decoded, deserializer
from service.formats.unpack import BoundedPath, Unpacker
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

MAX_STORAGE_FILES = 100

_DAMAGE = (Bag1Error, Bag2Error, apsw.Error, struct.error)


def read_bag1(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from a rosbag1 file. Raises ``InvalidInput`` naming the member or topic that is wrong."""
    chosen = with_defaults(mapping or mappings.UNMAPPED)
    columns = MessageColumns(chosen)
    with _library("rosbag1", path):
        bag = Bag1(BoundedPath(path))  # type: ignore[arg-type]
        with bag:
            _bound_chunks(bag)
            wanted = [connection for connection in bag.connections if columns.wants(connection.topic)]
            if wanted:
                _gather(bag.messages(wanted), columns, ros1=True)
    return assemble(columns, chosen)


def read_bag2(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from rosbag2's SQLite file, its folder or a zip of it. Raises ``InvalidInput`` as above."""
    chosen = with_defaults(mapping or mappings.UNMAPPED)
    columns = MessageColumns(chosen)
    with _storage_files(path) as files:
        for file in files:
            if file.suffix == ".mcap":
                mcap.gather(file, columns)
            else:
                _gather_sqlite(file, columns)
    return assemble(columns, chosen)


def _gather_sqlite(path: Path, columns: MessageColumns) -> None:
    with _library("rosbag2", path):
        storage = Sqlite3Reader(path)
        storage.open()
        try:
            wanted = [connection for connection in storage.connections if columns.wants(connection.topic)]
            if wanted:
                _gather(storage.messages(wanted), columns, ros1=False)
        finally:
            storage.close()


def _gather(messages: Iterator[tuple[Connection, int, bytes]], columns: MessageColumns, *, ros1: bool) -> None:
    deserializers: dict[int, Deserialize] = {}
    for connection, received, content in messages:
        if connection.id not in deserializers:
            deserializers[connection.id] = _deserializer(connection, ros1=ros1)
        if not isinstance(content, bytes) or not isinstance(received, int):
            raise InvalidInput(connection.topic, "a message without bytes or time", "a complete message")
        decode = partial(decoded, deserializers[connection.id], connection.topic, content)
        columns.add(connection.topic, received, decode)


def _deserializer(connection: Connection, *, ros1: bool) -> Deserialize:
    definition = connection.msgdef
    if definition.format == MessageDefinitionFormat.IDL:
        raise InvalidInput(connection.topic, "defined in IDL", "defined as ROS messages (ros2msg)")
    return deserializer(connection.msgtype, definition.data, ros1=ros1)


def _bound_chunks(bag: Bag1) -> None:
    """Let no chunk unpack to more than may be; the library itself has no bound."""
    unpacker = Unpacker()
    for position, chunk in bag.chunks.items():
        compression = {bz2.decompress: "bz2", lz4.frame.decompress: "lz4"}.get(chunk.decompressor, "")
        bag.chunks[position] = chunk._replace(decompressor=partial(unpacker.unpack, compression=compression))


@contextmanager
def _storage_files(path: Path) -> Iterator[list[Path]]:
    """The storage files in the order of recording; those of a zip are unpacked under names of our own."""
    if path.is_dir():
        yield sorted((file for file in path.iterdir() if file.suffix in STORAGE), key=lambda file: _natural(file.name))
        return
    with path.open("rb") as stream:
        zipped = stream.read(4) == b"PK\x03\x04"
    if not zipped:
        yield [path]
        return
    with tempfile.TemporaryDirectory() as folder, open_archive(path) as archive:
        names = sorted((name for name in archive.namelist() if PurePosixPath(name).suffix in STORAGE), key=_natural)
        if not 0 < len(names) <= MAX_STORAGE_FILES:
            raise InvalidInput("file", f"a zip of {len(names)} .db3 or .mcap files", f"1 to {MAX_STORAGE_FILES}")
        files = []
        for number, name in enumerate(names):
            file = Path(folder, f"{number}{PurePosixPath(name).suffix}")
            with archive.open(name) as source, file.open("wb") as target:
                shutil.copyfileobj(source, target)
            files.append(file)
        yield files


def _natural(name: str) -> tuple[int, str]:
    """Storage files are numbered: log_0.db3, …, log_10.db3."""
    digits = PurePosixPath(name).stem.rpartition("_")[2]
    return (int(digits) if digits.isdecimal() and len(digits) < 10 else 0), name


@contextmanager
def _library(name: str, path: Path) -> Iterator[None]:
    """Answer for a library that meets damaged files with whatever its parts raise, and tell nobody their place here."""
    try:
        yield
    except (InvalidInput, MemoryError):
        raise
    except (
        Bag1Error,
        Bag2Error,
        apsw.Error,
        struct.error,
        AssertionError,
        LookupError,
        ValueError,
        TypeError,
    ) as error:
        detail = f"{type(error).__name__}: {error}".replace(str(path), "the file")[:120]
        raise InvalidInput("file", f"a truncated or damaged {name} ({detail})", f"a complete {name} file") from error
    except OSError as error:
        if error.errno != errno.EINVAL:  # a place in the file that cannot be
            raise
        raise InvalidInput("file", f"a damaged {name} ({error})", f"a complete {name} file") from error
