"""What a model's answer at a working point rests on: the data, an extrapolation, or nothing to rely on."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stiction_client.defaults import BEND, UNCERTAIN
from stiction_client.elementwise import FloatArray, Number, greatest, least, logarithm, root, select, student_quantile

Kind = Literal["supported", "extrapolated", "not identified", "stale", "implausible"]

OUTDATED = "the material's logs are others since, and it was not fitted again by this method: ask for a fit"
SENSOR_GAIN = "sensor_gain"
"""Diagnostic, a sentence: whether the data determine a sensor's own gain, of a model of several sensors."""
WEAKENING = "weakening"
"""Diagnostic, a sentence: which log lowers the friction that a planner may count on."""
UNNOTICED = "unnoticed_change"
"""Diagnostic, a sentence: which change of its friction grasps of a material differ too much to show soon."""
UNKNOWN_SENSOR = "unknown_sensor"
"""Diagnostic, a sentence: the model was asked for as a sensor shows it of which it has no grasp, or knows of none."""
ONLY_SENSOR = "sensor"
"""Diagnostic: the name of the sensor that all grasps are of, where there is one."""
UNNAMED_SENSOR = "unknown"
"""What the sensor of logs that name none is called: any may be among them."""
ELEMENT_AREAS = "element_areas"
"""Diagnostic, a sentence: elements of the material's grasps differ in their area, and of which one forces are."""
SLOWEST_SLIP = "slowest_slip"
"""Diagnostic, m/s, of a model whose samples do not show how friction changes with velocity: hardly any slid slower.
Below it friction rests on an assumption."""
ASSUMED_CHANGE = "assumed_change"
"""Diagnostic, a sentence: by how much friction is assumed to change between rest and the speed of slip."""
SAME_GRASPS = "same_grasps"
"""Diagnostic, a sentence: which of a material's logs are of a grasp that another log of it has, and do not count."""
UNCHECKED = "unchecked_logs"
"""Diagnostic, a sentence: how many of a material's logs an older version stored without looking for findings."""
OTHERS_CALIBRATIONS = "others_calibrations"
"""Diagnostic, a sentence: how many of a material's logs another key's calibration corrects than sent them."""
OTHERS_GELS = "others_gels"
"""Diagnostic, a sentence: how many of a material's logs have forces by a gel that another key described."""
RECONSTRUCTED_FORCES = "reconstructed_forces"
"""Diagnostic, a sentence: how many of a material's logs have forces that no sensor measured."""
ONE_RECORD = "one_record"
"""Diagnostic, a sentence: all samples are of one grasp, and why slopes are not known of them."""
CHOSEN_BECAUSE = "chosen_because"
"""Diagnostic, a sentence: why this model answers who names no method."""
DISAGREEMENT = "disagreement"
"""Diagnostic, a sentence: that models of the material by other methods expect another friction (``disagreement``)."""
NOTES = (
    WEAKENING,
    ONE_RECORD,
    ASSUMED_CHANGE,
    SAME_GRASPS,
    UNCHECKED,
    OTHERS_CALIBRATIONS,
    OTHERS_GELS,
    RECONSTRUCTED_FORCES,
    SENSOR_GAIN,
    UNKNOWN_SENSOR,
    ELEMENT_AREAS,
    UNNOTICED,
)
"""Diagnostics that whoever reads an answer is to know beside it."""
ONE_GRASP = "one grasp does not show by how much others differ, and this method has no scale of it: ask method auto"
INDEPENDENT = (
    "this method takes all samples for independent, so that its intervals are too narrow where grasps or places "
    "differ: ask method auto"
)
SUPERSEDED = "a newer version took its place: fetch the current model"


@dataclass(frozen=True, slots=True)
class Domain:
    """Range of the data behind a model: tangential velocity, m/s, and normal force of an element, N."""

    tangential_velocity: tuple[float, float]
    normal_force: tuple[float, float]


class Model(Protocol):
    """What of a fitted friction model is needed here."""

    @property
    def coefficients(self) -> FloatArray:
        """β₀ [-], β₁ [s/m], β₂ [1/N]."""

    @property
    def covariance(self) -> FloatArray:
        """Of the coefficients, [3, 3]."""

    @property
    def degrees_of_freedom(self) -> float:
        """Of the coefficients' Student-t."""

    @property
    def domain(self) -> Domain:
        """Where the samples lie."""

    @property
    def identifiable(self) -> NDArray[np.bool_]:
        """Whether the data determine each coefficient, [3]."""

    @property
    def diagnostics(self) -> Mapping[str, Any]:
        """``doubtful_logs``, where there is one: which findings speak against its logs; ``surface_change``: by how much
        the newest of them differ from those before; ``unknown_velocity``: that the object's motion was not recorded;
        ``cluster_kind``: what of the samples shares errors, "grasp" where there are several, "merged" where these came
        as one set of moments; ``scale_between_grasps``:
        by how much they are thought to differ, of methods that allow for it; ``assumes``: that all errors are
        independent, of methods that allow for nothing else.
        """


