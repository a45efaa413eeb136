"""Sealed scenes: grasps drawn from a phrase that nobody knew before, so that no method can be tuned to them.

Loads, bodies and friction are drawn anew for each scene; a draw whose load friction cannot carry is drawn again.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from service.slip_benchmark.kinds import KINDS, Kind, SensorFault, pairing
from service.slip_benchmark.pillars import PillarGrasp
from slipcore.contact import Finger, Press, Scene, simulate
from slipcore.contact.effects.finite_layer import FiniteLayer
from slipcore.contact.effects.load_path import LoadPath
from slipcore.contact.effects.normal_tangential_coupling import NormalTangentialCoupling
from slipcore.contact.effects.object_motion import ObjectMotion
from slipcore.contact.effects.pressure_friction import PressureFriction
from slipcore.contact.effects.random_friction import RandomFriction
from slipcore.contact.effects.sensor_sampling import SensorSampling
from slipcore.contact.effects.surface_shape import CylinderSurface, SphereSurface
from slipcore.contact.effects.torsion import Torsion
from slipcore.contact.plan.plan import Effect
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.errors import SlipcoreError
from slipcore.frames import FloatArray, GraspLog, GroundTruth

FORMAT, VERSION = "stiction-slip-benchmark", 1
FIDELITY = Fidelity(cells=32, substeps=1, tolerance=1e-5)
REST = 0.3
"""s before the touch, in which nothing moves."""
TRIES = 20
"""Draws of one scene until friction carries its load."""

Value = TypeVar("Value", bound=np.generic)


@dataclass(frozen=True, slots=True)
class SealedScene:
    """Scene ``index`` of those that a ``phrase`` draws for some ``kinds`` of sensors, however many there are."""

    phrase: str
    index: int
    kinds: tuple[Kind, ...] = tuple(KINDS.values())

    @property
    def name(self) -> str:
        """Of its files."""
        return f"{self.index:04d}"

    @property
    def sensor(self) -> tuple[Kind, SensorFault]:
        """Kinds and faults go in turn, and are no secret."""
        pairs = pairing(self.kinds)
        return pairs[self.index % len(pairs)]

    def generator(self, attempt: int) -> np.random.Generator:
        """What all of it is drawn with; nobody gets it from the hash that the manifest gives."""
        digest = hashlib.sha256(f"{FORMAT} {VERSION}, scenes: {self.phrase}".encode()).digest()
        return np.random.default_rng(np.random.SeedSequence(int.from_bytes(digest), spawn_key=(self.index, attempt)))

    def make(self) -> tuple[GraspLog, GraspLog]:
        """The grasp as it is, and as the sensor reports it, both at the sensor's frames and with the truth."""
        kind, fault = self.sensor
        for attempt in range(TRIES):
            rng = self.generator(attempt)
            try:
                true = _pillars(rng) if kind.are_pillars else with_rest(simulate_gel(rng, kind))
                break
            except SlipcoreError as error:
                refused = error
        else:
            raise refused
        seen = fault.seen(kind, true, rng)
        return true.take(np.isin(true.time, seen.time)), seen


def seal(phrase: str) -> str:
    """What a manifest says of its phrase: enough to recognise it, not enough to draw a scene."""
    return hashlib.sha256(phrase.encode()).hexdigest()


# Gels, by boundary elements.


@dataclass(frozen=True, slots=True)
class DrawnPress:
    """A press that is drawn: ``friction``, normal ``force`` N, Hertz's contact ``radius`` m, and the ``finger``."""

    friction: float
    force: float
    radius: float
    finger: Finger

    @property
    def sliding(self) -> float:
        """Tangential force at which all of it slides, N."""
        return self.friction * self.force

    @property
    def turning(self) -> float:
        """Moment at which all of it turns, N·m, of Hertz's pressure."""
        return 3.0 * np.pi / 16.0 * self.sliding * self.radius

    @property
    def give(self) -> float:
        """How far the object moves until all slides, m (Mindlin, 1949)."""
        shear_modulus = 0.5 * self.finger.young_modulus / (1.0 + self.finger.poisson_ratio)
        return 3.0 * self.sliding * (2.0 - self.finger.poisson_ratio) / (16.0 * shear_modulus * self.radius)


