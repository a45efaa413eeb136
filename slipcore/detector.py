"""The slip detector: frames in, slip state out (all stages in order: strain, events, slip state).

``init`` and ``step`` are pure functions on an immutable state, so that a stream can be cut anywhere and taken up
again; ``SlipDetector`` holds such a state, and ``detect_slip`` is the fold of ``step`` over a log.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipcore.defaults import DEFAULT_METHOD, LIMITS, ContactOptions, choose_options
from slipcore.element_forces import ElementForces, element_forces, stick_ratio
from slipcore.errors import InvalidInput
from slipcore.frames import (
    BoolArray,
    FloatArray,
    Frame,
    GraspLog,
    check_element_area,
    check_frame,
    check_normal,
    check_pose,
)
from slipcore.methods import find_method
from slipcore.methods.interface import Decision, Observation
from slipcore.noise import NOTHING_SEEN, NoiseState, step_noise
from slipcore.rigid_motion import fit_rigid_motion, pose_motion, relative_velocity
from slipcore.slip_state import SlipHistory, SlipState, slip_events
from slipcore.strain import Lattice, lattice_steps, surface_normal
from slipcore.touch import contact_from_force, contact_from_shape, spatial_noise


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """What stays the same over a stream: the sensor's lattice and element area (m²), the method and its options."""

    lattice: Lattice
    element_area: float
    method: str
    options: ContactOptions


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """What a detector remembers of the last frame: the frame itself, its answer and the method's own state."""

    frame: Frame
    answer: SlipState
    method: Any


@dataclass(frozen=True, slots=True, eq=False)
class DetectorState:
    """A detector between two frames; immutable, and can be pickled."""

    setup: Setup
    memory: Memory | None = None
    marker_noise: NoiseState = NOTHING_SEEN
    pressing_noise: NoiseState = NOTHING_SEEN


def init(position: ArrayLike, element_area: float, method: str = DEFAULT_METHOD, **options: float) -> DetectorState:
    """A detector that has seen nothing: rest positions [n, m, 3] m and element area m².

    Raises ``InvalidInput`` for a lattice that has no strain, an unknown method and unknown or out-of-range options.
    """
    chosen = choose_options(find_method(method).options, options)
    return DetectorState(Setup(Lattice.at_rest(position), check_element_area(element_area), method, chosen))


def step(state: DetectorState, frame: Frame) -> tuple[DetectorState, SlipState]:
    """Take one valid frame, later than the last; on the first, every element in contact sticks."""
    setup, memory = state.setup, state.memory
    steps = lattice_steps(frame.displacement)
    normal = surface_normal(setup.lattice, steps) if frame.normal is None else frame.normal
    forces = None if frame.force is None else element_forces(frame.force, normal)
    pressing = _pressing(frame, forces)
    marker_noise, pressing_noise = state.marker_noise, state.pressing_noise
    if memory is None or not np.array_equal(frame.displacement, memory.frame.displacement):
        # a repeated frame would make the noise look smaller
        marker_noise = step_noise(marker_noise, frame.time, frame.displacement[..., :2].reshape(-1, 2).T)
        pressing_noise = step_noise(pressing_noise, frame.time, pressing.reshape(1, -1))
    known = pressing_noise.sigma if math.isfinite(pressing_noise.sigma) else spatial_noise(pressing)
    contact = _contact(setup, pressing, known, memory, has_force=forces is not None)
    touched = contact if memory is None else contact & ~memory.answer.contact
    seen = Observation(
        frame.time,
        math.inf if memory is None else frame.time - memory.frame.time,
        frame.displacement,
        steps,
        normal,
        forces,
        contact,
        touched,
        frame.object_pose,
        marker_noise.sigma,
        pressing_noise.sigma,
        frame.force,
    )
    method_state, decision = _decide(setup, memory, seen)
    answer = _answer(setup, memory, seen, decision)
    return DetectorState(setup, Memory(frame, answer, method_state), marker_noise, pressing_noise), answer


def _pressing(frame: Frame, forces: ElementForces | None) -> FloatArray:
    """How much each element is pressed inwards: by force, N, or without forces by indentation, m."""
    return -frame.displacement[..., 2] if forces is None else forces.pressing


def _contact(setup: Setup, pressing: FloatArray, noise: float, memory: Memory | None, *, has_force: bool) -> BoolArray:
    before = None if memory is None else memory.answer.contact
    if has_force:
        return contact_from_force(pressing, setup.element_area, noise, before, setup.options)
    return contact_from_shape(pressing, noise, before, setup.options)


def _decide(setup: Setup, memory: Memory | None, seen: Observation) -> tuple[Any, Decision]:
    method = find_method(setup.method)
    if memory is None:
        nothing = np.zeros(seen.contact.shape)
        return method.init(setup.lattice, seen, setup.options), Decision(nothing > 0.0, nothing)
    return method.step(memory.method, setup.lattice, seen, setup.options)


