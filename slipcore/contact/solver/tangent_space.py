"""Newton's system of tangential contact, in the space tangent to Coulomb's limits and to the given load.

A cell slides if a gradient step from it leaves its disk; it may move along its circle then, and anywhere if it sticks.

Loops over cells are compiled, without branches so that they run in vectors, and fused: at 64² cells a call of numpy
costs as much as its arithmetic. Fields in them are flat, of n cells.

Conjugate gradients keep fields in single precision, in units of a cell's own compliance and of the largest slip that
is left: they go to a share of that alone, and each Newton step finds anew what is left, in double precision. The space
stays in double precision: near the limit surface a rigid motion hardly lies in it, and single precision loses that.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.contact.defaults import TANGENTIAL
from slipcore.contact.elasticity.fields import VECTOR, largest
from slipcore.contact.elasticity.transform import Compiled, Numbers, convolve
from slipcore.frames import BoolArray, FloatArray

Space = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""Projector [3, n] (xx, xy and yy of each cell's projection on the space), arm [2, n], inverse Gram matrix [3, 3] of
the rigid motions in the space, curvature [n] of the limits (a sliding cell's slip over its limit) and scale [n].
"""
FIELDS = 7
"""What ``survey`` fills: the projector (3), what first moves sliding cells onto their circles (2), curvature, scale."""
SingleArray = NDArray[np.float32]
ScaledSpace = tuple[FloatArray, FloatArray, FloatArray, SingleArray, SingleArray]
"""The same with the curvature in units of a cell's own compliance; that and the scale in single precision."""
_CIRCLE_ROUNDING, _RANK = TANGENTIAL.circle_rounding, TANGENTIAL.rank
Taken = tuple[int, int, int]
"""How often the operator was applied, how often in single precision, and how often its inverse."""
_STIFFEST = float(np.finfo(np.float32).eps) ** -2  # no scale is smaller than single precision shows beside one


@compiled
def survey(
    here: tuple[FloatArray, FloatArray, FloatArray, float],
    load: tuple[FloatArray, BoolArray],
    fields: FloatArray,
) -> FloatArray:
    """Fill the ``FIELDS`` [7, n] of the space; its inverse Gram matrix of what is given.

    ``here``: traction and slip [2, n], limit [n] and the stiffness that scales a gradient step; ``load``: arm [2, n]
    and which resultants are given [3].
    """
    arm, given = load
    _classify(here, fields)
    gram = _gram(fields[:3], arm)
    for i in range(3):
        for j in range(3):
            gram[i, j] *= given[i] * given[j]
    return _inverse(gram)


@compiled
def _classify(here: tuple[FloatArray, FloatArray, FloatArray, float], fields: FloatArray) -> None:
    """Fill the fields.

    Where the curvature outweighs a cell's own compliance it is what the preconditioner must invert: hence the scale.
    """
    traction, slip, limit, stiffness = here
    for i in range(limit.size):
        radius, qx, qy = limit[i], traction[0, i], traction[1, i]
        wx, wy = qx - stiffness * slip[0, i], qy - stiffness * slip[1, i]
        inside = wx * wx + wy * wy <= radius * radius
        free = 1.0 if radius > 0.0 and inside else 0.0
        fields[0, i], fields[1, i], fields[2, i] = free, 0.0, free
        fields[3, i], fields[4, i], fields[5, i], fields[6, i] = 0.0, 0.0, 0.0, 1.0
        if radius <= 0.0 or inside:
            continue
        size = np.sqrt(qx * qx + qy * qy)
        on_circle = size > radius * (1.0 - _CIRCLE_ROUNDING)
        nx, ny = (qx / size, qy / size) if on_circle else (wx, wy)
        if not on_circle:
            size = np.sqrt(wx * wx + wy * wy)
            nx, ny = wx / size, wy / size
            fields[3, i], fields[4, i] = radius * nx - qx, radius * ny - qy
        fields[0, i], fields[1, i], fields[2, i] = ny * ny, -nx * ny, nx * nx
        curvature = max(-(slip[0, i] * nx + slip[1, i] * ny), 0.0) / radius
        fields[5, i], fields[6, i] = curvature, 1.0 / np.sqrt(1.0 + curvature * stiffness)


@compiled(fastmath=VECTOR)
def _gram(projector: FloatArray, arm: FloatArray) -> FloatArray:
    """Products of the three rigid motions, restricted to the space."""
    xx = xy = yy = xm = ym = mm = 0.0
    for i in range(arm.shape[1]):
        x, y = arm[0, i], arm[1, i]
        pxx, pxy, pyy = projector[0, i], projector[1, i], projector[2, i]
        pxm, pym = x * pxy - y * pxx, x * pyy - y * pxy
        xx += pxx
        xy += pxy
        yy += pyy
        xm += pxm
        ym += pym
        mm += x * pym - y * pxm
    return np.array(((xx, xy, xm), (xy, yy, ym), (xm, ym, mm)))


