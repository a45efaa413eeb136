"""One incremental step of tangential contact with Coulomb friction.

    minimise ½ qᵀCq + qᵀc   over |q_i| ≤ R_i, Σq A = F, Σ(x × q) A = M

with C the tangential compliance, c what the surface has moved apart from it since the last step, and R = μp. The rigid
motion of the object is the multiplier of the load: slip = Cq + c − B·motion is zero where a cell sticks and opposite
to its traction where it slides.

Newton's method in the space tangent to the constraints (both directions where a cell sticks, along the circle where it
slides), each system solved by preconditioned conjugate gradients; then the exact projection back, and an exact line
search, which is free because the objective is quadratic and the feasible set convex. Every iterate balances the load.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slipcore.compilation import compiled
from slipcore.contact.defaults import TANGENTIAL, TINY
from slipcore.contact.elasticity.fields import VECTOR, doubled, halved, lengths, resultants, rigid_displacement
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.limit_load import limit_load
from slipcore.contact.solver.projection import project
from slipcore.contact.solver.sliding import sliding_traction
from slipcore.contact.solver.tangent_space import TangentSpace
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SolverControl:
    """What drives the object along x, along y and in rotation: its load where ``given``, otherwise its motion.

    ``load``: F_x N, F_y N, M N·m on the finger, total; ``motion``: dx m, dy m, dφ rad in this step.
    """

    load: FloatArray = field(default_factory=lambda: np.zeros(3))
    motion: FloatArray = field(default_factory=lambda: np.zeros(3))
    given: BoolArray = field(default_factory=lambda: np.ones(3, dtype=bool))

    def __post_init__(self) -> None:
        for name in ("load", "motion", "given"):
            value = getattr(self, name)
            if value.shape != (3,) or not np.isfinite(value).all():
                raise InvalidInput(f"tangential {name}", value, "three finite numbers")


class TangentialContact(NamedTuple):
    """``traction`` on the finger and its ``displacement`` Cq [2, ny, nx]; ``slip`` of the finger against the object in
    this step; ``motion`` [3] of the object in this step (m, m, rad); ``residual`` of the natural map as a share of the
    largest limit; ``imbalance`` as a share of the summed limits; ``iterations``: Newton steps; ``slides`` [ny, nx]:
    cells that slide; ``sliding``: all cells slide. On the limit surface no motion is too large; the one given is the
    least with which all slide.
    """

    traction: FloatArray
    displacement: FloatArray
    slip: FloatArray
    motion: FloatArray
    residual: float
    imbalance: float
    iterations: int
    slides: BoolArray
    sliding: bool


def solve_tangential(
    operator: ElasticOperator,
    points: tuple[FloatArray, FloatArray],
    limit: FloatArray,
    offset: FloatArray,
    control: SolverControl,
    start: FloatArray,
    tolerance: float = TANGENTIAL.tolerance,
    max_iterations: int = TANGENTIAL.newton_steps,
) -> TangentialContact:
    """Tractions and motion of one step.

    ``points``: x and y of the cells [ny, nx] m; ``limit``: μp [ny, nx] Pa, zero outside contact; ``offset``: c above,
    [2, ny, nx] m; ``start``: a guess of the tractions; ``tolerance`` on the residual, relative to the largest limit.

    Raises ``InfeasibleLoad`` outside the limit surface and ``NotConverged`` at ``max_iterations``, where the tractions
    miss the load, or where a number is not finite or grows beyond what floating point holds.
    """
    if not limit.any():
        return _frictionless(offset, control)
    return _TangentialStep(operator, points, limit, offset, control).solve(start, tolerance, max_iterations)


class _TangentialStep:
    """The step with lengths and sums scaled, so that neither units nor the size of the contact matter."""

    def __init__(
        self,
        operator: ElasticOperator,
        points: tuple[FloatArray, FloatArray],
        limit: FloatArray,
        offset: FloatArray,
        control: SolverControl,
    ) -> None:
        self.operator, self.limit, self.control = operator, limit, control
        self.given = control.given
        x, y = points
        touching = limit > 0.0
        self.length = float(np.hypot(np.ptp(x[touching]), np.ptp(y[touching]))) / 2 or max(operator.grid.pitch)
        self.units = np.array([1.0, 1.0, self.length])
        self.arm = np.stack((x, y)) / self.length
        self.target = control.load / self.units / operator.grid.cell_area
        self.original = offset
        self.offset = offset - rigid_displacement(self.arm, np.where(self.given, 0.0, control.motion * self.units))
        kernel = operator.influence("xx")
        assert kernel is not None  # no body is rigid
        self.stiffness = 1.0 / float(kernel[0, 0])
        self.largest, self.capacity = float(limit.max()), float(limit.sum())
        self.dual = np.zeros(3)

    def solve(self, start: FloatArray, tolerance: float, max_iterations: int) -> TangentialContact:
        traction, feasible = self.project(start)
        if not feasible:
            return self._at_the_limit()
        displacement = self.operator.tangential(traction)
        residual = np.inf
        for iteration in range(max_iterations):
            gradient, point = _descend(traction, displacement, self.offset, self.stiffness)
            nearest, _ = self.project(point, keep=True)
            before, residual = residual, _largest_change(traction, nearest) / self.largest
            if not np.isfinite(residual):
                raise NotConverged("tangential contact", residual, tolerance, iteration)
            if iteration == 0 and residual > TANGENTIAL.far_start and min(self.limit.shape) >= 2 * TANGENTIAL.coarsest:
                traction, _ = self.project(self._from_coarse(traction))
                displacement = self.operator.tangential(traction)
                continue
            if residual <= tolerance:
                result = self._result(traction, displacement, residual, iteration)
                return self._at_the_limit(result) if result.sliding and self.given.all() else result
            slip = _against(gradient, self.arm, self.dual / self.stiffness)
            trial = nearest if residual > TANGENTIAL.slow * before and iteration % 2 else self._newton(traction, slip)
            traction, displacement = self._search(traction, displacement, slip, trial)
        raise NotConverged("tangential contact", residual, tolerance, max_iterations)

    def _from_coarse(self, traction: FloatArray) -> FloatArray:
        """The tractions of a grid of half as many cells a side, interpolated."""
        operator = self.operator.coarse
        x, y = halved(self.arm * self.length)
        limit, start = halved(self.limit, "constant"), halved(traction, "constant")
        try:
            coarse = solve_tangential(
                operator, (x, y), limit, halved(self.original), self.control, start, TANGENTIAL.coarse_tolerance
            )
        except (InfeasibleLoad, NotConverged):  # the coarse contact is another one; this is only a guess
            return traction
        return doubled(coarse.traction, self.limit.shape)

    def project(self, point: FloatArray, keep: bool = False) -> tuple[FloatArray, bool]:
        """Nearest feasible traction; ``keep`` its dual, which is the rigid motion when the point is a gradient step."""
        flat = project(
            point.reshape(2, -1),
            self.limit.ravel(),
            self.arm.reshape(2, -1),
            self.target,
            self.given,
            self.dual if keep else None,
        )
        if keep:
            self.dual = flat.motion
        return flat.traction.reshape(point.shape), flat.feasible

    def _newton(self, traction: FloatArray, slip: FloatArray) -> FloatArray:
        space = TangentSpace(traction, slip, self.limit, self.stiffness, self.arm, self.given)
        lacking = self.target - resultants(traction + space.onto_circle, self.arm)
        move = space.onto_circle + space.balancing(lacking)
        image = slip.copy()
        if np.abs(move).max() > TANGENTIAL.move_rounding * self.largest:
            image += self.operator.tangential(move)
        move += space.conjugate_gradients(self.operator, image, move, TANGENTIAL.reduction, TANGENTIAL.iterations)
        return self.project(space.outward(traction + move))[0]

    def _search(
        self, traction: FloatArray, displacement: FloatArray, slip: FloatArray, trial: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The best point on the way to a feasible trial; the whole way where that at least does not climb.

        The slope is taken with the slip, not with the gradient: the rigid motion in the latter does no work on a
        balanced way, but its rounding would drown the slope near the solution.
        """
        way = trial - traction
        response = self.operator.tangential(way)
        slope, curvature, work = _slopes(slip, way, response, self.limit)
        best = -slope / curvature if curvature > 0.0 and abs(slope) > TANGENTIAL.slope_rounding * work else 1.0
        share = 1.0 if best >= 0.5 else max(best, 0.0)
        if share == 1.0:
            return trial, displacement + response
        return traction + share * way, displacement + share * response

    def _result(
        self, traction: FloatArray, displacement: FloatArray, residual: float, iterations: int
    ) -> TangentialContact:
        scaled = np.where(self.given, self.dual / self.stiffness, self.control.motion * self.units)
        slip = displacement + self.offset - rigid_displacement(self.arm, np.where(self.given, scaled, 0.0))
        lacking = (self.target - resultants(traction, self.arm)) * self.given
        imbalance = float(np.abs(lacking).max()) / self.capacity
        if not imbalance <= TANGENTIAL.balance:
            raise NotConverged("balance of the tangential load", imbalance, TANGENTIAL.balance, iterations)
        if not np.isfinite(slip).all():
            raise NotConverged("slip of the tangential contact", np.nan, residual, iterations)
        slides = lengths(traction - self.stiffness * slip) > self.limit
        return TangentialContact(
            traction,
            displacement,
            slip,
            scaled / self.units,
            residual,
            imbalance,
            iterations,
            slides,
            bool(slides[self.limit > 0.0].all()),
        )

    def _at_the_limit(self, balanced: TangentialContact | None = None) -> TangentialContact:
        """All slides: the load is on the limit surface, or it is refused; ``balanced`` holds where it is inside.

        Cells that slide apart, as lateral slip makes them, add up to less than the limit.
        """
        radius, arm = self.limit.ravel(), self.arm.reshape(2, -1)
        factor, direction = limit_load(radius, arm, self.target, self.given)
        if factor < 1.0 - TANGENTIAL.limit_margin:
            raise InfeasibleLoad(self.control.load, factor)
        if balanced is not None and factor > 1.0 + TANGENTIAL.limit_margin:
            return balanced
        traction = sliding_traction(radius, arm, direction).reshape(self.offset.shape)
        displacement = self.operator.tangential(traction)
        along = rigid_displacement(self.arm, direction)
        lag = ((displacement + self.offset) * along).sum(axis=0) / (along**2).sum(axis=0).clip(min=TINY)
        self.dual = direction * float(lag[self.limit > 0.0].max()) * self.stiffness
        return self._result(traction, displacement, 0.0, 0)._replace(sliding=True)


