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
from slipcore.contact.defaults import PROJECTION, TANGENTIAL, TINY
from slipcore.contact.elasticity.fields import VECTOR, doubled, halved, largest, resultants, rigid_displacement
from slipcore.contact.elasticity.operator import ElasticOperator
from slipcore.contact.elasticity.transform import Compiled, convolve
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.limit_load import limit_load
from slipcore.contact.solver.projection import nearest_tractions, project
from slipcore.contact.solver.sliding import sliding_traction
from slipcore.contact.solver.tangent_space import FIELDS, Taken, newton_move, outward, survey
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray

# What compiled loops hold fixed; what each means stands in the table.
_SLOPE_ROUNDING, _MOVE_ROUNDING, _PROJECTION_STEPS = (
    TANGENTIAL.slope_rounding,
    TANGENTIAL.move_rounding,
    PROJECTION.newton_steps,
)
_ITERATIONS, _SLOW = TANGENTIAL.iterations, TANGENTIAL.slow
Fields = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
"""Traction, displacement, offset, slip and nearest feasible traction, each [2, ny, nx]."""
Constraints = tuple[FloatArray, FloatArray, FloatArray, BoolArray]
"""Limits [n], arm [2, n], and the resultants [3] that are given [3]."""


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
        self.operator, self.limit, self.control = operator, np.ascontiguousarray(limit), control
        self.given, self.arm = control.given, np.array(points)
        radius = self.limit.reshape(-1)
        extent, self.largest, self.capacity = _extent(self.arm.reshape(2, -1), radius)
        self.length = extent or max(operator.grid.pitch)
        self.arm /= self.length
        self.units = np.array([1.0, 1.0, self.length])
        self.target = control.load / self.units / operator.grid.cell_area
        self.constraints = radius, self.arm.reshape(2, -1), self.target, self.given
        self.original, self.offset = offset, np.ascontiguousarray(offset)
        moved = np.where(self.given, 0.0, control.motion * self.units)
        if moved.any():
            self.offset = offset - rigid_displacement(self.arm, moved)
        kernel = operator.influence("xx")
        assert kernel is not None  # no body is rigid
        self.stiffness = 1.0 / float(kernel[0, 0])
        self.dual, self.slack = np.zeros(3), 0.0

    def solve(self, start: FloatArray, tolerance: float, max_iterations: int) -> TangentialContact:
        self.slack = TANGENTIAL.motion_slack * tolerance * self.largest
        traction, feasible = self.project(start)
        if not feasible:
            return self._at_the_limit()
        here, before, first = self._at(traction), np.inf, 0
        residual = self._residual(here)
        if TANGENTIAL.far_start < residual < np.inf and min(self.limit.shape) >= 2 * TANGENTIAL.coarsest:
            here, before, first = self._at(self.project(self._from_coarse(traction))[0]), residual, 1
            residual = self._residual(here)
        residual, iterations = self._go_on(here, (before, residual), tolerance, (first, max_iterations))
        if not residual <= tolerance:
            raise NotConverged("tangential contact", residual, tolerance, iterations)
        result = self._result(here, residual, iterations)
        return self._at_the_limit(result) if result.sliding and self.given.all() else result

    def _at(self, traction: FloatArray) -> Fields:
        """What belongs to tractions, its last two yet to be found."""
        displacement = self.operator.tangential(traction)
        return traction, displacement, self.offset, np.empty_like(traction), np.empty_like(traction)

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

    def project(self, point: FloatArray) -> tuple[FloatArray, bool]:
        """Nearest feasible traction."""
        flat = project(point.reshape(2, -1), *self.constraints)
        return flat.traction.reshape(point.shape), flat.feasible

    def _residual(self, here: Fields) -> float:
        """How far a gradient step leads before it is projected back, as a share of the largest limit; fills the slip
        and the nearest feasible traction. The projection's dual, which is kept, is the rigid motion.
        """
        self.dual, change = _natural_map(here, self.constraints, self.stiffness, self.dual, self.slack)
        return change / self.largest

    def _go_on(
        self, here: Fields, residuals: tuple[float, float], tolerance: float, rounds: tuple[int, int]
    ) -> tuple[float, int]:
        """Newton's steps, in place, from the last two residuals and the first round to the tolerance or to the last
        round; the residual there, and the round.
        """
        operator = self.operator
        by = operator.tangential_compiled, operator.tangential_single, operator.tangential_inverse.single
        how = self.stiffness, self.largest, tolerance, self.slack
        forcing = TANGENTIAL.reduction, TANGENTIAL.least_reduction, TANGENTIAL.enough
        self.dual, residual, iterations, taken = _rounds(
            here, self.constraints, by, how, forcing, self.dual, residuals, rounds
        )
        count = operator.count
        count.tangential, count.single = count.tangential + taken[0], count.single + taken[1]
        count.inverse += taken[2]
        return residual, iterations

    def _result(self, here: Fields, residual: float, iterations: int) -> TangentialContact:
        traction, displacement, _, slip, _ = here
        motion = np.where(self.given, self.dual / self.stiffness / self.units, self.control.motion)
        lacking = (self.target - resultants(traction, self.arm)) * self.given
        imbalance = float(np.abs(lacking).max()) / self.capacity
        if not imbalance <= TANGENTIAL.balance:
            raise NotConverged("balance of the tangential load", imbalance, TANGENTIAL.balance, iterations)
        if not np.isfinite(largest(slip)):
            raise NotConverged("slip of the tangential contact", np.nan, residual, iterations)
        slides = np.empty(self.limit.shape, dtype=bool)
        sliding = _slides(traction, slip, self.limit, self.stiffness, slides)
        return TangentialContact(traction, displacement, slip, motion, residual, imbalance, iterations, slides, sliding)

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
        here = self._at(traction)
        gradient, along = here[1] + self.offset, rigid_displacement(self.arm, direction)
        lag = (gradient * along).sum(axis=0) / (along**2).sum(axis=0).clip(min=TINY)
        self.dual = direction * float(lag[self.limit > 0.0].max()) * self.stiffness
        moved = np.where(self.given, self.dual / self.stiffness, 0.0)
        np.subtract(gradient, rigid_displacement(self.arm, moved), out=here[3])
        return self._result(here, 0.0, 0)._replace(sliding=True)


