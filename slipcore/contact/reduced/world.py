"""A world to close a grip controller's loop in: one finger or two, a gripper, and an object that can slip."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import fftconvolve

from slipcore.arguments import shown
from slipcore.contact.defaults import WORLD
from slipcore.contact.effects.sensor_sampling import SensorSampling
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, HalfSpace
from slipcore.contact.plan.description import Finger
from slipcore.contact.reduced.kernel import (
    Bristles,
    Pad,
    Seat,
    Steps,
    advance,
    depths,
    displaced,
    pressures,
    seat_of,
)
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, Frame

GRAVITY = WORLD.gravity
"""m/s², standard."""

COMPONENTS: tuple[Component, ...] = ("xx", "yy", "xy")
"""Of displacement along the surface by traction along it."""


@dataclass(frozen=True, slots=True)
class Load:
    """What acts on the object: its ``mass`` kg, the share of its weight that something else ``supports``, and a
    ``force`` (x, y) N and ``moment`` N·m about the fingers' normal beside the weight, which is along +x.

    ``across`` N along the first finger's normal and ``tilting`` (about x, about y) N·m count where the world has a
    ``width``. All act on the object's centre.
    """

    mass: float
    supports: float = 0.0
    force: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0
    across: float = 0.0
    tilting: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_range("mass", self.mass, above=0.0, unit="kg")
        check_range("supports", self.supports, at_least=0.0, at_most=1.0)
        for name, values in (
            ("force", self.force),
            ("moment", (self.moment,)),
            ("across", (self.across,)),
            ("tilting", self.tilting),
        ):
            for value in values:
                check_range(name, value)

    def resultant(self) -> tuple[float, float, float]:
        """Force along x and y, N, and moment, N·m."""
        weight = self.mass * GRAVITY * (1.0 - self.supports)
        return weight + self.force[0], self.force[1], self.moment

    def in_six(self) -> FloatArray:
        """The same, then along the normal and about x and y, [6] N and N·m."""
        return np.array([*self.resultant(), self.across, *self.tilting])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class World:
    """Fingers on an object between them: ``friction`` [fingers, n, m], the coefficient at each bristle.

    Bristles stand on the sensor's points. They are tied by the half-space's own compliance, so that shear and torsion
    are as stiff as there, and bear Hertz's pressure of a spherical finger on a flat, rigid object, or a measured
    ``pressure`` [n, m] in any unit, whose shape is the same at any force. With a ``width`` m between two spherical
    fingers the object moves and turns in all six ways, and else along the surface and about its normal.
    ``gripper_lag`` s of the normal force behind its command; ``gel_time`` s: viscous part of the gel's compliance over
    its elastic one, which damps; ``gyration`` m: radius of gyration of the object; ``time_step`` s of the physics, with
    ``sweeps`` over the bristles in each. Noise is normal, ``marker_noise`` m a coordinate and
    ``force_noise`` N an element.
    """

    friction: FloatArray
    finger: Finger = field(default_factory=Finger)
    sampling: SensorSampling = field(default_factory=SensorSampling)
    pressure: FloatArray | None = None
    width: float | None = None
    gyration: float = WORLD.gyration
    gripper_lag: float = WORLD.gripper_lag
    gel_time: float = WORLD.gel_time
    time_step: float = WORLD.time_step
    sweeps: int = WORLD.sweeps
    marker_noise: float = 0.0
    force_noise: float = 0.0

    def __post_init__(self) -> None:
        _check_array("friction", self.friction)
        if self.pressure is not None:
            _check_array("pressure", self.pressure)
        shape = self.friction.shape
        if len(shape) != 3 or shape[0] not in (1, 2) or shape[1:] != self.sampling.points:
            raise InvalidInput("friction", f"of shape {list(shape)}", f"[1 or 2 fingers, {self.sampling.points}]")
        if not (np.isfinite(self.friction).all() and (self.friction > 0.0).all()):
            raise InvalidInput("friction", float(self.friction.min()), "finite and above 0")
        if math.isfinite(self.finger.thickness):
            raise InvalidInput("finger", self.finger, "no layer: a half-space")
        if self.pressure is None and not math.isfinite(self.finger.radius):
            raise InvalidInput("finger", self.finger, "a finite radius, of Hertz's pressure, or a measured pressure")
        self._check_pressure()
        self._check_width()
        for name in ("gyration", "gripper_lag", "time_step"):
            check_range(name, getattr(self, name), above=0.0)
        for name in ("gel_time", "marker_noise", "force_noise"):
            check_range(name, getattr(self, name), at_least=0.0)
        check_range("sweeps", self.sweeps, at_least=1)

    def _check_pressure(self) -> None:
        if self.pressure is None:
            return
        if self.pressure.shape != self.sampling.points:
            raise InvalidInput("pressure", f"of shape {list(self.pressure.shape)}", f"{list(self.sampling.points)}")
        total = float(self.pressure.sum())
        if not ((self.pressure >= 0.0).all() and 0.0 < total < math.inf):
            raise InvalidInput(
                "pressure", f"{self.pressure.min():g} to {self.pressure.max():g}", "0 or more, not all 0"
            )

    def _check_width(self) -> None:
        if self.width is None:
            return
        check_range("width", self.width, above=0.0, unit="m")
        if len(self.friction) != 2 or self.pressure is not None:
            raise InvalidInput("width", self.width, "none, but between two spherical fingers")

    @property
    def position(self) -> FloatArray:
        """The sensor's points at rest, [n, m, 3] m."""
        points, pitch = self.sampling.points, self.sampling.pitch
        axes = [pitch * (np.arange(count) - 0.5 * (count - 1)) for count in points]
        return np.stack([*np.meshgrid(*axes, indexing="ij"), np.zeros(points)], axis=-1)

    @property
    def normal(self) -> FloatArray:
        """Outward normals that forces refer to, [n, m, 3]: loads act on the undeformed plane, as in a simulated log."""
        return np.broadcast_to([0.0, 0.0, 1.0], (*self.sampling.points, 3))

    @property
    def element_area(self) -> float:
        """Area of an element, m²."""
        return self.sampling.pitch**2

    def contact(self, normal_force: float) -> HertzContact:
        """One finger's contact under ``normal_force`` N."""
        compliance = half_space(self.finger.young_modulus, self.finger.poisson_ratio)
        return HertzContact(self.finger.radius, normal_force, compliance)


