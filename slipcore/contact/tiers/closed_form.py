"""The closed-form tier: a sphere, pressed and pulled along one line, on elastic half-spaces without coupling.

Hertz with Mindlin–Deresiewicz's rule for any path of the loads. Exact at ν = 0; otherwise slip has a small component
across the force, which the rule leaves out.
"""

import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slipcore.contact.defaults import CHEAP_TIERS
from slipcore.contact.effects.elastic_object import ElasticObject
from slipcore.contact.effects.surface_shape import SphereSurface
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Plan
from slipcore.contact.reference.elastic_pair import Compliance, elastic_pair, half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.contact.reference.mindlin_deresiewicz import MindlinDeresiewicz
from slipcore.contact.tiers.sampling import FrameRecord, SensorGrid, frame_times, grasp_log, untouched
from slipcore.frames import FloatArray, GraspLog

NAME = "closed form"


@dataclass(frozen=True, slots=True)
class SphereOnPlane:
    """What the closed form needs of a scene: curvature, compliances of the ``finger`` and of ``both`` bodies, and the
    unit vector ``along`` which the tangential force acts.
    """

    curvature: float
    finger: Compliance
    both: Compliance
    along: tuple[float, float]


def sphere_on_plane(scene: SceneDescription, plan: Plan) -> SphereOnPlane | None:
    """The scene as a closed form sees it; None where something in it has none."""
    problem, finger = plan.problem, scene.finger
    spheres = [effect.curvature for effect in scene.present() if isinstance(effect, SphereSurface)]
    objects = [effect for effect in scene.present() if isinstance(effect, ElasticObject)]
    others = (problem.friction_fields, problem.pressure_laws, problem.velocity_laws, problem.creep)
    curvature = sum(spheres, start=1.0 / finger.radius)
    along = _line_of_force(plan)
    if (
        any(others)
        or problem.coupled
        or problem.spread
        or len(problem.finger) != 1  # a layer has added its part
        or len(problem.heights) != 1 + len(spheres)
        or len(problem.obstacle) != len(objects)
        or not curvature > 0.0
        or not scene.friction > 0.0
        or plan.sampling is None
        or along is None
    ):
        return None
    own = both = half_space(finger.young_modulus, finger.poisson_ratio)
    for body in objects:
        both = elastic_pair(both, half_space(body.young_modulus, body.poisson_ratio))
    return SphereOnPlane(curvature, own, both, along)


def _line_of_force(plan: Plan) -> tuple[float, float] | None:
    """The one line along which the contact is pulled, and never beyond what friction carries; else None."""
    if any(plan.drives(channel) for channel in ("moment", "motion_x", "motion_y", "yaw")):
        return None
    instants = np.union1d(plan.corners(), frame_times(plan))[1:]
    pulls = np.array([(plan.value("force_x", t), plan.value("force_y", t)) for t in instants])
    normal = np.array([plan.value("normal_force", t) for t in instants])
    size = np.hypot(pulls[:, 0], pulls[:, 1])
    if ((size > 0.0) & (size >= plan.problem.friction * normal)).any():
        return None
    longest = int(np.argmax(size))
    if size[longest] == 0.0:
        return (1.0, 0.0)
    x, y = pulls[longest] / size[longest]
    across = np.abs(pulls[:, 1] * x - pulls[:, 0] * y).max()
    return (float(x), float(y)) if across <= CHEAP_TIERS.rounding * size[longest] else None


def accuracy(scene: SceneDescription, plan: Plan) -> float | None:
    """Largest error against the full problem, as ``simulate`` counts it; None where the closed form does not hold."""
    case = sphere_on_plane(scene, plan)
    if case is None:
        return None
    return CHEAP_TIERS.sampling_error + CHEAP_TIERS.poisson_error * case.both.poisson / case.both.shear


