"""Whole logs: the fold of the detector's steps, and what later frames say of earlier ones."""

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipcore.calibration.model import SensorModel
from slipcore.defaults import DEFAULT_METHOD, FORCES_METHOD, MOST_LOOKAHEAD
from slipcore.detection.contradicting_forces import agreeing
from slipcore.detection.detector import DetectorState, init, masked, slip_state, step
from slipcore.detection.methods import find_method, findings_by
from slipcore.detection.reconstructed_forces import for_reconstructed_forces
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.interface import CompiledMethod
from slipcore.detection.sharpening import kernels_of, smoothing_found
from slipcore.detection.whole_log import history_of
from slipcore.errors import InvalidInput
from slipcore.finding import Finding
from slipcore.frames import GraspLog
from slipcore.patch.following import follow_patches
from slipcore.patch.regimes import slips_as_a_whole
from slipcore.repeated_frames import noise_of_own_frames, own_frames, with_repeated
from slipcore.slip_state import SlipHistory, SlipState, observed_over_time, slip_events
from slipcore.surface.log_normals import with_normals

LENGTHS = frozenset({"rounded", "lasting noise", "smoothed"})
"""Findings whose evidence is a length in m."""


def detect_slip(
    log: GraspLog,
    method: str = DEFAULT_METHOD,
    *,
    lookahead: int = 0,
    sensor_model: SensorModel | None = None,
    **options: float,
) -> SlipHistory:
    """Detect local slip in a whole log: the fold of ``step`` over its frames.

    With a ``lookahead`` each frame is decided in the light of that many frames after it (see ``FixedLagSmoother``);
    with a ``sensor_model`` the log is first corrected by it (``SensorModel.apply``). Frames that a recorder wrote again
    count as the one that they repeat, and hide no noise where they were interpolated (``repeated_frames``). Forces that
    are clearly late, or have crosstalk in them, are mended first (``contradicting_forces``). Method "filter" sharpens
    what the sensor smoothed, as far as the log's noise shows how widely, unless options give it, and takes
    reconstructed forces as ``for_reconstructed_forces`` says. A log without displacement is left to method
    "forces_only" where the default would see nothing; which method suits a log best, ``recommended_method`` says.
    ``options`` are the method's, and ``kernel_width`` of ``defaults.PatchOptions``; what the sensor model knows of
    noise and smoothing goes before their defaults. Raises ``InvalidInput`` as ``init`` does, and for a log of another
    lattice than the sensor model's.
    """
    if not log.sees_along_surface:
        allowed = (
            "x and y of it, too, as of markers. Heights alone show neither slip nor friction, but forces along the "
            "normal, by the sensor's gel: slipcore.forces.reconstruct (docs/forces.md#from-depth-alone)"
        )
        raise InvalidInput("displacement", log.metadata["displacement"], allowed)
    if method == DEFAULT_METHOD and not log.has_displacement:
        method = FORCES_METHOD
    if sensor_model is not None:
        log, _, known = sensor_model.apply(log, method)
        options = {**known, **options}
    if log.force_deviation and method == DEFAULT_METHOD:
        options = {**for_reconstructed_forces(log.force_deviation), **options}
    own = own_frames(log)
    if not own.all():
        found = detect_slip(log.take(own), method, lookahead=lookahead, sensor_model=None, **options)
        return with_repeated(found, log, own)
    log, mended = agreeing(with_normals(log))
    kernel_width = options.pop("kernel_width", 0.0)
    estimated = {}
    if method == DEFAULT_METHOD:
        estimated = {name: width for name, width in kernels_of(log).items() if name not in options}
        options = noise_of_own_frames(log) | options | estimated
    state = init(log.position, log.element_area, method, **options)
    if isinstance(find_method(method), CompiledMethod):
        history = history_of(log, state, checked_lookahead(lookahead))
        history = replace(history, findings=_in_its_units(mended + history.findings + smoothing_found(estimated), log))
        return with_patches(log, history, kernel_width=kernel_width)
    smoother, settled_states = FixedLagSmoother(state, lookahead), []
    for frame in log.frames():
        state, now = step(state, frame)
        if (settled := smoother.take(state, now)) is not None:
            settled_states.append(settled)
    history = collect_history([*settled_states, *smoother.rest()], state)
    history = replace(history, findings=_in_its_units(mended + history.findings, log))
    if not log.has_displacement:
        history = replace(history, velocity=np.full_like(history.velocity, np.nan))
    return with_patches(log, history, kernel_width=kernel_width)


