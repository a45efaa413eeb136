"""How often displacement at the end of a sensor's range is found, and how often there seems to be some where none is.

Presses of known contacts grow, are sheared, held and released, without noise and with it, as they are and rounded.
The rule's limits were chosen on a sphere and a flat punch on 5 mm (``TUNED``), which no table reports.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.forces.scenes import CONTACTS, LATTICES, press
from benchmarks.pages import table
from slipcore.forces import Gel
from slipcore.frames import BoolArray, FloatArray
from slipcore.saturation import saturated

STEPS = (
    *((p, 0.0) for p in np.linspace(0.05, 1.0, 20)),
    *((1.0, s) for s in np.linspace(0.05, 1.0, 15)),
    *((1.0, 1.0),) * 10,
    *((p, 0.0) for p in np.linspace(0.9, 0.1, 6)),
)
THICKNESS = {"half-space": np.inf, "5 mm": 5e-3, "2 mm": 2e-3}
TUNED = {("5 mm", "sphere"), ("5 mm", "flat punch")}
NOISES = (0.0, 1e-7, 1e-6, 3e-6, 1e-5)
ROUNDED = (0.0, 1e-7, 1e-6, 5e-6, 2e-5)
LEVELS = (0.95, 0.9, 0.8, 0.7, 0.5, 0.3)
"""Of the largest displacement, at which it is cut."""
AXES = {"z": slice(2, 3), "x and y": slice(0, 2)}
FOUND = 0.99
"""Share of the cut readings that must be found."""


@dataclass(frozen=True, slots=True)
class Detection:
    """Logs of one lattice, ``axes`` cut at a ``level`` and rounded to a ``step`` m: in how many of them it was found;
    a level of 1 is not cut, and what is found there is not so.
    """

    lattice: str
    axes: str
    step: float
    level: float
    found: int
    logs: int


def fields() -> Iterator[tuple[str, FloatArray]]:
    """Displacements [t, n, m, 3] m without noise, by the markers' lattice; nothing touches in the first three."""
    for gel, thickness in THICKNESS.items():
        for contact in CONTACTS:
            if (gel, contact) in TUNED:
                continue
            for name, lattice in LATTICES.items():
                centre = (0.21 * lattice.pitch, -0.34 * lattice.pitch)
                moved = press(contact, Gel(1e6, 0.49, thickness), lattice, centre, STEPS).log.displacement
                yield name, np.concatenate((np.zeros((3, *moved.shape[1:])), moved))


def cut(field: FloatArray, axes: slice, level: float, step: float) -> tuple[FloatArray, BoolArray]:
    """A field that ends at a level of its largest reading along some axes, and where it does."""
    end = level * np.abs(field[..., axes]).max()
    end = np.round(end / step) * step if step else end
    seen = field.copy()
    seen[..., axes] = np.clip(seen[..., axes], -end, end)
    return seen, seen != field


def detections() -> list[Detection]:
    """Of all presses, noises, roundings and levels."""
    counts: dict[tuple[str, str, float, float], list[bool]] = defaultdict(list)
    rng = np.random.default_rng(6)
    for lattice, field in fields():
        for noise in NOISES:
            noisy = field + noise * rng.standard_normal(field.shape)
            for step in ROUNDED:
                shown = np.round(noisy / step) * step if step else noisy
                counts[lattice, "any", step, 1.0].append(bool(saturated(shown).any()))
                for axes, chosen in AXES.items():
                    for level in LEVELS:
                        seen, is_cut = cut(shown, chosen, level, step)
                        if is_cut.any():
                            counts[lattice, axes, step, level].append(bool(saturated(seen)[is_cut].mean() > FOUND))
    return [Detection(*key, sum(each), len(each)) for key, each in counts.items()]


def detection_table(found: list[Detection]) -> str:
    """Shares of logs by lattice, axes and rounding."""
    columns = ("markers", "cut along", "rounded to, µm", "not cut", *(f"at {100 * level:.0f} %" for level in LEVELS))
    shares = {(d.lattice, d.axes, d.step, d.level): f"{d.found / d.logs:.0%}" for d in found}
    rows = [
        (lattice, axes, f"{1e6 * step:g}" if step else "–", shares[lattice, "any", step, 1.0],
         *(shares.get((lattice, axes, step, level), "–") for level in LEVELS))
        for lattice in LATTICES for axes in AXES for step in ROUNDED
    ]  # fmt: skip
    return table(columns, rows)
