"""Scenes that detectors are tuned on, and others that they are only scored on.

Three disjoint sets: ``TUNING`` (the defaults of slipcore were chosen on these), ``SCORING`` (simulated, never looked at
while choosing) and ``REFERENCE`` (an independent solver's, ../shared/data/contact; scoring only). Simulated truth is
kept under .cache, by a hash of the scene.
"""

import hashlib
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slipcore import FrictionLaw, GraspLog, GroundTruth
from slipcore.contact.boundary_elements import Fidelity
from slipcore.contact.effects import (
    CylinderSurface,
    ElasticObject,
    FlatSurface,
    FrictionPatch,
    LoadPath,
    NormalTangentialCoupling,
    ObjectMotion,
    PressingSpread,
    PressureFriction,
    RandomFriction,
    RingSurface,
    SensorSampling,
    SphereSurface,
    Torsion,
    VelocityFriction,
    Viscoelasticity,
    WavySurface,
)
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.contact.simulate import simulate

CACHE = Path(".cache/detector_scenes")
REFERENCES = Path("../shared/data/contact")
PITCH = 0.75e-3
FIDELITY = Fidelity(cells=32, substeps=1, tolerance=1e-5)
REFERENCE = ("cond1", "cond4", "reversal", "ring", "cond1_layer5c")


def scene(name: str, *effects: object, force: float, friction: float, duration: float, **finger: float) -> Scene:
    """A 20 × 20 sensor at 30 frames a second, pressed within ½ s."""
    sampling = SensorSampling((20, 20), PITCH, 30.0)
    press = Press(force, 0.5)
    return Scene(name, (sampling, *effects), Finger(**finger), friction, press, duration)  # type: ignore[arg-type]


def tuning() -> list[Scene]:
    """Scenes that defaults may be chosen on."""
    return [
        scene("ramp", _shear(0.7, 2.4, 3.8), force=8.0, friction=0.5, duration=2.6),
        scene("diagonal", LoadPath((0.7, 2.2), force_x=(0, -2.4), force_y=(0, 2.0)),
              force=9.0, friction=0.36, duration=2.4, radius=12e-3),
        scene("twist", Torsion(9e-3, 0.7, 1.5), force=8.0, friction=0.5, duration=2.4),
        scene("normal force rises", LoadPath((0.7, 1.5, 1.7, 2.4, 3.2), force_x=(0, 2.4, 2.4, 2.4, 4.6),
              normal_force=(0, 0, 0, 6.0, 6.0)), force=8.0, friction=0.4, duration=3.3),
        scene("normal force falls", LoadPath((0.7, 1.4, 1.6, 2.6), force_x=(0, 2.0, 2.0, 2.0),
              normal_force=(0, 0, 0, -5.8)), force=12.0, friction=0.4, duration=2.7),
        scene("back and forth", LoadPath((0.7, 1.4, 1.6, 2.8, 3.6), force_x=(0, 3.1, 3.1, -3.1, 1.5)),
              force=8.0, friction=0.45, duration=3.7),
        scene("cup", RingSurface(3.8e-3, 2.5e-3), LoadPath((0.7, 2.2), force_x=(0, 4.0), moment=(0, 6e-3)),
              force=14.0, friction=0.4, duration=2.3, radius=20e-3),
        scene("coupled", NormalTangentialCoupling(), _shear(0.7, 2.2, 3.4), force=10.0, friction=0.4,
              duration=2.4, poisson_ratio=0.42),
        scene("friction of speed and load", VelocityFriction(2.0), PressureFriction(-0.5, PITCH**2),
              _shear(0.7, 2.2, 3.0), force=10.0, friction=0.42, duration=2.4),
        scene("press only", PressingSpread(), force=12.0, friction=0.5, duration=1.5, poisson_ratio=0.4),
        scene("hold and release", LoadPath((0.7, 1.4, 2.2, 2.6, 3.2), force_x=(0, 3.2, 3.2, 0.6, 0.0),
              normal_force=(0, 0, 0, -2.0, -9.2)), force=9.5, friction=0.45, duration=3.2),
        scene("slippery patch", FrictionPatch(-0.2, (1.5e-3, 0.5e-3), 1.8e-3), RandomFriction(0.03, 1e-3),
              _shear(0.7, 2.2, 3.0), force=9.0, friction=0.45, duration=2.4),
        scene("slides", ObjectMotion((0.7, 2.2, 2.9), x=(0.0, 1.4e-3, 0.7e-3), y=(0.0, 0.0, 0.0)),
              force=8.0, friction=0.5, duration=3.0),
        scene("grip follows load", LoadPath((0.5, 1.0, 1.5, 2.0, 2.5), force_x=(0, 1.4, 2.6, 3.0, 4.2),
              normal_force=(0, 0, 3.0, 3.0, 6.0)), force=5.0, friction=0.5, duration=2.7),
    ]  # fmt: skip


