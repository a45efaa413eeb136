"""A world to close a grip controller's loop in: one finger or two, a gripper, and an object that can slip."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipcore.contact.defaults import WORLD
from slipcore.contact.effects.sensor_sampling import SensorSampling
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, HalfSpace
from slipcore.contact.plan.description import Finger
from slipcore.contact.reduced.kernel import Bristles, Pad, Steps, advance, depths, displaced, pressures
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
    """

    mass: float
    supports: float = 0.0
    force: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0

    def __post_init__(self) -> None:
        check_range("mass", self.mass, above=0.0, unit="kg")
        check_range("supports", self.supports, at_least=0.0, at_most=1.0)
        for name, value in (("force", self.force[0]), ("force", self.force[1]), ("moment", self.moment)):
            check_range(name, value)

    def resultant(self) -> tuple[float, float, float]:
        """Force along x and y, N, and moment, N·m."""
        weight = self.mass * GRAVITY * (1.0 - self.supports)
        return weight + self.force[0], self.force[1], self.moment


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class World:
    """Fingers on an object between them: ``friction`` [fingers, n, m], the coefficient at each bristle.

    Bristles stand on the sensor's points. They are tied by the half-space's own compliance, so that shear and torsion
    are as stiff as there, and bear Hertz's pressure of a spherical finger on a flat, rigid object.
    ``gripper_lag`` s of the normal force behind its command; ``gel_time`` s: viscous part of the gel's compliance over
    its elastic one, which damps; ``gyration`` m: radius of gyration of the object; ``time_step`` s of the physics, with
    ``sweeps`` over the bristles in each. Noise is normal, ``marker_noise`` m a coordinate and
    ``force_noise`` N an element.
    """

    friction: FloatArray
    finger: Finger = field(default_factory=Finger)
    sampling: SensorSampling = field(default_factory=SensorSampling)
    gyration: float = WORLD.gyration
    gripper_lag: float = WORLD.gripper_lag
    gel_time: float = WORLD.gel_time
    time_step: float = WORLD.time_step
    sweeps: int = WORLD.sweeps
    marker_noise: float = 0.0
    force_noise: float = 0.0

    def __post_init__(self) -> None:
        shape = self.friction.shape
        if len(shape) != 3 or shape[0] not in (1, 2) or shape[1:] != self.sampling.points:
            raise InvalidInput("friction", f"of shape {list(shape)}", f"[1 or 2 fingers, {self.sampling.points}]")
        if not (np.isfinite(self.friction).all() and (self.friction > 0.0).all()):
            raise InvalidInput("friction", float(self.friction.min()), "finite and above 0")
        if not math.isfinite(self.finger.radius) or math.isfinite(self.finger.thickness):
            raise InvalidInput("finger", self.finger, "a finite radius and no layer: Hertz's pressure on a half-space")
        for name in ("gyration", "gripper_lag", "time_step"):
            check_range(name, getattr(self, name), above=0.0)
        for name in ("gel_time", "marker_noise", "force_noise"):
            check_range(name, getattr(self, name), at_least=0.0)
        check_range("sweeps", self.sweeps, at_least=1)

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

    ``pose`` [3] of the object (m, m, rad) and its ``velocity`` are in the first finger's frame; ``normal_force`` [f] N;
    ``force`` [f, n, m, 2] N on each element; ``offset`` [f, n, m, 2] m by which each has slipped (NaN:
    apart); ``slip`` [f, n, m];
    ``load`` [3] that acted last.
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
        np.zeros(3),
        np.zeros(3),
        nothing,
        nothing.copy(),
        np.zeros(shape, bool),
        np.zeros(3),
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
    after = np.asarray(load.resultant())
    normal, motion = state.normal_force.copy(), np.stack([state.pose, state.velocity])
    fingers = len(commands)
    force, offset = (part.reshape(fingers, size, 2).copy() for part in (state.force, state.offset))
    slip = state.slip.reshape(fingers, size).copy()
    steps = Steps(
        count, length, world.sweeps, world.gripper_lag, world.gel_time, load.mass, load.mass * world.gyration**2
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
    points, normal = world.friction.shape[1:], float(state.normal_force[finger])
    shear = state.force[finger].reshape(-1, 2)
    force = np.column_stack([shear, -pressures(state.pad, normal)]).reshape(*points, 3)
    depth = depths(state.pad, normal, world.finger.radius)
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
    return pressures(state.pad, float(state.normal_force[finger])).reshape(world.friction.shape[1:])


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
    return Pad(x.copy(), y.copy(), place, table.reshape(-1, 3), same, world.contact(1.0).contact_radius ** 3)


def _check_stiffness(world: World, normal_force: float, mass: float, length: float) -> None:
    """Refuse a mass that the contact's stiffness 8Ga/(2 − ν) moves too fast for the time step."""
    shear = world.finger.young_modulus / (2.0 * (1.0 + world.finger.poisson_ratio))
    radius = world.contact(normal_force).contact_radius
    stiffness = len(world.friction) * 8.0 * shear * radius / (2.0 - world.finger.poisson_ratio)
    least = stiffness * length * (length + 2.0 * world.gel_time) / WORLD.most_stiff
    if mass < least:
        raise InvalidInput("mass", f"{mass:g} kg", f"at least {least:.3g} kg with steps of {length:g} s")
