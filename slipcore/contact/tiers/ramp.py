"""A grasp log in closed form: a sphere is pressed on the sensor, then sheared (Hertz, Cattaneo–Mindlin)."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from slipcore.contact.defaults import CHEAP_TIERS, SCHEDULE, RampDefaults
from slipcore.contact.reference.cattaneo_mindlin import CattaneoMindlin
from slipcore.contact.reference.checks import check_range
from slipcore.contact.reference.elastic_pair import half_space
from slipcore.contact.reference.hertz import HertzContact
from slipcore.defaults import choose_options
from slipcore.errors import InvalidInput
from slipcore.frames import BoolArray, FloatArray, FrictionLaw, GraspLog, GroundTruth


@dataclass(frozen=True, slots=True)
class RampSchedule:
    """Seconds of each phase, in their order; a phase of 0 s is left out (but the log needs two frames)."""

    rest: float = SCHEDULE.rest
    """Without contact: a detector sees its noise, then the touch."""
    press: float = SCHEDULE.press
    """F_N rises in proportion to time. On an uncoupled half-space this moves points along the normal only."""
    settle: float = SCHEDULE.settle
    shear: float = SCHEDULE.shear
    """F_T rises in proportion to time at constant F_N."""
    hold: float = SCHEDULE.hold
    """Constant load: points stay at the Coulomb limit but no longer move."""


@dataclass(frozen=True, slots=True, eq=False)
class _Fields:
    """What the closed forms give for one frame at the points [n, m]."""

    displacement: FloatArray
    force: FloatArray
    pose: FloatArray
    contact: BoolArray
    at_limit: BoolArray
    slip: FloatArray
    stick_ratio: float


def tangential_ramp(
    *,
    schedule: RampSchedule | None = None,
    marker_noise: float = 0.0,
    force_noise: float = 0.0,
    seed: int | np.random.Generator = 0,
    **options: float,
) -> GraspLog:
    """Log with truth of a rigid sphere pressed on a flat elastic sensor with F_N (N) and sheared along +x.

    ``options`` are those of ``contact.defaults.RampDefaults``. ``marker_noise`` m and ``force_noise`` N are standard
    deviations per component; the truth and the object's pose stay exact. Points lie on a centred square lattice; the
    force of an element is the traction at its point times pitch². Coulomb friction with constant μ, sensor a half-space
    without normal–tangential coupling. Raises ``InvalidInput``.
    """
    ramp = choose_options(RampDefaults, options)
    check_range("normal_force", ramp.normal_force, above=0.0, unit="N")
    check_range("marker_noise", marker_noise, at_least=0.0, unit="m")
    check_range("force_noise", force_noise, at_least=0.0, unit="N")
    compliance = half_space(ramp.young_modulus, ramp.poisson_ratio)
    time, normal, tangential = _loads(schedule or RampSchedule(), ramp.frame_rate)
    position = _lattice(ramp.points, ramp.pitch)

    @cache  # before the touch, while it settles and in the end the load stays as it is
    def frame(pressed: float, sheared: float) -> _Fields:
        hertz = HertzContact(ramp.sphere_radius, pressed * ramp.normal_force, compliance)
        sliding_force = ramp.friction * hertz.normal_force
        loaded = CattaneoMindlin(hertz, ramp.friction, sheared * ramp.tangential_force * sliding_force)
        return _fields(loaded, position, ramp.pitch**2)

    noise = (marker_noise, force_noise, np.random.default_rng(seed))
    return _log(
        time, position, ramp.pitch, list(map(frame, normal.tolist(), tangential.tolist())), ramp.friction, noise
    )


def _log(
    time: FloatArray,
    position: FloatArray,
    pitch: float,
    fields: list[_Fields],
    friction: float,
    noise: tuple[float, float, np.random.Generator],
) -> GraspLog:
    marker_noise, force_noise, rng = noise
    displacement = np.stack([f.displacement for f in fields])
    force = np.stack([f.force for f in fields])
    return GraspLog(
        time=time,
        position=position,
        displacement=displacement + marker_noise * rng.standard_normal(displacement.shape),
        element_area=pitch**2,
        force=force + force_noise * rng.standard_normal(force.shape),
        normal=np.broadcast_to([0.0, 0.0, 1.0], force.shape),  # linear theory: loads act on the undeformed plane
        object_pose=np.stack([f.pose for f in fields]),
        sensor="half-space",
        metadata={"tier": "closed form", "source": "Hertz, Cattaneo–Mindlin"},
        truth=_truth(fields, friction),
    )


def _loads(schedule: RampSchedule, frame_rate: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time of each frame, and the fractions of the final F_N and F_T at it."""
    check_range("frame_rate", frame_rate, above=0.0, unit="1/s")
    phases = [schedule.rest, schedule.press, schedule.settle, schedule.shear, schedule.hold]
    for name, seconds in zip(RampSchedule.__slots__, phases, strict=True):
        check_range(f"schedule.{name}", seconds, at_least=0.0, unit="s")
    knots = np.cumsum([0.0, *phases])
    # A whole number of frames stays one in spite of rounding.
    last = np.floor(knots[-1] * frame_rate * (1.0 + CHEAP_TIERS.rounding))
    time = np.arange(last + 1.0) / frame_rate
    normal = _rise(time, knots[1], schedule.press)
    return time, normal, _rise(time, knots[3], schedule.shear)