def simulate_gel(rng: np.random.Generator, kind: Kind) -> GraspLog:
    """A gel that is pressed and then loaded or moved sideways."""
    body, (family, carried) = _body(rng), _FAMILIES[rng.integers(len(_FAMILIES))]
    effects, least = _variety(rng, kind, body)
    loaded, duration = family(rng, body, least * carried)
    sampling = SensorSampling(kind.points, kind.pitch, kind.frame_rate)
    scene = Scene("sealed", (sampling, *effects, *loaded), body.finger, body.friction, Press(body.force, 0.5), duration)
    return simulate(scene, fidelity=FIDELITY, seed=int(rng.integers(2**31)))


def _body(rng: np.random.Generator) -> DrawnPress:
    finger = Finger(
        radius=float(rng.uniform(10e-3, 25e-3)),
        young_modulus=_evenly(rng, 0.4e6, 1.5e6),
        poisson_ratio=float(rng.uniform(0.42, 0.49)),
    )
    radius = float(rng.uniform(3e-3, 5.5e-3))
    modulus = finger.young_modulus / (1.0 - finger.poisson_ratio**2)
    return DrawnPress(_evenly(rng, 0.25, 0.9), 4.0 * modulus * radius**3 / (3.0 * finger.radius), radius, finger)


def _variety(rng: np.random.Generator, kind: Kind, body: DrawnPress) -> tuple[list[Effect], float]:
    """What the object and its surface are like, and the share of the sliding force that this leaves."""
    effects: list[Effect] = []
    carried = 1.0
    shape = rng.random()
    if shape < 0.15:
        effects.append(SphereSurface(float(rng.uniform(5.0, 30.0))))
    elif shape < 0.3:
        effects.append(CylinderSurface(float(rng.uniform(5.0, 30.0)), float(rng.uniform(0.0, np.pi))))
    if rng.random() < 0.4:
        effects.append(FiniteLayer(float(rng.uniform(4e-3, 8e-3))))
    if rng.random() < 0.25:
        effects.append(NormalTangentialCoupling())
    law = rng.random()
    if law < 0.2:
        effects.append(RandomFriction(float(rng.uniform(0.04, 0.12)) * body.friction, 1e-3))
        carried = 0.9
    elif law < 0.4:
        fall = float(rng.uniform(0.1, 0.3))  # of friction under the greatest pressure
        peak = 1.5 * body.force / (np.pi * body.radius**2) * kind.pitch**2
        effects.append(PressureFriction(-fall * body.friction / peak, kind.pitch**2))
        carried = 1.0 - 1.2 * fall
    return effects, carried


Loaded = tuple[tuple[Effect, ...], float]
"""Effects that load or move the object, and how long the scene lasts, s."""


def _pull(rng: np.random.Generator, body: DrawnPress, carried: float) -> Loaded:
    """Pulled along a line, then held."""
    end = 0.7 + float(rng.uniform(0.8, 1.8))
    level, angle = carried * rng.uniform(0.7, 0.97) * body.sliding, rng.uniform(0.0, 2.0 * np.pi)
    return (_loads((0.7, end), np.array([[0.0, 0.0], [1.0, 0.0]]) * level, angle),), end + 0.3


def _back_and_forth(rng: np.random.Generator, body: DrawnPress, carried: float) -> Loaded:
    """Pulled, pulled back, and pulled again."""
    time = 0.7 + np.cumsum([0.0, *rng.uniform(0.5, 1.0, 3)])
    levels = carried * body.sliding * np.array([0.0, 1.0, -1.0, 1.0]) * [0.0, *rng.uniform(0.6, 0.95, 3)]
    along = np.stack([levels, np.zeros(4)], axis=-1)
    return (_loads(tuple(time), along, rng.uniform(0.0, 2.0 * np.pi)),), float(time[-1]) + 0.1


