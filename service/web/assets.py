"""Style and scripts of the pages: files of our own, whose addresses change with their content."""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

TYPES = {".css": "text/css; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".svg": "image/svg+xml"}


@dataclass(frozen=True, slots=True)
class Asset:
    """A file, its content type, and the digest of its content that stands in its address."""

    name: str
    content: bytes
    content_type: str
    digest: str

    @property
    def path(self) -> str:
        """Where it is served, and may be kept for ever."""
        return f"/assets/{self.digest}/{self.name}"


@cache
def all_assets() -> dict[str, Asset]:
    """Every file of the folder ``static``, by name."""
    folder = files("service.web") / "static"
    return {file.name: _asset(file.name, file.read_bytes()) for file in folder.iterdir()}


def _asset(name: str, content: bytes) -> Asset:
    suffix = name[name.rindex(".") :]
    return Asset(name, content, TYPES[suffix], hashlib.blake2b(content, digest_size=8).hexdigest())


def path_of(name: str) -> str:
    """The address of a file, for the templates; raises ``KeyError`` for one that is not there."""
    return all_assets()[name].path