def _in_its_units(found: tuple[Finding, ...], log: GraspLog) -> tuple[Finding, ...]:
    """Without those that give lengths where the log's scale is unknown."""
    return found if log.is_scaled else tuple(each for each in found if each.name not in LENGTHS)


def with_patches(log: GraspLog, history: SlipHistory, **options: float) -> SlipHistory:
    """The history with the log's contact patches, and with their macro slip beside that of elements.

    ``options``: see ``defaults.PatchOptions``; raises ``InvalidInput`` for those that do not exist or are out of range.
    """
    patches = follow_patches(log, history.contact, history.slip, **options)
    macro_slip = history.macro_slip | slips_as_a_whole(patches, len(log))
    return replace(history, patches=patches, macro_slip=macro_slip)


def checked_lookahead(lookahead: int) -> int:
    """The number of frames, refused where it is none."""
    whole = isinstance(lookahead, int | np.integer) and not isinstance(lookahead, bool)
    if not whole or not 0 <= lookahead <= MOST_LOOKAHEAD:
        raise InvalidInput("lookahead", lookahead, f"a whole number of frames, 0 to {MOST_LOOKAHEAD}")
    return int(lookahead)


class FixedLagSmoother:
    """A running detector's slip states, each ``lookahead`` frames late and revised by what came meanwhile.

    A fixed-lag smoother (Kim, 1994) of the two states of method "filter"; the states of other methods, which keep no
    posterior, are late but the same. ``start`` is the detector's state before the first frame that is taken.
    """

    def __init__(self, start: DetectorState, lookahead: int) -> None:
        self._lookahead = checked_lookahead(lookahead)
        method = find_method(start.setup.method)
        self._revise = method.revise if lookahead and isinstance(method, CompiledMethod) else None
        self._states, self._recent = deque([start]), deque[SlipState]()
        self._revised = start.memory

    def take(self, state: DetectorState, now: SlipState) -> SlipState | None:
        """The detector's state after a frame, and its slip state: what is settled by it, if anything."""
        self._states.append(state)
        self._recent.append(now)
        return self._settle() if len(self._recent) > self._lookahead else None

    def rest(self) -> list[SlipState]:
        """The last frames, with what lookahead there is."""
        return [self._settle() for _ in range(len(self._recent))]

    def _settle(self) -> SlipState:
        now, before = self._recent.popleft(), self._states.popleft()
        if self._revise is None:
            return now
        after = self._states[0]
        contact = after.memory.contact
        decision = self._revise([state.memory.elements for state in self._states], before.setup.sensor.settings)
        revised = after.memory._replace(slip=np.empty_like(contact), probability=np.empty(contact.shape))
        velocity = np.empty((*contact.shape, 2))
        touching, slipping = apply_decision(
            before.setup.lattice.position, before.frame, after.frame, decision, self._revised, revised,
            np.empty(contact.shape), velocity,
        )  # fmt: skip
        self._revised = revised
        settled = slip_state(after.frame.time, revised, velocity, touching, slipping)
        return masked(settled, after.observed, before.observed)


def collect_history(slip_states: Sequence[SlipState], state: DetectorState) -> SlipHistory:
    """The history that a detector's slip states add up to, with the ``state`` that it ended in.

    Raises ``InvalidInput`` when there are none.
    """
    if not slip_states:
        raise InvalidInput("slip_states", "empty", "at least one frame's slip state")
    time, contact, slip, probability, ratio, velocity, macro_slip = (
        np.array([getattr(each, name) for each in slip_states])
        for name in ("time", "contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip")
    )
    observed = observed_over_time(slip_states)
    events = slip_events(time, contact, slip, observed)
    noise, method = state.noise, state.setup.method
    return SlipHistory(
        time, contact, slip, probability, ratio, velocity, macro_slip, events, noise, method, observed,
        findings=findings_by(method, state.memory.common, noise, state.of_method),
    )  # fmt: skip
