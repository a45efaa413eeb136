"""Arrays of 3 × 3 elastic pillars at 1000 frames a second, in closed form: Coulomb friction under each pillar alone."""

from dataclasses import dataclass

import numpy as np

from slipcore import FrictionLaw, GraspLog, GroundTruth
from slipcore.frames import BoolArray, FloatArray

RATE = 1000.0
PITCH = 7e-3
NORMAL_STIFFNESS, TANGENTIAL_STIFFNESS = 6.5e3, 3e3
"""N/m of a pillar; those of a PapillArray lie between 5 and 8, and about 3 N/mm."""
LIMIT = 0.99
"""Share of its friction from which a pillar counts as slipping, by its contact factor."""

Path = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PillarGrasp:
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
    seed: int = 0

    def simulate(self) -> GraspLog:
        """The grasp without noise, with its truth."""
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
        return GraspLog(
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
                FrictionLaw((self.friction, 0.0, 0.0), self.scatter * self.friction),
            ),
        )


def _limit(pressed: FloatArray, friction: FloatArray) -> FloatArray:
    return LIMIT * NORMAL_STIFFNESS * pressed * friction / TANGENTIAL_STIFFNESS


def _stick_ratio(contact: BoolArray, slips: BoolArray) -> FloatArray:
    touching = contact.sum(axis=(1, 2))
    return np.where(touching > 0, 1.0 - (slips & contact).sum(axis=(1, 2)) / np.maximum(touching, 1), np.nan)


def _bent(place: FloatArray, pose: FloatArray, most: FloatArray) -> tuple[FloatArray, BoolArray]:
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
