"""Every default with its unit, range and source: `python -m benchmarks.defaults --page docs/defaults.md`; a second."""

from collections.abc import Iterator
from dataclasses import MISSING, fields

from benchmarks.pages import options, picture_folder, table, write
from benchmarks.sensitivity.rows import tables_of_options
from slipcore.options import Option, describe_options
from stiction_client import ControlSettings
from stiction_client.controller.settings import Gain, gains

COLUMNS = ("of", "default", "value", "unit", "from", "to", "source")

Row = tuple[str, str, str, str, str, str, str]


def rows() -> Iterator[Row]:
    """Of each method and table in turn, and of grip control."""
    for label, kind in tables_of_options().items():
        described = describe_options(kind)
        for entry in fields(kind):
            yield _row(label, entry.name, entry.default, described[entry.name])
    for entry in fields(ControlSettings):
        if entry.default is not MISSING:
            yield _row("ControlSettings", entry.name, entry.default, gains()[entry.name])


def _row(label: str, name: str, value: float, described: Option | Gain) -> Row:
    low, high, unit, source = described
    shown = [f"{each:.12g}" for each in (value, low, high)]
    return label, f"`{name}`", shown[0], unit, *shown[1:], source


def main() -> None:
    """Renew the page."""
    arguments = options(__doc__).parse_args()
    found = list(rows())
    picture_folder(arguments)
    write(found, {"defaults": table(COLUMNS, found)}, arguments, "defaults.json")


if __name__ == "__main__":
    main()