def _wander(rng: np.random.Generator, body: DrawnPress, carried: float) -> Loaded:
    """Force and its direction wander while the grip changes."""
    time = 0.7 + np.cumsum([0.0, *rng.uniform(0.3, 0.6, 5)])
    extra = body.force * np.r_[0.0, rng.uniform(-0.4, 0.3, 5)]
    level = 0.95 * carried * body.friction * (body.force + extra) * np.r_[0.0, rng.uniform(0.3, 0.9, 5)]
    angle = rng.uniform(0.0, 2.0 * np.pi) + np.cumsum(rng.normal(0.0, 0.7, 6))
    along = level[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return (replace(_loads(tuple(time), along, 0.0), normal_force=_plain(extra)),), float(time[-1]) + 0.1


def _twist(rng: np.random.Generator, body: DrawnPress, carried: float) -> Loaded:
    """Turned about the normal while something pulls a little."""
    end = 0.7 + float(rng.uniform(0.8, 1.5))
    share, turn = carried * rng.uniform(0.6, 0.9), rng.uniform(0.5, 1.4)
    moment = float(rng.choice([-1.0, 1.0]) * share * np.sin(turn) * body.turning * 0.85)
    along = np.array([[0.0, 0.0], [share * np.cos(turn) * body.sliding, 0.0]])
    pulled = _loads((0.7, end), along, rng.uniform(0.0, 2.0 * np.pi))
    return (pulled, Torsion(moment, 0.7, end - 0.7)), end + 0.3


def _grip(rng: np.random.Generator, body: DrawnPress, carried: float) -> Loaded:
    """Held by a load while the grip loosens, or tightens before it is pulled further."""
    time = 0.7 + np.cumsum([0.0, *rng.uniform(0.4, 0.9, 2), rng.uniform(0.6, 1.2)])
    share, angle = rng.uniform(0.4, 0.7), rng.uniform(0.0, 2.0 * np.pi)
    more = rng.uniform(0.3, 0.8) if rng.random() < 0.5 else share / rng.uniform(0.75, 0.92) - 1.0
    last = share if more < 0.0 else min(0.9 * (1.0 + more), 1.3)
    levels = carried * body.sliding * np.array([0.0, share, share, last])
    extra = body.force * np.array([0.0, 0.0, more, more])
    if more < 0.0:  # it loosens to the end
        extra[2] = 0.0
    path = _loads(tuple(time), np.stack([levels, np.zeros(4)], axis=-1), angle)
    return (replace(path, normal_force=_plain(extra)),), float(time[-1]) + 0.2


def _slide(rng: np.random.Generator, body: DrawnPress, _: float) -> Loaded:
    """Moved along until all of it slides, and half of the time back."""
    way = rng.uniform(1.1, 1.6) * body.give + rng.uniform(0.0, 2e-3)
    angle, end = rng.uniform(0.0, 2.0 * np.pi), 0.7 + float(rng.uniform(1.0, 2.0))
    back = end + float(rng.uniform(0.4, 0.9))
    ways = np.array([0.0, way, way * (rng.uniform(-0.3, 0.6) if rng.random() < 0.5 else 1.0)])
    x, y = ways * np.cos(angle), ways * np.sin(angle)
    return (ObjectMotion((0.7, end, back), _plain(x), _plain(y)),), back + 0.1


def _turn_and_slide(rng: np.random.Generator, body: DrawnPress, _: float) -> Loaded:
    """Moved and turned until all of it slides."""
    end = 0.7 + float(rng.uniform(1.0, 2.0))
    way, angle = rng.uniform(0.6, 1.5) * body.give, rng.uniform(0.0, 2.0 * np.pi)
    yaw = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.5) * body.give / body.radius)
    there = (float(way * np.cos(angle)), float(way * np.sin(angle)))
    return (ObjectMotion((0.7, end), (0.0, there[0]), (0.0, there[1]), (0.0, yaw)),), end + 0.2


def _let_go(rng: np.random.Generator, body: DrawnPress, _: float) -> Loaded:
    """Pressed, held and released: next to nothing slips."""
    end = 1.0 + float(rng.uniform(0.5, 0.8))
    return (LoadPath((1.0, end), normal_force=(0.0, -0.93 * body.force)),), end