class WorldState(NamedTuple):
    """The world between two frames, never written to; arrays as ``kernel.advance`` has them.

    ``pose`` [6] of the object and its ``velocity`` are in the first finger's frame: along x and y and about z, then
    along z and about x and y (m, m, rad, m, rad, rad), where the world has a ``width``; ``normal_force`` [f] N of the
    gripper; ``force`` [f, n, m, 2] N on each element; ``offset`` [f, n, m, 2] m by which each has slipped (NaN: apart);
    ``slip`` [f, n, m]; ``load`` [6] that acted last.
    """

    pad: Pad
    time: float
    normal_force: FloatArray
    pose: FloatArray
    velocity: FloatArray
    force: FloatArray
    offset: FloatArray
    slip: BoolArray
    load: FloatArray

    @property
    def slipped(self) -> FloatArray:
        """How far the middle of each contact has slipped, [f] m: nothing unless all of it does."""
        n, m = self.slip.shape[1:]
        along, across = self.offset[:, n // 2, m // 2].T
        return np.asarray(np.hypot(along, across))


def init(world: World, normal_force: float) -> WorldState:
    """Fingers at rest on the object, each pressed with ``normal_force`` N, without load."""
    check_range("normal_force", normal_force, above=0.0, unit="N")
    shape = world.friction.shape
    nothing = np.zeros((*shape, 2))
    return WorldState(
        _pad(world),
        0.0,
        np.full(shape[0], float(normal_force)),
        np.zeros(6),
        np.zeros(6),
        nothing,
        nothing.copy(),
        np.zeros(shape, bool),
        np.zeros(6),
    )


def step(world: World, state: WorldState, command: ArrayLike, load: Load, duration: float) -> WorldState:
    """The world ``duration`` s later: gripper commanded to ``command`` N (of each finger, or one for all), the load
    changing evenly from the last one.

    Raises ``InvalidInput`` for a negative command and for a mass too small for the physics' time step.
    """
    commands = np.broadcast_to(np.asarray(command, float), state.normal_force.shape).copy()
    for value in commands:
        check_range("command", float(value), at_least=0.0, unit="N")
    count = max(round(check_range("duration", duration, above=0.0, unit="s") / world.time_step), 1)
    length = duration / count
    _check_stiffness(world, max(*commands, *state.normal_force), load.mass, length)
    size = world.friction[0].size
    after = load.in_six()
    normal, motion = state.normal_force.copy(), np.stack([state.pose, state.velocity])
    fingers = len(commands)
    force, offset = (part.reshape(fingers, size, 2).copy() for part in (state.force, state.offset))
    slip = state.slip.reshape(fingers, size).copy()
    steps = Steps(
        count,
        length,
        world.sweeps,
        world.gripper_lag,
        world.gel_time,
        load.mass,
        load.mass * world.gyration**2,
        *_between(world),
    )
    friction = world.friction.reshape(fingers, size)
    bristles = Bristles(force, offset, slip)
    advance(state.pad, steps, friction, commands, np.stack([state.load, after]), normal, motion, bristles)
    return WorldState(
        state.pad,
        state.time + duration,
        normal,
        motion[0],
        motion[1],
        force.reshape(state.force.shape),
        offset.reshape(state.offset.shape),
        slip.reshape(state.slip.shape),
        after,
    )


def observe(world: World, state: WorldState, finger: int = 0, generator: np.random.Generator | None = None) -> Frame:
    """What the sensor of one finger sees, as a detector takes it; without a ``generator`` there is no noise."""
    points, seat = world.friction.shape[1:], _seat(world, state, finger)
    shear = state.force[finger].reshape(-1, 2)
    force = np.column_stack([shear, -pressures(state.pad, seat.normal, seat.x, seat.y)]).reshape(*points, 3)
    depth = depths(state.pad, seat.normal, world.finger.radius, seat.x, seat.y)
    displacement = np.column_stack([displaced(state.pad, shear), -depth]).reshape(*points, 3)
    if generator is not None:
        displacement = displacement + world.marker_noise * generator.standard_normal(displacement.shape)
        force = force + world.force_noise * generator.standard_normal(force.shape)
    return Frame(state.time, displacement, force, None, world.normal)


def stick_ratio(world: World, state: WorldState, finger: int = 0) -> float:
    """True share of the contact's elements that do not slip; NaN without contact."""
    touching = _normal(world, state, finger) > 0.0
    return 1.0 - float(state.slip[finger][touching].mean()) if touching.any() else math.nan


def _normal(world: World, state: WorldState, finger: int) -> FloatArray:
    seat = _seat(world, state, finger)
    return pressures(state.pad, seat.normal, seat.x, seat.y).reshape(world.friction.shape[1:])


def _seat(world: World, state: WorldState, finger: int) -> Seat:
    """How the object sits on a finger."""
    return seat_of(state.pad, float(state.normal_force[finger]), state.pose, 1.0 - 2.0 * finger, *_between(world))


def _between(world: World) -> tuple[float, float, float]:
    """Half of the width between the fingers, m, the radius of their balls, m, and their E*, Pa; 0 without a width."""
    if world.width is None:
        return 0.0, 0.0, 0.0
    compliance = half_space(world.finger.young_modulus, world.finger.poisson_ratio)
    return 0.5 * world.width, world.finger.radius, compliance.contact_modulus


def _pad(world: World) -> Pad:
    n, m = world.sampling.points
    grid = Grid((m, n), (world.sampling.pitch, world.sampling.pitch))
    body = HalfSpace.from_young(world.finger.young_modulus, world.finger.poisson_ratio)
    rows, columns = (np.arange(1 - count, count) for count in (n, m))
    table = np.zeros((len(rows), len(columns), 3))
    for entry, component in enumerate(COMPONENTS):
        quadrant = body.influence(component, grid)
        if quadrant is not None:
            table[..., entry] = quadrant.T[np.ix_(abs(rows), abs(columns))] / world.element_area
    table[..., 2] *= np.sign(np.outer(rows, columns))
    x, y = world.position[..., 0].ravel(), world.position[..., 1].ravel()
    place = np.add.outer(np.arange(n) * len(columns), np.arange(m)).ravel()
    same = (n - 1) * len(columns) + m - 1
    pad = Pad(x.copy(), y.copy(), place, table.reshape(-1, 3), same, 0.0)
    if world.pressure is None:
        return pad._replace(pressing=world.contact(1.0).contact_radius ** 3)
    share = world.pressure.ravel() / world.pressure.sum()
    return pad._replace(share=share, depth=_depth(body, grid, share.reshape(n, m)).ravel())


def _depth(body: HalfSpace, grid: Grid, force: FloatArray) -> FloatArray:
    """Normal displacement [n, m] m by the normal ``force`` [n, m] N on the elements."""
    n, m = force.shape
    quadrant = body.influence("nn", grid)
    assert quadrant is not None  # whatever presses displaces
    table = quadrant.T[np.ix_(*(abs(np.arange(1 - count, count)) for count in (n, m)))]
    return np.asarray(fftconvolve(table, force / grid.cell_area, mode="valid"))


def _check_array(name: str, given: object) -> None:
    if not isinstance(given, np.ndarray):
        raise InvalidInput(name, shown(given), "an array, of a value at each of the sensor's points")


def _check_stiffness(world: World, normal_force: float, mass: float, length: float) -> None:
    """Refuse a mass that the contact's stiffness 8Ga/(2 − ν) moves too fast for the time step, or that across it."""
    shear = world.finger.young_modulus / (2.0 * (1.0 + world.finger.poisson_ratio))
    if world.pressure is None:
        radius = world.contact(normal_force).contact_radius
    else:
        radius = math.sqrt(np.count_nonzero(world.pressure) * world.element_area / math.pi)
    stiffness = len(world.friction) * 8.0 * shear * radius / (2.0 - world.finger.poisson_ratio)
    if world.width is not None:
        half_width, sphere, modulus = _between(world)
        tilt = stiffness * half_width**2 + 2.0 * normal_force * (half_width + sphere)
        stiffness = max(stiffness, 4.0 * modulus * radius, tilt / world.gyration**2)
    least = stiffness * length * (length + 2.0 * world.gel_time) / WORLD.most_stiff
    if mass < least:
        raise InvalidInput("mass", f"{mass:g} kg", f"at least {least:.3g} kg with steps of {length:g} s")