@compiled
def _descend(
    traction: FloatArray, displacement: FloatArray, offset: FloatArray, stiffness: float
) -> tuple[FloatArray, FloatArray]:
    """The gradient, and the point that a step of length ``stiffness`` against it leads to."""
    gradient, point = np.empty_like(traction), np.empty_like(traction)
    q, u, c = traction.reshape(-1), displacement.reshape(-1), offset.reshape(-1)
    g, w = gradient.reshape(-1), point.reshape(-1)
    for i in range(q.size):
        slope = u[i] + c[i]
        g[i], w[i] = slope, q[i] - stiffness * slope
    return gradient, point


@compiled
def _largest_change(before: FloatArray, after: FloatArray) -> float:
    """Largest difference of two fields; NaN where one is NaN, which is neither larger nor smaller than anything."""
    largest, a, b = 0.0, before.reshape(-1), after.reshape(-1)
    for i in range(a.size):
        size = abs(b[i] - a[i])
        if not size <= largest:
            largest = size
            if np.isnan(size):
                break
    return largest


@compiled
def _against(gradient: FloatArray, arm: FloatArray, motion: FloatArray) -> FloatArray:
    """A gradient [2, ny, nx] less a rigid motion [3]."""
    slip, mx, my, yaw = np.empty_like(gradient), motion[0], motion[1], motion[2]
    g, a, s = gradient.reshape(2, -1), arm.reshape(2, -1), slip.reshape(2, -1)
    for i in range(g.shape[1]):
        s[0, i], s[1, i] = g[0, i] - (mx - yaw * a[1, i]), g[1, i] - (my + yaw * a[0, i])
    return slip