_FAMILIES = (
    *((_pull, 1.0),) * 3,
    *((_back_and_forth, 1.0),) * 3,
    *((_wander, 1.0),) * 2,
    *((_twist, 1.0),) * 2,
    *((_grip, 0.95),) * 3,
    *((_slide, 1.0),) * 4,
    *((_turn_and_slide, 1.0),) * 2,
    (_let_go, 1.0),
)
"""Ways to load a gel with the share of the sliding force that they may go to, each as often as it is drawn."""


def _loads(time: tuple[float, ...], along: FloatArray, angle: float) -> LoadPath:
    """Forces [k, 2] N at times, turned by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return LoadPath(
        tuple(float(t) for t in time),
        force_x=_plain(c * along[:, 0] - s * along[:, 1]),
        force_y=_plain(s * along[:, 0] + c * along[:, 1]),
    )


def _plain(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _evenly(rng: np.random.Generator, low: float, high: float) -> float:
    """A factor between two, evenly on a logarithmic scale."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def with_rest(log: GraspLog) -> GraspLog:
    """The log after some time in which nothing touched."""
    assert log.truth is not None
    assert log.force is not None
    step = float(np.median(np.diff(log.time)))
    count = round(REST / step)
    truth = log.truth
    return replace(
        log,
        time=np.r_[np.arange(count) * step, log.time - log.time[0] + count * step],
        displacement=_before(log.displacement, count),
        force=_before(log.force, count),
        normal=None,
        object_pose=None if log.object_pose is None else _before(log.object_pose, count),
        truth=GroundTruth(
            contact=_before(truth.contact, count),
            slip_kinematic=_before(truth.slip_kinematic, count),
            slip_contact_factor=_before(truth.slip_contact_factor, count),
            stick_ratio=np.r_[np.full(count, np.nan), truth.stick_ratio],
            friction=truth.friction,
        ),
    )


def _before(field: NDArray[Value], count: int) -> NDArray[Value]:
    """The field after so many frames of nothing."""
    return np.concatenate([np.zeros((count, *field.shape[1:]), field.dtype), field])


# Pillars, in closed form.


def _pillars(rng: np.random.Generator) -> GraspLog:
    """A plate that is pressed on pillars, and moved and turned over them while the grip may change."""
    friction, depth = _evenly(rng, 0.3, 0.9), float(rng.uniform(0.7e-3, 1.5e-3))
    time = np.cumsum([0.0, 0.25, *rng.uniform(0.3, 0.5, 1), 0.15, *rng.uniform(0.4, 0.8, 2)])
    full = friction * depth * 6.5 / 3.0  # m that a pillar bends until it slips
    ways, angle = full * _ways(rng), rng.uniform(0.0, 2.0 * np.pi)
    grip = depth * rng.choice([1.0, 1.0, 0.6, 1.4])
    turned = rng.random() < 0.4
    yaw = float(rng.uniform(-1.2, 1.2)) * full / 7e-3 if turned else 0.0
    return PillarGrasp(
        "sealed",
        friction,
        _plain(time),
        (-1e-4, -1e-4, depth, depth, depth, float(grip)),
        x=_plain(ways * np.cos(angle)),
        y=_plain(ways * np.sin(angle)),
        yaw=(0.0, 0.0, 0.0, 0.0, 0.5 * yaw, yaw),
        tilt=(float(rng.uniform(-0.03, 0.03)), float(rng.uniform(-0.03, 0.03))),
        seed=int(rng.integers(2**31)),
    ).simulate()


def _ways(rng: np.random.Generator) -> FloatArray:
    """Where the plate is at each knot, as a share of what a pillar bends: on, there and back, or nowhere."""
    first = rng.uniform(0.5, 1.3)
    last = rng.choice([first + rng.uniform(0.2, 0.8), -rng.uniform(0.2, 1.0), first])
    return np.array([0.0, 0.0, 0.0, 0.0, first, last])
