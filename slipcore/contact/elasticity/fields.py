"""Sums over fields of cells [..., ny, nx]: products, rigid motions and their resultants."""

from typing import Literal

import numpy as np

from slipcore.compilation import compiled
from slipcore.frames import FloatArray

VECTOR = {"reassoc", "nsz", "contract"}
"""Liberties that compiled sums take to run in vectors; infinities and NaN keep their meaning."""
_SIZE_BITS = 0x7FFF_FFFF_FFFF_FFFF  # of a number without its sign


def inner(a: FloatArray, b: FloatArray) -> float:
    """Σ a·b of two contiguous fields.

    Compiled, because the BLAS behind ``numpy.vdot`` starts threads for it, at a hundred times its cost on a busy
    machine.
    """
    return float(_inner(a.reshape(-1), b.reshape(-1)))


def rigid_displacement(arm: FloatArray, motion: FloatArray) -> FloatArray:
    """Displacement [2, ...] of the points at ``arm`` [2, ...] in a small rigid motion (x, y, rotation)."""
    moved = np.empty_like(arm)
    np.subtract(motion[0], motion[2] * arm[1], out=moved[0])
    np.add(motion[1], motion[2] * arm[0], out=moved[1])
    return moved


def lengths(field: FloatArray) -> FloatArray:
    """Lengths [...] of vectors [2, ...]; numpy's ``hypot`` guards against squares that no field here has, at ten times
    the cost.
    """
    return np.asarray(np.sqrt(field[0] * field[0] + field[1] * field[1]))


def resultants(traction: FloatArray, arm: FloatArray) -> FloatArray:
    """Sums [3] of tractions [2, ...] at ``arm`` [2, ...]: along x, along y, and their moment."""
    return np.array(_resultants(traction.reshape(2, -1), arm.reshape(2, -1)))


def halved(field: FloatArray, beyond: Literal["edge", "constant"] = "edge") -> FloatArray:
    """Means over blocks of 2 × 2 cells; beyond the field its edge is repeated, or all is zero."""
    ny, nx = field.shape[-2:]
    whole = np.pad(field, [(0, 0)] * (field.ndim - 2) + [(0, ny % 2), (0, nx % 2)], mode=beyond)
    blocks = whole.reshape(*field.shape[:-2], -(-ny // 2), 2, -(-nx // 2), 2)
    return blocks.mean(axis=(-3, -1))  # type: ignore[no-any-return]


def doubled(field: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Linear interpolation to cells of half the size, cut to ``shape``."""
    along_y = _doubled_last(np.swapaxes(field, -1, -2))
    whole = _doubled_last(np.swapaxes(along_y, -1, -2))
    return np.ascontiguousarray(whole[..., : shape[0], : shape[1]])


def _doubled_last(field: FloatArray) -> FloatArray:
    around = np.concatenate((field[..., :1], field, field[..., -1:]), axis=-1)
    halves = np.stack((0.75 * field + 0.25 * around[..., :-2], 0.75 * field + 0.25 * around[..., 2:]), axis=-1)
    return halves.reshape(*field.shape[:-1], -1)


@compiled
def largest(field: FloatArray) -> float:
    """Largest size of the numbers of a contiguous field; NaN where one is NaN.

    Taken as whole numbers, bits without the sign are in the order of sizes, NaN above infinity: these run in vectors.
    """
    found = np.zeros(1, dtype=np.int64)
    bits, most = field.reshape(-1).view(np.int64), 0
    for i in range(bits.size):
        most = max(most, bits[i] & _SIZE_BITS)
    found[0] = most
    return float(found.view(np.float64)[0])


@compiled(fastmath=VECTOR)
def _resultants(traction: FloatArray, arm: FloatArray) -> tuple[float, float, float]:
    sx = sy = sm = 0.0
    for i in range(arm.shape[1]):
        qx, qy = traction[0, i], traction[1, i]
        sx += qx
        sy += qy
        sm += arm[0, i] * qy - arm[1, i] * qx
    return sx, sy, sm


@compiled(fastmath=VECTOR)
def _inner(a: FloatArray, b: FloatArray) -> float:
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total
