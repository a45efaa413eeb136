"""The slip detector: frames in, slip state out (all stages in order: strain, events, slip state).

``init`` and ``step`` are pure functions on an immutable state, so that a stream can be cut anywhere and taken up
again; ``SlipDetector`` holds such a state, and ``batch.detect_slip`` is the fold of ``step`` over a log.
"""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipcore.defaults import DEFAULT_METHOD, LIMITS, NOISE, ContactOptions, choose_options
from slipcore.detection.methods import find_method
from slipcore.detection.shared.answer import answer
from slipcore.detection.shared.contact import Touch
from slipcore.detection.shared.interface import CompiledMethod, Method, Observation, Start
from slipcore.detection.shared.observe import observe
from slipcore.detection.shared.strain import Lattice
from slipcore.errors import InvalidInput
from slipcore.frames import (
    BoolArray,
    FloatArray,
    Frame,
    check_element_area,
    check_frame,
    check_mask,
    check_normal,
    check_pose,
)
from slipcore.slip_state import SlipState

Scalar = TypeVar("Scalar", bound=np.generic)


def _read_only(array: NDArray[Scalar]) -> NDArray[Scalar]:
    """The same data, not to be written to: users can't change what a detector remembers, kernels see one type."""
    if not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


NO_FIELD, NO_MASK, NO_POSE = (_read_only(np.empty(s, t)) for s, t in (((0, 0, 3), float), ((0, 0), bool), (0, float)))
"""Stand for what a frame does not have."""


class Setup(NamedTuple):
    """What stays the same over a stream: the sensor's lattice and element area (m²), the method and its options; and
    as arrays these options and what an element needs to touch by force and by shape (``kernels.contact.Touch``).
    """

    lattice: Lattice
    element_area: float
    method: str
    options: ContactOptions
    settings: FloatArray
    touch_by_force: FloatArray
    touch_by_shape: FloatArray


class Memory(NamedTuple):
    """What a detector remembers of the last frame: what it saw; ``masks`` [2, n, m], contact and slip, and the
    ``probability`` that it answered; of ``noise`` (``kernels.observe.step_noise``); and the method's own. Before the
    first frame ``time`` is −∞ and nothing touches.
    """

    time: float
    displacement: FloatArray
    force: FloatArray
    object_pose: FloatArray
    observed: BoolArray | None
    masks: BoolArray
    probability: FloatArray
    noise: FloatArray
    own: FloatArray
    numbers: FloatArray
    other: Any


class DetectorState(NamedTuple):
    """A detector between two frames, never written to; can be pickled. ``noise``: estimated standard deviation of one
    marker coordinate, m; NaN while it cannot be estimated.
    """

    setup: Setup
    memory: Memory
    noise: float


def init(position: ArrayLike, element_area: float, method: str = DEFAULT_METHOD, **options: float) -> DetectorState:
    """A detector that has seen nothing: rest positions [n, m, 3] m and element area m².

    Raises ``InvalidInput`` for a lattice that has no strain, an unknown method and unknown or out-of-range options.
    """
    found = find_method(method)
    chosen = choose_options(found.options, options)
    lattice, area = Lattice.at_rest(position), check_element_area(element_area)
    if isinstance(found, CompiledMethod):
        start, other = found.start(lattice, chosen), None
    else:
        start, other = Start(np.zeros(0), np.zeros((0, 0, 0)), np.zeros(0)), found.init(lattice, chosen)
    setup = Setup(lattice, area, method, chosen, start.settings, *touch_thresholds(chosen, area))
    shape = lattice.position.shape
    still, nothing, none = _read_only(np.zeros(shape)), np.zeros(shape[:2]), np.zeros((2, *shape[:2]), bool)
    noise = np.zeros((9, max(1 + NOISE.memory, NOISE.series)))
    memory = Memory(-math.inf, still, NO_FIELD, NO_POSE, None, none, nothing, noise, start.own, start.numbers, other)
    return DetectorState(setup, memory, math.nan)