@dataclass(frozen=True, slots=True)
class Support:
    """What an answer rests on, and one sentence on what to do about it.

    ``kind``, the first that applies: "implausible" (friction cannot be so there, or within the data, or findings speak
    against the logs), "stale" (the model is not the material's any more), "not identified" (the data do not show
    friction there, or no coefficient at all, or are of one grasp by a method that takes the next one to be alike, or
    the method takes all samples for independent), "extrapolated" (beyond the data), "supported".
    """

    kind: Kind
    advice: str

    def warning(self, *others: str | None) -> str | None:
        """What speaks against the answer: ``others``, and the advice where the answer cannot be relied on."""
        own = None if self.kind in ("supported", "extrapolated") else self.advice
        return "; ".join(filter(None, (*others, own))) or None


def support(model: Model, tangential_velocity: float, normal_force: float, stale: str | None = None) -> Support:
    """What the answer at v (m/s) and f_n (N an element) rests on; ``stale``: why the model is, if it is."""
    reason = _implausible(model) or _beyond_the_law(model, tangential_velocity, normal_force)
    if reason is not None:
        return Support("implausible", reason)
    changed = model.diagnostics.get("surface_change")
    if changed:
        return Support("stale", f"{changed}: clean the surface; if it stays so, begin a new epoch")
    if stale is not None:
        return Support("stale", f"the model is outdated: {stale}")
    part = float(uncertainty(model, *within(model, tangential_velocity, normal_force)))
    if tangential_velocity > 0.0 and _knows_no_velocity(model):
        return Support("not identified", f"{model.diagnostics['unknown_velocity']}: record a grasp with its motion")
    if not part <= UNCERTAIN or not any(model.identifiable.tolist()):
        return Support("not identified", _too_fast(model, tangential_velocity, normal_force) or _ignorance(part))
    reason = _takes_grasps_as_alike(model)
    if reason is not None:
        return Support("not identified", reason)
    outside = extrapolation(model, tangential_velocity, normal_force)
    if outside is not None:
        part = _uncertainty_outside(model, tangential_velocity, normal_force)
        known = f"the expected friction is known to within ± {part:.0%} there"
        if tangential_velocity < slowest_shown(model):
            known += ", if velocity changes it no more than is assumed"
            return Support("extrapolated", f"{outside}; {known}: record slip at other speeds")
        return Support("extrapolated", f"{outside}; {known}: record a grasp there")
    return Support("supported", f"the samples determine the expected friction to within ± {part:.1%}")


def notes(diagnostics: Mapping[str, Any]) -> tuple[str, ...]:
    """Sentences on a model that its answers carry, whatever they rest on."""
    return tuple(str(diagnostics[name]) for name in NOTES if diagnostics.get(name))


def kinds(
    model: Model, tangential_velocity: ArrayLike, normal_force: ArrayLike, stale: str | None = None
) -> NDArray[np.str_]:
    """The kind of support at each v and f_n, in their common shape; see ``Support``."""
    v, f_n = np.broadcast_arrays(np.asarray(tangential_velocity, float), np.asarray(normal_force, float))
    if _implausible(model) is not None:
        return np.full(v.shape, "implausible")
    beyond = np.logical_not(_can_be(model, _expected(model, v, f_n)))
    is_stale = np.full(v.shape, stale is not None or bool(model.diagnostics.get("surface_change")))
    identified = np.asarray(uncertainty(model, *within(model, v, f_n)) <= UNCERTAIN) & model.identifiable.any()
    unknown = ~identified | ((v > 0.0) & _knows_no_velocity(model)) | (_takes_grasps_as_alike(model) is not None)
    (low, high), fastest = model.domain.normal_force, model.domain.tangential_velocity[1]
    outside = (f_n < low) | (f_n > high) | (v > fastest) | (v < slowest_shown(model))
    each = {"implausible": beyond, "stale": is_stale, "not identified": unknown, "extrapolated": outside}
    return np.select([*each.values()], [*each], "supported")


