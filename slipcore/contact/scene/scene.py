"""Scenes as users have them: described in code or in a file, simulated and explained."""

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Self, TypeVar

from slipcore.arguments import of_kind, shown
from slipcore.contact.effects import EFFECTS
from slipcore.contact.plan.description import Finger, Press, SceneDescription
from slipcore.contact.plan.entries import check_types
from slipcore.contact.plan.plan import Effect
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.scene.explain import Explanation, explain
from slipcore.errors import InvalidInput

LIBRARY = Path(__file__).parents[1] / "scenes"


@dataclass(frozen=True, slots=True)
class Scene(SceneDescription):
    """A scene that can be read from a file and can explain its effects; its entries are ``SceneDescription``'s."""

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read a scene file; a bare name is one of the library's."""
        of_kind("scene", path, str | Path)
        asked = path = Path(path)
        if not path.suffix and not path.exists():
            path = LIBRARY / f"{path}.toml"
        if not path.is_file():
            near = get_close_matches(asked.name, library())
            known = f"the library, such as {' or '.join(near)} (did you mean that?)" if near else ", ".join(library())
            raise InvalidInput("scene", asked, f"a TOML file, or one of {known}")
        try:
            entries = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise InvalidInput("scene file", path, f"TOML ({error})") from error
        return cls.from_mapping(entries)

    @classmethod
    def from_mapping(cls, entries: Mapping[str, Any]) -> Self:
        """A scene from the entries of a scene file; effects are tables with a ``kind``."""
        for name in entries:
            if name not in _ENTRIES:
                raise InvalidInput("entry of a scene", name, ", ".join(_ENTRIES))
        own = {name: value for name, value in entries.items() if name != "effect"}
        for name, kind in _PARTS.items():
            if name in own:
                own[name] = _record(kind, _table(name, own[name]))
        tables = entries.get("effect", ())
        if not isinstance(tables, list | tuple):
            raise InvalidInput("effect", shown(tables), "one table for each effect, under [[effect]]")
        return _record(cls, own | {"effects": tuple(_effect(_table("effect", table)) for table in tables)})

    def explain(self, seed: int = 0, progress: Progress = no_progress, *, all_runs: bool = False) -> Explanation:
        """What each effect is there for, what it costs and what leaving it out would change, by coarse runs.

        Raises ``ManyRuns``, with what it takes, for more than five of them that are not asked for by ``all_runs``.
        """
        return explain(self, seed, progress, all_runs=all_runs)


Record = TypeVar("Record")
_PARTS: dict[str, type[Any]] = {"finger": Finger, "press": Press}
_ENTRIES = ("name", "description", "friction", "duration", "finger", "press", "effect")


def library() -> list[str]:
    """Names of the scenes that come with the package."""
    return sorted(path.stem for path in LIBRARY.glob("*.toml"))


def _table(name: str, value: object) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise InvalidInput(name, shown(value), "a table of entries")
    return dict(value)


def _effect(table: dict[str, Any]) -> Effect:
    kind = table.pop("kind", None)
    if kind not in EFFECTS:
        raise InvalidInput("kind of effect", kind, ", ".join(sorted(EFFECTS)))
    return _record(EFFECTS[kind], table)


def _record(kind: type[Record], entries: Mapping[str, Any]) -> Record:
    """A record from a table, refused where the table lacks an entry, or has one of another name or type."""
    known = [entry.name for entry in fields(kind)]  # type: ignore[arg-type]
    for name in entries:
        if name not in known:
            raise InvalidInput(f"entry of {kind.__name__}", name, ", ".join(known))
    for entry in fields(kind):  # type: ignore[arg-type]
        if entry.name not in entries and entry.default is MISSING and entry.default_factory is MISSING:
            raise InvalidInput(f"{entry.name} of {kind.__name__}", "missing", "an entry with that name")
    check_types(kind, entries)
    return kind(**{name: _frozen(value) for name, value in entries.items()})


def _frozen(value: Any) -> Any:
    return tuple(_frozen(part) for part in value) if isinstance(value, list) else value
