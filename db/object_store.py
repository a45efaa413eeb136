"""Blobs in an object store: S3 and what is compatible with it, or any other that ``obstore`` knows by URL."""

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import uuid4

from db.defaults import OBJECT_STORE_TIMEOUT
from db.errors import DriverMissing, NotFound, StorageUnavailable

SCHEMES = ("s3", "s3a", "gs", "az", "azure", "adl", "abfs", "abfss", "http", "https", "file")
"""Of URLs that obstore takes, but for a store in memory, which keeps nothing."""

_SHA256 = re.compile(r"[0-9a-f]{64}")
_CLOCK = "clock"
_QUARANTINE = "quarantine"


class ObjectStore:
    """Objects ``ab/ab12…`` under a URL such as ``s3://bucket/prefix``; credentials are the environment's.

    Raises ``DriverMissing`` without the library, ``StorageUnavailable`` for a URL that it does not take.
    """

    def __init__(self, url: str) -> None:
        try:
            import obstore
            from obstore.store import from_url
        except ModuleNotFoundError as error:
            raise DriverMissing(url.partition("?")[0], "obstore", what="blob store", extra="s3") from error
        self._obstore, self._name = obstore, url.partition("?")[0]
        seconds = timedelta(seconds=OBJECT_STORE_TIMEOUT)
        with _answered(f"blob store {self._name}"):
            self._store: Any = from_url(
                url,
                client_options={"timeout": seconds, "connect_timeout": seconds, "allow_http": _is_plain_http()},
                retry_config={"max_retries": 2, "retry_timeout": seconds},
            )

    def __str__(self) -> str:
        return self._name

    def put(self, sha256: str, path: Path) -> None:
        """Store a file as the blob of this hash; when it returns, the store has it."""
        with _answered("blob store"):
            self._obstore.put(self._store, _key(sha256), path)

    def get(self, sha256: str, path: Path) -> None:
        """Write a blob to ``path``; raises ``NotFound``."""
        with _answered("blob store", sha256), path.open("wb") as target:
            for chunk in self._obstore.get(self._store, _key(sha256)).stream():
                target.write(chunk)

    def has(self, sha256: str) -> bool:
        """Whether a blob is there."""
        return self._is_there(_key(sha256))

    def now(self) -> datetime:
        """The present moment by the store's own clock, whatever this machine's says."""
        with _answered("blob store"):
            key = f"{_CLOCK}/{uuid4().hex}"  # another server may look at the same time
            self._obstore.put(self._store, key, b"")
            written: datetime = self._obstore.head(self._store, key)["last_modified"]
            self._obstore.delete(self._store, key)
        return written

    def hashes(self, before: datetime | None = None, *, set_aside: bool = False) -> Iterator[str]:
        """Hashes of all blobs, or of those that were stored before a moment of the store's clock.

        Either of the blobs in their places, or of those ``set_aside``. What else is under the URL is another's, and be
        it the blobs of a store in a folder of this one.
        """
        place = _aside if set_aside else _key
        with _answered("blob store"):
            for page in self._obstore.list(self._store, prefix=_QUARANTINE if set_aside else None):
                for entry in page:
                    name = entry["path"].rpartition("/")[2]
                    is_old = before is None or entry["last_modified"] < before
                    if _SHA256.fullmatch(name) and entry["path"] == place(name) and is_old:
                        yield name

    def delete(self, hashes: Iterable[str], *, set_aside: bool = False) -> None:
        """Remove blobs; those that aren't there are no error."""
        keys = [_aside(sha256) if set_aside else _key(sha256) for sha256 in hashes]
        if keys:
            with _answered("blob store"):
                self._obstore.delete(self._store, keys)

    def set_aside(self, sha256: str, *, back: bool = False) -> bool:
        """Move a blob into the quarantine, or ``back`` to its place; False where it isn't."""
        source, target = (_aside(sha256), _key(sha256)) if back else (_key(sha256), _aside(sha256))
        with _answered("blob store"):
            try:
                self._obstore.head(self._store, source)
                self._obstore.rename(self._store, source, target)
            except FileNotFoundError:  # of the latter where somebody else was faster
                return False
        return True

    def read(self, key: str) -> str | None:
        """The text of an object that is no blob; None where there is none."""
        with _answered("blob store"):
            try:
                return bytes(self._obstore.get(self._store, key).bytes()).decode(errors="backslashreplace")
            except FileNotFoundError:
                return None

    def write(self, key: str, text: str) -> None:
        """Store a text that is no blob."""
        with _answered("blob store"):
            self._obstore.put(self._store, key, text.encode())

    def ping(self) -> None:
        """Make sure that the store answers; raises ``StorageUnavailable``."""
        self._is_there("ready")

    def _is_there(self, key: str) -> bool:
        with _answered("blob store"):
            try:
                self._obstore.head(self._store, key)
            except FileNotFoundError:
                return False
        return True


class ObjectQuarantine:
    """Objects beside the blobs (``db.quarantine.Quarantine``)."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store

    def put(self, sha256: str) -> None:
        """Set a blob aside, as of now; one that isn't there is no error."""
        self._store.set_aside(sha256)

    def recall(self, sha256: str) -> bool:
        """Make it a blob again; False if it was not set aside."""
        return self._store.set_aside(sha256, back=True)

    def hashes(self, before: datetime | None = None) -> Iterator[str]:
        """Hashes of all that were set aside, or of those before a moment of the store's clock."""
        return self._store.hashes(before, set_aside=True)

    def delete(self, hashes: Iterable[str]) -> None:
        """Delete for good."""
        self._store.delete(hashes, set_aside=True)


def _is_plain_http() -> bool:
    """Whether an endpoint without TLS was chosen by name."""
    return os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")


def _key(sha256: str) -> str:
    return f"{sha256[:2]}/{sha256}"


def _aside(sha256: str) -> str:
    return f"{_QUARANTINE}/{sha256}"


@contextmanager
def _answered(name: str, sha256: str = "") -> Iterator[None]:
    """The library's errors as ours; its own are no subclasses of one another in every case."""
    try:
        yield
    except FileNotFoundError as error:
        if sha256:
            raise NotFound("blob", sha256) from error
        raise StorageUnavailable(f"{name}: {_first_line(error)}") from error
    except Exception as error:
        if type(error).__module__.partition(".")[0] in ("obstore", "builtins"):
            raise StorageUnavailable(f"{name}: {_first_line(error)}") from error
        raise


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:200]