def disagreement(method: str, model: Model, others: Mapping[str, Model]) -> str | None:
    """Which of the ``others``, fitted by other methods to the same data, expect another friction somewhere within it.

    They disagree where the 95 % intervals of the expected friction have no value in common: at a bound of the data or
    at rest, in the middle of the normal forces. None where none does.
    """
    (_, fastest), (low, high) = model.domain.tangential_velocity, model.domain.normal_force
    v, f_n = np.array([0.0, 0.0, 0.0, fastest, fastest]), np.array([0.5 * (low + high), low, high, low, high])
    mean, half = map(np.asarray, _interval(model, v, f_n))
    for name, other in others.items():
        expected, spread = map(np.asarray, _interval(other, v, f_n))
        gap = np.abs(mean - expected) - (half + spread)
        at = int(np.argmax(gap))
        if gap[at] > 0.0:
            each = f"{name} expects {expected[at]:.3g} ± {spread[at]:.2g}, {method} {mean[at]:.3g} ± {half[at]:.2g}"
            where = f"at {v[at]:.4g} m/s and {f_n[at]:.4g} N an element"
            return f"methods disagree by more than their intervals allow: {each} {where}; look at the samples"
    return None


def uncertainty(model: Model, tangential_velocity: Number, normal_force: Number) -> Number:
    """Half-width of the 95 % interval of the friction expected at v and f_n, in parts of it."""
    mean, half = _interval(model, tangential_velocity, normal_force)
    measurable = mean > 1e-9 * half  # else it is nothing beside its uncertainty
    return select(measurable, half / select(measurable, mean, 1.0), math.inf)


def within(model: Model, tangential_velocity: Number, normal_force: Number) -> tuple[Number, Number]:
    """The nearest v and f_n that the data show (``slowest_shown``)."""
    (low, high), fastest = model.domain.normal_force, model.domain.tangential_velocity[1]
    v = greatest(least(tangential_velocity, fastest), slowest_shown(model))
    return v, least(greatest(normal_force, low), high)


def slowest_shown(model: Model) -> float:
    """The least v, m/s, at which the data show friction: 0, the limit at rest, where they show how friction changes
    with velocity; else the velocity of the slowest slip.
    """
    return float(model.diagnostics.get(SLOWEST_SLIP) or 0.0)


def beyond_velocity(domain: Domain, tangential_velocity: Number) -> Number:
    """How far v lies outside the data, 0 inside: the logarithm of its ratio to the fastest."""
    return logarithm(greatest(tangential_velocity * _inverse(domain.tangential_velocity[1]), 1.0))


def beyond_force(domain: Domain, normal_force: Number) -> Number:
    """How far f_n lies outside the data, in parts of the bound that it passes: 0 inside and at a bound of 0."""
    low, high = domain.normal_force
    above, below = greatest(normal_force - high, 0.0), greatest(low - normal_force, 0.0)
    return above * _inverse(high) + below * _inverse(low)


def widening(model: Model, tangential_velocity: ArrayLike, normal_force: ArrayLike) -> FloatArray:
    """Standard deviation of what the law bends away from its line at v and f_n outside the data; 0 inside."""
    v, f_n = np.asarray(tangential_velocity, float), np.asarray(normal_force, float)
    return np.asarray(
        extrapolation_scale(model) * np.hypot(beyond_velocity(model.domain, v), beyond_force(model.domain, f_n))
    )


def extrapolation_scale(model: Model) -> float:
    """The same at a distance of 1 (``BEND``, ``beyond_velocity``, ``beyond_force``)."""
    (slowest, fastest), (low, high) = model.domain.tangential_velocity, model.domain.normal_force
    b0, b1, b2 = model.coefficients.tolist()
    return BEND * abs(float(b0 + 0.5 * (slowest + fastest) * b1 + 0.5 * (low + high) * b2))


def extrapolation(model: Model, tangential_velocity: float, normal_force: float) -> str | None:
    """Which of v (m/s) and f_n (N an element) lies outside the data; None where neither does.

    Slower than the data is not outside where these show how velocity changes friction (``slowest_shown``): slip is
    never observed at rest, and a grasp that holds is the limit v → 0.
    """
    velocities = slowest_shown(model), model.domain.tangential_velocity[1]
    asked = (
        ("tangential velocity", tangential_velocity, velocities, "m/s"),
        ("normal force", normal_force, model.domain.normal_force, "N an element"),
    )
    remarks = [
        f"{name} extrapolated to {value:.4g} {unit}, observed {low:.4g} to {high:.4g}"
        for name, value, (low, high), unit in asked
        if not low <= value <= high
    ]
    return "; ".join(remarks) or None


def _interval(model: Model, v: Number, f_n: Number) -> tuple[Number, Number]:
    """The friction expected at v and f_n, and the half-width of its 95 % interval."""
    (c00, c01, c02), (c10, c11, c12), (c20, c21, c22) = model.covariance.tolist()
    variance = c00 + v * (c01 + c10) + v * v * c11 + f_n * (c02 + c20 + v * (c12 + c21) + f_n * c22)
    return _expected(model, v, f_n), student_quantile(model.degrees_of_freedom, 0.975) * root(variance)


