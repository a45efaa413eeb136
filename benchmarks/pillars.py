"""Arrays of 3 × 3 elastic pillars at 1000 frames a second, in closed form: Coulomb friction under each pillar alone."""

from dataclasses import dataclass, field

import numpy as np

from benchmarks.detector_scenes import Case, phases
from slipcore import FrictionLaw, GraspLog, GroundTruth

RATE = 1000.0
PITCH = 7e-3
NORMAL_STIFFNESS, TANGENTIAL_STIFFNESS = 6.5e3, 3e3
"""N/m of a pillar; those of a PapillArray lie between 5 and 8, and about 3 N/mm."""
LIMIT = 0.99
"""Share of its friction from which a pillar counts as slipping, by its contact factor."""

Path = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Grasp:
    """A plate that pillars carry: its way, at knots of time in s. ``depth`` m at the middle pillar, which is ``taller``
    m than the others; x, y m and yaw rad; tilted by ``tilt`` rad about x and y. Of a pillar, ``uneven`` m is the
    standard deviation of height, and ``scatter`` that of friction, as a share of it.
    """

    name: str
    friction: float
    time: Path
    depth: Path
    x: Path = ()
    y: Path = ()
    yaw: Path = ()
    tilt: tuple[float, float] = (0.0, 0.0)
    taller: float = 2e-4
    uneven: float = 5e-5
    scatter: float = 0.03
    seed: int = field(default=0)

    def log(self) -> Case:
        """The grasp without noise, and its phases."""
        rng = np.random.default_rng(self.seed)
        time = np.arange(round(self.time[-1] * RATE) + 1) / RATE
        depth, x, y, yaw = (
            np.interp(time, self.time, path) if path else np.zeros_like(time)
            for path in (self.depth, self.x, self.y, self.yaw)
        )
        row, column = np.meshgrid(np.arange(3.0) - 1.0, np.arange(3.0) - 1.0, indexing="ij")
        position = PITCH * np.stack([row, column, 0.0 * row], axis=-1)
        height = self.uneven * rng.standard_normal((3, 3)) - self.taller * ((row != 0) | (column != 0))
        height = height + position[..., :2] @ np.array(self.tilt)
        friction = self.friction * (1.0 + self.scatter * rng.standard_normal((3, 3)))
        pressed = np.maximum(depth[:, None, None] + height, 0.0)
        pose = np.stack([x, y, yaw], axis=-1)
        bent, slips = _bent(position[..., :2], pose, NORMAL_STIFFNESS * pressed * friction / TANGENTIAL_STIFFNESS)
        displacement = np.concatenate([bent, -pressed[..., None]], axis=-1)
        contact = pressed > 0.0
        log = GraspLog(
            time=time,
            position=position,
            displacement=displacement,
            element_area=PITCH**2,
            force=displacement * [TANGENTIAL_STIFFNESS, TANGENTIAL_STIFFNESS, NORMAL_STIFFNESS],
            normal=np.broadcast_to([0.0, 0.0, 1.0], displacement.shape),
            object_pose=pose,
            truth=GroundTruth(
                contact,
                slips,
                contact & (np.hypot(bent[..., 0], bent[..., 1]) >= _limit(pressed, friction)),
                _stick_ratio(contact, slips),
                FrictionLaw((self.friction, 0.0, 0.0)),
            ),
        )
        return Case(self.name, log, phases(log))


def _limit(pressed: np.ndarray, friction: np.ndarray) -> np.ndarray:
    return LIMIT * NORMAL_STIFFNESS * pressed * friction / TANGENTIAL_STIFFNESS


def _stick_ratio(contact: np.ndarray, slips: np.ndarray) -> np.ndarray:
    touching = contact.sum(axis=(1, 2))
    return np.where(touching > 0, 1.0 - (slips & contact).sum(axis=(1, 2)) / np.maximum(touching, 1), np.nan)


