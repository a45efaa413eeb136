"""The deformed surface and the forces on it: normals, pressing and tangential force of every element."""

import math

from slipcore.compilation import compiled
from slipcore.frames import FloatArray


@compiled
def steps_at(field: FloatArray, i: int, j: int) -> tuple[float, float, float, float, float, float]:
    """Differences of a field [n, m, 3] at one element along rows (x, y, z) and columns (x, y, z).

    Central inside and one-sided at the edges, as ``strain.lattice_steps``.
    """
    n, m, _ = field.shape
    a, b = min(i + 1, n - 1), max(i - 1, 0)
    c, d = min(j + 1, m - 1), max(j - 1, 0)
    return (
        field[a, j, 0] - field[b, j, 0],
        field[a, j, 1] - field[b, j, 1],
        field[a, j, 2] - field[b, j, 2],
        field[i, c, 0] - field[i, d, 0],
        field[i, c, 1] - field[i, d, 1],
        field[i, c, 2] - field[i, d, 2],
    )


@compiled
def surface_normals(rest_steps: FloatArray, orientation: float, displacement: FloatArray, normal: FloatArray) -> None:
    """Outward unit normals [n, m, 3] of the displaced surface; zero where markers have come to lie in one line."""
    n, m, _ = displacement.shape
    for i in range(n):
        for j in range(m):
            ux, uy, uz, vx, vy, vz = steps_at(displacement, i, j)
            ux += rest_steps[0, 0, i, j]
            uy += rest_steps[0, 1, i, j]
            uz += rest_steps[0, 2, i, j]
            vx += rest_steps[1, 0, i, j]
            vy += rest_steps[1, 1, i, j]
            vz += rest_steps[1, 2, i, j]
            x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            length = math.sqrt(x * x + y * y + z * z)
            scale = orientation / length if length > 0.0 else 0.0
            normal[i, j, 0], normal[i, j, 1], normal[i, j, 2] = scale * x, scale * y, scale * z


@compiled
def normals_over_time(rest_steps: FloatArray, orientation: float, displacement: FloatArray, normal: FloatArray) -> None:
    """Normals [t, n, m, 3] of each frame (see ``surface_normals``)."""
    for k in range(len(displacement)):
        surface_normals(rest_steps, orientation, displacement[k], normal[k])


@compiled
def split_forces(force: FloatArray, normal: FloatArray, pressing: FloatArray, tangential: FloatArray) -> None:
    """Force on each element, split at the surface: inwards positive, N, and the magnitude along it, N.

    As ``element_forces.element_forces`` (paper, eq. 38–39), with the sign of the normal part kept.
    """
    n, m = pressing.shape
    for i in range(n):
        for j in range(m):
            x, y, z = force[i, j, 0], force[i, j, 1], force[i, j, 2]
            a, b, c = normal[i, j, 0], normal[i, j, 1], normal[i, j, 2]
            along = x * a + y * b + z * c
            x, y, z = x - along * a, y - along * b, z - along * c
            pressing[i, j] = -along
            tangential[i, j] = math.sqrt(x * x + y * y + z * z)
