"""Virtual elastic beams (the paper, (17)–(26)): a fingertip of bending beams, each tied to its neighbours by springs.

Each beam on the lattice bends with stiffness b and is coupled to its neighbours with stiffness k, so that tip forces
are K u = b u + k Σ (u − u_neighbour) per component. A tip in contact moves with the object until the force on it would
exceed the Coulomb limit; then the force stays at the limit along the trial force (return mapping). A chain is a lattice
one beam wide. The paper leaves viscosity out, and so does this; pressing alone moves no tip.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.fft
from scipy import optimize

from slipcore.compilation import compiled
from slipcore.contact.defaults import REFERENCE
from slipcore.contact.errors import InfeasibleLoad, NotConverged
from slipcore.contact.limit_load import limit_load
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class BeamLattice:
    """Beams [n, m] at ``pitch`` m, x along the first axis, with ``bending`` b > 0 and ``coupling`` k ≥ 0 in N/m."""

    shape: tuple[int, int]
    pitch: float
    bending: float
    coupling: float

    def __post_init__(self) -> None:
        if min(self.shape) < 1:
            raise InvalidInput("shape", list(self.shape), "one beam or more along each side")
        check_range("pitch", self.pitch, above=0.0, unit="m")
        check_range("bending", self.bending, above=0.0, unit="N/m")
        check_range("coupling", self.coupling, at_least=0.0, unit="N/m")

    @property
    def position(self) -> FloatArray:
        """Places of the beams [n, m, 2] in m, about the centre of the lattice."""
        x, y = ((np.arange(size) - 0.5 * (size - 1)) * self.pitch for size in self.shape)
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    def force(self, displacement: FloatArray) -> FloatArray:
        """Forces [n, m, 2] in N that hold the tips at ``displacement`` [n, m, 2] m: (17)–(20), K u."""
        force: FloatArray = self.bending * displacement
        for axis in (0, 1):
            pull = self.coupling * np.diff(displacement, axis=axis)
            before = [(0, 1) if i == axis else (0, 0) for i in range(displacement.ndim)]
            after = [(1, 0) if i == axis else (0, 0) for i in range(displacement.ndim)]
            force = force - np.pad(pull, before) + np.pad(pull, after)
        return force

    def displacement(self, force: FloatArray) -> FloatArray:
        """Displacements [n, m, 2] in m under tip forces [n, m, 2] in N: the exact inverse, by cosine transform."""
        waves = [2.0 - 2.0 * np.cos(np.pi * np.arange(size) / size) for size in self.shape]
        stiffness = self.bending + self.coupling * (waves[0][:, None] + waves[1][None, :])
        spectrum = scipy.fft.dctn(force, axes=(0, 1)) / stiffness[..., None]
        displacement: FloatArray = scipy.fft.idctn(spectrum, axes=(0, 1))
        return displacement

    def carried(self, pose: FloatArray) -> FloatArray:
        """Displacement [n, m, 2] of the object's points over the beams in a small motion (m, m, rad)."""
        x, y = self.position[..., 0], self.position[..., 1]
        return np.stack([pose[0] - pose[2] * y, pose[1] + pose[2] * x], axis=-1)

    def resultants(self, force: FloatArray) -> FloatArray:
        """Sums [3] of tip forces: F_x, F_y in N and M in N·m."""
        x, y = self.position[..., 0], self.position[..., 1]
        moment = (x * force[..., 1] - y * force[..., 0]).sum()
        return np.array([force[..., 0].sum(), force[..., 1].sum(), moment])


class BeamState(NamedTuple):
    """Beams at the end of a step.

    ``displacement`` and ``force`` (on the tips by the object) [n, m, 2] in m and N, ``slip`` [n, m, 2] of the tips
    relative to the object in this step in m (0 out of contact), ``pose`` [3] of the object, ``residual`` as a share of
    the largest limit, ``sweeps``.
    """

    displacement: FloatArray
    force: FloatArray
    slip: FloatArray
    pose: FloatArray
    residual: float
    sweeps: int


