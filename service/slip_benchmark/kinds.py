"""The sensors of the benchmark, and what is wrong with each in turn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from service.slip_benchmark import faults, pillars
from service.slip_benchmark.faults import Fault
from slipcore.contact.effects.force_noise import ForceNoise
from slipcore.contact.effects.marker_noise import MarkerNoise
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog


@dataclass(frozen=True, slots=True)
class Kind:
    """A sensor: ``points`` along x and y at ``pitch`` m, ``frame_rate`` 1/s, standard deviation of ``force_noise`` N
    (None: it measures no forces); ``in_plane``: it sees x and y alone, and which markers touch; what it ``says``.
    """

    name: str
    says: str
    points: tuple[int, int]
    pitch: float
    frame_rate: float
    force_noise: float | None = None
    in_plane: bool = False

    @property
    def are_pillars(self) -> bool:
        """Whether its elements are separate pillars rather than one gel."""
        return self.name == PILLARS


PILLARS = "pillars 3x3"
_LATTICE = "displacement (x, y, z) and forces of a gel, as Tac3D"
_PILLARS = "displacement and force of separate pillars at 1 kHz, as a PapillArray"
_IN_PLANE = "displacement in the plane (x, y) and which markers touch, no forces"
_WITH_DEPTH = "displacement (x, y, z), no forces, as GelSight with depth"
KINDS = {
    kind.name: kind
    for kind in (
        Kind("lattice 20x20", _LATTICE, (20, 20), 0.75e-3, 30.0, force_noise=2e-3),
        Kind(PILLARS, _PILLARS, (3, 3), pillars.PITCH, pillars.RATE, force_noise=1e-2),
        Kind("markers 10x7", _IN_PLANE, (10, 7), 1.5e-3, 25.0, in_plane=True),
        Kind("markers 30x30", _WITH_DEPTH, (30, 30), 0.5e-3, 30.0),
    )
}


@dataclass(frozen=True, slots=True)
class SensorFault:
    """What is wrong with a sensor: ``marker_noise`` m, white, beside a fault of its own by this ``name``; with no noise
    of markers there is none of forces either.
    """

    name: str
    marker_noise: float
    put_in: Fault

    def seen(self, kind: Kind, log: GraspLog, rng: np.random.Generator) -> GraspLog:
        """The log as such a sensor reports it: nothing of the object, and no truth but beside it."""
        reported = self.put_in(replace(log, normal=None, object_pose=None), rng)
        reported = MarkerNoise(self.marker_noise).observe(reported, rng)
        if kind.force_noise is None:
            reported = replace(reported, force=None)
        elif self.marker_noise:
            reported = ForceNoise(kind.force_noise).observe(reported, rng)
        return in_plane(reported) if kind.in_plane else reported


def in_plane(log: GraspLog) -> GraspLog:
    """The log of a camera without depth: x and y alone, and which markers touch."""
    assert log.truth is not None
    return replace(log, displacement=log.displacement * [1.0, 1.0, 0.0], contact=log.truth.contact)


def _nothing(log: GraspLog, _: np.random.Generator) -> GraspLog:
    return log


USUAL = 1e-6
"""m of marker noise beside each other fault."""
COMMON: Mapping[str, tuple[float, Fault]] = {
    "no noise": (0.0, _nothing),
    "noise 1 µm": (1e-6, _nothing),
    "noise 3 µm": (3e-6, _nothing),
    "noise 10 µm": (1e-5, _nothing),
    "common shake 5 µm": (USUAL, faults.shake(5e-6)),
    "correlated noise (0.9) 3 µm": (USUAL, faults.correlated(3e-6)),
    "hysteresis 5 µm": (USUAL, faults.hysteresis(5e-6)),
    "10 % of markers lost": (USUAL, faults.lost(0.1)),
    "10 % of frames dropped": (USUAL, faults.dropped(0.1)),
}
OF_FORCES, OF_MARKERS = "crosstalk 10 %", "5 % of markers freeze"
OWN: Mapping[str, Fault] = {OF_FORCES: faults.crosstalk(0.1), OF_MARKERS: faults.frozen(0.05)}


def faults_of(kind: Kind) -> tuple[SensorFault, ...]:
    """The faults of a kind, in the order in which scenes have them."""
    own = OF_MARKERS if kind.force_noise is None else OF_FORCES
    found = {**COMMON, own: (USUAL, OWN[own])}
    return tuple(SensorFault(name, noise, fault) for name, (noise, fault) in found.items())


def pairing(kinds: Sequence[Kind]) -> tuple[tuple[Kind, SensorFault], ...]:
    """Each kind with each of its faults, kinds in turn: what scenes have one after the other, and then again."""
    return tuple(
        pair
        for row in zip(*([(kind, fault) for fault in faults_of(kind)] for kind in kinds), strict=True)
        for pair in row
    )


def kinds_named(names: Sequence[str]) -> tuple[Kind, ...]:
    """The kinds of these names, all of them without names; raises ``InvalidInput``."""
    for name in names:
        if name not in KINDS or names.count(name) > 1:
            raise InvalidInput("kind", name, f"each once of {', '.join(KINDS)}")
    return tuple(kind for kind in KINDS.values() if not names or kind.name in names)
