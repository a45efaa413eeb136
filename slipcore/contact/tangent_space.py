"""Newton's system of tangential contact, in the space tangent to Coulomb's limits and to the given load."""

import numpy as np
from numba import njit

from slipcore.contact.fields import inner
from slipcore.contact.operator import ElasticOperator
from slipcore.frames import BoolArray, FloatArray

OUTSIDE, STICK, SLIP = 0, 1, 2


class TangentSpace:
    """Directions in which tractions may move to first order, and the curvature of the limits along them.

    A cell slides if a gradient step from it, of length ``stiffness``, leaves its disk. ``onto_circle`` [2, ny, nx]
    first moves sliding cells to their limit. ``state`` [ny, nx] is OUTSIDE, STICK or SLIP; ``normal`` [2, ny, nx] the
    direction of a sliding cell's traction; ``curvature`` [ny, nx] its slip over its limit.
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
        self.state = np.empty(limit.shape, dtype=np.int8)
        self.normal, self.onto_circle = np.zeros_like(traction), np.zeros_like(traction)
        self.curvature = np.zeros(limit.shape)
        _classify(traction, slip, limit, stiffness, self.state, self.normal, self.onto_circle, self.curvature)
        # Where the curvature outweighs a cell's own compliance it is what the preconditioner must invert.
        self.scale = 1.0 / np.sqrt(1.0 + self.curvature * stiffness)
        self.arm = arm
        gram = _gram(self.state, self.normal, arm) * np.outer(given, given)
        self.inverse_gram = np.linalg.pinv(gram, rcond=1e-12, hermitian=True)

    def balancing(self, lacking: FloatArray) -> FloatArray:
        """The smallest move within the space that adds the resultants ``lacking`` [3]."""
        move = np.zeros_like(self.normal)
        _subtract_rigid(self.state, self.normal, self.arm, -self.inverse_gram @ lacking, move)
        return move

    def balanced(self, move: FloatArray) -> FloatArray:
        """The part of a move [2, ny, nx] that lies in the space and has no given resultant; in place."""
        sums = _restrict(self.state, self.normal, self.arm, move)
        _subtract_rigid(self.state, self.normal, self.arm, self.inverse_gram @ sums, move)
        return move

    def conjugate_gradients(
        self, operator: ElasticOperator, slip: FloatArray, made: FloatArray, reduction: float, max_iterations: int
    ) -> FloatArray:
        """The move that brings the tangential part of ``slip`` to zero; ``made`` is the move made so far.

        Solves P(C + curvature)P move = −P(slip + curvature·made), preconditioned, to a share ``reduction`` of the
        first preconditioned residual.
        """
        inverse = operator.tangential_inverse
        residual = self.balanced(slip + self.curvature * made)
        move = np.zeros_like(slip)
        improved = self.balanced(self.scale * inverse(self.scale * residual))
        direction = -improved
        size = first = inner(residual, improved)
        for _ in range(max_iterations):
            if size <= 0.0:
                break
            answer = operator.tangential(direction)
            step = size / _stiffen(self.state, self.normal, self.curvature, direction, answer)
            _advance(move, residual, direction, answer, step)
            self.balanced(residual)
            improved = self.balanced(self.scale * inverse(self.scale * residual))
            before, size = size, inner(residual, improved)
            if size <= reduction**2 * first:
                break
            direction *= size / before
            direction -= improved
        return move


@njit(cache=True)
def _classify(traction, slip, limit, stiffness, state, normal, onto_circle, curvature):  # type: ignore[no-untyped-def]
    for j in range(limit.shape[0]):
        for i in range(limit.shape[1]):
            radius = limit[j, i]
            if radius <= 0.0:
                state[j, i] = OUTSIDE
                continue
            qx, qy = traction[0, j, i], traction[1, j, i]
            wx, wy = qx - stiffness * slip[0, j, i], qy - stiffness * slip[1, j, i]
            if wx * wx + wy * wy <= radius * radius:
                state[j, i] = STICK
                continue
            size = np.sqrt(qx * qx + qy * qy)
            on_circle = size > radius * (1.0 - 1e-12)
            nx, ny = (qx / size, qy / size) if on_circle else (wx, wy)
            if not on_circle:
                size = np.sqrt(wx * wx + wy * wy)
                nx, ny = wx / size, wy / size
                onto_circle[0, j, i], onto_circle[1, j, i] = radius * nx - qx, radius * ny - qy
            state[j, i] = SLIP
            normal[0, j, i], normal[1, j, i] = nx, ny
            curvature[j, i] = max(-(slip[0, j, i] * nx + slip[1, j, i] * ny), 0.0) / radius


@njit(cache=True)
def _gram(state, normal, arm):  # type: ignore[no-untyped-def]
    """Products of the three rigid motions, restricted to the space."""
    gram = np.zeros((3, 3))
    for j in range(state.shape[0]):
        for i in range(state.shape[1]):
            kind = state[j, i]
            if kind == OUTSIDE:
                continue
            x, y = arm[0, j, i], arm[1, j, i]
            axx, axy, ayy = 1.0, 0.0, 1.0
            if kind == SLIP:
                nx, ny = normal[0, j, i], normal[1, j, i]
                axx, axy, ayy = ny * ny, -nx * ny, nx * nx
            gram[0, 0] += axx
            gram[0, 1] += axy
            gram[1, 1] += ayy
            gram[0, 2] += x * axy - y * axx
            gram[1, 2] += x * ayy - y * axy
            gram[2, 2] += x * x * ayy - 2.0 * x * y * axy + y * y * axx
    gram[1, 0], gram[2, 0], gram[2, 1] = gram[0, 1], gram[0, 2], gram[1, 2]
    return gram


@njit(cache=True)
def _restrict(state, normal, arm, move):  # type: ignore[no-untyped-def]
    """Restrict a move to the space in place and return its resultants [3]."""
    sums = np.zeros(3)
    for j in range(state.shape[0]):
        for i in range(state.shape[1]):
            kind = state[j, i]
            if kind == OUTSIDE:
                move[0, j, i] = move[1, j, i] = 0.0
                continue
            if kind == SLIP:
                nx, ny = normal[0, j, i], normal[1, j, i]
                along = nx * move[1, j, i] - ny * move[0, j, i]
                move[0, j, i], move[1, j, i] = -ny * along, nx * along
            sums[0] += move[0, j, i]
            sums[1] += move[1, j, i]
            sums[2] += arm[0, j, i] * move[1, j, i] - arm[1, j, i] * move[0, j, i]
    return sums


@njit(cache=True)
def _subtract_rigid(state, normal, arm, motion, move):  # type: ignore[no-untyped-def]
    """Subtract from a move, in place, the part of a rigid motion [3] that lies in the space."""
    for j in range(state.shape[0]):
        for i in range(state.shape[1]):
            kind = state[j, i]
            if kind == OUTSIDE:
                continue
            dx, dy = motion[0] - arm[1, j, i] * motion[2], motion[1] + arm[0, j, i] * motion[2]
            if kind == SLIP:
                nx, ny = normal[0, j, i], normal[1, j, i]
                along = nx * dy - ny * dx
                dx, dy = -ny * along, nx * along
            move[0, j, i] -= dx
            move[1, j, i] -= dy


@njit(cache=True)
def _stiffen(state, normal, curvature, direction, answer):  # type: ignore[no-untyped-def]
    """Restrict C·direction to the space and add the curvature, in place; return direction·answer."""
    product = 0.0
    for j in range(state.shape[0]):
        for i in range(state.shape[1]):
            kind = state[j, i]
            if kind == OUTSIDE:
                answer[0, j, i] = answer[1, j, i] = 0.0
                continue
            if kind == SLIP:
                nx, ny = normal[0, j, i], normal[1, j, i]
                along = nx * answer[1, j, i] - ny * answer[0, j, i]
                answer[0, j, i] = -ny * along + curvature[j, i] * direction[0, j, i]
                answer[1, j, i] = nx * along + curvature[j, i] * direction[1, j, i]
            product += direction[0, j, i] * answer[0, j, i] + direction[1, j, i] * answer[1, j, i]
    return product


@njit(cache=True)
def _advance(move, residual, direction, answer, step):  # type: ignore[no-untyped-def]
    for k in range(2):
        for j in range(move.shape[1]):
            for i in range(move.shape[2]):
                move[k, j, i] += step * direction[k, j, i]
                residual[k, j, i] += step * answer[k, j, i]