class BeamHistory(NamedTuple):
    """States over time: ``displacement``, ``force``, ``slip`` [t, n, m, 2], ``pose`` [t, 3]; and truth per tip
    [t, n, m]: ``contact``, ``slip_kinematic`` (moved relative to the object in the step), ``slip_contact_factor`` (at
    the Coulomb limit).
    """

    displacement: FloatArray
    force: FloatArray
    slip: FloatArray
    pose: FloatArray
    contact: BoolArray
    slip_kinematic: BoolArray
    slip_contact_factor: BoolArray


def layer_beams(
    shape: tuple[int, int], pitch: float, thickness: float, young_modulus: float, poisson_ratio: float
) -> BeamLattice:
    """Beams that stand for a bonded layer of ``thickness`` m, to second order in the wave number times thickness.

    b = G A/h and k = (G h/2)(1/3 + (3 + 4ν)/6(1 − ν)): the mean of what waves across and along their direction see.
    """
    check_range("thickness", thickness, above=0.0, unit="m")
    modulus = 1.0 / half_space(young_modulus, poisson_ratio).shear
    stretch = 1.0 / 3.0 + (3.0 + 4.0 * poisson_ratio) / (6.0 * (1.0 - poisson_ratio))
    return BeamLattice(shape, pitch, modulus * pitch**2 / thickness, 0.5 * modulus * thickness * stretch)


def unloaded(lattice: BeamLattice) -> BeamState:
    """Straight beams, and the object at its origin."""
    nothing = np.zeros((*lattice.shape, 2))
    return BeamState(nothing, nothing, nothing, np.zeros(3), 0.0, 0)


def drag(
    lattice: BeamLattice,
    state: BeamState,
    pose: FloatArray,
    limit: FloatArray,
    tolerance: float = REFERENCE.beam_tolerance,
) -> BeamState:
    """State after the object has moved to ``pose`` [3] (m, m, rad), with Coulomb limits μf_n ``limit`` [n, m] in N.

    The limit is 0 where nothing touches. Block Gauss–Seidel with over-relaxation on a convex problem: each beam in
    turn sticks, or slips by the return mapping. Raises ``NotConverged``.
    """
    limit = _checked_limit(lattice, limit)
    goal = state.displacement + lattice.carried(np.asarray(pose, float) - state.pose)
    displacement = np.where(limit[..., None] > 0.0, goal + state.slip, state.displacement)
    largest = float(limit.max())
    if largest == 0.0:
        return unloaded(lattice)._replace(pose=np.array(pose, float))
    spread = 4.0 * lattice.coupling / (lattice.bending + 4.0 * lattice.coupling)
    relaxation = 2.0 / (1.0 + np.sqrt(1.0 - spread**2))
    stiffness, bounds = (lattice.bending, lattice.coupling), (tolerance * largest, REFERENCE.beam_sweeps)
    residual, sweeps = _relax(displacement, goal, limit, *stiffness, relaxation, *bounds)
    if residual > tolerance * largest:
        raise NotConverged("beam lattice", residual / largest, tolerance, sweeps)
    slip = np.where(limit[..., None] > 0.0, displacement - goal, 0.0)
    return BeamState(displacement, lattice.force(displacement), slip, np.array(pose, float), residual / largest, sweeps)


def push(lattice: BeamLattice, state: BeamState, load: FloatArray, limit: FloatArray) -> BeamState:
    """State after the object has come to carry ``load`` [3] (F_x N, F_y N, M N·m); ``limit`` as for ``drag``.

    Finds the pose, from the one before, by Powell's hybrid method. Raises ``InfeasibleLoad`` on or outside the limit
    surface, and ``NotConverged``.
    """
    limit = _checked_limit(lattice, limit)
    load, arm = np.asarray(load, float), np.moveaxis(lattice.position, -1, 0).reshape(2, -1)
    factor = limit_load(limit.ravel(), arm, load, np.ones(3, dtype=bool)).factor if limit.any() else 0.0
    if factor <= 1.0:
        raise InfeasibleLoad(load, factor)
    capacity, length = float(limit.sum()), lattice.pitch * float(np.hypot(*lattice.shape))
    units = np.array([1.0, 1.0, length])
    travel = capacity / (lattice.bending * np.count_nonzero(limit)) / units

    inner = REFERENCE.inner_share * REFERENCE.beam_tolerance

    def imbalance(steps: FloatArray) -> FloatArray:
        moved = drag(lattice, state, state.pose + steps * travel, limit, inner)
        return (lattice.resultants(moved.force) - load) / (units * capacity)

    root = optimize.root(
        imbalance,
        np.zeros(3),
        method="hybr",
        options={"xtol": REFERENCE.pose_tolerance, "eps": REFERENCE.pose_step, "factor": REFERENCE.first_pose},
    )
    worst = float(np.abs(root.fun).max())
    if worst > REFERENCE.load_tolerance:
        raise NotConverged("load on the beams", worst, REFERENCE.load_tolerance, int(root.nfev))
    return drag(lattice, state, state.pose + root.x * travel, limit)


