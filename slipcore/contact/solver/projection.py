"""Nearest tractions that Coulomb's law and the load allow: {|q_i| ≤ R_i} ∩ {Σq = F, Σ(x × q) = M}.

The dual has three unknowns only, a rigid motion λ: q_i is the nearest point of disk i to w_i + B_i λ, with B_i λ = (λ₁
− y_i λ₃, λ₂ + x_i λ₃), and λ minimises the convex φ(λ) = Σ h_i(w_i + B_i λ) − λ·target, whose gradient is the
imbalance. Newton's steps on φ are shortened where its slope along them changes sign. They are never judged by the size
of the imbalance, which near full sliding hardly falls until the very end.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import PROJECTION, TINY
from slipcore.contact.elasticity.fields import VECTOR, largest
from slipcore.frames import BoolArray, FloatArray

# What compiled loops hold fixed; what each means stands in the table.
_BLOCK, _FLAT, _LONGEST, _TINY = PROJECTION.block, PROJECTION.flat, PROJECTION.longest, TINY
_TIGHT = PROJECTION.tight
_SEARCH_STEPS, _SLOPE, _GROWTH, _BRACKET = (
    PROJECTION.search_steps,
    PROJECTION.slope,
    PROJECTION.growth,
    PROJECTION.bracket,
)
_RIDGE, _CERTIFICATE = PROJECTION.ridge, PROJECTION.certificate


class Projection(NamedTuple):
    """``traction`` [2, n]; ``motion`` [3] (the dual λ, zero where the load is not given); ``imbalance`` [3]."""

    traction: FloatArray
    motion: FloatArray
    imbalance: FloatArray
    iterations: int
    feasible: bool


class Constraints(NamedTuple):
    """What is projected on what: the ``point`` w [2, n], disks of ``radius`` [n] at ``arm`` [2, n], and the resultants
    ``target`` [3] that are ``given`` [3].
    """

    point: FloatArray
    radius: FloatArray
    arm: FloatArray
    target: FloatArray
    given: BoolArray


class Evaluation(NamedTuple):
    """φ at a dual, to be filled: ``traction`` [2, n], ``gradient`` [3] (the imbalance) and ``hessian`` [3, 3]."""

    traction: FloatArray
    gradient: FloatArray
    hessian: FloatArray


def project(
    point: FloatArray,
    radius: FloatArray,
    arm: FloatArray,
    target: FloatArray,
    given: BoolArray,
    start: FloatArray | None = None,
    max_iterations: int = PROJECTION.newton_steps,
) -> Projection:
    """Project ``point`` [2, n] on the disks of ``radius`` [n] and on the resultants ``target`` [3] that are ``given``
    [3].

    ``arm`` [2, n]: x and y of the cells; ``start``: a guess of the dual, from a projection nearby. ``feasible`` is
    False where no tractions within the disks have that resultant. Tractions and imbalance are NaN for points that are
    not finite or whose squares are not.
    """
    first = np.zeros(3) if start is None else np.where(given, start, 0.0)
    traction = np.empty_like(point)
    point = np.ascontiguousarray(point)  # a view of a larger array would be compiled for once more
    motion, imbalance, iterations, feasible = nearest_tractions(
        (point, radius, arm, target, given), first, traction, (0.0, max_iterations)
    )
    return Projection(traction, motion, imbalance, iterations, feasible)


@compiled
def nearest_tractions(
    given_constraints: tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray],
    motion: FloatArray,
    traction: FloatArray,
    bounds: tuple[float, int],
) -> tuple[FloatArray, FloatArray, int, bool]:
    """``project`` for compiled code: Newton's steps on φ from a dual ``motion``; fills the ``traction``.

    ``bounds``: by how much the dual may be off, as Newton's next step shows it, and most steps. The constraints come as
    a plain tuple, which enters compiled code four times as fast as a named one.
    """
    slack, max_iterations = bounds
    constraints = Constraints(*given_constraints)
    tight = _TIGHT * _sum(constraints.radius)
    here = Evaluation(traction, np.empty(3), np.empty((3, 3)))
    trial = Evaluation(traction, np.empty(3), np.empty((3, 3)))
    feasible, reach = True, largest(constraints.radius) + largest(constraints.point)
    if not 2.0 * reach * reach < np.inf:  # its square, too: an infinite one would make the traction 0, not the limit
        traction[:] = np.nan
        return motion, np.full(3, np.nan), 0, feasible
    _evaluate(constraints, motion, here)
    iteration, before = 0, np.inf
    for iteration in range(max_iterations):  # noqa: B007
        size = np.abs(here.gradient).max()
        if size <= tight:
            break
        # Of a load that cannot be carried some imbalance stays; where it falls there is nothing to certify.
        if np.abs(motion).max() > _FLAT * reach or (size > _SLOPE * before and _is_certificate(constraints, motion)):
            feasible = False
            break
        step, before = -_solve(here.hessian, here.gradient, constraints.given), size
        if np.abs(step).max() <= slack:
            break
        # Where all disks are left on one side φ is straight and Newton's step has no length of its own.
        step *= min(1.0, 2.0 * (reach + np.abs(motion).max()) / max(np.abs(step).max(), _TINY))
        motion = _search(constraints, motion, step, here.gradient, tight, trial)
        here.gradient[:], here.hessian[:] = trial.gradient, trial.hessian
    return motion, here.gradient, iteration, feasible


@compiled
def _search(
    constraints: Constraints,
    motion: FloatArray,
    step: FloatArray,
    gradient: FloatArray,
    tight: float,
    found: Evaluation,
) -> FloatArray:
    """Move along ``step`` to where the slope of φ has at most half its first size, by bracketing and false position;
    φ there goes to ``found``.
    """
    first = float(gradient @ step)
    low, low_slope, high, high_slope, length = 0.0, first, np.inf, np.inf, 1.0
    trial = motion + step
    for _ in range(_SEARCH_STEPS):
        trial = motion + length * step
        _evaluate(constraints, trial, found)
        slope = float(found.gradient @ step)
        if abs(slope) <= _SLOPE * abs(first) or np.abs(found.gradient).max() <= tight:
            break
        if slope < 0.0:
            low, low_slope = length, slope
        else:
            high, high_slope = length, slope
        if high == np.inf and length >= _LONGEST:
            break
        if high == np.inf:
            length *= _GROWTH
        else:
            share = low_slope / (low_slope - high_slope)
            length = low + min(max(share, _BRACKET), 1.0 - _BRACKET) * (high - low)
    return trial


@compiled
def _evaluate(constraints: Constraints, motion: FloatArray, found: Evaluation) -> None:
    """Tractions for a dual ``motion``, the gradient of φ (the imbalance) and its Hessian."""
    point, radius, arm, target, given = constraints
    traction, gradient, hessian = found
    gx, gy, gm = -target[0], -target[1], -target[2]
    hxx = hxy = hyy = hxm = hym = hmm = 0.0
    for first in range(0, radius.size, _BLOCK):
        part = slice(first, min(first + _BLOCK, radius.size))
        (bx, by, bm), (bxx, bxy, byy, bxm, bym, bmm) = _evaluate_block(
            point[0, part],
            point[1, part],
            radius[part],
            arm[0, part],
            arm[1, part],
            motion,
            traction[0, part],
            traction[1, part],
        )
        gx, gy, gm = gx + bx, gy + by, gm + bm
        hxx, hxy, hyy, hxm, hym, hmm = hxx + bxx, hxy + bxy, hyy + byy, hxm + bxm, hym + bym, hmm + bmm
    gradient[0], gradient[1], gradient[2] = gx * given[0], gy * given[1], gm * given[2]
    hessian[0, 0], hessian[0, 1], hessian[0, 2] = hxx, hxy, hxm
    hessian[1, 0], hessian[1, 1], hessian[1, 2] = hxy, hyy, hym
    hessian[2, 0], hessian[2, 1], hessian[2, 2] = hxm, hym, hmm


@compiled(fastmath=VECTOR)
def _evaluate_block(
    point_x: FloatArray,
    point_y: FloatArray,
    radius: FloatArray,
    arm_x: FloatArray,
    arm_y: FloatArray,
    motion: FloatArray,
    traction_x: FloatArray,
    traction_y: FloatArray,
) -> tuple[tuple[float, float, float], tuple[float, float, float, float, float, float]]:
    """Tractions of a few cells, their resultants and derivatives; without branches, so that it runs in vectors."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    bx = by = bm = hxx = hxy = hyy = hxm = hym = hmm = 0.0
    for i in range(radius.size):
        x, y = arm_x[i], arm_y[i]
        qx, qy = point_x[i] + mx - y * yaw, point_y[i] + my + x * yaw
        over = 1.0 / np.sqrt(qx * qx + qy * qy + _TINY)
        share = min(1.0, radius[i] * over)
        free = 1.0 if share == 1.0 else 0.0
        turning = (1.0 - free) * share * over * over  # at its limit a traction turns, but does not grow
        jxx, jxy, jyy = free + turning * qy * qy, -turning * qx * qy, free + turning * qx * qx
        qx, qy = share * qx, share * qy
        traction_x[i], traction_y[i] = qx, qy
        bx += qx
        by += qy
        bm += x * qy - y * qx
        jxm, jym = x * jxy - y * jxx, x * jyy - y * jxy
        hxx += jxx
        hxy += jxy
        hyy += jyy
        hxm += jxm
        hym += jym
        hmm += x * jym - y * jxm
    return (bx, by, bm), (hxx, hxy, hyy, hxm, hym, hmm)


