"""Where a contact patch lies on the lattice of markers."""

import numpy as np

from slipcore.frames import FloatArray


def lattice_pose(weight: FloatArray, position: FloatArray, least_anisotropy: float) -> tuple[FloatArray, FloatArray]:
    """Where a patch lies among the markers at rest, [t, 3] x m, y m, yaw rad, and its radius of gyration, [t] m.

    ``weight`` [t, n, m]: pressure or depth, 0 outside of the patch. The yaw is that of the longer principal axis,
    continuous over the frames; NaN where (a² − b²)/(a² + b²) of the half-axes is under ``least_anisotropy``. All NaN
    where there is no patch. What sticks to the markers stays where it is.
    """
    x, y = position[..., 0].ravel(), position[..., 1].ravel()
    sums = weight.reshape(len(weight), -1) @ np.stack([np.ones_like(x), x, y, x * x, x * y, y * y]).T
    total = np.where(sums[:, 0] > 0.0, sums[:, 0], np.nan)
    mx, my, xx, xy, yy = (sums[:, 1:] / total[:, None]).T
    difference, mixed, size = xx - mx * mx - yy + my * my, 2.0 * (xy - mx * my), xx - mx * mx + yy - my * my
    oblong = np.hypot(difference, mixed) > least_anisotropy * size
    yaw = np.where(oblong, 0.5 * np.arctan2(mixed, difference), np.nan)
    yaw[oblong] = np.unwrap(yaw[oblong], period=np.pi)
    return np.column_stack([mx, my, yaw]), np.sqrt(np.maximum(size, 0.0))
