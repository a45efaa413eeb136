"""Presses on a gel whose forces are known: what sensors that see only their markers move are given.

Each contact prescribes pressure and shear in closed form; their means over cells of 0.15 mm, five or ten to a marker,
are the truth, and markers move by these cells' influence. A reconstruction (bilinear between nodes one to a marker)
can therefore represent none of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve

from slipcore import GraspLog
from slipcore.contact.elasticity.bonded_layer import LayerBase
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, HalfSpace
from slipcore.contact.elasticity.interior import Below, Interior
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.forces import Gel
from slipcore.frames import FloatArray

CELL = 0.15e-3
SIDE = 101
"""Cells along a side of the truth's square grid: odd, so that one lies under the middle."""
SAMPLES = 8
"""Points a cell and axis at which closed forms are averaged; none lies where a pressure is infinite."""
FRICTION = 0.4
NORMAL_FORCE, TANGENTIAL_SHARE = 10.0, 0.7
"""N, and the largest tangential force over friction times this."""
PROGRESS = ((0.5, 0.0), (1.0, 0.5), (1.0, 1.0))
"""Of normal and of tangential load, frame by frame."""

Indices = NDArray[np.int64]
Shape = Callable[[FloatArray, FloatArray, float, float], tuple[FloatArray, FloatArray]]
"""From x and y (m) and progress: pressure in any unit, and shear (x, y) as a share of friction times pressure."""


def _sphere(
    x: FloatArray, y: FloatArray, press: float, shear: float, radius: float = 3.5e-3
) -> tuple[FloatArray, FloatArray]:
    """Hertz, and sideways Cattaneo and Mindlin: pressure and the size of its shear over friction."""
    a = radius * np.cbrt(press)
    c = a * np.cbrt(1.0 - TANGENTIAL_SHARE * shear)
    square = x**2 + y**2
    pressure = np.sqrt(np.maximum(a**2 - square, 0.0))
    return pressure, pressure - np.sqrt(np.maximum(c**2 - square, 0.0))


def sphere(x: FloatArray, y: FloatArray, press: float, shear: float) -> tuple[FloatArray, FloatArray]:
    """A sphere that is pressed and pushed along x and a little along y."""
    pressure, slid = _sphere(x, y, press, shear)
    return pressure, np.multiply.outer([0.96, 0.28], slid)


def flat_punch(x: FloatArray, y: FloatArray, _press: float, shear: float) -> tuple[FloatArray, FloatArray]:
    """A circular punch with a flat face, which sticks; infinite at its rim."""
    inside = (3e-3) ** 2 - x**2 - y**2
    pressure = np.where(inside > 0.0, 1.0 / np.sqrt(np.maximum(inside, 1e-18)), 0.0)
    return pressure, np.multiply.outer([0.6, -0.8], TANGENTIAL_SHARE * shear * pressure)


def ring(x: FloatArray, y: FloatArray, press: float, shear: float) -> tuple[FloatArray, FloatArray]:
    """A ring of 3.2 mm radius that is pushed and turned."""
    r, width = np.maximum(np.hypot(x, y), CELL), 1.3e-3 * np.sqrt(press)
    pressure = np.sqrt(np.maximum(width**2 - (r - 3.2e-3) ** 2, 0.0))
    turned = np.stack((0.7 - 0.6 * y / r, 0.6 * x / r))
    return pressure, TANGENTIAL_SHARE * shear * pressure * turned


def tilted_edge(x: FloatArray, y: FloatArray, press: float, shear: float) -> tuple[FloatArray, FloatArray]:
    """A block that stands on one of its edges, where pressure is infinite."""
    along, width = (x + 1.5e-3), 3e-3 * press
    on = (along > 0.0) & (along < width) & (np.abs(y) < 3e-3)
    pressure = np.where(on, np.sqrt(np.maximum(width - along, 0.0) / np.maximum(along, 1e-9)), 0.0)
    return pressure, np.multiply.outer([0.0, 1.0], TANGENTIAL_SHARE * shear * pressure)


