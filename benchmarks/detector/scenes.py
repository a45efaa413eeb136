"""Scenes that detectors are tuned on, and others that they are only scored on.

Three disjoint sets: ``tuning`` (the defaults of slipcore were chosen on these), ``scoring`` (simulated, written before
the defaults were chosen and scored on after that) and ``reference`` (an independent solver's, ../shared/data/contact;
scoring only). Simulated truth is kept under .cache, by a hash of the scene.
"""

import hashlib
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slipcore import FrictionLaw, GraspLog, GroundTruth
from slipcore.contact.effects import (
    CylinderSurface,
    ElasticObject,
    FiniteLayer,
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
from slipcore.contact.scene import Finger, Press, Scene, simulate
from slipcore.contact.tiers.boundary_elements import Fidelity

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
    return [*_first_tuning(), *_second_tuning()]


def _first_tuning() -> list[Scene]:
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


def _second_tuning() -> list[Scene]:
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
        scene("bonded gel", FiniteLayer(5e-3), _shear(0.7, 2.3, 3.4), force=9.0, friction=0.45, duration=2.5),
        scene("bonded gel turns", FiniteLayer(8e-3), LoadPath((0.7, 1.7, 2.5), force_x=(0, 1.5, 1.5),
              moment=(0, 5e-3, 9e-3)), force=11.0, friction=0.4, duration=2.7, radius=20e-3),
        scene("bonded gel, squeezed", FiniteLayer(4.5e-3), LoadPath((0.7, 1.5, 2.1, 2.8), force_y=(0, 2.4, 2.4, 3.6),
              normal_force=(0, 0, 4.0, 4.0)), force=7.0, friction=0.42, duration=2.9, radius=12e-3),
        scene("set down", LoadPath((0.7, 1.4, 2.0, 2.5, 3.1), force_x=(0, 2.9, 2.9, 0.0, 0.0),
              normal_force=(0, 0, 0, 0, -8.7)), force=9.0, friction=0.42, duration=3.1, radius=12e-3),
    ]  # fmt: skip


def scoring() -> list[Scene]:
    """Scenes that are only scored on: other loads, shapes, materials and friction than those of ``tuning``."""
    return [*_scoring_of_loads(), *_scoring_of_bodies()]


def _scoring_of_loads() -> list[Scene]:
    time, normal_force, force_x, force_y = _wandering_load(8.0, 0.4, seed=20)
    return [
        scene("gentle ramp", LoadPath((0.8, 3.0), force_x=(0, 2.5), force_y=(0, 3.1)), force=7.0, friction=0.62,
              duration=3.2, radius=22e-3, young_modulus=0.7e6),
        scene("quick pull", LoadPath((0.6, 0.95), force_y=(0, -1.68)), force=6.0, friction=0.3, duration=1.3),
        scene("screw and unscrew", LoadPath((0.7, 1.8, 2.2, 3.2), moment=(0, -9.5e-3, -9.5e-3, 4e-3)), force=12.0,
              friction=0.35, duration=3.4),
        scene("pull while turning", LoadPath((0.7, 1.6, 2.8), force_x=(0, -1.0, -2.6), force_y=(0, 1.2, 1.2),
              moment=(0, -3e-3, -5e-3)), force=9.0, friction=0.55, duration=3.0, radius=18e-3),
        scene("swing", LoadPath((0.6, 1.3, 2.7, 3.6), force_y=(0, 3.6, -3.4, 2.0)), force=11.0, friction=0.38,
              duration=3.7),
        scene("grip tightens", LoadPath((0.7, 1.5, 1.7, 2.5, 3.5), force_x=(0, 3.1, 3.1, 3.1, 6.2),
              normal_force=(0, 0, 0, 6.0, 6.0)), force=7.0, friction=0.55, duration=3.6),
        scene("grip loosens", LoadPath((0.7, 1.4, 1.6, 3.0), force_x=(0, 1.5, 1.5, 1.5), force_y=(0, -2.1, -2.1, -2.1),
              normal_force=(0, 0, 0, -7.6)), force=14.0, friction=0.45, duration=3.1, radius=12e-3),
        scene("lift, hold, set down", LoadPath((0.7, 1.5, 2.1, 2.6, 3.2), force_y=(0, 4.2, 4.2, 0.3, 0.0),
              normal_force=(0, 0, 0, 0, -9.6)), force=10.0, friction=0.5, duration=3.2),
        scene("load wanders", LoadPath(time, normal_force, force_x, force_y), force=8.0, friction=0.4,
              duration=time[-1] + 0.1, radius=16e-3),
        scene("stage turns and slides", ObjectMotion((0.6, 1.8, 3.0), x=(0.0, 0.6e-3, 0.1e-3), y=(0.0, -3e-4, -3e-4),
              yaw=(0.0, 0.05, 0.05)), force=8.0, friction=0.42, duration=3.1),
        scene("press hard and let go", LoadPath((0.9, 1.9), normal_force=(0, -14.0)), NormalTangentialCoupling(),
              force=15.0, friction=0.5, duration=1.9, poisson_ratio=0.45),
    ]  # fmt: skip


