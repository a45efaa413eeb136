"""What a notebook shows of a record."""

from collections.abc import Iterable
from html import escape

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 360.0, 60.0
"""Of a curve, in pixels."""


def summary(title: str, rows: Iterable[tuple[str, object]], below: str = "") -> str:
    """A table of names and values as HTML, all of it escaped; ``below``: HTML of our own."""
    lines = "".join(f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in rows)
    return f"<div><strong>{escape(title)}</strong><table>{lines}</table>{below}</div>"


def curve(values: NDArray[np.float64], label: str) -> str:
    """Values from 0 to 1 [t] as a small picture; what is NaN leaves a gap."""
    step = max(1, len(values) // int(WIDTH))
    shown = values[::step]
    across = WIDTH / max(len(shown) - 1, 1)
    before = np.append(np.nan, shown[:-1])
    points = " ".join(
        f"{'M' if np.isnan(before[k]) else 'L'}{k * across:.1f} {(1.0 - shown[k]) * HEIGHT:.1f}"
        for k in np.flatnonzero(~np.isnan(shown))
    )
    box = f'viewBox="0 -2 {WIDTH:g} {HEIGHT + 4:g}" width="{WIDTH:g}" role="img" aria-label="{escape(label)}"'
    return f'<svg {box}><path d="{points}" fill="none" stroke="#0072b2" stroke-width="1.5"/></svg>'