@compiled
def _inverse(gram: FloatArray) -> FloatArray:
    """By cofactors; the pseudo-inverse where all cells slide along one line, so that some rigid motion is not in the
    space.
    """
    xx, xy, yy, xm, ym, mm = gram[0, 0], gram[0, 1], gram[1, 1], gram[0, 2], gram[1, 2], gram[2, 2]
    plane = xx * yy - xy * xy
    cofactors = np.array(
        (yy * mm - ym * ym, xm * ym - xy * mm, xy * ym - xm * yy, xx * mm - xm * xm, xy * xm - xx * ym)
    )
    determinant = xx * cofactors[0] + xy * cofactors[1] + xm * cofactors[2]
    least = np.sqrt(_RANK) * max(xx, yy, mm)
    if xx > least and plane > least * xx and determinant > least * plane:
        a, b, c, d, e = cofactors / determinant
        return np.array(((a, b, c), (b, d, e), (c, e, plane / determinant)))
    values, vectors = np.linalg.eigh(gram)
    inverse = np.zeros((3, 3))
    for k in range(3):
        if values[k] > _RANK * values[2]:
            inverse += np.outer(vectors[:, k], vectors[:, k]) / values[k]
    return inverse


@compiled(fastmath=VECTOR)
def _restrict(projector: FloatArray, arm: FloatArray, move: FloatArray) -> tuple[float, float, float]:
    """Restrict a move to the space in place and return its resultants."""
    sx = sy = sm = 0.0
    for i in range(move.shape[1]):
        mx, my = move[0, i], move[1, i]
        px = projector[0, i] * mx + projector[1, i] * my
        py = projector[1, i] * mx + projector[2, i] * my
        move[0, i], move[1, i] = px, py
        sx += px
        sy += py
        sm += arm[0, i] * py - arm[1, i] * px
    return sx, sy, sm