def scoring() -> list[Scene]:
    """Scenes that are only scored on."""
    return [
        scene("steep ramp", _shear(0.6, 1.4, 5.2), force=11.0, friction=0.5, duration=1.7, radius=18e-3),
        scene("lift a cylinder", CylinderSurface(25.0, 0.4), LoadPath((0.7, 2.4), force_x=(0, 0.6), force_y=(0, 3.2)),
              force=10.0, friction=0.38, duration=2.6, radius=20e-3),
        scene("turn and pull", LoadPath((0.7, 1.7, 2.7), force_x=(0, 0.5, 2.4), moment=(0, 6e-3, 6e-3)),
              force=10.0, friction=0.45, duration=2.9),
        scene("turn back", LoadPath((0.7, 1.7, 3.2), moment=(0, 10e-3, -8e-3)),
              force=9.0, friction=0.5, duration=3.3),
        scene("squeeze harder", LoadPath((0.6, 1.6, 2.2, 3.0), force_y=(0, -3.0, -3.0, -4.4),
              normal_force=(0, 0, 5.0, 5.0)), force=9.0, friction=0.4, duration=3.2, radius=18e-3),
        scene("squeeze in steps", LoadPath((0.6, 1.1, 1.4, 1.9, 2.2, 2.8), force_x=(0, 2.2, 2.2, 3.2, 3.2, 4.6),
              normal_force=(0, 0, 2.5, 2.5, 5.5, 5.5)), force=6.5, friction=0.42, duration=3.0),
        scene("grip fades", LoadPath((0.7, 1.3, 2.8), force_x=(0, 1.6, 1.6), force_y=(0, 1.0, 1.0),
              normal_force=(0, 0, -7.0)), force=13.0, friction=0.35, duration=3.0),
        scene("shake", LoadPath((0.7, 1.1, 1.9, 2.7, 3.5), force_x=(0, 2.7, -2.9, 3.0, -1.0)),
              force=10.0, friction=0.33, duration=3.6),
        scene("rim of a cup", RingSurface(4.5e-3, 3e-3), LoadPath((0.7, 2.2), force_x=(0, 2.0), force_y=(0, 4.0)),
              force=16.0, friction=0.42, duration=2.4, radius=18e-3),
        scene("coupled and squeezed", NormalTangentialCoupling(), LoadPath((0.7, 1.6, 2.3, 3.0),
              force_x=(0, 2.6, 2.6, 3.6), normal_force=(0, 0, 4.0, 4.0)), force=9.0, friction=0.4, duration=3.1,
              poisson_ratio=0.45),
        scene("soft object", ElasticObject(2e6, 0.45), _shear(0.7, 2.3, 3.3), force=9.0, friction=0.42, duration=2.5),
        scene("creeping gel", Viscoelasticity((0.2,), (0.4,)),
              LoadPath((0.7, 1.6, 2.4, 3.0), force_x=(0, 2.6, 2.6, 3.3)), force=9.0, friction=0.42, duration=3.1),
        scene("falling friction", VelocityFriction(-3.0), PressureFriction(-0.8, PITCH**2), _shear(0.7, 2.3, 3.0),
              force=10.0, friction=0.45, duration=2.5),
        scene("seam", FrictionPatch(0.15, (-2.5e-3, 0.0), 2.5e-3), RandomFriction(0.03, 0.8e-3),
              LoadPath((0.7, 2.3), force_x=(0, 1.8), force_y=(0, 2.6)), force=9.0, friction=0.35, duration=2.5),
        scene("stage slides to and fro",
              ObjectMotion((0.6, 2.0, 3.6), x=(0.0, 0.9e-3, -0.7e-3), y=(0.0, 0.5e-3, 0.5e-3)), force=7.0,
              friction=0.45, duration=3.8),
        scene("corner of a box", FlatSurface((7e-3, 20e-3), (-1.5e-3, 0.0)), WavySurface(4e-6, 3e-3),
              _shear(0.7, 2.3, 3.2), force=10.0, friction=0.4, duration=2.5, radius=25e-3),
        scene("press a ball", SphereSurface(40.0), NormalTangentialCoupling(), force=10.0, friction=0.4, duration=1.4,
              poisson_ratio=0.42),
        scene("set down", LoadPath((0.7, 1.4, 2.0, 2.5, 3.1), force_x=(0, 2.9, 2.9, 0.0, 0.0),
              normal_force=(0, 0, 0, 0, -8.7)), force=9.0, friction=0.42, duration=3.1, radius=12e-3),
    ]  # fmt: skip


