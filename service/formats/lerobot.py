"""A LeRobot data set (v3.0) as a folder: its episodes, and which of its files each is in (docs/formats.md)."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from service.formats import LEROBOT_INFO
from service.formats.json_text import parse_object
from service.formats.mapping import UNMAPPED, FieldMapping
from slipcore.errors import InvalidInput

VERSION = "v3."
"""What the versions of data sets that are read begin with."""

CONVERTER = "lerobot.datasets.v30.convert_dataset_v21_to_v30"
"""LeRobot's own program that brings older data sets to this version."""

EPISODES = "meta/episodes/*/*.parquet"
PLACE = ("data/chunk_index", "data/file_index")
COLUMNS = ("episode_index", "tasks", *PLACE)

DATA_PATH = re.compile(r"(?:[^{}]|\{(?:chunk|file)_index(?::0?\dd)?\})+")
"""Where files of frames are; other formats could ask for a text as long as they like."""


@dataclass(frozen=True, slots=True)
class Episode:
    """An episode: its number, the file of frames that has it among others, and what was done in it."""

    number: int
    file: Path
    task: str | None


def episodes(folder: Path, mapping: FieldMapping | None = None) -> list[Episode]:
    """All episodes of a data set, or the one that the mapping asks for.

    Raises ``InvalidInput`` for another version, for damage, and where the displacement is not among the features.
    """
    info = _info(folder)
    mapped = mapping or UNMAPPED
    _check_features(info["features"], mapped)
    found = _episodes(folder, info["data_path"])
    chosen = [each for each in found if mapped.episode in (None, each.number)]
    if not chosen:
        raise _not_one(mapped, found)
    return chosen


def episode(folder: Path, mapping: FieldMapping | None = None) -> tuple[Episode, FieldMapping]:
    """The episode that the mapping asks for, or the only one, and the mapping with its number."""
    mapped = mapping or UNMAPPED
    found = episodes(folder, mapped)
    if len(found) > 1:
        raise _not_one(mapped, found)
    return found[0], replace(mapped, episode=found[0].number)


def _not_one(mapping: FieldMapping, found: list[Episode]) -> InvalidInput:
    numbers = ", ".join(str(each.number) for each in found[:20]) + (", …" if len(found) > 20 else "")
    return InvalidInput("episode", "missing" if mapping.episode is None else mapping.episode, f"one of {numbers}")


def _info(folder: Path) -> dict[str, Any]:
    try:
        info = parse_object(LEROBOT_INFO, (folder / LEROBOT_INFO).read_text(encoding="utf-8"))
        version, features = str(info["codebase_version"]), info["features"]
        {name: feature["shape"] for name, feature in features.items()}
        needed = {"features": features, "data_path": str(info["data_path"])}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        value = f"damaged ({type(error).__name__}: {str(error)[:80]})"
        raise InvalidInput(LEROBOT_INFO, value, "the description that LeRobot writes") from error
    if not version.startswith(VERSION):
        raise InvalidInput("codebase_version", version[:20], f"v3.0; python -m {CONVERTER} brings older ones to it")
    if not DATA_PATH.fullmatch(needed["data_path"]):
        allowed = "a path with {chunk_index:03d} and {file_index:03d}"
        raise InvalidInput("data_path", repr(needed["data_path"])[:60], allowed)
    return needed


def _check_features(features: dict[str, Any], mapping: FieldMapping) -> None:
    """Raises ``InvalidInput`` where what slip is found from, displacement or forces, is not there, with what is."""
    origin = mapping.origins.get("displacement")
    has_forces = "force" in mapping.origins or "observation.force" in features
    wanted = origin.fields if origin else ("observation.displacement",)
    missing = [name for name in wanted if name not in features and (origin or not has_forces)]
    if missing:
        given = ", ".join(f"{name} {feature['shape']}" for name, feature in features.items() if "." in name)
        allowed = f"a mapping that names the features of the markers; the data set has {given or 'no observations'}"
        raise InvalidInput("displacement", f"not among the features ({missing[0]})", allowed[:600])


def _episodes(folder: Path, data_path: str) -> list[Episode]:
    try:
        tables = [pq.read_table(path, columns=list(COLUMNS)) for path in sorted(folder.glob(EPISODES))]
        rows = [row for table in tables for row in table.to_pylist()]
        found = [Episode(int(row["episode_index"]), _file(folder, data_path, row), _task(row)) for row in rows]
    except InvalidInput:
        raise
    except (pa.ArrowException, OSError, LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        value = f"damaged ({type(error).__name__}: {str(error)[:80]})"
        raise InvalidInput(EPISODES, value, f"a complete table of {', '.join(COLUMNS)}") from error
    if not found:
        raise InvalidInput(EPISODES, "without episodes", "one episode or more")
    return sorted(found, key=lambda each: each.number)


def _file(folder: Path, data_path: str, row: dict[str, Any]) -> Path:
    """The file of frames, which has to be inside of the data set."""
    chunk, number = (int(row[name]) for name in PLACE)
    file = folder / data_path.format(chunk_index=chunk, file_index=number)
    try:
        is_inside = file.resolve().is_relative_to(folder.resolve())
    except RuntimeError:  # a link that leads to itself
        is_inside = False
    if not is_inside:
        raise InvalidInput("data_path", repr(data_path)[:60], "a path inside of the data set")
    if not file.is_file():
        raise InvalidInput("data set", f"without {file.relative_to(folder)}", "all files that its episodes are in")
    return file


def _task(row: dict[str, Any]) -> str | None:
    return ", ".join(map(str, row["tasks"])) if row["tasks"] else None
