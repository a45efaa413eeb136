"""The slip detector: frames in, slip state out (all stages in order: strain, events, slip state).

``init`` and ``step`` are pure functions on an immutable state, so that a stream can be cut anywhere and taken up
again; ``SlipDetector`` holds such a state, and ``batch.detect_slip`` is the fold of ``step`` over a log.
"""

import math
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.blas import ddot

from slipcore.defaults import DEFAULT_METHOD, LIMITS, ContactOptions, choose_options
from slipcore.detection.methods import find_method, findings_by
from slipcore.detection.shared.contact import ContactThreshold
from slipcore.detection.shared.decision import decide_frame
from slipcore.detection.shared.interface import CompiledMethod, ObservedFrame, Start
from slipcore.detection.shared.lasting_noise import TURNING, start_noise
from slipcore.detection.shared.observe import observe_frame
from slipcore.detection.shared.records import (
    NO_FIELD,
    NO_MASK,
    NO_POSE,
    DetectorSetup,
    FrameArrays,
    Memory,
    empty_like,
    for_setup,
    plain,
    read_only,
    shared_workspace,
    unwritten,
    workspace,
)
from slipcore.detection.sharpening import sharpened
from slipcore.errors import InvalidInput
from slipcore.finding import Finding
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
from slipcore.gross_slip import is_gross_slip
from slipcore.slip_state import SlipState
from slipcore.surface.log_normals import normals_of_shape
from slipcore.surface.strain import Lattice
from slipcore.surface.turning import SUMS
from slipcore.surface.unit_normals import are_outward_units


class Setup(NamedTuple):
    """What stays the same over a stream: lattice, element area (m²), method and its options; and what kernels take of
    it.
    """

    lattice: Lattice
    element_area: float
    method: str
    options: ContactOptions
    sensor: DetectorSetup


class DetectorState(NamedTuple):
    """A detector between two frames, never written to; can be pickled.

    The last ``frame`` (before the first its time is −∞ and nothing touches), which elements were ``observed`` in it
    (None: all), what is remembered beside it, and the state of a method in numpy. ``noise``: estimated standard
    deviation of one marker coordinate, m; NaN while it cannot be estimated.
    """

    setup: Setup
    frame: FrameArrays
    observed: BoolArray | None
    memory: Memory
    of_method: Any
    noise: float


def init(position: ArrayLike, element_area: float, method: str = DEFAULT_METHOD, **options: float) -> DetectorState:
    """A detector that has seen nothing: rest positions [n, m, 3] m and element area m².

    Raises ``InvalidInput`` for a lattice that has no strain, an unknown method and unknown or out-of-range options.
    """
    found = find_method(method)
    chosen = choose_options(found.options, options)
    lattice, area = Lattice.at_rest(position), check_element_area(element_area)
    start, of_method = Start(np.zeros(0), np.zeros((0, 0, 0)), np.zeros(0)), None
    if isinstance(found, CompiledMethod):
        start = found.start(lattice, chosen)
    else:
        of_method = found.init(lattice, chosen)
    sensor = DetectorSetup(*for_setup(lattice), *touch_thresholds(chosen, area), start.settings)
    shape = lattice.position.shape
    frame = FrameArrays(-math.inf, read_only(np.zeros(shape)), NO_FIELD, NO_POSE, NO_FIELD, NO_MASK)
    noise = start_noise()
    nowhere, nothing = np.zeros(shape[:2], bool), np.zeros(shape[:2])
    memory = Memory(nowhere, nowhere, nothing, noise, start.elements, start.common)
    return DetectorState(Setup(lattice, area, method, chosen, sensor), frame, None, memory, of_method, math.nan)


def with_options(state: DetectorState, **options: float) -> DetectorState:
    """The detector with other ``options`` from the next frame on; those not named stay.

    Raises ``InvalidInput`` as ``init`` does.
    """
    setup = state.setup
    chosen = asdict(setup.options) | options
    return state._replace(setup=init(setup.lattice.position, setup.element_area, setup.method, **chosen).setup)


def touch_thresholds(options: ContactOptions, element_area: float) -> tuple[FloatArray, FloatArray]:
    """What an element of that area, m², needs to touch, by force and by shape: ``ContactThreshold`` as arrays."""
    by_shape = ContactThreshold(
        least=options.contact_depth,
        share=options.contact_depth_share,
        noise=options.contact_noise,
        release=options.release_share,
        rim=options.rim_curvature,
        rim_noise=options.rim_noise,
        reach=options.contact_reach,
        widening=options.contact_widening,
        edge=options.contact_edge,
    )
    least = options.contact_pressure * element_area
    by_force = by_shape._replace(least=least, share=options.contact_force_share, rim=1.0)
    return np.array(by_force), np.array(by_shape)