def two_contacts(x: FloatArray, y: FloatArray, press: float, shear: float) -> tuple[FloatArray, FloatArray]:
    """Two spheres that are pushed in different directions."""
    first, slid = _sphere(x + 2.8e-3, y + 1.2e-3, press, shear, 2e-3)
    second, slid_too = _sphere(x - 2.6e-3, y - 1.8e-3, press, shear, 1.6e-3)
    return first + second, np.multiply.outer([1.0, 0.0], slid) + np.multiply.outer([0.0, -1.0], slid_too)


CONTACTS: dict[str, Shape] = {
    "sphere": sphere,
    "flat punch": flat_punch,
    "ring": ring,
    "tilted edge": tilted_edge,
    "two contacts": two_contacts,
}


class Lattice(NamedTuple):
    """Markers along x and y, and their pitch in cells."""

    shape: tuple[int, int]
    cells: int

    @property
    def pitch(self) -> float:
        """Between markers, m."""
        return self.cells * CELL

    def indices(self) -> list[Indices]:
        """Cells under the markers, along x and along y."""
        return [self.cells * np.arange(n) - self.cells * (n - 1) // 2 + SIDE // 2 for n in self.shape]


LATTICES = {"20 × 20": Lattice((20, 20), 5), "10 × 7": Lattice((10, 7), 10)}


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """A press without noise: the ``log``, whose forces are true, and the true ``area`` [t] m² of contact.

    ``total`` [t, 3] N and ``moment`` [t] N m about z, also of what lies beyond the markers' elements.
    """

    log: GraspLog
    area: FloatArray
    total: FloatArray
    moment: FloatArray


@lru_cache(maxsize=4)
def influence(gel: Gel) -> FloatArray:
    """Displacement (x, y, into the gel) by 1 Pa along each of them on one cell, at all offsets: [3, 3, n, n] m."""
    grid = Grid((SIDE, SIDE), (CELL, CELL))
    if gel.marker_depth > 0.0:
        body = Interior(gel.young_modulus, gel.poisson_ratio, gel.thickness, gel.marker_depth)
        quadrants = body.influences(grid)
    else:
        quadrants = _at_the_surface(gel, grid)
    whole = np.empty((3, 3, 2 * SIDE - 1, 2 * SIDE - 1))
    offset = np.arange(1 - SIDE, SIDE)
    sign = {"x": np.sign(offset)[None, :], "y": np.sign(offset)[:, None]}
    for name, quadrant in quadrants.items():
        to, by = ("xyz".index(letter) for letter in name.replace("n", "z"))
        kernel = quadrant[np.ix_(np.abs(offset), np.abs(offset))]
        for axis in "xy":
            kernel = kernel * sign[axis] if name.count(axis) == 1 else kernel
        whole[to, by] = kernel
    whole[1, 0] = whole[0, 1]
    return whole


def _at_the_surface(gel: Gel, grid: Grid) -> dict[Below, FloatArray]:
    free = HalfSpace.from_young(gel.young_modulus, gel.poisson_ratio)
    base = () if np.isinf(gel.thickness) else (LayerBase(gel.thickness, gel.young_modulus, gel.poisson_ratio),)
    operator = ElasticOperator((free, *base), grid)
    kernels: dict[Below, FloatArray] = {}
    for name in get_args(Component):
        kernel = operator.influence(name)
        kernels[name] = np.zeros(grid.shape) if kernel is None else kernel
    return kernels | {"xz": -kernels["zx"], "yz": -kernels["zy"]}


def traction(shape: Shape, press: float, shear: float, centre: tuple[float, float]) -> FloatArray:
    """Means over the cells of shear along x and y and of pressure, [3, n, n] Pa."""
    axis = CELL * (np.arange(SIDE * SAMPLES) + 0.5) / SAMPLES - 0.5 * CELL * SIDE
    y, x = np.meshgrid(axis - centre[1], axis - centre[0], indexing="ij")
    pressure, slid = shape(x, y, press, shear)
    fine = np.concatenate((FRICTION * slid, pressure[None]))
    cells = fine.reshape(3, SIDE, SAMPLES, SIDE, SAMPLES).mean(axis=(2, 4))
    return np.asarray(cells * (press * NORMAL_FORCE / (cells[2].sum() * CELL**2)))


def anywhere(contact: str, rng: np.random.Generator) -> Shape:
    """A contact of up to a quarter more or less in size, turned at random."""
    shape, scale, angle = CONTACTS[contact], rng.uniform(0.75, 1.2), rng.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

    def turned(x: FloatArray, y: FloatArray, press: float, shear: float) -> tuple[FloatArray, FloatArray]:
        along, across = np.tensordot(turn, np.stack((x, y)), 1) / scale
        pressure, slid = shape(along, across, press, shear)
        return pressure, np.tensordot(turn.T, slid, 1)

    return turned


def press(
    contact: str | Shape,
    gel: Gel,
    lattice: Lattice,
    centre: tuple[float, float] = (0.0, 0.0),
    steps: Sequence[tuple[float, float]] = PROGRESS,
) -> Truth:
    """A contact on a gel, frame by frame, as markers without noise show it."""
    columns, rows = lattice.indices()
    kernel, moved, force, area, total, moment = influence(gel), [], [], [], [], []
    middle_of = CELL * (np.arange(SIDE) - SIDE // 2)
    for step in steps:
        loads = traction(CONTACTS[contact] if isinstance(contact, str) else contact, *step, centre)
        everywhere = oaconvolve(kernel, loads[None], mode="same", axes=(-2, -1)).sum(axis=1)
        middle = slice(SIDE // 2, SIDE // 2 + SIDE)
        moved.append(everywhere[:, middle, middle][:, rows][:, :, columns])
        force.append(_on_elements(loads, lattice))
        area.append(np.count_nonzero(loads[2]) * CELL**2)
        total.append(CELL**2 * loads.sum(axis=(1, 2)))
        moment.append(CELL**2 * float((middle_of * loads[1] - middle_of[:, None] * loads[0]).sum()))
    outward = np.array([1.0, 1.0, -1.0])
    x, y = (CELL * (index - SIDE // 2) for index in (columns, rows))
    position = np.stack((*np.meshgrid(x, y, indexing="ij"), np.zeros(lattice.shape)), axis=-1)
    displacement, forces = (np.stack(field).transpose(0, 3, 2, 1) * outward for field in (moved, force))
    log = GraspLog(np.arange(len(steps)) / 30.0, position, displacement, lattice.pitch**2, forces)
    return Truth(log, np.array(area), np.stack(total) * outward, np.array(moment))


def _on_elements(loads: FloatArray, lattice: Lattice) -> FloatArray:
    """Forces (N) on the markers' square elements, [3, ny, nx]; a cell on the border of two counts half for each."""
    sums = loads * CELL**2
    width = lattice.cells
    weight = np.ones(width) if width % 2 else np.concatenate(([0.5], np.ones(width - 1), [0.5]))
    for axis, index in zip((1, 2), lattice.indices()[::-1], strict=True):
        around = index[:, None] + np.arange(len(weight)) - len(weight) // 2
        padded = np.moveaxis(sums, axis, -1)
        inside = (around >= 0) & (around < SIDE)
        taken = np.where(inside, padded[..., np.clip(around, 0, SIDE - 1)], 0.0)
        sums = np.moveaxis(taken @ weight, -1, axis)
    return sums


def repeated(truth: Truth, times: int) -> Truth:
    """Each frame so many times, one after the other."""
    log = truth.log
    assert log.force is not None
    displacement, force, area, total, moment = (
        np.repeat(field, times, axis=0)
        for field in (log.displacement, log.force, truth.area, truth.total, truth.moment)
    )
    again = replace(log, time=np.arange(len(total)) / 30.0, displacement=displacement, force=force)
    return Truth(again, area, total, moment)


def seen(log: GraspLog, noise: float, with_depth: bool, rng: np.random.Generator) -> GraspLog:
    """What a sensor with this noise (m) shows, in the plane or with depth; forces are kept as the truth."""
    displacement = log.displacement + noise * rng.standard_normal(log.displacement.shape)
    if not with_depth:
        displacement[..., 2] = 0.0
    return replace(log, displacement=displacement)
