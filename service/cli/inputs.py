"""The files that commands read: logs by their options, and what must not be written over."""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from slipcore import GraspLog


def refuse_inputs(output: Path, *inputs: Path | None) -> None:
    """Raises ``InvalidInput`` where a command would write over what it reads, or into it, by whatever name or link."""
    from slipcore import InvalidInput

    for path in inputs:
        if path is None or not path.exists() or not output.exists():
            continue
        if output.samefile(path) or output.resolve().is_relative_to(path.resolve()):
            raise InvalidInput("output", f"{output}, which is read", "another file")


def read_log(
    path: Path,
    mapping: Path | None = None,
    scale: float | None = None,
    frame_rate: float | None = None,
    rest: str | None = None,
) -> "GraspLog":
    """The log in a file, by what the options of a command say about it; raises what names the file."""
    from service import formats
    from slipcore.errors import SlipcoreError

    read_mapping = mapping_text(mapping)
    try:
        return formats.read(path, scale=scale, frame_rate=frame_rate, mapping=read_mapping, rest=rest_of(rest))
    except SlipcoreError as error:
        error.add_note(f"in {path}")
        raise


def mapping_text(path: Path | None) -> str | None:
    """What a mapping's file says, or the name of a preset; raises ``InvalidInput`` for neither."""
    from service.formats.presets import PRESETS
    from slipcore import InvalidInput

    if path is None or (str(path) in PRESETS and not path.exists()):
        return None if path is None else str(path)
    if not path.exists():
        raise InvalidInput("mapping", f"{path}, no file", f"a file of JSON, or {' or '.join(PRESETS)}")
    return path.read_text(encoding="utf-8")


def rest_of(rest: str | None) -> str | Path | None:
    """The word or number that names a frame at rest, or a file that shows the sensor alone."""
    return Path(rest) if rest is not None and Path(rest).is_file() else rest