@compiled
def _solve(hessian: FloatArray, gradient: FloatArray, given: BoolArray) -> FloatArray:
    """Newton's step in the directions whose load is given (Cholesky), with a ridge where φ is flat."""
    lower, step = np.zeros((3, 3)), np.zeros(3)
    # Where all disks are left exactly along an axis φ has no curvature at all along it: its step is to stay finite.
    least = max(_RIDGE**2 * max(hessian[0, 0], hessian[1, 1], hessian[2, 2]), _TINY)
    for i in range(3):
        for j in range(i):
            lower[i, j] = (hessian[i, j] * given[i] * given[j] - (lower[i, :j] * lower[j, :j]).sum()) / lower[j, j]
        diagonal = hessian[i, i] if given[i] else 1.0
        pivot = diagonal - (lower[i, :i] ** 2).sum()
        lower[i, i] = np.sqrt(max(pivot, _RIDGE * diagonal, least))
    for i in range(3):
        step[i] = (gradient[i] * given[i] - (lower[i, :i] * step[:i]).sum()) / lower[i, i]
    for i in range(2, -1, -1):
        step[i] = (step[i] - (lower[i + 1 :, i] * step[i + 1 :]).sum()) / lower[i, i]
    return step


@compiled
def _is_certificate(constraints: Constraints, motion: FloatArray) -> bool:
    """Whether the load does more work on this motion than friction everywhere could take up."""
    arm = constraints.arm
    return bool(
        constraints.target @ motion > _taken_up(constraints.radius, arm[0], arm[1], motion) * (1.0 + _CERTIFICATE)
    )


@compiled(fastmath=VECTOR)
def _taken_up(radius: FloatArray, arm_x: FloatArray, arm_y: FloatArray, motion: FloatArray) -> float:
    """The most that friction takes up on a motion."""
    mx, my, yaw, taken = motion[0], motion[1], motion[2], 0.0
    for i in range(radius.size):
        vx, vy = mx - arm_y[i] * yaw, my + arm_x[i] * yaw
        taken += radius[i] * np.sqrt(vx * vx + vy * vy)
    return taken


@compiled(fastmath=VECTOR)
def _sum(field: FloatArray) -> float:
    total = 0.0
    for i in range(field.size):
        total += field[i]
    return total