@compiled
def _extent(points: FloatArray, limit: FloatArray) -> tuple[float, float, float]:
    """Half the diagonal of the box [m] around the points [2, n] that touch; the largest limit [n], and their sum."""
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    top = total = 0.0
    for i in range(limit.size):
        total += limit[i]
        if limit[i] > 0.0:
            x, y = points[0, i], points[1, i]
            low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
            top = max(top, limit[i])
    extent = 0.5 * np.hypot(high_x - low_x, high_y - low_y) if top > 0.0 else 0.0
    return extent, total if np.isnan(total) else top, total


@compiled
def _rounds(
    here: Fields,
    constraints: Constraints,
    by: tuple[Compiled, Compiled, Compiled],
    how: tuple[float, float, float, float],
    forcing: tuple[float, float, float],
    dual: FloatArray,
    residuals: tuple[float, float],
    rounds: tuple[int, int],
) -> tuple[FloatArray, float, int, Taken]:
    """``_TangentialStep._go_on``: the dual, the last residual, the round, and what was taken.

    ``by``: operator, the same in single precision, and preconditioner; ``how``: the stiffness that scales a gradient
    step, the largest limit, the tolerance, and by how much the rigid motion may be off; ``forcing``: as ``_share_left``
    has it. Where Newton's steps stall, the gradient step is taken every other time.
    """
    (traction, displacement, _, slip, nearest), (stiffness, top, tolerance, slack) = here, how
    (before, residual), (iteration, last), (applied, single, inverted) = residuals, rounds, (0, 0, 0)
    trial = np.empty_like(traction)
    while iteration < last and tolerance < residual < np.inf:
        if residual <= _SLOW * before or iteration % 2 == 0:
            bounds = stiffness, _MOVE_ROUNDING * top, _share_left(before, residual, tolerance, forcing)
            taken = _newton(traction, slip, trial, constraints, by, bounds)
            applied, single, inverted = applied + taken[0], single + taken[1], inverted + taken[2]
        else:
            _balance(nearest.reshape(2, -1), constraints, trial.reshape(2, -1))
        _search((traction, displacement), slip, trial, constraints[0], by[0])
        dual, change = _natural_map(here, constraints, stiffness, dual, slack)
        before, residual = residual, change / top
        applied, iteration = applied + 1, iteration + 1
    return dual, residual, iteration, (applied, single, inverted)