@compiled(fastmath=VECTOR)
def _slopes(slip: FloatArray, way: FloatArray, response: FloatArray, limit: FloatArray) -> tuple[float, float, float]:
    """Slope and curvature of the objective along a ``way`` [2, ny, nx], and the work of the slip's size at the limits.

    ``response``: the way's displacement.
    """
    slope = curvature = work = 0.0
    s, w, c, radius = slip.reshape(2, -1), way.reshape(2, -1), response.reshape(2, -1), limit.reshape(-1)
    for i in range(radius.size):
        sx, sy, wx, wy = s[0, i], s[1, i], w[0, i], w[1, i]
        slope += sx * wx + sy * wy
        curvature += wx * c[0, i] + wy * c[1, i]
        work += np.sqrt(sx * sx + sy * sy) * radius[i]
    return slope, curvature, work


def _frictionless(offset: FloatArray, control: SolverControl) -> TangentialContact:
    """Nothing holds and nothing is held."""
    if (np.abs(control.load) * control.given).any():
        raise InfeasibleLoad(control.load, 0.0)
    nothing, motion = np.zeros_like(offset), np.where(control.given, 0.0, control.motion)
    slides = np.ones(offset.shape[1:], dtype=bool)
    return TangentialContact(nothing, nothing.copy(), offset.copy(), motion, 0.0, 0.0, 0, slides, True)