@compiled(fastmath=VECTOR)
def _subtract_rigid(projector: FloatArray, arm: FloatArray, motion: FloatArray, move: FloatArray) -> None:
    """Subtract from a move, in place, the part of a rigid motion [3] that lies in the space."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    for i in range(move.shape[1]):
        dx, dy = mx - arm[1, i] * yaw, my + arm[0, i] * yaw
        move[0, i] -= projector[0, i] * dx + projector[1, i] * dy
        move[1, i] -= projector[1, i] * dx + projector[2, i] * dy


@compiled
def _rigid(inverse_gram: Numbers, sums: tuple[Any, Any, Any]) -> Numbers:
    """The rigid motion [3] whose part in the space has these resultants."""
    motion: Numbers = inverse_gram[:, 0] * sums[0] + inverse_gram[:, 1] * sums[1] + inverse_gram[:, 2] * sums[2]
    return motion


@compiled
def newton_move(
    space: Space,
    fields: tuple[FloatArray, FloatArray, FloatArray],
    target: FloatArray,
    by: tuple[Compiled, Compiled, Compiled],
    bounds: tuple[float, float, float, int],
) -> tuple[FloatArray, Taken]:
    """The move [2, ny, nx] onto the limits and to the resultants ``target`` [3], and from there to where the tangential
    part of the slip is zero; and what it took.

    Solves P(C + curvature)P move = −P(slip + curvature·made), with ``made`` the first part, by preconditioned conjugate
    gradients. ``fields`` [2, ny, nx]: traction, slip and what leads onto the circles; ``by``: operator, the same in
    single precision, and preconditioner; ``bounds``: a cell's own stiffness, a first part that is none, reduction of
    the preconditioned residual, most iterations.
    """
    (projector, arm, inverse_gram, _, _), (traction, slip, onto_circle), stiffness = space, fields, bounds[0]
    move, left = onto_circle.copy(), np.empty_like(slip)
    m, r = move.reshape(2, -1), left.reshape(2, -1)
    _subtract_rigid(projector, arm, _rigid(inverse_gram, _excess(target, traction.reshape(2, -1), m, arm)), m)
    moved = largest(move) > bounds[1]
    if moved:
        convolve(move, left, by[0])
    else:
        left[:] = 0.0
    _restrict_slip(space, slip.reshape(2, -1), m, r)
    top = largest(left)
    if not 0.0 < top < np.inf:
        return move, (int(moved), 0, 0)
    change, count = _conjugate_gradients(_scaled(space, stiffness), _shares(left, top), by[1:], bounds[2:])
    _add(m, change.reshape(2, -1), stiffness * top)
    return move, (count + moved, count, count)


@compiled
def _restrict_slip(space: Space, slip: FloatArray, made: FloatArray, left: FloatArray) -> None:
    """Make of the displacement by a ``made`` move the slip that is ``left`` in the space, without resultants."""
    projector, arm, inverse_gram, curvature, _ = space
    for k in range(2):
        for i in range(slip.shape[1]):
            left[k, i] += slip[k, i] + curvature[i] * made[k, i]
    _subtract_rigid(projector, arm, _rigid(inverse_gram, _restrict(projector, arm, left)), left)


@compiled
def _scaled(space: Space, stiffness: float) -> ScaledSpace:
    """A space in the units and precisions of conjugate gradients."""
    projector, arm, inverse_gram, curvature, scale = space
    stiff, scales = np.empty(scale.size, dtype=np.float32), np.empty(scale.size, dtype=np.float32)
    for i in range(scale.size):
        stiff[i] = min(curvature[i] * stiffness, _STIFFEST)
        scales[i] = max(scale[i], 1.0 / np.sqrt(_STIFFEST))
    return projector, arm, inverse_gram, stiff, scales


@compiled
def _shares(field: FloatArray, top: float) -> SingleArray:
    """A field [2, ny, nx] in units of its largest number, in single precision."""
    shares = np.empty(field.shape, dtype=np.float32)
    f, s = field.reshape(-1), shares.reshape(-1)
    for i in range(f.size):
        s[i] = f[i] / top
    return shares


@compiled
def _add(move: FloatArray, change: SingleArray, unit: float) -> None:
    """Add a change in some unit to a move, in place."""
    for k in range(2):
        for i in range(move.shape[1]):
            move[k, i] += unit * change[k, i]


@compiled(fastmath=VECTOR)
def _excess(target: FloatArray, traction: FloatArray, move: FloatArray, arm: FloatArray) -> tuple[float, float, float]:
    """Resultants of moved tractions beyond a target [3]."""
    sx, sy, sm = -target[0], -target[1], -target[2]
    for i in range(arm.shape[1]):
        qx, qy = traction[0, i] + move[0, i], traction[1, i] + move[1, i]
        sx += qx
        sy += qy
        sm += arm[0, i] * qy - arm[1, i] * qx
    return sx, sy, sm


@compiled
def _conjugate_gradients(
    space: ScaledSpace, residual: SingleArray, by: tuple[Compiled, Compiled], bounds: tuple[float, int]
) -> tuple[SingleArray, int]:
    """The move [2, ny, nx] that takes a ``residual``, which is overwritten, to zero; how often it took the operator.

    How far it came is told by the residual itself: to ask the preconditioned one would take one more preconditioner.
    """
    (operator, preconditioner), (reduction, most) = by, bounds
    move, direction, image, improved = (
        np.zeros_like(residual),
        np.zeros_like(residual),
        np.empty_like(residual),
        np.empty_like(residual),
    )
    m, d, r, i, g = (
        move.reshape(2, -1),
        direction.reshape(2, -1),
        residual.reshape(2, -1),
        image.reshape(2, -1),
        improved.reshape(2, -1),
    )
    left = first = _scaled_into(space[4], r, i)
    before, count = np.inf, 0
    while count < most and left > reduction**2 * first:
        convolve(image, improved, preconditioner)
        size, motion = _improve(space, r, g)
        if not size > 0.0:
            break
        _turn(space[0], space[1], motion, d, g, size / before)
        convolve(direction, image, operator)
        left = _advance(space, m, r, d, i, size)
        before, count = size, count + 1
    return move, count


@compiled(fastmath=VECTOR)
def _scaled_into(scale: SingleArray, residual: SingleArray, image: SingleArray) -> float:
    """Fill the image with the scaled residual; the sum of the squares of the latter."""
    square = 0.0
    for i in range(scale.size):
        rx, ry = residual[0, i], residual[1, i]
        image[0, i], image[1, i] = scale[i] * rx, scale[i] * ry
        square += rx * rx + ry * ry
    return square


@compiled
def _advance(
    space: ScaledSpace,
    move: SingleArray,
    residual: SingleArray,
    direction: SingleArray,
    image: SingleArray,
    size: float,
) -> float:
    """One conjugate-gradient step in place; the square of the new residual. ``image``: the operator on ``direction``,
    then the new residual, scaled for the preconditioner.
    """
    projector, arm, inverse_gram, curvature, scale = space
    product, sums = _stiffen(projector, arm, curvature, direction, image)
    return _go_on(projector, arm, scale, _rigid(inverse_gram, sums), (move, residual, direction, image), size / product)


@compiled(fastmath=VECTOR)
def _stiffen(
    projector: FloatArray, arm: FloatArray, curvature: SingleArray, direction: SingleArray, image: SingleArray
) -> tuple[float, tuple[float, float, float]]:
    """Restrict C·direction to the space and add the curvature, in place; direction·image, and its resultants."""
    product = sx = sy = sm = 0.0
    for i in range(direction.shape[1]):
        ax, ay, dx, dy = image[0, i], image[1, i], direction[0, i], direction[1, i]
        px = projector[0, i] * ax + projector[1, i] * ay + curvature[i] * dx
        py = projector[1, i] * ax + projector[2, i] * ay + curvature[i] * dy
        image[0, i], image[1, i] = px, py
        product += dx * px + dy * py
        sx += px
        sy += py
        sm += arm[0, i] * py - arm[1, i] * px
    return product, (sx, sy, sm)


@compiled(fastmath=VECTOR)
def _go_on(
    projector: FloatArray,
    arm: FloatArray,
    scale: SingleArray,
    motion: FloatArray,
    fields: tuple[SingleArray, SingleArray, SingleArray, SingleArray],
    step: float,
) -> float:
    """Add a step along a direction to the move, and its image without a rigid motion to the residual, in place; scale
    the latter into the image; its square.
    """
    move, residual, direction, image = fields
    mx, my, yaw, square = motion[0], motion[1], motion[2], 0.0
    for i in range(move.shape[1]):
        dx, dy = mx - arm[1, i] * yaw, my + arm[0, i] * yaw
        move[0, i] += step * direction[0, i]
        move[1, i] += step * direction[1, i]
        rx = residual[0, i] + step * (image[0, i] - projector[0, i] * dx - projector[1, i] * dy)
        ry = residual[1, i] + step * (image[1, i] - projector[1, i] * dx - projector[2, i] * dy)
        residual[0, i], residual[1, i] = rx, ry
        image[0, i], image[1, i] = scale[i] * rx, scale[i] * ry
        square += rx * rx + ry * ry
    return square


@compiled
def _improve(space: ScaledSpace, residual: SingleArray, improved: SingleArray) -> tuple[float, FloatArray]:
    """Scale a preconditioned residual and restrict it to the space, in place; its product with the residual, and the
    rigid motion whose part in the space has its resultants.

    That motion is not part of the product, since the residual has no resultants.
    """
    projector, arm, inverse_gram, _, scale = space
    product, sums = _restrict_scaled(projector, arm, scale, residual, improved)
    return product, _rigid(inverse_gram, sums)


@compiled(fastmath=VECTOR)
def _restrict_scaled(
    projector: FloatArray, arm: FloatArray, scale: SingleArray, residual: SingleArray, move: SingleArray
) -> tuple[float, tuple[float, float, float]]:
    """Scale a move and restrict it to the space, in place; its product with the residual, and its resultants."""
    product = sx = sy = sm = 0.0
    for i in range(move.shape[1]):
        mx, my = scale[i] * move[0, i], scale[i] * move[1, i]
        px = projector[0, i] * mx + projector[1, i] * my
        py = projector[1, i] * mx + projector[2, i] * my
        move[0, i], move[1, i] = px, py
        product += residual[0, i] * px + residual[1, i] * py
        sx += px
        sy += py
        sm += arm[0, i] * py - arm[1, i] * px
    return product, (sx, sy, sm)


@compiled(fastmath=VECTOR)
def _turn(
    projector: FloatArray,
    arm: FloatArray,
    motion: FloatArray,
    direction: SingleArray,
    improved: SingleArray,
    share: float,
) -> None:
    """The next conjugate direction, in place: a share of the last less what is improved without a rigid motion."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    for i in range(direction.shape[1]):
        dx, dy = mx - arm[1, i] * yaw, my + arm[0, i] * yaw
        px = improved[0, i] - projector[0, i] * dx - projector[1, i] * dy
        py = improved[1, i] - projector[1, i] * dx - projector[2, i] * dy
        direction[0, i], direction[1, i] = share * direction[0, i] - px, share * direction[1, i] - py


@compiled(fastmath=VECTOR)
def outward(traction: FloatArray, move: FloatArray, scale: FloatArray, point: FloatArray) -> None:
    """Fill ``point`` with moved tractions [2, n], those of sliding cells 1 + curvature·stiffness times as long: at a
    solution, the gradient step from it.

    Projected, sliding cells stay at their limits. From tractions at the limits, a projection that makes up on all cells
    for what one of them is cut by would take sliding cells inside, against their slip: the step would climb.
    """
    for i in range(scale.size):
        longer = 1.0 / (scale[i] * scale[i])
        point[0, i], point[1, i] = longer * (traction[0, i] + move[0, i]), longer * (traction[1, i] + move[1, i])