def touch_thresholds(options: ContactOptions, element_area: float) -> tuple[FloatArray, FloatArray]:
    """What an element of that area, m², needs to touch, by force and by shape: ``kernels.contact.Touch`` as arrays."""
    least = options.contact_pressure * element_area
    noise, release = options.contact_noise, options.release_share
    by_force = Touch(least, options.contact_force_share, noise, release, 1.0, 1.0)
    by_shape = Touch(
        options.contact_depth,
        options.contact_depth_share,
        noise,
        release,
        options.rim_curvature,
        options.contact_reach,
    )
    return np.array(by_force), np.array(by_shape)


def step(state: DetectorState, frame: Frame) -> tuple[DetectorState, SlipState]:
    """Take one valid frame, later than the last; on the first, every element in contact sticks."""
    method, (setup, memory, _) = find_method(state.setup.method), state
    force = NO_FIELD if frame.force is None else frame.force
    pose = NO_POSE if frame.object_pose is None else frame.object_pose
    shape = memory.probability.shape
    after = Memory(
        frame.time,
        _read_only(frame.displacement),
        _read_only(force),
        _read_only(pose),
        frame.observed,
        np.empty((2, *shape), bool),
        np.empty(shape),
        np.empty_like(memory.noise),
        np.empty_like(memory.own),
        np.empty_like(memory.numbers),
        None,
    )
    velocity = np.empty((*shape, 2))
    if isinstance(method, CompiledMethod):
        noise, touching, slipping = _run(method, setup, memory, frame, after, velocity)
    else:
        after, noise, touching, slipping = _run_by_parts(method, setup, memory, frame, after, velocity)
    now = said(frame.time, after.masks[0], after.masks[1], after.probability, velocity, touching, slipping)
    return DetectorState(setup, after, noise), masked(now, frame.observed, memory.observed)


def _run(
    method: CompiledMethod[Any], setup: Setup, memory: Memory, frame: Frame, after: Memory, velocity: FloatArray
) -> tuple[float, int, int]:
    """Fill the arrays of ``after`` and ``velocity``; the marker noise, and how many elements touch and slip."""
    lattice = setup.lattice
    return method.run(
        lattice.position,
        lattice.steps,
        lattice.inverse_jacobian,
        lattice.orientation,
        setup.touch_by_shape if frame.force is None else setup.touch_by_force,
        setup.settings,
        frame.time,
        after.displacement,
        after.force,
        after.object_pose,
        NO_FIELD if frame.normal is None else _read_only(frame.normal),
        NO_MASK if frame.contact is None else _read_only(frame.contact),
        memory.time,
        _read_only(memory.displacement),
        _read_only(memory.force),
        _read_only(memory.object_pose),
        memory.masks,
        memory.probability,
        memory.noise,
        memory.own,
        memory.numbers,
        after.masks,
        after.probability,
        after.noise,
        after.own,
        after.numbers,
        velocity,
    )


def _run_by_parts(
    method: Method[Any, Any], setup: Setup, memory: Memory, frame: Frame, after: Memory, velocity: FloatArray
) -> tuple[Memory, float, int, int]:
    """The same for a method in numpy, and ``after`` with its state."""
    shape = memory.probability.shape
    normal, pressing, tangential = np.empty((*shape, 3)), np.empty(shape), np.empty(shape)
    stays = np.empty(shape, bool)
    noise, _ = observe(
        setup.lattice.steps,
        setup.lattice.orientation,
        setup.touch_by_shape if frame.force is None else setup.touch_by_force,
        frame.time,
        after.displacement,
        after.force,
        NO_FIELD if frame.normal is None else _read_only(frame.normal),
        NO_MASK if frame.contact is None else _read_only(frame.contact),
        memory.masks[0],
        memory.noise,
        normal,
        pressing,
        tangential,
        after.masks[0],
        stays,
        after.noise,
    )
    interval = frame.time - memory.time
    seen = Observation(
        interval, after.displacement, normal, after.force, pressing, tangential, after.masks[0], stays, noise
    )
    other, decision = method.step(memory.other, setup.lattice, seen, setup.options)
    touching, slipping = answer(
        setup.lattice.position,
        interval,
        _read_only(memory.displacement),
        after.displacement,
        _read_only(memory.object_pose),
        after.object_pose,
        after.masks[0],
        stays,
        *decision,
        memory.masks[1],
        memory.probability,
        after.masks[1],
        after.probability,
        velocity,
    )
    return after._replace(other=other), noise, touching, slipping