def _bent(place: np.ndarray, pose: np.ndarray, most: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far each pillar is bent, [t, 3, 3, 2] m, and whether it slips: carried along by the plate, and returned to
    the ``most``, [t, 3, 3] m, that friction holds (Simo and Hughes, Computational Inelasticity, 1998).
    """
    cosine, sine = np.cos(pose[:, 2])[:, None, None], np.sin(pose[:, 2])[:, None, None]
    carried = np.stack(
        [
            pose[:, 0, None, None] + (cosine - 1.0) * place[..., 0] - sine * place[..., 1],
            pose[:, 1, None, None] + sine * place[..., 0] + (cosine - 1.0) * place[..., 1],
        ],
        axis=-1,
    )
    bent, slips = np.zeros(carried.shape), np.zeros(most.shape, bool)
    for k in range(1, len(carried)):
        trial = bent[k - 1] + carried[k] - carried[k - 1]
        length = np.hypot(trial[..., 0], trial[..., 1])
        slips[k] = length > most[k]
        bent[k] = trial * np.where(slips[k], most[k] / np.maximum(length, 1e-30), 1.0)[..., None]
    return bent, slips & (most > 0.0)


def tuning() -> list[Grasp]:
    """Grasps that defaults may be chosen on."""
    return [
        Grasp("ramp", 0.5, (0.0, 0.2, 0.7, 0.9, 2.4), (-1e-4, -1e-4, 1.2e-3, 1.2e-3, 1.2e-3),
              x=(0.0, 0.0, 0.0, 0.0, 1.9e-3), tilt=(0.02, -0.01), seed=1),
        Grasp("twist", 0.4, (0.0, 0.2, 0.7, 0.9, 2.2), (-1e-4, -1e-4, 1.0e-3, 1.0e-3, 1.0e-3),
              yaw=(0.0, 0.0, 0.0, 0.0, 0.16), tilt=(0.0, 0.03), seed=2),
        Grasp("to and fro", 0.7, (0.0, 0.2, 0.6, 1.3, 2.3, 2.9), (-1e-4, -1e-4, 9e-4, 9e-4, 9e-4, 9e-4),
              x=(0.0, 0.0, 0.0, 1.5e-3, -0.9e-3, 0.2e-3), seed=3),
        Grasp("grip fades", 0.35, (0.0, 0.2, 0.7, 1.2, 1.5, 2.8), (-1e-4, -1e-4, 1.6e-3, 1.6e-3, 1.6e-3, 0.5e-3),
              y=(0.0, 0.0, 0.0, 6e-4, 6e-4, 6e-4), tilt=(-0.02, 0.0), seed=4),
        Grasp("grip rises", 0.45, (0.0, 0.2, 0.6, 1.4, 1.6, 2.1, 2.8), (-1e-4, -1e-4, 7e-4, 7e-4, 7e-4, 1.3e-3, 1.3e-3),
              x=(0.0, 0.0, 0.0, 7e-4, 7e-4, 7e-4, 1.7e-3), seed=5),
        Grasp("pull and hold", 0.9, (0.0, 0.2, 0.7, 1.6, 2.8), (-1e-4, -1e-4, 9e-4, 9e-4, 9e-4),
              x=(0.0, 0.0, 0.0, 1.1e-3, 1.1e-3), y=(0.0, 0.0, 0.0, -0.9e-3, -0.9e-3), tilt=(0.03, 0.02), seed=6),
        Grasp("press only", 0.5, (0.0, 0.2, 0.9, 1.4), (-1e-4, -1e-4, 1.5e-3, 1.5e-3), tilt=(0.01, 0.0), seed=7),
    ]  # fmt: skip


def scoring() -> list[Grasp]:
    """Grasps that are only scored on."""
    return [
        Grasp("slow ramp", 0.6, (0.0, 0.3, 0.9, 1.1, 3.4), (-1e-4, -1e-4, 8e-4, 8e-4, 8e-4),
              y=(0.0, 0.0, 0.0, 0.0, -1.6e-3), tilt=(-0.03, 0.01), seed=21),
        Grasp("quick ramp", 0.38, (0.0, 0.2, 0.5, 0.6, 1.0), (-1e-4, -1e-4, 1.4e-3, 1.4e-3, 1.4e-3),
              x=(0.0, 0.0, 0.0, 0.0, -1.5e-3), seed=22),
        Grasp("turn and pull", 0.55, (0.0, 0.2, 0.7, 1.5, 2.5), (-1e-4, -1e-4, 1.1e-3, 1.1e-3, 1.1e-3),
              x=(0.0, 0.0, 0.0, 2e-4, 1.4e-3), yaw=(0.0, 0.0, 0.0, 0.06, 0.08), seed=23),
        Grasp("swing", 0.45, (0.0, 0.2, 0.7, 1.3, 2.3, 3.2), (-1e-4, -1e-4, 1.2e-3, 1.2e-3, 1.2e-3, 1.2e-3),
              y=(0.0, 0.0, 0.0, 1.3e-3, -1.0e-3, 0.6e-3), tilt=(0.01, 0.02), seed=24),
        Grasp("grip loosens", 0.5, (0.0, 0.2, 0.7, 1.3, 1.5, 3.0), (-1e-4, -1e-4, 1.5e-3, 1.5e-3, 1.5e-3, 4e-4),
              x=(0.0, 0.0, 0.0, -5e-4, -5e-4, -5e-4), y=(0.0, 0.0, 0.0, 5e-4, 5e-4, 5e-4), seed=25),
        Grasp("grip tightens", 0.65, (0.0, 0.2, 0.6, 1.3, 2.0, 3.0), (-1e-4, -1e-4, 6e-4, 6e-4, 1.2e-3, 1.2e-3),
              x=(0.0, 0.0, 0.0, 8e-4, 1.0e-3, 2.3e-3), tilt=(0.0, -0.02), seed=26),
        Grasp("lift and hold", 0.8, (0.0, 0.2, 0.8, 1.8, 3.0), (-1e-4, -1e-4, 1.0e-3, 1.0e-3, 1.0e-3),
              y=(0.0, 0.0, 0.0, 1.5e-3, 1.5e-3), tilt=(0.02, 0.02), seed=27),
        Grasp("press and let go", 0.5, (0.0, 0.2, 0.8, 1.6), (-1e-4, -1e-4, 1.6e-3, -1e-4), tilt=(0.0, 0.02), seed=28),
    ]  # fmt: skip


def cases(which: str) -> list[Case]:
    """The cases of the set ``tuning`` or ``scoring``."""
    return [grasp.log() for grasp in {"tuning": tuning, "scoring": scoring}[which]()]