def _shear(start: float, end: float, force: float) -> LoadPath:
    return LoadPath((start, end), force_x=(0.0, force))


@dataclass(frozen=True, slots=True)
class Case:
    """A log without noise, and the loading phase of each frame."""

    name: str
    log: GraspLog
    phase: tuple[str, ...]


def cases(which: str) -> Iterator[Case]:
    """The cases of the set ``tuning``, ``scoring`` or ``reference``."""
    if which == "reference":
        logs = [(name, reference(name)) for name in REFERENCE if (REFERENCES / f"{name}.npz").is_file()]
    else:
        logs = [(entry.name, simulated(entry)) for entry in {"tuning": tuning, "scoring": scoring}[which]()]
    for name, log in logs:
        yield Case(name, log, phases(log))


def simulated(entry: Scene, fidelity: Fidelity = FIDELITY) -> GraspLog:
    """A scene's log, simulated once and then read back."""
    key = hashlib.sha256(repr((entry, fidelity)).encode()).hexdigest()[:16]
    path = CACHE / f"{key}.pickle"
    if path.is_file():
        return pickle.loads(path.read_bytes())
    log = simulate(entry, fidelity=fidelity, seed=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(pickle.dumps(log))
    return log


def reference(name: str) -> GraspLog:
    """A scene of the independent solver at 30 fps; its z points into the finger, so it is turned by π about x."""
    with np.load(REFERENCES / f"{name}.npz") as data:
        turn = np.array([1.0, -1.0, -1.0])
        x, y = np.meshgrid(data["x"], data["y"])
        shape = data["u"].shape
        rigid = data["rigid"]
        return GraspLog(
            time=np.arange(shape[0]) / 30.0,
            position=1e-3 * turn * np.stack([x, y, np.zeros_like(x)], axis=-1),
            displacement=1e-3 * turn * data["u"],
            element_area=PITCH**2,
            force=turn * data["f"],
            normal=np.broadcast_to([0.0, 0.0, 1.0], shape),
            object_pose=np.stack([1e-3 * rigid[:, 0], -1e-3 * rigid[:, 1], -rigid[:, 2]], axis=-1),
            truth=GroundTruth(
                data["contact"] > 0,
                data["slip_kinematic"] > 0,
                data["slip_contact_factor"] > 0,
                data["stick_ratio"],
                FrictionLaw((float(data["mu"]), 0.0, 0.0)),
            ),
        )


LEVER = 3e-3
"""m; makes a moment comparable with a force: about the mean radius of these contacts."""
STILL = 2e-3
"""Change of a load in a frame, as a share of its largest, that still counts as a hold."""


def phases(log: GraspLog) -> tuple[str, ...]:
    """Loading phase of each frame, from the total load on the finger."""
    assert log.force is not None
    pressing = -log.force[..., 2].sum(axis=(1, 2))
    x, y = log.position[..., 0], log.position[..., 1]
    moment = (x * log.force[..., 1] - y * log.force[..., 0]).sum(axis=(1, 2)) / LEVER
    sideways = np.stack([*log.force[..., :2].sum(axis=(1, 2)).T, moment])
    level = np.sqrt((sideways**2).sum(axis=0))
    grows, normal = np.diff(level, prepend=level[0]), np.diff(pressing, prepend=pressing[0])
    top = max(level.max(), 0.05 * pressing.max())
    return tuple(
        _phase(pressing[k], level[k] / top, normal[k] / pressing.max(), grows[k] / top) for k in range(len(log))
    )


def _phase(pressing: float, level: float, normal: float, tangential: float) -> str:
    if pressing <= 0.0:
        return "free"
    if normal > STILL:
        return "press" if level < 0.05 else "normal rises"
    if normal < -STILL:
        return "normal falls"
    if abs(tangential) <= STILL:
        return "hold"
    return "shear" if tangential > 0.0 else "unload"


def observed(log: GraspLog, marker_noise: float, force_noise: float, inputs: str, seed: int = 0) -> GraspLog:
    """The log with noise (m, N), as seen with ``inputs`` "displacement", "force" or "motion" (force and motion)."""
    rng = np.random.default_rng(seed)
    shape = log.displacement.shape
    assert log.force is not None
    return replace(
        log,
        displacement=log.displacement + marker_noise * rng.standard_normal(shape),
        force=None if inputs == "displacement" else log.force + force_noise * rng.standard_normal(shape),
        object_pose=log.object_pose if inputs == "motion" else None,
    )
