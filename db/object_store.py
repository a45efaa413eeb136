"""Blobs in an object store: S3 and what is compatible with it, or any other that ``obstore`` knows by URL."""

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from db.defaults import OBJECT_STORE_TIMEOUT
from db.errors import DriverMissing, NotFound, StorageUnavailable

_SHA256 = re.compile(r"[0-9a-f]{64}")
_CLOCK = "clock"


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
        self._obstore = obstore
        seconds = timedelta(seconds=OBJECT_STORE_TIMEOUT)
        with _answered("blob store"):
            self._store: Any = from_url(
                url,
                client_options={"timeout": seconds, "connect_timeout": seconds, "allow_http": _is_plain_http()},
                retry_config={"max_retries": 2, "retry_timeout": seconds},
            )

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
            self._obstore.put(self._store, _CLOCK, b"")
            written: datetime = self._obstore.head(self._store, _CLOCK)["last_modified"]
            self._obstore.delete(self._store, _CLOCK)
        return written

    def hashes(self, before: datetime | None = None) -> Iterator[str]:
        """Hashes of all blobs, or of those that were stored before a moment of the store's clock."""
        with _answered("blob store"):
            for page in self._obstore.list(self._store):
                for entry in page:
                    name = entry["path"].rpartition("/")[2]
                    if _SHA256.fullmatch(name) and (before is None or entry["last_modified"] < before):
                        yield name

    def delete(self, hashes: Iterable[str]) -> None:
        """Remove blobs; those that aren't there are no error."""
        keys = [_key(sha256) for sha256 in hashes]
        if keys:
            with _answered("blob store"):
                self._obstore.delete(self._store, keys)

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


def _is_plain_http() -> bool:
    """Whether an endpoint without TLS was chosen by name."""
    return os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")


def _key(sha256: str) -> str:
    return f"{sha256[:2]}/{sha256}"


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
