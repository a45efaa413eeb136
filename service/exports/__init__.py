"""Grasp logs with their slip state, for viewers and learners of others: one module each."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from service.formats import EXTRA, import_with_library
from service.whole_files import write_whole
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from slipcore.slip_state import SlipHistory


@dataclass(frozen=True, slots=True, eq=False)
class DetectedLog:
    """A log, what was detected in it, and its name."""

    log: GraspLog
    history: SlipHistory
    name: str


@dataclass(frozen=True, slots=True)
class Target:
    """Where logs go: the module that writes it, how its files' names end, what installs its library, and whether it
    takes several logs.
    """

    module: str
    suffix: str
    install: str = f"pip install 'stiction[{EXTRA}]'"
    takes_many: bool = False


TARGETS = {
    "foxglove": Target("service.exports.foxglove", ".mcap"),
    "rerun": Target("service.exports.rerun", ".rrd", "pip install rerun-sdk (171 MB)"),
    "lerobot": Target("service.exports.lerobot", "", takes_many=True),
}
"""By name; a name without an ending is a folder."""


def target_of(output: Path) -> str:
    """What an output's name asks for; raises ``InvalidInput``."""
    for name, target in TARGETS.items():
        if output.suffix.lower() == target.suffix:
            return name
    allowed = ", ".join(target.suffix or "no ending (a folder)" for target in TARGETS.values())
    raise InvalidInput("output", output.name, f"a name with the ending {allowed}")


def check_output(output: Path, name: str) -> None:
    """Raises ``InvalidInput`` where something is that an export would take the place of, as it may be its input."""
    if TARGETS[name].suffix:
        if output.exists():
            raise InvalidInput("output", output, "a file that is not there yet")
    elif output.exists() and (output.is_file() or any(output.iterdir())):
        raise InvalidInput("output", output, "a folder that is empty or not there yet")
    elif output.resolve() == Path.cwd():  # the new folder would not be the one that the shell is in
        raise InvalidInput("output", f"{output}, the folder that you are in", "another, empty or not there yet")


def write(recordings: Sequence[DetectedLog], output: Path, name: str) -> None:
    """Write a new file or folder, whole or not at all.

    Raises as ``check_output``, ``InvalidInput`` for several logs in a file of one, and ``UnsupportedFormat`` where a
    library is missing.
    """
    check_output(output, name)
    target = TARGETS[name]
    if len(recordings) > 1 and not target.takes_many:
        raise InvalidInput("logs", len(recordings), f"one log a file for {name}")
    module = import_with_library(target.module, name, target.install)
    write_whole(output, lambda beside: module.write(recordings, beside))