def said(
    time: float,
    contact: BoolArray,
    slip: BoolArray,
    probability: FloatArray,
    velocity: FloatArray,
    touching: int,
    slipping: int,
) -> SlipState:
    """The answer, with the number of elements that touch and of those that slip."""
    ratio = 1.0 - slipping / touching if touching else math.nan
    fields = _read_only(contact), _read_only(slip), _read_only(probability), ratio, _read_only(velocity)
    return SlipState(time, *fields, macro_slip=0 < touching == slipping)


def masked(now: SlipState, observed: BoolArray | None, before: BoolArray | None) -> SlipState:
    """The answer without what was not observed; the detector itself goes on with the placeholders."""
    if observed is None:
        return now
    return now.masked(observed, observed if before is None else observed & before)


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
        return self.state.noise

    def step(
        self,
        time: float,
        displacement: ArrayLike,
        force: ArrayLike | None = None,
        object_pose: ArrayLike | None = None,
        normal: ArrayLike | None = None,
        contact: ArrayLike | None = None,
        observed: ArrayLike | None = None,
    ) -> SlipState:
        """Take the next frame: time s, displacement [n, m, 3] m, force [n, m, 3] N, object pose [3] m, m, rad,
        outward normals [n, m, 3], known contact [n, m] and which elements were observed [n, m] (see ``GraspLog``).

        Raises ``InvalidInput`` for wrong shapes, numbers that are not finite or absurd, time that does not grow, and
        forces that are given for some frames only; the detector then stays as it was.
        """
        frame = _checked(self.state, time, displacement, force, object_pose, normal, contact, observed)
        self.state, answer = step(self.state, frame)
        return answer


def _checked(
    state: DetectorState,
    time: float,
    displacement: ArrayLike,
    force: ArrayLike | None,
    object_pose: ArrayLike | None,
    normal: ArrayLike | None,
    contact: ArrayLike | None,
    observed: ArrayLike | None,
) -> Frame:
    shape, last = state.setup.lattice.position.shape, state.memory
    if not math.isfinite(time):
        raise InvalidInput("time", time, "finite seconds")
    if not time > last.time:
        raise InvalidInput("time", f"{time:.9g} s after {last.time:.9g} s", "strictly increasing seconds")
    if last.time > -math.inf and (force is None) != (last.force.size == 0):
        raise InvalidInput("force", "missing" if force is None else "given", "in every frame or in none")
    return Frame(
        float(time),
        _field("displacement", displacement, shape, LIMITS.displacement, "m"),
        None if force is None else _field("force", force, shape, LIMITS.force, "N per element"),
        None if object_pose is None else check_pose(object_pose),
        None if normal is None else check_normal(normal, shape),
        None if contact is None else check_mask("contact", contact, shape[:2]),
        None if observed is None else check_mask("observed", observed, shape[:2]),
    )


def _field(name: str, value: ArrayLike, shape: tuple[int, ...], limit: float, unit: str) -> FloatArray:
    """A copy of the field that nobody writes to; what is not plainly right is looked at by ``check_frame``."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and value.shape == shape:
        copy = value.copy()
        flat = copy.ravel()
        if flat @ flat <= limit * limit:  # none is larger, nor infinite or NaN
            copy.flags.writeable = False
            return copy
    return check_frame(name, value, shape, limit, unit)
