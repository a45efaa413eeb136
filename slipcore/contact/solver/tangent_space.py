"""Newton's system of tangential contact, in the space tangent to Coulomb's limits and to the given load.

Loops over cells are compiled, without branches so that they run in vectors, and fused: at 64² cells a call of numpy
costs as much as its arithmetic.
"""

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.contact.defaults import TANGENTIAL
from slipcore.contact.elasticity.fields import VECTOR
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.elasticity.transform import Compiled, convolve
from slipcore.frames import BoolArray, FloatArray

OUTSIDE, STICK, SLIP = 0, 1, 2
Space = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""Projector, arm, inverse Gram matrix, curvature and scale of a space, for flat fields of n cells."""
_CIRCLE_ROUNDING, _RANK = TANGENTIAL.circle_rounding, TANGENTIAL.rank


class TangentSpace:
    """Directions in which tractions may move to first order, and the curvature of the limits along them.

    A cell slides if a gradient step from it, of length ``stiffness``, leaves its disk. ``onto_circle`` [2, ny, nx]
    first moves sliding cells to their limit. ``state`` [ny, nx] is OUTSIDE, STICK or SLIP; ``projector`` [3, ny, nx]
    holds xx, xy and yy of each cell's projection on the space; ``curvature`` [ny, nx] a sliding cell's slip over its
    limit.
    """

    def __init__(
        self,
        traction: FloatArray,
        slip: FloatArray,
        limit: FloatArray,
        stiffness: float,
        arm: FloatArray,
        given: BoolArray,
    ) -> None:
        self.arm = arm
        self.state = np.empty(limit.shape, dtype=np.int8)
        self.projector, self.onto_circle = np.empty((3, *limit.shape)), np.zeros_like(traction)
        # Where the curvature outweighs a cell's own compliance it is what the preconditioner must invert.
        self.curvature, self.scale = np.zeros(limit.shape), np.ones(limit.shape)
        _classify(
            _flat(traction),
            _flat(slip),
            limit.ravel(),
            stiffness,
            (
                self.state.ravel(),
                _flat(self.projector),
                _flat(self.onto_circle),
                self.curvature.ravel(),
                self.scale.ravel(),
            ),
        )
        self.inverse_gram = _inverse(_gram(_flat(self.projector), _flat(arm)) * np.outer(given, given))

    def balancing(self, lacking: FloatArray) -> FloatArray:
        """The smallest move within the space that adds the resultants ``lacking`` [3]."""
        move = np.zeros_like(self.onto_circle)
        _subtract_rigid(_flat(self.projector), _flat(self.arm), -self.inverse_gram @ lacking, _flat(move))
        return move

    def balanced(self, move: FloatArray) -> FloatArray:
        """The part of a move [2, ny, nx] that lies in the space and has no given resultant; in place."""
        _balance(_flat(self.projector), _flat(self.arm), self.inverse_gram, _flat(move))
        return move

    def outward(self, traction: FloatArray) -> FloatArray:
        """Tractions [2, ny, nx] with those of sliding cells 1 + curvature·stiffness times as long: at a solution, the
        gradient step from it.

        Projected, sliding cells stay at their limits. From tractions at the limits, a projection that makes up on all
        cells for what one of them is cut by would take sliding cells inside, against their slip: the step would climb.
        """
        return traction / self.scale**2

    def conjugate_gradients(
        self, operator: ElasticOperator, slip: FloatArray, made: FloatArray, reduction: float, max_iterations: int
    ) -> FloatArray:
        """The move that brings the tangential part of ``slip`` to zero; ``made`` is the move made so far.

        Solves P(C + curvature)P move = −P(slip + curvature·made), preconditioned, to a share ``reduction`` of the
        first preconditioned residual.
        """
        by, bounds = (operator.tangential_compiled, operator.tangential_inverse.compiled), (reduction, max_iterations)
        move, count = _conjugate_gradients(self.flat, slip, made, by, bounds)
        operator.count.tangential += count
        return move

    @property
    def flat(self) -> Space:
        """The space as compiled loops take it."""
        return (
            _flat(self.projector),
            _flat(self.arm),
            self.inverse_gram,
            self.curvature.ravel(),
            self.scale.ravel(),
        )


def _flat(field: FloatArray) -> FloatArray:
    return field.reshape(len(field), -1)


@compiled
def _classify(
    traction: FloatArray,
    slip: FloatArray,
    limit: FloatArray,
    stiffness: float,
    found: tuple[NDArray[np.int8], FloatArray, FloatArray, FloatArray, FloatArray],
) -> None:
    """Fill state, projector, onto_circle, curvature and scale, as ``TangentSpace`` has them, for flat fields."""
    state, projector, onto_circle, curvature, scale = found
    for i in range(limit.size):
        radius = limit[i]
        if radius <= 0.0:
            state[i] = OUTSIDE
            projector[:, i] = 0.0
            continue
        qx, qy = traction[0, i], traction[1, i]
        wx, wy = qx - stiffness * slip[0, i], qy - stiffness * slip[1, i]
        if wx * wx + wy * wy <= radius * radius:
            state[i] = STICK
            projector[0, i], projector[1, i], projector[2, i] = 1.0, 0.0, 1.0
            continue
        size = np.sqrt(qx * qx + qy * qy)
        on_circle = size > radius * (1.0 - _CIRCLE_ROUNDING)
        nx, ny = (qx / size, qy / size) if on_circle else (wx, wy)
        if not on_circle:
            size = np.sqrt(wx * wx + wy * wy)
            nx, ny = wx / size, wy / size
            onto_circle[0, i], onto_circle[1, i] = radius * nx - qx, radius * ny - qy
        state[i] = SLIP
        projector[0, i], projector[1, i], projector[2, i] = ny * ny, -nx * ny, nx * nx
        curvature[i] = max(-(slip[0, i] * nx + slip[1, i] * ny), 0.0) / radius
        scale[i] = 1.0 / np.sqrt(1.0 + curvature[i] * stiffness)


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
    """Pseudo-inverse: where all cells slide along one line some rigid motion is not in the space."""
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
def _balance(projector: FloatArray, arm: FloatArray, inverse_gram: FloatArray, move: FloatArray) -> None:
    """Restrict a move to the space and take off its resultants, in place."""
    _subtract_rigid(projector, arm, _rigid(inverse_gram, _restrict(projector, arm, move)), move)


@compiled
def _rigid(inverse_gram: FloatArray, sums: tuple[float, float, float]) -> FloatArray:
    """The rigid motion [3] whose part in the space has these resultants."""
    return inverse_gram[:, 0] * sums[0] + inverse_gram[:, 1] * sums[1] + inverse_gram[:, 2] * sums[2]


@compiled
def _conjugate_gradients(
    space: Space, slip: FloatArray, made: FloatArray, by: tuple[Compiled, Compiled], bounds: tuple[float, int]
) -> tuple[FloatArray, int]:
    """The move [2, ny, nx], and how often it took the operator; ``by``: operator and preconditioner; ``bounds``:
    reduction of the residual, and most iterations.
    """
    (operator, preconditioner), (reduction, most) = by, bounds
    move, direction, residual = np.zeros_like(slip), np.zeros_like(slip), np.empty_like(slip)
    image, improved = np.empty_like(slip), np.empty_like(slip)
    m, d, r, i, g = (
        move.reshape(2, -1),
        direction.reshape(2, -1),
        residual.reshape(2, -1),
        image.reshape(2, -1),
        improved.reshape(2, -1),
    )
    _begin(space, slip.reshape(2, -1), made.reshape(2, -1), r, i)
    convolve(image, improved, preconditioner)
    size = first = _improve(space, r, g)
    _turn(d, g, 0.0)
    count = 0
    while count < most and size > 0.0:
        convolve(direction, image, operator)
        _advance(space, m, r, d, i, size)
        convolve(image, improved, preconditioner)
        before, size = size, _improve(space, r, g)
        count += 1
        if size <= reduction**2 * first:
            break
        _turn(d, g, size / before)
    return move, count


@compiled
def _begin(space: Space, slip: FloatArray, made: FloatArray, residual: FloatArray, image: FloatArray) -> None:
    """The first residual, and the same scaled for the preconditioner."""
    projector, arm, inverse_gram, curvature, scale = space
    for k in range(2):
        for i in range(slip.shape[1]):
            residual[k, i] = slip[k, i] + curvature[i] * made[k, i]
    _scale_balanced(projector, arm, scale, _rigid(inverse_gram, _restrict(projector, arm, residual)), residual, image)


@compiled(fastmath=VECTOR)
def _scale_balanced(
    projector: FloatArray,
    arm: FloatArray,
    scale: FloatArray,
    motion: FloatArray,
    residual: FloatArray,
    image: FloatArray,
) -> None:
    """Subtract a rigid motion from the residual, in place, and scale that for the preconditioner."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    for i in range(residual.shape[1]):
        dx, dy = mx - arm[1, i] * yaw, my + arm[0, i] * yaw
        rx = residual[0, i] - projector[0, i] * dx - projector[1, i] * dy
        ry = residual[1, i] - projector[1, i] * dx - projector[2, i] * dy
        residual[0, i], residual[1, i] = rx, ry
        image[0, i], image[1, i] = scale[i] * rx, scale[i] * ry