def follow(lattice: BeamLattice, poses: FloatArray, limits: FloatArray) -> BeamHistory:
    """Drag straight beams through ``poses`` [t, 3] with ``limits`` μf_n [t, n, m] in N; the first step counts too."""
    state, states = unloaded(lattice), []
    for pose, limit in zip(poses, limits, strict=True):
        state = drag(lattice, state, pose, limit)
        states.append(state)
    force, slip = np.stack([s.force for s in states]), np.stack([s.slip for s in states])
    contact = np.asarray(limits) > 0.0
    tolerance = REFERENCE.beam_noise * REFERENCE.beam_tolerance  # of a beam at the limit but not moving
    floor = tolerance * float(np.max(limits)) / lattice.bending
    return BeamHistory(
        displacement=np.stack([s.displacement for s in states]),
        force=force,
        slip=slip,
        pose=np.stack([s.pose for s in states]),
        contact=contact,
        slip_kinematic=np.hypot(slip[..., 0], slip[..., 1]) > floor,
        slip_contact_factor=contact & (np.hypot(force[..., 0], force[..., 1]) >= (1.0 - REFERENCE.at_limit) * limits),
    )


def _checked_limit(lattice: BeamLattice, limit: FloatArray) -> FloatArray:
    checked = np.ascontiguousarray(limit, dtype=float)
    if checked.shape != lattice.shape:
        raise InvalidInput("limit", f"of shape {list(checked.shape)}", f"shape {list(lattice.shape)}")
    if not (np.isfinite(checked).all() and (checked >= 0.0).all()):
        raise InvalidInput("limit", f"{checked.min():.6g} N at its least", "finite and at least 0 N")
    return checked


@compiled
def _relax(
    u: FloatArray,
    goal: FloatArray,
    limit: FloatArray,
    bending: float,
    coupling: float,
    relaxation: float,
    tolerance: float,
    max_sweeps: int,
) -> tuple[float, int]:
    """Sweep over the beams until no force is off by more than ``tolerance``; ``u`` is overwritten."""
    n, m = limit.shape
    worst = np.inf
    for sweep in range(max_sweeps):
        worst = 0.0
        for i in range(n):
            for j in range(m):
                sx, sy, stiffness = 0.0, 0.0, bending
                for di, dj in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                    if 0 <= i + di < n and 0 <= j + dj < m:
                        sx += coupling * u[i + di, j + dj, 0]
                        sy += coupling * u[i + di, j + dj, 1]
                        stiffness += coupling
                step = relaxation / stiffness
                # a gradient step of the energy, then the proximal step of friction on the slip u − goal
                wx = u[i, j, 0] + step * (sx - stiffness * u[i, j, 0])
                wy = u[i, j, 1] + step * (sy - stiffness * u[i, j, 1])
                if limit[i, j] > 0.0:
                    gx, gy = wx - goal[i, j, 0], wy - goal[i, j, 1]
                    size = np.sqrt(gx * gx + gy * gy)
                    left = max(size - step * limit[i, j], 0.0)
                    share = left / size if size > 0.0 else 0.0
                    wx, wy = goal[i, j, 0] + share * gx, goal[i, j, 1] + share * gy
                change = np.sqrt((wx - u[i, j, 0]) ** 2 + (wy - u[i, j, 1]) ** 2)
                worst = max(worst, change / step)
                u[i, j, 0], u[i, j, 1] = wx, wy
        if worst <= tolerance:
            return worst, sweep + 1
    return worst, max_sweeps
