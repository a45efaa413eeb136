"""What commands put on pages: small pictures, and tables between `<!-- table NAME -->` and `<!-- end -->`."""

import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image


def renew(page: Path, tables: Mapping[str, str]) -> None:
    """Put Markdown tables, by name, in the place of those that the page has."""
    text = page.read_text(encoding="utf-8")
    for name, table in tables.items():
        pattern = rf"(<!-- table {re.escape(name)} -->\n).*?(<!-- end -->)"
        text, count = re.subn(pattern, lambda found, made=table: f"{found[1]}{made}\n{found[2]}", text, flags=re.DOTALL)
        if count != 1:
            raise SystemExit(f"{page} has {count} places for the table {name}; needed: one")
    page.write_text(text, encoding="utf-8")


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
        return "–" if np.isnan(value) else f"{value:.3g}"
    return str(value)
