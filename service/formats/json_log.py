"""Small logs in JSON: one object of the members, or of frames (docs/formats.md)."""

import json
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from service.formats import mapping as mappings
from service.formats.assemble import as_array, assemble
from service.formats.json_text import parse_object
from service.formats.mapping import FieldMapping, Origin, default_origins
from service.formats.members import DTYPES, ONCE
from service.formats.messages import follow
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog

MAX_JSON_BYTES = 32 * 2**20
"""Bytes of a JSON file, which takes ten times as many in memory; larger logs have better formats."""


def read(path: Path, mapping: FieldMapping | None = None) -> GraspLog:
    """Read a grasp log from a JSON file. Raises ``InvalidInput`` naming the member that is wrong."""
    document = _document(path)
    own = mappings.parse(json.dumps(document["mapping"])) if "mapping" in document else mappings.UNMAPPED
    defaults = default_origins()
    if isinstance(document.get("frames"), list):
        defaults |= {name: Origin((f"frames.{name}",), explicit=False) for name in _of_frames(document)}
    return assemble(_Document(document), mappings.chosen_over(mapping, own).over(defaults))


class _Document:
    """A JSON object; a ``Recording``."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._document = document

    def column(self, name: str, _topic: str | None, field: str, _once: bool) -> NDArray[Any] | None:
        """What a dotted path leads to."""
        value = follow(self._document, field)
        if value is None:
            self._check_absent(name, field)
            return None
        return as_array(name, value)

    def _check_absent(self, name: str, field: str) -> None:
        """Raises ``InvalidInput`` for what some frames have and others do not: it would be left out of all."""
        within, _, rest = field.partition(".")
        frames = self._document.get(within)
        if isinstance(frames, list) and rest:
            having = sum(follow(frame, rest) is not None for frame in frames)
            if having:
                raise InvalidInput(name, f"in {having} of {len(frames)} frames", "in each of them, or in none")

    def grid(self) -> None:
        """Given by the arrays' shapes alone."""

    def contents(self) -> str:
        """The object's keys."""
        return f"the keys {', '.join(self._document)}"[:300]


def _of_frames(document: dict[str, Any]) -> list[str]:
    """Members that are looked for in each of the frames: those that the object itself does not have."""
    named = [name for name in DTYPES if name not in ONCE]
    for name in named:
        if name in document and any(follow(frame, name) is not None for frame in document["frames"]):
            raise InvalidInput(name, "in the object and in its frames", "in one of the two")
    return [name for name in named if name not in document]


def _document(path: Path) -> dict[str, Any]:
    size = path.stat().st_size
    if size > MAX_JSON_BYTES:
        raise InvalidInput("file", f"{size} bytes of JSON", f"at most {MAX_JSON_BYTES} bytes")
    return parse_object("file", path.read_bytes())
