"""What commands put on pages: small pictures, and tables between `<!-- table NAME -->` and `<!-- end -->`."""

import argparse
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image


def options(description: str | None) -> argparse.ArgumentParser:
    """A command with a folder for its results, and the page that it may renew."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"), help="folder for JSON and pictures")
    parser.add_argument("--page", type=Path, help="page to renew, with its pictures in images/ beside it")
    return parser


def picture_folder(arguments: argparse.Namespace) -> Path:
    """Where pictures go: beside the page, or with the results. Both folders are made."""
    pictures: Path = arguments.output if arguments.page is None else arguments.page.parent / "images"
    for folder in (arguments.output, pictures):
        folder.mkdir(parents=True, exist_ok=True)
    return pictures


def write(
    numbers: object, tables: Mapping[str, str], arguments: argparse.Namespace, name: str, partly: bool = False
) -> None:
    """Write the numbers as JSON, and renew the page if there is one, or ``partly`` what of its tables is made anew."""
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / name).write_text(json.dumps(numbers, indent=1), encoding="utf-8")
    if arguments.page is not None:
        renew(arguments.page, tables, partly)


def renew(page: Path, tables: Mapping[str, str], partly: bool = False) -> None:
    """Put Markdown tables, by name, in the place of those that the page has; ``partly``: their cells alone."""
    text = page.read_text(encoding="utf-8")
    for name, made in tables.items():
        pattern = rf"(<!-- table {re.escape(name)} -->\n)(.*?)\n?(<!-- end -->)"
        found = list(re.finditer(pattern, text, flags=re.DOTALL))
        if len(found) != 1:
            raise SystemExit(f"{page} has {len(found)} places for the table {name}; needed: one")
        head, old, end = found[0].groups()
        text = text.replace(found[0][0], f"{head}{merged(old, made) if partly else made}\n{end}")
    page.write_text(text, encoding="utf-8")


def merged(old: str, new: str) -> str:
    """An old Markdown table with the cells that a new one has, by what begins their row and heads their column."""
    columns, *rows = _cells(old)
    heads, *changed = _cells(new)
    cells = {(row[0], head): cell for row in changed for head, cell in zip(heads, row, strict=True)}
    unknown = [row[0] for row in changed if row[0] not in [each[0] for each in rows]] + [
        head for head in heads if head not in columns
    ]
    if unknown:
        raise SystemExit(f"the page's table has no {', '.join(unknown)}; make it anew as a whole")
    return table(
        columns, [[cells.get((row[0], head), was) for head, was in zip(columns, row, strict=True)] for row in rows]
    )


def _cells(text: str) -> list[list[str]]:
    """Of a Markdown table, without the line below its head."""
    lines = [line.strip().removeprefix("| ").removesuffix(" |").split(" | ") for line in text.strip().splitlines()]
    return [lines[0], *lines[2:]]


def save(picture: Figure, path: Path) -> None:
    """Write a small PNG: 256 colours are plenty for lines and maps."""
    buffer = io.BytesIO()
    picture.savefig(buffer, dpi=100, bbox_inches="tight")
    Image.open(buffer).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE).save(path, optimize=True)


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; numbers with three digits."""
    lines = [columns, ["---"] * len(columns), *([_cell(value) for value in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(value: object) -> str:
    if isinstance(value, (float, np.floating)):
        return "–" if np.isnan(value) else f"{value:.3g}" if abs(value) < 1000.0 else f"{value:.0f}"
    return str(value)
