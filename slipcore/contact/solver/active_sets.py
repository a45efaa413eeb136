"""Active sets of frictionless contact on one box, in compiled code.

Each set is relaxed by a few conjugate gradients and clipped, with projected gradients as a safeguard.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import TINY
from slipcore.contact.elasticity.fields import VECTOR
from slipcore.contact.elasticity.transform import Compiled, convolve
from slipcore.frames import BoolArray, FloatArray

_TINY = TINY  # what compiled loops hold fixed


class Relaxed(NamedTuple):
    """``pressure`` Pa and its ``displacement`` m [1, ny, nx]; ``approach`` m; ``residual`` as a share of the
    indentation; ``iterations``: active sets; ``applications`` of the operator.
    """

    pressure: FloatArray
    displacement: FloatArray
    approach: float
    residual: float
    iterations: int
    applications: int


@compiled
def relaxed(
    start: FloatArray,
    height: FloatArray,
    given: tuple[bool, float, float],
    by: tuple[Compiled, Compiled],
    bounds: tuple[float, int, int, float],
    relaxation: tuple[float, int],
) -> Relaxed:
    """Pressure [1, ny, nx] from a guess of it, for a gap between undeformed bodies of ``height`` [1, ny, nx] m.

    ``given``: whether that is the sum of pressures, rather than the approach; the value, and the lowest height. ``by``:
    operator and preconditioner; ``bounds``: tolerance, most active sets, over how many energies may climb, and what is
    no climb; ``relaxation``: reduction of each set's residual, and most conjugate gradients.
    """
    (balanced, value, lowest), (operator, _), (tolerance, most, memory, rounding) = given, by, bounds
    pressure, displacement, response = start.copy(), np.empty_like(start), np.empty_like(start)
    _make_feasible(pressure, height, given)
    convolve(pressure, displacement, operator)
    energies, applications = np.full(memory, _energy(pressure, displacement, height, given)), 1
    residual, approach = np.inf, value
    for iteration in range(most):
        if balanced:
            approach = _mean_under(pressure, displacement, height)
        gap = displacement + height - approach
        residual = _violation(pressure, gap) / max(approach - lowest, _TINY)
        if residual <= tolerance and approach > lowest:
            return Relaxed(pressure, displacement, approach, residual, iteration, applications)
        change, response, needed = _relax((pressure > 0.0) | (gap < 0.0), gap, balanced, by, relaxation)
        trial, applications = pressure + change, applications + needed
        if _make_feasible(trial, height, given):
            convolve(trial - pressure, response, operator)
            applications += 1
        moved = displacement + response
        energy, highest = _energy(trial, moved, height, given), energies.max()
        if energy > highest + rounding * abs(highest):
            trial, moved = _descend(pressure, displacement, gap, (approach - lowest, height, given, operator))
            energy, applications = _energy(trial, moved, height, given), applications + 1
        pressure, displacement = trial, moved
        energies[iteration % memory] = energy
    return Relaxed(pressure, displacement, approach, residual, most, applications)


@compiled(fastmath=VECTOR)
def _energy(
    pressure: FloatArray, displacement: FloatArray, height: FloatArray, given: tuple[bool, float, float]
) -> float:
    """The objective; it need only not climb above its last few values, or active sets could not change freely."""
    shift = 0.0 if given[0] else given[1]
    p, u, h, total = pressure.ravel(), displacement.ravel(), height.ravel(), 0.0
    for i in range(p.size):
        total += p[i] * (0.5 * u[i] + h[i] - shift) if p[i] != 0.0 else 0.0  # the height may be infinite elsewhere
    return total


@compiled(fastmath=VECTOR)
def _mean_under(pressure: FloatArray, displacement: FloatArray, height: FloatArray) -> float:
    """The approach that closes the gap on average over the contact."""
    p, u, h, total, count = pressure.ravel(), displacement.ravel(), height.ravel(), 0.0, 0
    for i in range(p.size):
        total += u[i] + h[i] if p[i] > 0.0 else 0.0
        count += p[i] > 0.0
    return total / count


@compiled
def _violation(pressure: FloatArray, gap: FloatArray) -> float:
    """Largest gap under pressure, or penetration elsewhere; NaN where a gap is NaN."""
    p, g, worst = pressure.ravel(), gap.ravel(), 0.0
    for i in range(p.size):
        size = abs(g[i]) if p[i] > 0.0 else -g[i]
        if not size <= worst:
            worst = size
            if np.isnan(size):
                break
    return worst


@compiled(fastmath=VECTOR)
def _make_feasible(pressure: FloatArray, height: FloatArray, given: tuple[bool, float, float]) -> bool:
    """Clip at zero and scale to the sum that is given, in place; whether anything was clipped."""
    (balanced, value, lowest), p, h, total, clipped = given, pressure.ravel(), height.ravel(), 0.0, False
    for i in range(p.size):
        clipped |= p[i] < 0.0
        p[i] = p[i] if p[i] > 0.0 else 0.0
        total += p[i]
    if balanced and total == 0.0:  # an empty contact would never fill again
        for i in range(p.size):
            p[i] = 1.0 if h[i] <= lowest else 0.0
            total += p[i]
    if balanced:
        for i in range(p.size):
            p[i] *= value / total
    return clipped


@compiled
def _relax(
    active: BoolArray,
    gap: FloatArray,
    balanced: bool,
    by: tuple[Compiled, Compiled],
    relaxation: tuple[float, int],
) -> tuple[FloatArray, FloatArray, int]:
    """A change of pressure that closes the gap on the active cells, at the same total force if that is given, and its
    displacement, by conjugate gradients; and how often they took the operator.
    """
    (operator, preconditioner), (reduction, most) = by, relaxation
    change, response, residual = np.zeros_like(gap), np.zeros_like(gap), gap.copy()
    improved, image = np.empty_like(gap), np.empty_like(gap)
    _restrict(residual, active, balanced)
    convolve(residual, improved, preconditioner)
    _restrict(improved, active, balanced)
    direction = -improved
    size = first = _inner(residual, improved)
    count = 0
    while count < most and size > 0.0:
        convolve(direction, image, operator)
        _advance(change, response, residual, direction, image, size / _inner(direction, image))
        _restrict(residual, active, balanced)
        convolve(residual, improved, preconditioner)
        _restrict(improved, active, balanced)
        before, size = size, _inner(residual, improved)
        count += 1
        if size <= reduction**2 * first:
            break
        _turn(direction, improved, size / before)
    return change, response, count


@compiled
def _descend(
    pressure: FloatArray,
    displacement: FloatArray,
    gap: FloatArray,
    problem: tuple[float, FloatArray, tuple[bool, float, float], Compiled],
) -> tuple[FloatArray, FloatArray]:
    """A projected gradient step at the contact's own mean stiffness, with an exact line search; ``problem``: the
    indentation, height, what is given, and the operator.
    """
    depth, height, given, operator = problem
    p, g, total, count = pressure.ravel(), gap.ravel(), 0.0, 0
    for i in range(p.size):
        if p[i] > 0.0:
            total += p[i]
            count += 1
    stiffness = total / count / depth if count else 1.0
    trial, response = pressure.copy(), np.empty_like(pressure)
    q = trial.ravel()
    for i in range(q.size):
        if p[i] > 0.0 or g[i] < 0.0:
            q[i] -= stiffness * g[i]
    _make_feasible(trial, height, given)
    way = trial - pressure
    convolve(way, response, operator)
    slope, w = 0.0, way.ravel()
    for i in range(w.size):
        if w[i] != 0.0:  # where there is no surface the gap is infinite
            slope += w[i] * g[i]
    curvature = _inner(way, response)
    share = min(max(-slope / curvature, 0.0), 1.0) if curvature > 0.0 else 0.0
    return pressure + share * way, displacement + share * response


@compiled(fastmath=VECTOR)
def _restrict(field: FloatArray, active: BoolArray, balanced: bool) -> None:
    """Zero a field outside the active cells and, if ``balanced``, make it sum to zero on them; in place."""
    f, on, total, count = field.ravel(), active.ravel(), 0.0, 0
    for i in range(f.size):
        f[i] = f[i] if on[i] else 0.0
        total += f[i]
        count += on[i]
    if balanced and count:
        mean = total / count
        for i in range(f.size):
            f[i] -= mean if on[i] else 0.0


@compiled
def _advance(
    change: FloatArray,
    response: FloatArray,
    residual: FloatArray,
    direction: FloatArray,
    image: FloatArray,
    step: float,
) -> None:
    """One conjugate-gradient step in place; ``image``: the operator on ``direction``."""
    c, r, s, d, m = change.ravel(), response.ravel(), residual.ravel(), direction.ravel(), image.ravel()
    for i in range(c.size):
        c[i] += step * d[i]
        r[i] += step * m[i]
        s[i] += step * m[i]


@compiled
def _turn(direction: FloatArray, improved: FloatArray, share: float) -> None:
    """The next conjugate direction, in place."""
    d, m = direction.ravel(), improved.ravel()
    for i in range(d.size):
        d[i] = share * d[i] - m[i]


@compiled(fastmath=VECTOR)
def _inner(a: FloatArray, b: FloatArray) -> float:
    x, y, total = a.ravel(), b.ravel(), 0.0
    for i in range(x.size):
        total += x[i] * y[i]
    return total