@compiled
def _advance(
    space: Space, move: FloatArray, residual: FloatArray, direction: FloatArray, image: FloatArray, size: float
) -> None:
    """One conjugate-gradient step in place; ``image``: the operator on ``direction``, then the new residual, scaled for
    the preconditioner.
    """
    projector, arm, inverse_gram, curvature, scale = space
    step = size / _stiffen(projector, curvature, direction, image)
    sums = _go_on(arm, move, residual, direction, image, step)
    _scale_balanced(projector, arm, scale, _rigid(inverse_gram, sums), residual, image)


@compiled(fastmath=VECTOR)
def _go_on(
    arm: FloatArray, move: FloatArray, residual: FloatArray, direction: FloatArray, image: FloatArray, step: float
) -> tuple[float, float, float]:
    """Add a step along a direction to the move, and its image to the residual, in place; the resultants of that."""
    sx = sy = sm = 0.0
    for i in range(move.shape[1]):
        move[0, i] += step * direction[0, i]
        move[1, i] += step * direction[1, i]
        rx, ry = residual[0, i] + step * image[0, i], residual[1, i] + step * image[1, i]
        residual[0, i], residual[1, i] = rx, ry
        sx += rx
        sy += ry
        sm += arm[0, i] * ry - arm[1, i] * rx
    return sx, sy, sm