def _answer(setup: Setup, memory: Memory | None, seen: Observation, decision: Decision) -> SlipState:
    may_slip = seen.contact & ~seen.touched
    slip = decision.slip & may_slip
    probability = np.where(may_slip, decision.probability, 0.0)
    velocity = _velocity(setup.lattice, memory, seen, slip, probability)
    for array in (seen.contact, slip, probability, velocity):
        array.flags.writeable = False  # the detector remembers them
    sticking = np.count_nonzero(seen.contact & ~slip)
    macro_slip = bool(seen.contact.any()) and sticking == 0
    ratio = stick_ratio(seen.contact, slip)
    return SlipState(seen.time, seen.contact, slip, probability, ratio, velocity, macro_slip)


def _velocity(
    lattice: Lattice, memory: Memory | None, seen: Observation, slip: BoolArray, probability: FloatArray
) -> FloatArray:
    """Velocity over the last interval of what was in contact all through it, relative to the object.

    The object moves as its pose says, or else as the elements do that stick before and after,
    the more surely the more.
    """
    if memory is None:
        return np.full((*slip.shape, 2), np.nan)
    before, observed = memory.answer, seen.contact & memory.answer.contact
    start = memory.frame.displacement[..., :2]
    points, moved = lattice.position[..., :2] + start, seen.displacement[..., :2] - start
    if seen.object_pose is not None and memory.frame.object_pose is not None:
        motion = pose_motion(memory.frame.object_pose, seen.object_pose)
    else:
        sticking = observed & ~slip & ~before.slip
        weight = np.where(sticking, (1.0 - probability) * (1.0 - before.probability), 0.0)
        motion = fit_rigid_motion(points.reshape(-1, 2), moved.reshape(-1, 2), weight.ravel())
    return relative_velocity(points, moved, observed, motion, seen.interval)


class SlipDetector:
    """A running detector: feed it frames as they come, ask for its ``state`` to go on elsewhere.

    Parameters as for ``init``; raises ``InvalidInput`` likewise.
    """

    def __init__(self, position: ArrayLike, element_area: float, method: str = DEFAULT_METHOD, **options: float):
        self.state = init(position, element_area, method, **options)

    @classmethod
    def resume(cls, state: DetectorState) -> "SlipDetector":
        """Go on from the state of another detector."""
        detector = cls.__new__(cls)
        detector.state = state
        return detector

    @property
    def noise(self) -> float:
        """Estimated standard deviation of one marker coordinate, m; NaN while it cannot be estimated."""
        return self.state.marker_noise.sigma

    def step(
        self,
        time: float,
        displacement: ArrayLike,
        force: ArrayLike | None = None,
        object_pose: ArrayLike | None = None,
        normal: ArrayLike | None = None,
    ) -> SlipState:
        """Take the next frame: time s, displacement [n, m, 3] m, force [n, m, 3] N, object pose [3] m, m, rad.

        Raises ``InvalidInput`` for wrong shapes, numbers that are not finite or absurd, time that does not grow, and
        forces that are given for some frames only; the detector then stays as it was.
        """
        frame = _checked(self.state, time, displacement, force, object_pose, normal)
        self.state, answer = step(self.state, frame)
        return answer


def detect_slip(log: GraspLog, method: str = DEFAULT_METHOD, **options: float) -> SlipHistory:
    """Detect local slip in a whole log: the fold of ``step`` over its frames.

    Raises ``InvalidInput`` as ``init`` does.
    """
    state = init(log.position, log.element_area, method, **options)
    answers = []
    for frame in log.frames():
        state, answer = step(state, frame)
        answers.append(answer)
    return collect_history(answers, state)


def collect_history(answers: Sequence[SlipState], state: DetectorState) -> SlipHistory:
    """The history that a detector's answers add up to, with the ``state`` that it ended in.

    Raises ``InvalidInput`` when there are none.
    """
    if not answers:
        raise InvalidInput("answers", "empty", "at least one frame's slip state")
    time, contact, slip, probability, ratio, velocity, macro_slip = (
        np.array([getattr(answer, name) for answer in answers])
        for name in ("time", "contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip")
    )
    events = slip_events(time, contact, slip)
    noise, method = state.marker_noise.sigma, state.setup.method
    return SlipHistory(time, contact, slip, probability, ratio, velocity, macro_slip, events, noise, method)


def _checked(
    state: DetectorState,
    time: float,
    displacement: ArrayLike,
    force: ArrayLike | None,
    object_pose: ArrayLike | None,
    normal: ArrayLike | None,
) -> Frame:
    shape = state.setup.lattice.position.shape
    if not math.isfinite(time):
        raise InvalidInput("time", time, "finite seconds")
    last = None if state.memory is None else state.memory.frame
    if last is not None and not time > last.time:
        raise InvalidInput("time", f"{time:.9g} s after {last.time:.9g} s", "strictly increasing seconds")
    if last is not None and (force is None) != (last.force is None):
        raise InvalidInput("force", "missing" if force is None else "given", "in every frame or in none")
    return Frame(
        float(time),
        check_frame("displacement", displacement, shape, LIMITS.displacement, "m"),
        None if force is None else check_frame("force", force, shape, LIMITS.force, "N per element"),
        None if object_pose is None else check_pose(object_pose),
        None if normal is None else check_normal(normal, shape),
    )
