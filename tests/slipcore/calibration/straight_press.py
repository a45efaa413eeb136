"""A press without noise whose every number is chosen: each element takes its share of one load."""

from collections.abc import Sequence

import numpy as np

from slipcore.calibration.press import PressLog, find_press
from slipcore.frames import FloatArray, GraspLog

GRID = (8, 8)
STEP = 0.1
DEPTH = 1e-3
LOAD = np.array([0.0] * 12 + [0.2, 0.4, 0.6, 0.8] + [1.0] * 6 + [0.8, 0.6, 0.4, 0.2] + [0.0] * 12)
"""Share of the greatest load in each frame: 12 before it and 12 after it are free."""


def places(grid: tuple[int, int] = GRID) -> FloatArray:
    """Elements of 1 mm about the middle, [n, m, 3] m."""
    x, y = (1e-3 * (np.arange(count) - 0.5 * (count - 1)) for count in grid)
    return np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros(grid)], axis=-1)


def shares(width: float = 1e-3, grid: tuple[int, int] = GRID) -> FloatArray:
    """Of the load on each element, a Gaussian of that standard deviation, m; their sum is 1."""
    share = np.exp(-0.5 * (places(grid)[..., :2] ** 2).sum(axis=-1) / width**2)
    return np.asarray(share / share.sum())


def straight(
    load: FloatArray = LOAD,
    share: FloatArray | None = None,
    newton: float = 2.0,
    tangential: Sequence[float] = (0.0, 0.0),
    moved: Sequence[float] = (0.0, 0.0),
    added: FloatArray | float = 0.0,
) -> GraspLog:
    """``tangential``: share of the load along x and y; ``moved``: of the depth; ``added``: forces [t, n, m, 3] N."""
    share = shares() if share is None else share
    force = newton * load[:, None, None, None] * share[..., None] * [*tangential, -1.0] + added
    motion = DEPTH * load[:, None, None, None] * (share / share.max())[..., None] * [0.0, 0.0, -1.0]
    motion = motion + DEPTH * load[:, None, None, None] * np.array([*moved, 0.0])
    normal = np.broadcast_to([0.0, 0.0, 1.0], force.shape)
    time = STEP * np.arange(len(load))
    return GraspLog(time, places(share.shape), motion, 1e-6, force=force, normal=normal, sensor="straight press")


def press(**chosen: object) -> PressLog:
    """The same, as calibration sees it."""
    return find_press(straight(**chosen))  # type: ignore[arg-type]
