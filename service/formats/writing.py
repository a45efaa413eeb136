"""Write grasp logs: as Stiction's own container, as Parquet or as MCAP, each read back bit for bit."""

from pathlib import Path

from service import formats
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from stiction_client import container

SUFFIXES = {"npz": ".npz", "parquet": ".parquet", "mcap": ".mcap"}
"""Formats that are written, and how the names of their files end."""


def write(log: GraspLog, path: Path, name: str) -> None:
    """Write a log in the format ``name``; raises ``UnsupportedFormat`` where its library is missing."""
    if name == "npz":
        container.write(log, path)
    else:
        formats.module_of(name).write(log, path)


def format_of(path: Path) -> str:
    """The format that a file's name asks for; raises ``InvalidInput``."""
    for name, suffix in SUFFIXES.items():
        if path.suffix.lower() == suffix:
            return name
    raise InvalidInput("output", path.name, f"a name that ends in {', '.join(SUFFIXES.values())}")
