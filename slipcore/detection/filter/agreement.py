"""Whether forces agree with the displacement: their sums follow that of the displacement, in stick and slip alike."""

import math
from typing import NamedTuple

from slipcore.compilation import compiled
from slipcore.defaults import NUMERICS
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.filter.state import (
    AGREEING,
    BY_SHAPE,
    FAST,
    LEAN,
    MISFIT,
    MOST_PRESSED,
    NORMAL_SUMS,
    REST,
    SHEAR_SUMS,
    SLOW,
    TRUST,
)
from slipcore.detection.filter.tuning import Tuning
from slipcore.detection.shared.records import FrameArrays, Surface
from slipcore.frames import FloatArray

_SEEN, _CLEAR, _RETURNED = NUMERICS.agreement_seen, NUMERICS.agreement_clear, NUMERICS.agreement_rest


class Stiffness(NamedTuple):
    """Sums of forces over sums of displacement, N/m, along the normal and along the surface; and the share of the
    normal force that appears along x and along y without displacement.
    """

    normal: float
    shear: float
    lean_x: float
    lean_y: float


@compiled(inline=True)
def step_agreement(frame: FrameArrays, noise: tuple[float, float, float], tuning: Tuning, common: FloatArray) -> None:
    """Learn in ``common`` how far forces may be trusted, and what share of the normal force appears along the surface.

    What forces do to an elastic gel sums up, over a lattice that reaches beyond the contact, to nearly the same sum of
    displacement wherever they act: F_z = k_n Σu_z and F_t = k_t Σu_t + c F_n, whatever sticks or slips, with a
    crosstalk c. Forces are trusted as far as neither their level, since the first frame, nor their changes in
    ``agreement_slow`` part from that: 1/(1 + (q/q₀)²), with q the squared misfit over the squared force, and
    q₀ = ``agreement_misfit`` squared. ``noise``: interval s, variance of a marker coordinate m², and deviation of an
    element's force N.
    """
    interval, variance, force_noise = noise
    if not follow_sums(frame, interval, tuning, common):
        return
    count = frame.displacement.shape[0] * frame.displacement.shape[1]
    fast = low_pass(interval, tuning.agreement_fast)
    left = count * fast / (2.0 - fast)
    of_force, of_place = left * force_noise**2 + tuning.ratio_least_force**2, left * variance
    common[MOST_PRESSED] = max(common[MOST_PRESSED], (common[FAST + 5] - common[REST + 5]) ** 2)
    if common[MOST_PRESSED] <= _SEEN * of_place:
        return  # markers are seen in the plane alone, or nothing has touched
    gain = low_pass(interval, tuning.agreement_memory)
    learn_sums(common, gain)
    found = stiffness_of(common, gain * of_force, tuning)
    noise_of_sum = of_force + found.normal**2 * (of_place + tuning.agreement_error**2 * common[MOST_PRESSED])
    step = low_pass(interval, tuning.agreement_fast)
    level, change = common[MISFIT], common[MISFIT + 1]
    common[MISFIT] = level + step * misfit(common, REST, found, noise_of_sum, level)
    common[MISFIT + 1] = change + step * misfit(common, SLOW, found, 2.0 * noise_of_sum, change)
    odd = max(common[MISFIT], common[MISFIT + 1]) / tuning.agreement_misfit**2
    trust = 1.0 / (1.0 + odd * odd)
    common[TRUST] = trust
    if trust < tuning.contact_doubted or trust > tuning.contact_trusted:
        common[BY_SHAPE] = 1.0 if trust < tuning.contact_doubted else 0.0
    size2 = found.lean_x**2 + found.lean_y**2
    share = max(0.0, 1.0 - tuning.lean_least**2 / size2) if size2 > 0.0 else 0.0
    common[LEAN], common[LEAN + 1] = share * found.lean_x, share * found.lean_y


@compiled
def follow_sums(frame: FrameArrays, interval: float, tuning: Tuning, common: FloatArray) -> bool:
    """Low-pass the sums of forces and of displacement, fast and slowly; False in the first frame, where they begin.

    They count from anew once nothing is pressed any more, so that a force that drifts is not held against it.
    """
    fast, slow = low_pass(interval, tuning.agreement_fast), low_pass(interval, tuning.agreement_slow)
    first = common[AGREEING] == 0.0
    common[AGREEING] = 1.0
    n, m, _ = frame.force.shape
    for axis in range(3):
        force = place = 0.0
        for i in range(n):
            for j in range(m):
                force += frame.force[i, j, axis]
                place += frame.displacement[i, j, axis]
        for at, value in ((axis, force), (axis + 3, place)):
            common[FAST + at] = value if first else common[FAST + at] + fast * (value - common[FAST + at])
            common[SLOW + at] = value if first else common[SLOW + at] + slow * (value - common[SLOW + at])
            common[REST + at] = value if first else common[REST + at]
    if (common[FAST + 5] - common[REST + 5]) ** 2 < _RETURNED * common[MOST_PRESSED]:
        common[REST : REST + 6] = common[FAST : FAST + 6]
    return not first