@compiled
def _share_left(before: float, residual: float, tolerance: float, forcing: tuple[float, float, float]) -> float:
    """What the next Newton system may leave (Eisenstat and Walker 1996, second choice): the square of the share to
    which the residual fell, so that convergence can be quadratic, but no less than what the tolerance asks.

    ``forcing``: the most and the least that may be left, and the share of the tolerance that is little enough.
    """
    most, least, enough = forcing
    fell = residual / before if before < np.inf else 1.0
    return min(max(fell * fell, enough * tolerance / residual, least), most)


@compiled
def _newton(
    traction: FloatArray,
    slip: FloatArray,
    trial: FloatArray,
    constraints: Constraints,
    by: tuple[Compiled, Compiled, Compiled],
    how: tuple[float, float, float],
) -> Taken:
    """Fill the ``trial`` with where a Newton step leads, projected back; what it took.

    ``how``: the stiffness that scales a gradient step, a move that is none, and how far to solve the system.
    """
    (radius, arm, target, given), (stiffness, negligible, reduction) = constraints, how
    cells, q, p = np.empty((FIELDS, radius.size)), traction.reshape(2, -1), trial.reshape(2, -1)
    inverse_gram = survey((q, slip.reshape(2, -1), radius, stiffness), (arm, given), cells)
    space, onto_circle = (cells[:3], arm, inverse_gram, cells[5], cells[6]), cells[3:5].reshape(traction.shape)
    bounds = stiffness, negligible, reduction, int(_ITERATIONS)  # a literal would be a type of its own, compiled anew
    move, taken = newton_move(space, (traction, slip, onto_circle), target, by, bounds)
    point = np.empty_like(q)
    outward(q, move.reshape(2, -1), cells[6], point)
    _balance(point, constraints, p)
    return taken


@compiled
def _balance(point: FloatArray, constraints: Constraints, traction: FloatArray) -> None:
    """Fill the ``traction`` [2, n] with the feasible one nearest to a ``point``."""
    radius, arm, target, given = constraints
    exactly = 0.0, int(_PROJECTION_STEPS)
    nearest_tractions((point, radius, arm, target, given), np.zeros(3), traction, exactly)


@compiled
def _natural_map(
    here: Fields, constraints: Constraints, stiffness: float, dual: FloatArray, slack: float
) -> tuple[FloatArray, float]:
    """Fill the slip and the feasible traction nearest to a gradient step; the dual of that, from a guess of it, and the
    largest change of traction. ``slack``: by how much the dual may be off, and so the traction miss the load.
    """
    (traction, displacement, offset, slip, nearest), (radius, arm, target, given) = here, constraints
    point = np.empty_like(traction)
    q, u, c, w = traction.reshape(-1), displacement.reshape(-1), offset.reshape(-1), point.reshape(-1)
    g, p = slip.reshape(-1), nearest.reshape(-1)
    for i in range(q.size):
        slope = u[i] + c[i]
        g[i], w[i] = slope, q[i] - stiffness * slope
    step = point.reshape(2, -1), radius, arm, target, given
    dual, _, _, _ = nearest_tractions(step, dual, nearest.reshape(2, -1), (slack, int(_PROJECTION_STEPS)))
    _subtract_rigid(slip.reshape(2, -1), arm, dual / stiffness)
    for i in range(q.size):
        w[i] = p[i] - q[i]
    return dual, largest(w)


