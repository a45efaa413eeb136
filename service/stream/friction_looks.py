"""Looks for friction in the last frames of a live detector, beside it, so that frames need not wait for them."""

import logging
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import estimators
import slipcore
from estimators.errors import EstimatorError
from service.processes.fair_executor import FairExecutor
from service.report.wording import LEVELS
from service.stream.detector_session import STRIDE, WINDOW, DetectorSession, log_of
from slipcore import Frame, FrictionSamples, SlipState, collect_samples

if TYPE_CHECKING:
    from estimators import FrictionModel
    from slipcore import DetectorState

logger = logging.getLogger(__name__)

_LOOKS = FairExecutor()
"""Does the looks for friction, so that frames need not wait for them."""


class RecentFrames(NamedTuple):
    """The last frames and the detector's answers to them, its state, and ``options`` of samples of reconstructed
    forces.
    """

    frames: list[Frame]
    answers: list[SlipState]
    state: "DetectorState"
    options: Mapping[str, float]


def plan_look(session: DetectorSession, frame: Frame, state: SlipState) -> None:
    """Once in a while, let the last frames be looked at."""
    if frame.force is None:
        return
    if session.forces is not None and session.forces.stream is not None:
        frame = frame._replace(force=session.forces.alike)
    session.frames = [*session.frames[1 - WINDOW :], frame]
    session.answers = [*session.answers[1 - WINDOW :], state]
    session.until_look -= 1
    if session.until_look == 0:
        session.until_look = STRIDE
        options = {} if session.forces is None or session.forces.stream is None else session.forces.of_samples
        recent = RecentFrames(session.frames, session.answers, session.detector.state, options)
        session.look = _LOOKS.of(session.limit.owner).submit(_look, session, recent)


def _look(session: DetectorSession, recent: RecentFrames) -> None:
    try:
        _find_friction(session, recent)
    except Exception:  # costs the stream this second's friction, and nothing else
        logger.exception("a look for friction failed")


def _find_friction(session: DetectorSession, recent: RecentFrames) -> None:
    """The samples since the last look, merged with those before."""
    history = slipcore.collect_history(recent.answers, recent.state)
    samples = collect_samples(log_of(session, recent.frames, "", {}), history, **recent.options)
    end = recent.frames[-1].time  # which has no next frame yet, so it is the next look's
    new = (samples.time >= session.looked_until) & (samples.time < end)
    session.looked_until = end
    part = {name: getattr(samples, name)[new] for name in samples.arrays()}
    found = FrictionSamples(**part, element_area=samples.element_area)
    session.moments = session.moments.merge(estimators.Moments.from_samples(found, places=False))
    try:
        model = session.moments.fit()
    except EstimatorError:  # too few samples yet
        return
    session.friction, session.expected = _summary(model), _expected(model)


def _summary(model: "FrictionModel") -> dict[str, Any]:
    return {
        "coefficients": model.coefficients.tolist(),
        "standard_errors": [value if math.isfinite(value) else None for value in model.standard_errors.tolist()],
        "scale": float(model.scale),
        "samples": model.n,
    }


def _expected(model: "FrictionModel") -> dict[str, float] | None:
    """Friction of an element that begins to slip under the middle of the forces seen, with 90 % of new observations."""
    force = 0.5 * sum(model.domain.normal_force)
    low, high = (float(model.predict(0.0, force, quantile=level)) for level in LEVELS)
    found = {"mean": float(model.predict(0.0, force)), "low": low, "high": high, "normal_force": force}
    return found if all(map(math.isfinite, found.values())) else None
