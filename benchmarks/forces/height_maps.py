"""Normal forces by maps of height (`python -m benchmarks.forces --only "height maps"`).

Presses of benchmarks/forces/scenes.py as a depth camera sees them: each of its pixels shows how high the gel stands at
a *place*, which is not where its point was at rest, with noise of its own. Files of such maps are read as users' are,
with so many elements across as the grid says. The truth is a pixel's own cell of constant traction; a reconstruction
has bilinear ones, one to an element, and is told nothing of forces along the surface.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from scipy.ndimage import map_coordinates

from benchmarks.forces.scenes import CELL, PROGRESS, SIDE, Lattice, Truth, press, repeated
from benchmarks.pages import table
from service import formats
from slipcore import GraspLog
from slipcore.defaults import NORMAL_95
from slipcore.forces import Gel, reconstruct
from slipcore.frames import BoolArray, FloatArray

PIXELS = Lattice((SIDE - 1, SIDE - 1), 1)
"""A pixel a cell, 0.15 mm wide: 100 × 100."""
GELS = {"half-space": np.inf, "5 mm": 5e-3, "2 mm": 2e-3}
SHOWN = ("sphere", "ring")
NOISES = (0.0, 10e-6, 30e-6)
"""Of a pixel, m; twenty-five of them are an element of a grid of 20 × 20."""
GRID, GRIDS = 20, (10, 25, 33)
"""Elements along a side, and those that it is compared with."""
LOADS = {"straight": PROGRESS[:1], "sheared": PROGRESS[1:]}
"""Presses straight down, and with up to 2.8 N aside."""
HELD = 5
"""Frames of each load, by which noise shows."""
SETTLED = 10
"""Steps in which the point that came to a place is found: each leaves as much as a length is stretched, a quarter."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One press, by load: relative errors (L2 over its frames) of the resultant normal ``force`` and of ``elements``'
    forces, and how many intervals of 95 % ``held`` these, each of how many; and ``seconds`` of CPU for the log.
    """

    gel: str
    contact: str
    side: int
    noise: float
    force: dict[str, float]
    elements: dict[str, float]
    held: dict[str, tuple[int, int]]
    held_elements: dict[str, tuple[int, int]]
    seconds: float


def cases() -> Iterator[tuple[str, str, int, float]]:
    """Gel, contact, elements along a side and noise: gels, contacts and noises on one grid, then grids."""
    for gel, contact, noise in product(GELS, SHOWN, NOISES):
        yield gel, contact, GRID, noise
    for side in GRIDS:
        yield "5 mm", "sphere", side, NOISES[1]


def outcome(gel: str, contact: str, side: int, noise: float) -> Outcome:
    """Of one press, by a file of its maps."""
    described = Gel(1e6, 0.49, GELS[gel])
    truth = repeated(press(contact, described, PIXELS), HELD)
    log = read(heights(truth, noise, np.random.default_rng(31)), side)
    began = time.process_time()
    found = reconstruct(log, described)
    seconds = time.process_time() - began
    true, total = on_elements(truth, side), truth.total[:, 2]
    error, of_elements = found.resultant[1:, 2] - total, found.force[1:, ..., 2] - true  # after the frame at rest
    holds = np.abs(error) <= NORMAL_95 * found.resultant_deviation[1:, 2]
    holds_elements = np.abs(of_elements) <= NORMAL_95 * found.deviation[1:, ..., 2]
    touched = found.contact[1:] | (true < 0.0)
    straight = HELD * len(LOADS["straight"])
    parts = dict(zip(LOADS, (slice(straight), slice(straight, None)), strict=True))
    return Outcome(
        gel, contact, side, noise,
        {load: _relative(error[part], total[part]) for load, part in parts.items()},
        {load: _relative(of_elements[part], true[part]) for load, part in parts.items()},
        {load: _count(holds[part]) for load, part in parts.items()},
        {load: _count(holds_elements[part][touched[part]]) for load, part in parts.items()}, seconds,
    )  # fmt: skip


def _relative(error: FloatArray, true: FloatArray) -> float:
    return float(np.linalg.norm(error) / np.linalg.norm(true))


def _count(holds: BoolArray) -> tuple[int, int]:
    return int(holds.sum()), holds.size


def heights(truth: Truth, noise: float, rng: np.random.Generator) -> FloatArray:
    """Maps [1 + t, rows, columns] m, the first at rest: what rises at each place, which its point came to sideways."""
    moved = truth.log.displacement.transpose(0, 3, 2, 1)
    maps = np.stack([np.zeros(moved.shape[2:]), *map(_at_places, moved)])
    return np.asarray(maps + noise * rng.standard_normal(maps.shape))


def _at_places(moved: FloatArray) -> FloatArray:
    """What rises [rows, columns] m at each place, by displacements [3, rows, columns] m of the points."""
    place = np.indices(moved.shape[1:]).astype(float)
    came_from = place
    for _ in range(SETTLED):
        aside = [map_coordinates(moved[axis], came_from, order=1, mode="nearest") for axis in (1, 0)]
        came_from = place - np.array(aside) / CELL
    return np.asarray(map_coordinates(moved[2], came_from, order=1, mode="nearest"))


def read(maps: FloatArray, side: int) -> GraspLog:
    """What the service makes of a file of these maps, with so many elements along a side."""
    mapping = {"height": "depth", "pixel": CELL, "grid": [side, side]}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "maps.h5"
        with h5py.File(path, "w") as file:
            file["time"], file["depth"] = np.arange(len(maps)) / 30.0, maps
            file.attrs["stiction_mapping"] = json.dumps(mapping)
        return formats.read(path)


def on_elements(truth: Truth, side: int) -> FloatArray:
    """True normal forces [t, side, side] N on the elements of a grid; a cell on a border counts by its area."""
    assert truth.log.force is not None
    edges = np.linspace(0.0, PIXELS.shape[0], side + 1)
    cells = np.arange(PIXELS.shape[0])
    share = np.clip(np.minimum(edges[1:, None], cells + 1.0) - np.maximum(edges[:-1, None], cells), 0.0, 1.0)
    return np.asarray(np.einsum("ri,tji,cj->trc", share, truth.log.force[..., 2], share))


def height_table(found: list[Outcome]) -> str:
    """A row a press; errors in percent, straight / sheared, and shares of intervals that hold the truth."""
    columns = ("gel", "contact", "elements", "noise of a pixel, µm", "F_z, %", "field, %", "inside: F_z", "element",
               "CPU, s")  # fmt: skip
    rows = [
        (
            each.gel, each.contact, f"{each.side} × {each.side}", f"{1e6 * each.noise:g}",
            *(" / ".join(f"{100.0 * of[load]:.2g}" for load in LOADS) for of in (each.force, each.elements)),
            *(" / ".join(f"{of[load][0] / of[load][1]:.0%}" for load in LOADS)
              for of in (each.held, each.held_elements)),
            each.seconds,
        )
        for each in found
    ]  # fmt: skip
    return table(columns, rows)