def step(state: DetectorState, frame: Frame) -> tuple[DetectorState, SlipState]:
    """Take one valid frame, later than the last; on the first, every element in contact sticks."""
    setup, last = state.setup, unwritten(state.frame)
    displacement, force = sharpened(frame.displacement, frame.force, setup.options, setup.element_area)
    seen = frame_arrays(frame, displacement, force)
    method, memory = find_method(setup.method), state.memory
    sensor, after, of_method = setup.sensor, empty_like(memory), None
    shape = memory.probability.shape
    velocity = np.empty((*shape, 2))
    given: list[Any] = [tuple(part) for part in (sensor, last, seen, memory, after)]  # numba is slow at named tuples
    if isinstance(method, CompiledMethod):
        noise, touching, slipping = method.run(*given, shared_workspace(*shape), velocity)
    else:
        room = workspace(*shape)
        observe_frame(*[*given, plain(room)])
        noise, pressing_noise = (float(known) for known in room.surface.noise[:2])
        observation = ObservedFrame(
            seen.time - last.time,
            seen.displacement,
            seen.force,
            after.contact,
            *room.surface[:4],
            noise,
            pressing_noise,
        )
        of_method, decision = method.step(state.of_method, setup.lattice, observation, setup.options)
        touching, slipping = decide_frame(*[*given, plain(room._replace(decision=decision)), velocity])
    now = slip_state(frame.time, after, velocity, touching, slipping)
    return DetectorState(setup, seen, frame.observed, after, of_method, noise), masked(
        now, frame.observed, state.observed
    )


def frame_arrays(frame: Frame, displacement: FloatArray, force: FloatArray | None) -> FrameArrays:
    """A frame with this displacement and force as kernels take it, not to be written to; what it does not have is
    empty.
    """
    return FrameArrays(
        frame.time,
        read_only(displacement),
        NO_FIELD if force is None else read_only(force),
        NO_POSE if frame.object_pose is None else read_only(frame.object_pose),
        NO_FIELD if frame.normal is None else read_only(frame.normal),
        NO_MASK if frame.contact is None else read_only(frame.contact),
    )


def slip_state(time: float, memory: Memory, velocity: FloatArray, touching: int, slipping: int) -> SlipState:
    """The slip state of a step, with the number of elements that touch and of those that slip."""
    ratio = 1.0 - slipping / touching if touching else math.nan
    contact, slip, probability = (
        read_only(memory.contact),
        read_only(memory.slip),
        read_only(memory.probability),
    )
    macro_slip = is_gross_slip(contact, slip)
    return SlipState(time, contact, slip, probability, ratio, read_only(velocity), macro_slip)


def masked(now: SlipState, observed: BoolArray | None, before: BoolArray | None) -> SlipState:
    """The slip state without what was not observed; the detector itself goes on with the placeholders."""
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

    @property
    def normals(self) -> FloatArray:
        """Outward normals [n, m, 3] at which forces are split: those of the last frame where it gave any, else of the
        surface at rest, or of the deformed one once forces were seen to turn with it.
        """
        setup, frame, turned = self.state.setup, self.state.frame, self.state.memory.noise[TURNING, SUMS] > 0.0
        if frame.normal.size:
            return frame.normal
        return normals_of_shape(setup.lattice.position, frame.displacement[None])[0] if turned else setup.sensor.normal

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found inconsistent in the frames so far."""
        return findings_by(self.state.setup.method, self.state.memory.common, self.noise, self.state.of_method)

    def set_options(self, **options: float) -> None:
        """Go on with other ``options`` from the next frame on; those not named stay. Raises ``InvalidInput``."""
        self.state = with_options(self.state, **options)

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
        self.state, now = step(self.state, frame)
        return now


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
    shape, last = state.setup.lattice.position.shape, state.frame
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
        None if object_pose is None else _pose(object_pose),
        None if normal is None else _normal(normal, shape),
        None if contact is None else check_mask("contact", contact, shape[:2]),
        None if observed is None else check_mask("observed", observed, shape[:2]),
    )


def _field(name: str, value: ArrayLike, shape: tuple[int, ...], limit: float, unit: str) -> FloatArray:
    """A copy of the field that nobody writes to; what is not plainly right is looked at by ``check_frame``."""
    copy = _plain_copy(value, shape)
    if copy is not None:
        flat = copy.ravel()
        if ddot(flat, flat) <= limit * limit:  # none is larger, nor infinite or NaN; numpy would warn of these
            return _unwritable(copy)
    return check_frame(name, value, shape, limit, unit)


def _normal(value: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """The same of normals, by ``check_normal``."""
    copy = _plain_copy(value, shape)
    if copy is not None and are_outward_units(copy, LIMITS.normal_length):
        return _unwritable(copy)
    return check_normal(value, shape)


def _pose(value: ArrayLike) -> FloatArray:
    """The same of a pose, by ``check_pose``."""
    copy = _plain_copy(value, (3,))
    if copy is not None:
        x, y, yaw = copy.tolist()
        if abs(x) <= LIMITS.position and abs(y) <= LIMITS.position and abs(yaw) <= LIMITS.yaw:
            return _unwritable(copy)
    return check_pose(value)


def _plain_copy(value: ArrayLike, shape: tuple[int, ...]) -> FloatArray | None:
    """A copy of what is an array of this shape and of the type that kernels take, else None."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64 and value.shape == shape:
        return value.copy()
    return None


def _unwritable(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
