"""Style and scripts of the pages, whose addresses change with their content: files of our own, and Swagger UI's."""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

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


SWAGGER_UI = ("swagger-ui-bundle.js", "swagger-ui.css")
"""Files of Swagger UI (Apache 2.0) that a wheel brings; of its Python nothing is imported."""


@cache
def all_assets() -> dict[str, Asset]:
    """Every file of the folder ``static``, by name."""
    folder = files("service.web") / "static"
    return {file.name: _asset(file.name, file.read_bytes()) for file in folder.iterdir()}


@cache
def swagger_ui() -> dict[str, Asset]:
    """The files of Swagger UI, by name: 1.7 MB, read when the API's description is first looked at."""
    wheel = find_spec("fastapi_offline")
    assert wheel is not None
    assert wheel.submodule_search_locations is not None
    folder = Path(wheel.submodule_search_locations[0]) / "static"
    return {name: _asset(name, (folder / name).read_bytes()) for name in SWAGGER_UI}


def find_asset(name: str) -> Asset | None:
    """A file by its name."""
    return swagger_ui()[name] if name in SWAGGER_UI else all_assets().get(name)


def _asset(name: str, content: bytes) -> Asset:
    suffix = name[name.rindex(".") :]
    return Asset(name, content, TYPES[suffix], hashlib.blake2b(content, digest_size=8).hexdigest())


def path_of(name: str) -> str:
    """The address of a file, for the templates; raises ``LookupError`` for one that is not there."""
    found = find_asset(name)
    if found is None:
        raise LookupError(f"there is no file {name} among the style and scripts")
    return found.path
