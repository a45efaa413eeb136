"""Whether forces turn with the surface as it is pressed in, or are those on the surface at rest.

Of a log that gives no normals. Pressure p of what turns acts along the deformed normal n in place of the one at rest
n₀, so that p (n₀ − n) appears along the surface at rest; else nothing of it does. So what is along the surface is
fitted by λ p (n₀ − n), with λ = 1 or 0, beside what all elements share, which is a load. Friction that keeps the gel
from spreading under pressure (outwards on a half-space of ν < ½, inwards on a gel that is bonded to its back) looks
alike and adds −1.4 to 1 to λ, but gives way as a load makes the contact slip.
"""

import math

from slipcore.compilation import compiled
from slipcore.defaults import TURNING
from slipcore.frames import FloatArray

SUMS = 4
"""Over frames: of what is along p (n₀ − n), of its square, and both weighted by the load's fourth power."""
_LEAST, _BAND, _COUPLING, _DEVIATIONS = TURNING.least_share, TURNING.band, TURNING.coupling, TURNING.deviations
_LEAST_WEIGHT = TURNING.least_load**4


@compiled
def add_turning(place: FloatArray, rest: FloatArray, normal: FloatArray, force: FloatArray, sums: FloatArray) -> None:
    """Add to the ``sums`` [4] what a frame's ``force`` [n, m, 3] N says, on elements at ``place`` [n, m, 3] m, with
    outward normals of the surface at ``rest`` and of the deformed one, [n, m, 3] each.

    Ratios of force to pressure are fitted with weights p². The load is the mean ratio and that of the moment, together.
    """
    weight = along = square = moment = polar = x = y = 0.0
    turn_x = turn_y = turn_z = side_x = side_y = side_z = 0.0
    n, m, _ = force.shape
    for i in range(n):
        for j in range(m):
            a, b, c = rest[i, j, 0], rest[i, j, 1], rest[i, j, 2]
            u, v, w = force[i, j, 0], force[i, j, 1], force[i, j, 2]
            p = max(-(u * a + v * b + w * c), 0.0)
            tx, ty, tz = u + p * a, v + p * b, w + p * c
            dx, dy, dz = p * (a - normal[i, j, 0]), p * (b - normal[i, j, 1]), p * (c - normal[i, j, 2])
            along += tx * dx + ty * dy + tz * dz
            square += dx * dx + dy * dy + dz * dz
            turn_x, turn_y, turn_z = turn_x + p * dx, turn_y + p * dy, turn_z + p * dz
            side_x, side_y, side_z = side_x + p * tx, side_y + p * ty, side_z + p * tz
            r, s = place[i, j, 0] - place[0, 0, 0], place[i, j, 1] - place[0, 0, 1]  # wherever the lattice lies
            weight, x, y, polar = weight + p * p, x + p * p * r, y + p * p * s, polar + p * p * (r * r + s * s)
            moment += p * (r * ty - s * tx)
    if not weight > 0.0:
        return
    along -= (turn_x * side_x + turn_y * side_y + turn_z * side_z) / weight
    square = max(square - (turn_x * turn_x + turn_y * turn_y + turn_z * turn_z) / weight, 0.0)
    moment -= (x * side_y - y * side_x) / weight
    polar -= (x * x + y * y) / weight
    load = (side_x * side_x + side_y * side_y + side_z * side_z) / (weight * weight)
    if polar > 0.0:
        load += moment * moment / (weight * polar)
    sums[0], sums[1] = sums[0] + along, sums[1] + square
    sums[2], sums[3] = sums[2] + load * load * along, sums[3] + load * load * square


@compiled
def turning_over_time(
    place: FloatArray, rest: FloatArray, normal: FloatArray, force: FloatArray, sums: FloatArray
) -> None:
    """``add_turning`` of each frame: ``normal`` and ``force`` [t, n, m, 3]."""
    for k in range(len(force)):
        add_turning(place, rest, normal[k], force[k], sums)


@compiled
def turns(sums: FloatArray, noise: float, did: bool) -> bool:
    """Whether forces turn, by the ``sums`` [4] of ``add_turning``, their standard ``noise`` N (NaN: unknown), and
    whether they ``did`` so far; not where nothing shows it.

    λ of the frames under load is carried on by ``TURNING.coupling`` times what it parts from that of all frames: the
    share of friction that keeps the gel from spreading has fallen to about two thirds there.
    """
    along, square, loaded_along, loaded_square = sums[0], sums[1], sums[2], sums[3]
    if not square > 0.0:
        return False
    loaded = (loaded_along + _LEAST_WEIGHT * along) / (loaded_square + _LEAST_WEIGHT * square)
    share = loaded + _COUPLING * (loaded - along / square)
    least = _LEAST - _BAND if did else _LEAST
    return bool(share > least + _DEVIATIONS * noise / math.sqrt(square))