@compiled
def _subtract_rigid(field: FloatArray, arm: FloatArray, motion: FloatArray) -> None:
    """Subtract a rigid motion [3] from a field [2, n], in place."""
    mx, my, yaw = motion[0], motion[1], motion[2]
    for i in range(field.shape[1]):
        field[0, i] -= mx - yaw * arm[1, i]
        field[1, i] -= my + yaw * arm[0, i]


@compiled(fastmath=VECTOR)
def _slides(traction: FloatArray, slip: FloatArray, limit: FloatArray, stiffness: float, slides: BoolArray) -> bool:
    """Fill in which cells [ny, nx] slide; whether all do that touch."""
    q, s, radius, found, sticking = (
        traction.reshape(2, -1),
        slip.reshape(2, -1),
        limit.reshape(-1),
        slides.reshape(-1),
        0,
    )
    for i in range(radius.size):
        x, y = q[0, i] - stiffness * s[0, i], q[1, i] - stiffness * s[1, i]
        outside = x * x + y * y > radius[i] * radius[i]
        found[i] = outside
        sticking += (not outside) & (radius[i] > 0.0)
    return sticking == 0


@compiled
def _search(
    here: tuple[FloatArray, FloatArray], slip: FloatArray, trial: FloatArray, limit: FloatArray, operator: Compiled
) -> None:
    """Take traction and displacement, ``here``, to the best point on the way to a feasible trial, in place; the whole
    way where that at least does not climb.

    The slope is taken with the slip, not with the gradient: the rigid motion in the latter does no work on a balanced
    way, but its rounding would drown the slope near the solution.
    """
    traction, displacement = here
    way, response = trial - traction, np.empty_like(trial)
    convolve(way, response, operator)
    slope, curvature = _slopes(slip, way, response)
    best = -slope / curvature if curvature > 0.0 else 1.0
    if best < 0.5 and abs(slope) <= _SLOPE_ROUNDING * _work(slip, limit):
        best = 1.0
    share = 1.0 if best >= 0.5 else max(best, 0.0)
    q, u, t = traction.reshape(-1), displacement.reshape(-1), trial.reshape(-1)
    w, r = way.reshape(-1), response.reshape(-1)
    for i in range(q.size):
        q[i] = t[i] if share == 1.0 else q[i] + share * w[i]
        u[i] += share * r[i]


@compiled(fastmath=VECTOR)
def _slopes(slip: FloatArray, way: FloatArray, response: FloatArray) -> tuple[float, float]:
    """Slope and curvature of the objective along a ``way`` [2, ny, nx], whose displacement is the ``response``."""
    slope = curvature = 0.0
    s, w, c = slip.reshape(-1), way.reshape(-1), response.reshape(-1)
    for i in range(w.size):
        slope += s[i] * w[i]
        curvature += w[i] * c[i]
    return slope, curvature


@compiled(fastmath=VECTOR)
def _work(slip: FloatArray, limit: FloatArray) -> float:
    """What friction at its limits would take up of a slip's size [2, ny, nx]: what a slope rounds by."""
    s, work = slip.reshape(2, -1), 0.0
    for i in range(limit.size):
        work += np.sqrt(s[0, i] * s[0, i] + s[1, i] * s[1, i]) * limit[i]
    return work


def _frictionless(offset: FloatArray, control: SolverControl) -> TangentialContact:
    """Nothing holds and nothing is held."""
    if (np.abs(control.load) * control.given).any():
        raise InfeasibleLoad(control.load, 0.0)
    nothing, motion = np.zeros_like(offset), np.where(control.given, 0.0, control.motion)
    slides = np.ones(offset.shape[1:], dtype=bool)
    return TangentialContact(nothing, nothing.copy(), offset.copy(), motion, 0.0, 0.0, 0, slides, True)