def _rise(time: FloatArray, start: float, duration: float) -> FloatArray:
    """From 0 to 1 in proportion to time; a step just after ``start`` where ``duration`` is 0."""
    if duration == 0.0:
        return (time >= start).astype(float)
    return np.clip((time - start) / duration, 0.0, 1.0)


def _lattice(points: int, pitch: float) -> FloatArray:
    """Rest positions [points, points, 3], x along the first axis, centred on the contact."""
    check_range("pitch", pitch, above=0.0, unit="m")
    if points < 2:
        raise InvalidInput("points", points, "2 or more along each side")
    axis = (np.arange(points) - 0.5 * (points - 1)) * pitch
    x, y = np.meshgrid(axis, axis, indexing="ij")
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def _fields(sheared: CattaneoMindlin, position: FloatArray, element_area: float) -> _Fields:
    x, y = position[..., 0], position[..., 1]
    r = np.hypot(x, y)
    hertz = sheared.contact
    pressure = hertz.pressure(r)
    traction = np.stack([sheared.traction(r), np.zeros_like(r), -pressure], axis=-1)  # compression is −z
    tangential = sheared.displacement(x, y)
    contact = pressure > 0.0
    return _Fields(
        displacement=np.concatenate([tangential, -hertz.normal_displacement(r)[..., np.newaxis]], axis=-1),
        force=traction * element_area,
        pose=np.array([sheared.rigid_displacement, 0.0, 0.0]),
        contact=contact,
        at_limit=contact & (traction[..., 0] >= (1.0 - CHEAP_TIERS.limit_rounding) * sheared.friction * pressure),
        slip=np.where(contact[..., np.newaxis], sheared.slip(x, y), 0.0),
        stick_ratio=sheared.stick_ratio if hertz.normal_force > 0.0 else np.nan,
    )


def _truth(fields: list[_Fields], friction: float) -> GroundTruth:
    slip = np.stack([f.slip for f in fields])
    contact = np.stack([f.contact for f in fields])
    moved = np.zeros_like(contact)
    moved[1:] = (slip[1:] != slip[:-1]).any(axis=-1)  # exact: the closed form gives 0 in stick and repeats in a hold
    return GroundTruth(
        contact=contact,
        slip_kinematic=moved & contact,
        slip_contact_factor=np.stack([f.at_limit for f in fields]),
        stick_ratio=np.array([f.stick_ratio for f in fields]),
        friction=FrictionLaw((friction, 0.0, 0.0)),
    )