def run(scene: SceneDescription, plan: Plan) -> GraspLog:
    """Simulate a scene of which ``sphere_on_plane`` knows the closed form."""
    began, case, sampling = time.perf_counter(), sphere_on_plane(scene, plan), plan.sampling
    assert case is not None  # the caller has asked for the accuracy
    assert sampling is not None
    (n, m), pitch = sampling.points, sampling.pitch
    where, times = SensorGrid(Grid((m, n), (pitch, pitch)), (n, m), 1), frame_times(plan)
    state = MindlinDeresiewicz(HertzContact(1.0 / case.curvature, 0.0, case.both), scene.friction)
    corners, frames, steps = plan.corners(), [untouched(where)], 0
    for begin, end in pairwise(times):
        bends = corners[(corners > begin) & (corners < end)]
        stuck = np.inf
        for instant in (*bends, end):
            normal, pull = _loads(plan, case, float(instant))
            if not _holds(state, normal, pull):
                state = state.load(normal, pull)
                stuck = min(stuck, state.stick_radius)
            steps += 1
        frames.append(_frame(state, case, where, stuck))
    metadata = {
        "tier": NAME,
        "grid": "none",
        "steps": str(steps),
        "tolerance": "none",
        "unresolved": "nothing",
        "applications": "0",
        "seconds": f"{time.perf_counter() - began:.3f}",
    }
    return grasp_log(plan, where, times, frames, metadata)


def _loads(plan: Plan, case: SphereOnPlane, instant: float) -> tuple[float, float]:
    """Normal force and force along the line, N."""
    pull = plan.value("force_x", instant) * case.along[0] + plan.value("force_y", instant) * case.along[1]
    return max(plan.value("normal_force", instant), 0.0), pull


def _holds(state: MindlinDeresiewicz, normal: float, pull: float) -> bool:
    """Whether the loads are the last ones; a rounding would count as a reversal."""
    unchanged = abs(pull - state.tangential_force) <= CHEAP_TIERS.rounding * state.friction * normal
    return unchanged and normal == state.contact.normal_force


def _frame(state: MindlinDeresiewicz, case: SphereOnPlane, where: SensorGrid, stuck: float) -> FrameRecord:
    """The state at the sensor's points; ``stuck``: radius inside which nothing has moved since the last frame."""
    if state.contact.normal_force == 0.0:
        return untouched(where)
    position, radius = where.position(), state.contact.contact_radius
    x, y = position[..., 0], position[..., 1]
    r, sticking = np.hypot(x, y), _sticking_radius(state)
    contact = r < radius
    cosine, sine = case.along
    along, across = x * cosine + y * sine, y * cosine - x * sine
    u = state.displacement(along, across, case.finger)
    displacement = np.stack(
        (u[..., 0] * cosine - u[..., 1] * sine, u[..., 0] * sine + u[..., 1] * cosine, _depth(state, case, r)), axis=-1
    )
    pull = state.rigid_displacement
    return FrameRecord(
        displacement=displacement,
        force=_element_forces(state, case, where),
        pose=np.array([pull * cosine, pull * sine, 0.0]),
        contact=contact,
        moved=contact & (r > stuck),
        at_limit=contact & (r > sticking),
        stick_ratio=(sticking / radius) ** 2,
    )


def _depth(state: MindlinDeresiewicz, case: SphereOnPlane, r: FloatArray) -> FloatArray:
    """Displacement along the outward normal, m."""
    return -state.contact.normal_displacement(r, case.finger)


def _sticking_radius(state: MindlinDeresiewicz) -> float:
    """Radius beyond which the traction is at its limit, m: that of the level from which on the memory is ±μ."""
    level = state.contact.normal_force
    for density, lower in zip(state.memory[::-1], state.levels[-2::-1], strict=True):
        if abs(density) < state.friction or density != state.memory[-1]:
            break
        level = lower
    return HertzContact(state.contact.sphere_radius, level, state.contact.compliance).contact_radius


def _element_forces(state: MindlinDeresiewicz, case: SphereOnPlane, where: SensorGrid) -> FloatArray:
    """Force [n, m, 3] N on each element: means over ``element_samples``² of its points."""
    offset = (np.arange(CHEAP_TIERS.element_samples) + 0.5) / CHEAP_TIERS.element_samples - 0.5
    dx, dy = np.meshgrid(offset * where.pitch, offset * where.pitch)
    position = where.position()
    r = np.hypot(position[..., 0, None] + dx.ravel(), position[..., 1, None] + dy.ravel())
    along = state.traction(r).mean(axis=-1)
    pressure = state.contact.pressure(r).mean(axis=-1)
    return np.stack((along * case.along[0], along * case.along[1], -pressure), axis=-1) * where.pitch**2
