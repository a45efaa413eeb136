"""Synthetic images of a marker gel: dots with soft edges at places that are no whole pixels."""

import numpy as np
from numpy.typing import NDArray

from service.formats.marker_images import Grey
from slipcore.frames import FloatArray

SHAPE = (450, 460)
PITCH = 20.0


def lattice(rows: int = 20, columns: int = 20) -> FloatArray:
    """Places [rows columns, 2] px."""
    x, y = np.meshgrid(40.3 + PITCH * np.arange(columns), 35.7 + PITCH * np.arange(rows))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def jittered(seed: int = 1, rows: int = 20, columns: int = 20) -> FloatArray:
    """A lattice whose dots are up to a fifth of the pitch off."""
    return lattice(rows, columns) + np.random.default_rng(seed).uniform(-0.2 * PITCH, 0.2 * PITCH, (rows * columns, 2))


def draw(
    place: FloatArray,
    shape: tuple[int, int] = SHAPE,
    *,
    radius: float = 3.5,
    dark: bool = True,
    noise: float = 0.0,
    slope: float = 0.3,
    seed: int = 0,
) -> Grey:
    """Dots of 100 grey levels on a ground whose light changes by ``slope`` from side to side; ``noise`` is a share of
    all 255 levels.
    """
    half = int(radius + 5)
    index = np.rint(place).astype(int)[:, :, None] + np.arange(-half, half + 1)  # [k, xy, w]
    away = index - place[:, :, None]
    distance = np.hypot(away[:, 1, :, None], away[:, 0, None, :])
    cover: NDArray[np.float64] = np.zeros(np.add(shape, 2 * half))
    np.add.at(
        cover, (index[:, 1, :, None] + half, index[:, 0, None, :] + half), 1 / (1 + np.exp(2 * (distance - radius)))
    )
    ground = (180.0 if dark else 60.0) * (1.0 + slope * np.linspace(-0.5, 0.5, shape[1]))
    image = ground + (-100.0 if dark else 100.0) * cover[half:-half, half:-half]
    image = image + np.random.default_rng(seed).normal(0.0, 255.0 * noise, shape) if noise else image
    return image.clip(0, 255).round().astype(np.uint8)


def sheared_press(rest: FloatArray, frames: int) -> FloatArray:
    """Places [frames, k, 2]: dots spread around a press while all shear by 12 px, more than half of the pitch."""
    share = np.linspace(0.0, 1.0, frames)[:, None, None]
    away = rest - rest.mean(axis=0)
    spread = 4.0 * away / 80.0 * np.exp(0.5 - 0.5 * (np.linalg.norm(away, axis=1, keepdims=True) / 80.0) ** 2)
    sideways = np.stack([8.0 + 4.0 * away[:, 1] / 200.0, np.full(len(rest), -5.0)], axis=1)
    places: FloatArray = rest + spread * np.minimum(2.0 * share, 1.0) + sideways * share
    return places
