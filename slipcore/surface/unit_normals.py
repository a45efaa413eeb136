"""Whether given normals are what is asked for, in one pass: where elements are few, each call of numpy counts."""

import math

from slipcore.compilation import compiled
from slipcore.frames import FloatArray


@compiled
def are_outward_units(normal: FloatArray, tolerance: float) -> bool:
    """Whether all vectors [n, m, 3] are finite, point outwards (z above 0) and have length 1 to a ``tolerance``."""
    n, m, _ = normal.shape
    for i in range(n):
        for j in range(m):
            x, y, z = normal[i, j, 0], normal[i, j, 1], normal[i, j, 2]
            if not (z > 0.0 and abs(math.sqrt(x * x + y * y + z * z) - 1.0) <= tolerance):
                return False
    return True