def _expected(model: Model, v: Number, f_n: Number) -> Number:
    b0, b1, b2 = model.coefficients.tolist()
    expected: Number = b0 + v * b1 + f_n * b2
    return expected


def _knows_no_velocity(model: Model) -> bool:
    """Whether the model's samples say nothing of velocity, for none of their objects' motion was recorded."""
    return "unknown_velocity" in model.diagnostics and not model.domain.tangential_velocity[1] > 0.0


def _takes_grasps_as_alike(model: Model) -> str | None:
    """Why its intervals do not hold for a new grasp, of a method that allows for no other friction in it: the samples
    are of one, or it takes those of all grasps for independent. None of any other.
    """
    if "scale_between_grasps" in model.diagnostics:
        return None
    if model.diagnostics.get("cluster_kind") in ("element", "time block", "none"):
        return ONE_GRASP
    return INDEPENDENT if "assumes" in model.diagnostics else None


def _inverse(bound: float) -> float:
    return 1.0 / bound if bound > 0.0 else 0.0


def _implausible(model: Model) -> str | None:
    """Why friction cannot be as the model says, or its logs are in doubt; None where nothing speaks against it."""
    doubtful = model.diagnostics.get("doubtful_logs")
    if doubtful:
        return f"{doubtful}: mend what the finding names, or withdraw the log"
    b0, b1, b2 = model.coefficients.tolist()
    velocities, forces = model.domain.tangential_velocity, model.domain.normal_force
    for v, f_n in itertools.product(velocities, forces):  # between which friction is linear
        friction = b0 + b1 * v + b2 * f_n
        if not 0.0 < friction < math.inf:
            return (
                f"friction within the data comes out at {friction:.3g}, at {v:.4g} m/s and {f_n:.4g} N an element: "
                "look for a log with wrong forces (stiction check), and withdraw it"
            )
    return None


def _beyond_the_law(model: Model, tangential_velocity: float, normal_force: float) -> str | None:
    """That no friction is what the law has at v and f_n, of a law that is plausible within its data."""
    friction = float(_expected(model, tangential_velocity, normal_force))
    if _can_be(model, friction):
        return None
    where = f"at {tangential_velocity:.4g} m/s and {normal_force:.4g} N an element"
    much = ", over twice what it is within the data" if friction > 0.0 else ""
    return (
        f"friction comes out at {friction:.3g} {where}{much}, too far outside of the data for the law: "
        "record a grasp there"
    )


def _can_be(model: Model, friction: Number) -> bool | NDArray[np.bool_]:
    """Where ``friction`` that the law has is above 0 and at most twice the greatest within its data, rest among them:
    over that it is farther from what was seen than 0 is.
    """
    b0, b1, b2 = model.coefficients.tolist()
    low, high = model.domain.normal_force
    most = b0 + max(0.0, b1 * model.domain.tangential_velocity[1]) + max(b2 * low, b2 * high)
    can_be: bool | NDArray[np.bool_] = (friction > 0.0) & (friction <= 2.0 * most)
    return can_be


def _uncertainty_outside(model: Model, tangential_velocity: float, normal_force: float) -> float:
    """``uncertainty`` where the law may bend, too."""
    expected, half = map(float, _interval(model, tangential_velocity, normal_force))
    bend = float(student_quantile(math.inf, 0.975)) * float(widening(model, tangential_velocity, normal_force))
    return math.hypot(half, bend) / expected


def _too_fast(model: Model, tangential_velocity: float, normal_force: float) -> str | None:
    """That friction is known where slip was seen, all of it faster than is asked for: more of the same tells nothing
    of v. None where it is not so.
    """
    slowest = model.domain.tangential_velocity[0]
    part = float(uncertainty(model, *within(model, slowest, normal_force)))
    asked = float(uncertainty(model, *within(model, tangential_velocity, normal_force)))
    if not (tangential_velocity < slowest and part <= UNCERTAIN < asked):
        return None
    known = f"the expected friction is known to within ± {part:.1%} where slip was slowest, at {slowest:.4g} m/s"
    return f"{known}, but not at {tangential_velocity:.4g} m/s: record slower slip"


def _ignorance(part: float) -> str:
    """What to do where friction is known to such a ``part`` of itself, or no coefficient is."""
    if part > 1.0:
        return "the samples do not determine the expected friction there: record more grasps, and others"
    if not part <= UNCERTAIN:
        return f"the expected friction is known to within ± {part:.0%} only: record more grasps"
    return (
        f"no coefficient is known, only friction near the middle of the samples (± {part:.1%}): "
        "record grasps that press harder and lighter"
    )
