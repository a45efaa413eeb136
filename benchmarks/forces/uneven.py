"""Forces on gels that are not alike thick everywhere (`python -m benchmarks.forces --only "uneven gel"`).

A sphere presses on wedges (a flat surface over an inclined base), a ridge and domes (a curved surface over a flat
base), which finite elements move (benchmarks/forces/uneven_layers.py). Forces are found by the gel's map of thickness,
and by its mean thickness instead. Chosen were, by displacement alone: the thickness between a marker and a node with a
cone on wedges of 4 mm, the plane that leans with an ellipse on wedges of 2.5 to 8 mm, and that it does so by the mean
of both places on a dome of 10 % and a ridge of 20 %.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from benchmarks.forces.scenes import (
    CELL,
    CONTACTS,
    FRICTION,
    LATTICES,
    NORMAL_FORCE,
    PROGRESS,
    SIDE,
    Truth,
    press,
    repeated,
    seen,
    sphere,
    traction,
)
from benchmarks.forces.uneven_layers import Layer, Profile, moved_by_cells, moved_by_rings
from benchmarks.pages import table
from slipcore.defaults import NORMAL_95
from slipcore.forces import Gel, Reconstruction, reconstruct
from slipcore.frames import FloatArray

LATTICE = LATTICES["20 × 20"]
THICKNESS, YOUNG_MODULUS, POISSON_RATIO = 5e-3, 1e6, 0.49
HALF_WIDTH = 9.5 * LATTICE.pitch
"""m from the middle to the outermost markers."""
ASIDE = 3e-3
"""m from the middle, where contacts lie that do not lie there."""
NOISE, DRAWS = 1e-6, 2
DIRECTION = (0.96, 0.28)
"""Of the sphere's shear."""
BY_MAP, BY_MEAN = "its map", "its mean thickness"


class Shape(NamedTuple):
    """A ``form`` of gel that is thicker or thinner at the outermost markers by a ``change`` of its thickness."""

    form: str
    change: float

    def relative(self, x: FloatArray) -> FloatArray:
        """Thickness over that in the middle, at x (or at the distance from a dome's axis) m."""
        at = x / HALF_WIDTH
        by = np.clip(at, -1.4, 1.4) if self.form == "wedge" else -np.minimum(at**2, 2.1)
        return np.asarray(1.0 + self.change * by)

    def layer(self) -> Layer:
        """For finite elements."""

        def thickness(x: FloatArray) -> FloatArray:
            return THICKNESS * self.relative(x)

        def flat(x: FloatArray) -> FloatArray:
            return np.zeros_like(x)

        surface: Profile = flat if self.form == "wedge" else lambda x: thickness(x) - THICKNESS
        return Layer(YOUNG_MODULUS, POISSON_RATIO, surface, thickness, self.form == "dome")

    def at(self, position: FloatArray) -> FloatArray:
        """Relative thickness [n, m] at markers [n, m, 3] m."""
        x, y = position[..., 0], position[..., 1]
        return self.relative(np.hypot(x, y) if self.form == "dome" else x)


SHAPES = (*(Shape("wedge", change) for change in (0.0, 0.1, 0.2, 0.4)), Shape("ridge", 0.1),
          *(Shape("dome", change) for change in (0.07, 0.14)))  # fmt: skip


@dataclass(frozen=True, slots=True)
class Outcome:
    """One press: relative errors (L2 over its frames), tangential and normal, of the resultant and of the field; and
    how many intervals of 95 % ``held`` the resultant's components, alike, each of how many.
    """

    shape: str
    seen: str
    aside: float
    described: str
    resultant: tuple[float, float]
    field: tuple[float, float]
    held: tuple[tuple[int, int], tuple[int, int]]


def outcomes() -> Iterator[Outcome]:
    """Of all shapes, seen with depth and in the plane, by both descriptions."""
    for shape in SHAPES:
        for aside, truth in presses(shape):
            repeats = repeated(truth, DRAWS)
            for with_depth in (True, False):
                log = seen(repeats.log, NOISE, with_depth, np.random.default_rng(37))
                for described in (BY_MAP, BY_MEAN) if shape.change else (BY_MEAN,):
                    found = reconstruct(log, gel(shape, log.position, described), noise=NOISE)
                    yield _outcome(shape, "with z" if with_depth else "in the plane", aside, described, repeats, found)