@compiled(fastmath=VECTOR)
def _stiffen(projector: FloatArray, curvature: FloatArray, direction: FloatArray, image: FloatArray) -> float:
    """Restrict C·direction to the space and add the curvature, in place; return direction·image."""
    product = 0.0
    for i in range(direction.shape[1]):
        ax, ay, dx, dy = image[0, i], image[1, i], direction[0, i], direction[1, i]
        px = projector[0, i] * ax + projector[1, i] * ay + curvature[i] * dx
        py = projector[1, i] * ax + projector[2, i] * ay + curvature[i] * dy
        image[0, i], image[1, i] = px, py
        product += dx * px + dy * py
    return product


@compiled
def _improve(space: Space, residual: FloatArray, improved: FloatArray) -> float:
    """Scale and balance a preconditioned residual in place; its product with the residual."""
    projector, arm, inverse_gram, _, scale = space
    sums = _restrict_scaled(projector, arm, scale, improved)
    return _balanced_product(projector, arm, _rigid(inverse_gram, sums), residual, improved)


@compiled(fastmath=VECTOR)
def _restrict_scaled(
    projector: FloatArray, arm: FloatArray, scale: FloatArray, move: FloatArray
) -> tuple[float, float, float]:
    """Scale a move and restrict it to the space, in place; its resultants."""
    sx = sy = sm = 0.0
    for i in range(move.shape[1]):
        mx, my = scale[i] * move[0, i], scale[i] * move[1, i]
        px = projector[0, i] * mx + projector[1, i] * my
        py = projector[1, i] * mx + projector[2, i] * my
        move[0, i], move[1, i] = px, py
        sx += px
        sy += py
        sm += arm[0, i] * py - arm[1, i] * px
    return sx, sy, sm


@compiled(fastmath=VECTOR)
def _balanced_product(
    projector: FloatArray, arm: FloatArray, motion: FloatArray, residual: FloatArray, move: FloatArray
) -> float:
    """Subtract a rigid motion from a move, in place; its product with the residual."""
    mx, my, yaw, product = motion[0], motion[1], motion[2], 0.0
    for i in range(move.shape[1]):
        dx, dy = mx - arm[1, i] * yaw, my + arm[0, i] * yaw
        px = move[0, i] - projector[0, i] * dx - projector[1, i] * dy
        py = move[1, i] - projector[1, i] * dx - projector[2, i] * dy
        move[0, i], move[1, i] = px, py
        product += residual[0, i] * px + residual[1, i] * py
    return product


@compiled
def _turn(direction: FloatArray, improved: FloatArray, share: float) -> None:
    """The next conjugate direction, in place."""
    for k in range(2):
        for i in range(direction.shape[1]):
            direction[k, i] = share * direction[k, i] - improved[k, i]
