"""Nearest tractions that Coulomb's law and the load allow: {|q_i| ≤ R_i} ∩ {Σq = F, Σ(x × q) = M}.

The dual has three unknowns only, a rigid motion λ: q_i is the nearest point of disk i to w_i + B_i λ, with B_i λ = (λ₁
− y_i λ₃, λ₂ + x_i λ₃), and λ minimises the convex φ(λ) = Σ h_i(w_i + B_i λ) − λ·target, whose gradient is the
imbalance. Newton's steps on φ are shortened where its slope along them changes sign. They are never judged by the size
of the imbalance, which near full sliding hardly falls until the very end.
"""

from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.elasticity.fields import VECTOR
from slipcore.frames import BoolArray, FloatArray

TIGHT = 2e-14
"""Imbalance, as a share of the sum of the radii, that rounding allows to reach."""

BLOCK = 256
"""Cells summed at a time: a plain sum of many equal tractions rounds always the same way, and misses ``TIGHT``."""

FLAT = 1e7
"""Dual, as a multiple of the largest wish and radius, beyond which φ is flat to rounding: the load is at its limit."""

SMALLEST = 1e-300
"""Added to squares that are divided by."""

LONGEST = 1e6
"""Steps a search may grow to: φ is then as good as linear along it."""


class Projection(NamedTuple):
    """``traction`` [2, n]; ``motion`` [3] (the dual λ, zero where the load is not given); ``imbalance`` [3]."""

    traction: FloatArray
    motion: FloatArray
    imbalance: FloatArray
    iterations: int
    feasible: bool


def project(
    wish: FloatArray,
    radius: FloatArray,
    arm: FloatArray,
    target: FloatArray,
    given: BoolArray,
    start: FloatArray | None = None,
    max_iterations: int = 60,
) -> Projection:
    """Project ``wish`` [2, n] on the disks of ``radius`` [n] and on the resultants ``target`` [3] that are ``given``
    [3].

    ``arm`` [2, n]: x and y of the cells; ``start``: a guess of the dual, from a projection nearby. ``feasible`` is
    False where no tractions within the disks have that resultant.
    """
    first = np.zeros(3) if start is None else np.where(given, start, 0.0)
    traction = np.empty_like(wish)
    motion, imbalance, iterations, feasible = _dual_newton(
        wish, radius, arm, target, given, first, traction, TIGHT * radius.sum(), max_iterations
    )
    return Projection(traction, motion, imbalance, iterations, feasible)


@compiled
def _dual_newton(wish, radius, arm, target, given, motion, traction, tight, max_iterations):  # type: ignore[no-untyped-def]
    gradient, hessian = np.empty(3), np.empty((3, 3))
    trial_gradient, trial_hessian = np.empty(3), np.empty((3, 3))
    feasible, reach = True, radius.max() + np.abs(wish).max()
    _evaluate(wish, radius, arm, target, given, motion, traction, gradient, hessian)
    iteration = 0
    for iteration in range(max_iterations):  # noqa: B007
        if np.abs(gradient).max() <= tight:
            break
        if np.abs(motion).max() > FLAT * reach or _is_certificate(radius, arm, target, motion):
            feasible = False
            break
        step = -_solve(hessian, gradient, given)
        # Where all disks are left on one side φ is straight and Newton's step has no length of its own.
        step *= min(1.0, 2.0 * (reach + np.abs(motion).max()) / max(np.abs(step).max(), 1e-300))
        motion = _search(
            wish, radius, arm, target, given, motion, step, gradient, tight, traction, trial_gradient, trial_hessian
        )
        gradient[:], hessian[:] = trial_gradient, trial_hessian
    return motion, gradient, iteration, feasible


@compiled
def _search(wish, radius, arm, target, given, motion, step, gradient, tight, traction, trial_gradient, trial_hessian):  # type: ignore[no-untyped-def]
    """Move along ``step`` to where the slope of φ has at most half its first size, by bracketing and false position."""
    first = gradient @ step
    low, low_slope, high, high_slope, length = 0.0, first, np.inf, np.inf, 1.0
    trial = motion + step
    for _ in range(60):
        trial = motion + length * step
        _evaluate(wish, radius, arm, target, given, trial, traction, trial_gradient, trial_hessian)
        slope = trial_gradient @ step
        if abs(slope) <= 0.5 * abs(first) or np.abs(trial_gradient).max() <= tight:
            break
        if slope < 0.0:
            low, low_slope = length, slope
        else:
            high, high_slope = length, slope
        if high == np.inf and length >= LONGEST:
            break
        if high == np.inf:
            length *= 4.0
        else:
            share = low_slope / (low_slope - high_slope)
            length = low + min(max(share, 0.1), 0.9) * (high - low)
    return trial


@compiled
def _evaluate(wish, radius, arm, target, given, motion, traction, gradient, hessian):  # type: ignore[no-untyped-def]
    """Tractions for a dual ``motion``, the gradient of φ (the imbalance) and its Hessian."""
    gx, gy, gm = -target[0], -target[1], -target[2]
    hxx = hxy = hyy = hxm = hym = hmm = 0.0
    for first in range(0, radius.size, BLOCK):
        part = slice(first, min(first + BLOCK, radius.size))
        (bx, by, bm), (bxx, bxy, byy, bxm, bym, bmm) = _evaluate_block(
            wish[0, part],
            wish[1, part],
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
def _evaluate_block(wish_x, wish_y, radius, arm_x, arm_y, motion, traction_x, traction_y):  # type: ignore[no-untyped-def]
    """Tractions of a few cells, their resultants and derivatives; without branches, so that it runs in vectors."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    bx = by = bm = hxx = hxy = hyy = hxm = hym = hmm = 0.0
    for i in range(radius.size):
        x, y = arm_x[i], arm_y[i]
        qx, qy = wish_x[i] + mx - y * yaw, wish_y[i] + my + x * yaw
        square = qx * qx + qy * qy + SMALLEST
        share = min(1.0, radius[i] / np.sqrt(square))
        free = 1.0 if share == 1.0 else 0.0
        turning = (1.0 - free) * share / square  # at its limit a traction turns, but does not grow
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
def _solve(hessian, gradient, given):  # type: ignore[no-untyped-def]
    """Newton's step in the directions whose load is given (Cholesky), with a ridge where φ is flat."""
    lower, step = np.zeros((3, 3)), np.zeros(3)
    for i in range(3):
        for j in range(i):
            lower[i, j] = (hessian[i, j] * given[i] * given[j] - (lower[i, :j] * lower[j, :j]).sum()) / lower[j, j]
        diagonal = hessian[i, i] if given[i] else 1.0
        pivot = diagonal - (lower[i, :i] ** 2).sum()
        lower[i, i] = np.sqrt(max(pivot, 1e-13 * diagonal, 1e-300))
    for i in range(3):
        step[i] = (gradient[i] * given[i] - (lower[i, :i] * step[:i]).sum()) / lower[i, i]
    for i in range(2, -1, -1):
        step[i] = (step[i] - (lower[i + 1 :, i] * step[i + 1 :]).sum()) / lower[i, i]
    return step


@compiled
def _is_certificate(radius, arm, target, motion):  # type: ignore[no-untyped-def]
    """Whether the load does more work on this motion than friction everywhere could take up."""
    work, taken = target @ motion, 0.0
    for i in range(radius.size):
        taken += radius[i] * np.hypot(motion[0] - arm[1, i] * motion[2], motion[1] + arm[0, i] * motion[2])
    return work > taken * (1.0 + 1e-12)