def gel(shape: Shape, position: FloatArray, described: str) -> Gel:
    """As it is described: by its map, or by its mean thickness under the markers."""
    relative = shape.at(position)
    if described == BY_MEAN:
        return Gel(YOUNG_MODULUS, POISSON_RATIO, THICKNESS * float(relative.mean()))
    rows = tuple(map(tuple, relative.tolist()))
    return Gel(YOUNG_MODULUS, POISSON_RATIO, THICKNESS, relative_thickness=rows)


def presses(shape: Shape) -> list[tuple[float, Truth]]:
    """A sphere's, in the middle of a dome, and elsewhere also aside: by how far (m), and its truth."""
    asides = (0.0,) if shape.form == "dome" else (0.0, ASIDE)
    flat = [press("sphere", Gel(YOUNG_MODULUS, POISSON_RATIO, THICKNESS), LATTICE, (x, 0.0)) for x in asides]
    columns, rows = (CELL * (index - SIDE // 2) for index in LATTICE.indices())
    if shape.form == "dome":
        places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        moved = np.stack([_by_ring(shape, step, places) for step in PROGRESS])[None]
    else:
        loads = [traction(CONTACTS["sphere"], *step, (x, 0.0)) for x in asides for step in PROGRESS]
        moved = moved_by_cells(shape.layer(), np.stack(loads), CELL, (columns, rows))
    moved = moved.reshape(len(asides), len(PROGRESS), 3, len(rows), len(columns))
    return [(x, _with(shape, truth, part)) for x, truth, part in zip(asides, flat, moved, strict=True)]


def _by_ring(shape: Shape, step: tuple[float, float], places: FloatArray) -> FloatArray:
    """Displacement [3, j] m by a sphere on a dome's axis."""
    r = np.linspace(0.0, SIDE * CELL, 20_001)
    scale = step[0] * NORMAL_FORCE / np.trapezoid(2.0 * np.pi * r * sphere(r, 0.0 * r, *step)[0], r)

    def pressure(x: FloatArray) -> FloatArray:
        return np.asarray(scale * sphere(x, 0.0 * x, *step)[0])

    def shear(x: FloatArray) -> FloatArray:
        return np.asarray(scale * FRICTION * sphere(x, 0.0 * x, *step)[1][0] / DIRECTION[0])

    return moved_by_rings(shape.layer(), pressure, shear, DIRECTION, places)


def _with(shape: Shape, truth: Truth, moved: FloatArray) -> Truth:
    """The same forces, but on this gel, which they ``moved`` [t, 3, y, x] m so."""
    log, position = truth.log, truth.log.position.copy()
    if shape.form != "wedge":
        position[..., 2] = THICKNESS * (shape.at(position) - 1.0)
    displacement = moved.transpose(0, 3, 2, 1) * [1.0, 1.0, -1.0]
    return replace(truth, log=replace(log, position=position, displacement=displacement))


def _outcome(shape: Shape, seen_as: str, aside: float, described: str, truth: Truth, found: Reconstruction) -> Outcome:
    true = truth.log.force
    assert true is not None
    error, of_elements = found.resultant - truth.total, found.force - true
    holds = np.abs(error) <= NORMAL_95 * found.resultant_deviation
    name = f"{shape.form} {'±' if shape.form == 'wedge' else '−'} {100 * shape.change:g} %"
    return Outcome(
        name if shape.change else "flat", seen_as, aside, described,
        _parts(error, truth.total), _parts(of_elements, true),
        ((int(holds[:, :2].sum()), holds[:, :2].size), (int(holds[:, 2].sum()), holds[:, 2].size)),
    )  # fmt: skip


def _parts(error: FloatArray, true: FloatArray) -> tuple[float, float]:
    """What is tangential, and what is normal."""
    tangential, normal = (
        float(np.linalg.norm(error[part]) / np.linalg.norm(true[part])) for part in (np.s_[..., :2], np.s_[..., 2])
    )
    return tangential, normal


def uneven_table(found: list[Outcome]) -> str:
    """Errors in percent, and shares of intervals that hold the truth; tangential / normal."""
    columns = ("gel", "seen", "contact aside, mm", "described by", "resultant, %", "field, %", "inside: resultant")
    rows = [
        (
            each.shape, each.seen, f"{1e3 * each.aside:g}", each.described, _percent(each.resultant),
            _percent(each.field), " / ".join(f"{inside / count:.0%}" for inside, count in each.held),
        )
        for each in found
    ]  # fmt: skip
    return table(columns, rows)


def _percent(errors: tuple[float, float]) -> str:
    return " / ".join(f"{100.0 * error:.2g}" for error in errors)