def _scoring_of_bodies() -> list[Scene]:
    return [
        scene("soft fruit", ElasticObject(1.2e6, 0.45), LoadPath((0.7, 1.9, 2.4, 3.0), force_x=(0, 3.6, 3.6, 1.0)),
              force=8.0, friction=0.5, duration=3.1),
        scene("thin gel", FiniteLayer(4e-3), NormalTangentialCoupling(), LoadPath((0.7, 2.2), force_x=(0, 2.2),
              force_y=(0, 2.2)), force=9.0, friction=0.4, duration=2.4),
        scene("layer, squeezed", FiniteLayer(6e-3), LoadPath((0.7, 1.5, 2.1, 2.9, 3.5), force_x=(0, 2.9, 2.9, 4.2, 4.2),
              normal_force=(0, 0, 4.0, 4.0, 2.7)), force=8.0, friction=0.42, duration=3.6),
        scene("bar across", CylinderSurface(40.0, 1.1), LoadPath((0.7, 2.2), force_x=(0, 3.6), moment=(0, 3e-3)),
              force=12.0, friction=0.4, duration=2.5, radius=25e-3),
        scene("edge of a book", FlatSurface((9e-3, 6e-3), (1e-3, -0.5e-3)), LoadPath((0.7, 2.1), force_x=(0, -3.0),
              force_y=(0, 2.2)), force=12.0, friction=0.36, duration=2.4, radius=30e-3),
        scene("sandpaper", RandomFriction(0.06, 1.2e-3), _shear(0.6, 2.4, 4.3), force=8.0, friction=0.6, duration=2.6),
        scene("slow gel, twisted", Viscoelasticity((0.15, 0.1), (0.2, 1.0)), LoadPath((0.7, 1.9), force_y=(0, 1.0),
              moment=(0, 7e-3)), force=10.0, friction=0.42, duration=2.7),
        scene("rim of a glass", RingSurface(5e-3, 2e-3), LoadPath((0.7, 1.8, 3.0), force_x=(0, 6.6, -2.0)), force=18.0,
              friction=0.45, duration=3.1, radius=20e-3),
        scene("wet spot", FrictionPatch(-0.25, (-1e-3, 1.5e-3), 2e-3), PressureFriction(-0.4, PITCH**2),
              LoadPath((0.7, 2.2), force_x=(0, 1.8), force_y=(0, -2.0)), force=9.0, friction=0.5, duration=2.4),
        scene("press a bar", CylinderSurface(60.0, 0.7), PressingSpread(), force=11.0, friction=0.45, duration=1.5,
              poisson_ratio=0.42),
    ]  # fmt: skip


def _wandering_load(normal_force: float, friction: float, seed: int) -> tuple[tuple[float, ...], ...]:
    """Knots (time, extra F_N, F_x, F_y) of a load that wanders within 0.9 of the sliding force."""
    rng = np.random.default_rng(seed)
    time = 0.7 + np.cumsum(np.r_[0.0, rng.uniform(0.25, 0.6, 7)])
    extra = normal_force * np.r_[0.0, rng.uniform(-0.4, 0.5, 7)]
    level = friction * (normal_force + extra) * np.r_[0.0, rng.uniform(0.3, 0.9, 7)]
    angle = rng.uniform(0.0, 2.0 * np.pi) + np.cumsum(rng.normal(0.0, 0.7, 8))
    return tuple(
        tuple(float(v) for v in knots) for knots in (time, extra, level * np.cos(angle), level * np.sin(angle))
    )


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