@compiled
def learn_sums(common: FloatArray, gain: float) -> None:
    """Take the sums since rest into the mean squares and products from which the stiffness follows."""
    fx, fy, fz, ux, uy, uz = since(common, REST)
    pressing = -fz
    products = (uz * uz, fz * uz)
    for k in range(2):
        common[NORMAL_SUMS + k] += gain * (products[k] - common[NORMAL_SUMS + k])
    along = (
        ux * ux + uy * uy,
        ux * fx + uy * fy,
        pressing * pressing,
        ux * pressing,
        uy * pressing,
        fx * pressing,
        fy * pressing,
    )
    for k in range(7):
        common[SHEAR_SUMS + k] += gain * (along[k] - common[SHEAR_SUMS + k])


@compiled
def since(common: FloatArray, start: int) -> tuple[float, float, float, float, float, float]:
    """Sums of force, x, y and z N, and of displacement, m, less those that stand at ``start``."""
    return (
        common[FAST] - common[start],
        common[FAST + 1] - common[start + 1],
        common[FAST + 2] - common[start + 2],
        common[FAST + 3] - common[start + 3],
        common[FAST + 4] - common[start + 4],
        common[FAST + 5] - common[start + 5],
    )


@compiled
def stiffness_of(common: FloatArray, variance: float, tuning: Tuning) -> Stiffness:
    """Least squares of forces on displacement and normal force; ``variance`` of a sum of forces in one frame, N², as a
    share of what is remembered.

    Beforehand shear is as stiff as on a half-space, give or take ``stiffness_spread``, and crosstalk is 0, give or take
    ``lean_spread``.
    """
    normal = common[NORMAL_SUMS + 1] / common[NORMAL_SUMS] if common[NORMAL_SUMS] > 0.0 else 0.0
    uu, uf, nn, xn, yn, fxn, fyn = (
        common[SHEAR_SUMS],
        common[SHEAR_SUMS + 1],
        common[SHEAR_SUMS + 2],
        common[SHEAR_SUMS + 3],
        common[SHEAR_SUMS + 4],
        common[SHEAR_SUMS + 5],
        common[SHEAR_SUMS + 6],
    )
    pressed = nn + variance / tuning.lean_spread**2
    usual, spread = tuning.stiffness_ratio * normal, tuning.stiffness_spread * abs(normal)
    if not (pressed > 0.0 and spread > 0.0):
        return Stiffness(normal, 0.0, 0.0, 0.0)
    known = variance / spread**2
    shear = (uf - (xn * fxn + yn * fyn) / pressed + known * usual) / (uu - (xn * xn + yn * yn) / pressed + known)
    return Stiffness(normal, shear, (fxn - shear * xn) / pressed, (fyn - shear * yn) / pressed)


@compiled
def misfit(common: FloatArray, start: int, found: Stiffness, noise: float, known: float) -> float:
    """By how much the squared misfit of forces since ``start``, over their square, exceeds what is ``known`` of it; the
    less counts the less they stand out from ``noise`` of a sum, N².
    """
    fx, fy, fz, ux, uy, uz = since(common, start)
    z = found.normal * uz
    x, y = found.shear * ux - found.lean_x * fz, found.shear * uy - found.lean_y * fz
    parted = (fx - x) ** 2 + (fy - y) ** 2 + (fz - z) ** 2
    size = max(fx * fx + fy * fy + fz * fz, x * x + y * y + z * z)
    clear = _CLEAR * 3.0 * noise
    if not size > 0.0:
        return 0.0
    return size / (size + clear) * (max(parted - 3.0 * noise, 0.0) / size - known)


@compiled
def without_lean(force: FloatArray, surface: Surface, lean_x: float, lean_y: float) -> None:
    """Take what the normal force shows along x and y out of the tangential force of the ``surface``."""
    normal, pressing, tangential = surface.normal, surface.pressing, surface.tangential
    n, m = pressing.shape
    for i in range(n):
        for j in range(m):
            x, y = force[i, j, 0] + lean_x * force[i, j, 2], force[i, j, 1] + lean_y * force[i, j, 2]
            z, a, b, c = force[i, j, 2], normal[i, j, 0], normal[i, j, 1], normal[i, j, 2]
            along = x * a + y * b + z * c
            tangential[i, j] = math.sqrt((x - along * a) ** 2 + (y - along * b) ** 2 + (z - along * c) ** 2)
