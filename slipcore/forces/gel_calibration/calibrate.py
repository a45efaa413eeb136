"""A sensor's gel from a few presses with known forces: Young's modulus, Poisson's ratio and thickness, jointly."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import ndtri

from slipcore.calibration.press import known_forces
from slipcore.errors import InvalidInput
from slipcore.forces.defaults import GEL, GEL_CALIBRATION
from slipcore.forces.gel_calibration.bounded_gaussian import BoundedGaussian, through
from slipcore.forces.gel_calibration.likelihood import (
    Elasticity,
    EvaluatedGel,
    PressData,
    Presses,
    Seek,
    ThicknessMap,
    evaluate_gel,
    first_contacts,
)
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.uneven import thickest
from slipcore.forces.recording import DisplacementData, error
from slipcore.forces.tracking.known import KnownForce
from slipcore.frames import FloatArray, GraspLog, reported

GIVEN, PRIORS = "given", "the prior's: the presses hardly determine it"
HALF_SPACE = "at least: against these contacts the gel may be as thick as a half-space"
"""What is said of an estimate."""
_NORMAL = float(ndtri(0.5 + 0.5 * GEL_CALIBRATION.confidence))
"""Standard deviations to the end of an interval."""


@dataclass(frozen=True, slots=True)
class GelEstimate:
    """A property of a gel with its 95 % interval; ``information``: share of what is known that is from the presses.

    ``note``: "given"; that it is the prior's; or that the thickness has no upper end. Empty where the presses show it.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    information: float
    note: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class GelCalibration:
    """The ``gel``, and how well the presses determine each of its properties.

    ``correlation`` [3, 3]: between log Young's modulus, Poisson's ratio and the thickness; ``force`` [i] N of each
    press by this gel; ``misfit``: root mean square of what no gel explains of the displacement over its noise.
    """

    gel: Gel
    estimates: tuple[GelEstimate, ...]
    correlation: FloatArray
    force: FloatArray
    misfit: float

    def to_json(self) -> dict[str, Any]:
        """Of numbers and texts alone; what is infinite is None."""
        plain = [
            {name: value if value != math.inf else None for name, value in asdict(each).items()}
            for each in self.estimates
        ]
        return {
            "gel": self.gel.to_json(),
            "estimates": plain,
            "correlation": self.correlation.tolist(),
            "force": self.force.tolist(),
            "misfit": self.misfit,
        }


def calibrate_gel(
    logs: Sequence[GraspLog],
    known_force: Sequence[float | None] | None = None,
    young_modulus: float | None = None,
    poisson_ratio: float | None = None,
    thickness: float | None = None,
    marker_depth: float = 0.0,
    noise: float | None = None,
    relative_thickness: Sequence[Sequence[float]] | None = None,
) -> GelCalibration:
    """A gel from logs of presses on it: what is not given of it, from the displacement and the normal forces.

    ``known_force`` N of each log's hold, to 1 %; where it is None, what the log's gripper reports, if it does. At least
    one is known so, or ``young_modulus`` is given. What is given (Pa, m; ``thickness`` inf: a half-space) is taken as
    exact. ``noise`` m of a marker's coordinate (None: estimated from each log). ``relative_thickness`` [n, m]: of a gel
    that is not alike thick everywhere, at each marker, over ``thickness``, which is then finite. Of a log count the
    frames in which markers moved most. Raises ``InvalidInput`` for what does not fit, also for logs in which nothing
    touches, and ``UnknownScale`` for a log not in metres.
    """
    given, uneven = _checked(young_modulus, poisson_ratio, thickness, marker_depth, relative_thickness)
    presses = _presses(logs, known_forces(logs, known_force), marker_depth, noise, uneven)
    if young_modulus is None and all(math.isnan(press.force) for press in presses.each):
        raise InvalidInput("known_force", "none", "at least one, a gripper's in a log, or a given young_modulus")
    search = _GelSearch.begun(presses, young_modulus, given)
    search.climb()
    search.look_around()
    return _calibration(search)


def _checked(
    young: float | None,
    ratio: float | None,
    thickness: float | None,
    depth: float,
    uneven: Sequence[Sequence[float]] | None,
) -> tuple[Elasticity, ThicknessMap | None]:
    """The given elasticity, NaN where none is given, and the map; raises ``InvalidInput`` for what no gel has."""
    usual = GEL_CALIBRATION.first_ratio if ratio is None else ratio
    if thickness is None:  # thicker than any marker is deep, and finite where a map says what part of it
        thickness_tried = math.inf if uneven is None else GEL.marker_depth / GEL.relative_thickness[0]
    else:
        thickness_tried = thickness
    gel = Gel(1e6 if young is None else young, usual, thickness_tried, depth, uneven)  # type: ignore[arg-type]
    closeness = math.nan if thickness is None else 1.0 / gel.thickness
    return Elasticity(math.nan if ratio is None else gel.poisson_ratio, closeness), gel.relative_thickness


def _presses(
    logs: Sequence[GraspLog],
    forces: list[float | None],
    marker_depth: float,
    noise: float | None,
    uneven: ThicknessMap | None,
) -> Presses:
    """What the logs' holds show."""
    first = logs[0]
    for log in logs:
        if not np.array_equal(log.position, first.position) or log.element_area != first.element_area:
            raise InvalidInput("logs", "of several lattices", "one sensor at a time")
        if not log.sees_along_surface:
            raise InvalidInput("logs", "of displacement along the normal alone", "markers along the surface, too")
    position, nodes = _lattice(first)
    recordings = [DisplacementData.of(log, noise) for log in logs]
    axes = min((recording.axes for recording in recordings), key=len)
    known = [_known(*pair) for pair in zip(logs, forces, strict=True)]
    each = tuple(_held(*pair, len(axes) * len(position)) for pair in zip(recordings, known, strict=True))
    return Presses(position, marker_depth, axes, nodes, each, first.position, uneven)


def _lattice(log: GraspLog) -> tuple[FloatArray, Nodes]:
    """Markers [j, 2] m and the nodes about them."""
    position = log.position[..., :2].reshape(-1, 2)
    nodes = Nodes.around(position, log.element_area)
    side = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    if len(position) < 2 or side[-1] < nodes.grid.pitch[0]:
        raise InvalidInput("position", "markers on a line", "markers over an area")
    return position, nodes


def _known(log: GraspLog, force: float | None) -> KnownForce:
    """The normal force of a press: the given one, else what the gripper reports."""
    if force is not None:
        return KnownForce.of(np.full(len(log), force), None, len(log))
    if log.gripper_force is None:
        return KnownForce.of(None, None, len(log))
    return KnownForce.of(reported(log.gripper_force), log.gripper_force_deviation, len(log))


def _held(recording: DisplacementData, known: KnownForce, used: int) -> PressData:
    """The mean over the frames that are like the one in which markers moved most, of the first ``used`` data, and that
    of the force where it is known there, whose error lasts.
    """
    touched, strongest = recording.touched(), recording.strongest()
    if not touched.any():
        raise InvalidInput("logs", "one in which nothing touches", "presses that move markers by more than noise")
    data, seen = recording.data[:, :used], recording.seen[:, :used]
    most = np.where(seen[strongest], data[strongest], 0.0)
    change = np.sum(np.where(seen & seen[strongest], data - most, 0.0) ** 2, axis=1)
    allowed = GEL_CALIBRATION.held**2 * (most @ most) + 2.0 * used * recording.noise**2
    frames = touched & (change <= allowed) & (seen == seen[strongest]).all(axis=1)
    mean = data[frames].mean(axis=0)
    spread = error(mean, seen[strongest], recording.noise / math.sqrt(frames.sum()))
    told = frames & known.given[:, 2]
    if not told.any():
        return PressData(mean, spread, math.nan, math.nan)
    force, deviation = known.force[told, 2].mean(), known.deviation[told, 2].mean()
    return PressData(mean, spread, float(force), float(deviation / force))


@dataclass(slots=True, eq=False)
class _GelSearch:
    """Gels on which presses were ``tried``; ``given`` is what is not sought, NaN what is."""

    presses: Presses
    young_modulus: float | None
    given: Elasticity
    tried: list[EvaluatedGel]

    @classmethod
    def begun(cls, presses: Presses, young_modulus: float | None, given: Elasticity) -> "_GelSearch":
        """With thicknesses that are far apart."""
        pitch = presses.nodes.grid.pitch[0]
        usual = Elasticity(GEL_CALIBRATION.first_ratio, 1.0 / (GEL_CALIBRATION.first_thickness * pitch))
        thinnest, least = 1.0 / _thinnest(presses), _least_closeness(presses)
        if math.isnan(given.closeness) and least >= thinnest:
            allowed = f"one that is not too steep at {_thinnest(presses):.2g} m, the least thickness sought"
            raise InvalidInput("relative_thickness", "a map that is too steep", f"{allowed}, or a given thickness")
        usual = usual._replace(closeness=max(usual.closeness, least))
        first = Elasticity(*(b if math.isnan(a) else a for a, b in zip(given, usual, strict=True)))
        near, contacts = first_contacts(presses, first)
        others = [thinnest / GEL_CALIBRATION.factor**k for k in range(GEL_CALIBRATION.thicknesses)]
        others = [each for each in others if each > least]
        tried = [*others, least] if math.isnan(given.closeness) else [given.closeness]
        return cls(
            near,
            young_modulus,
            given,
            [evaluate_gel(near, first._replace(closeness=each), contacts, young_modulus) for each in tried],
        )

    @property
    def free(self) -> list[int]:
        """Which of the two are sought."""
        return [k for k in range(2) if math.isnan(self.given[k])]

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Of what is sought."""
        least, most = _least_closeness(self.presses), 1.0 / _thinnest(self.presses)
        low, high = np.array([[GEL_CALIBRATION.least_ratio, least], [0.5, most]])
        return low[self.free], high[self.free]

    @property
    def model_error(self) -> float:
        """How many times larger than with depth the model's errors are."""
        return 1.0 if len(self.presses.axes) > 2 else GEL_CALIBRATION.in_plane

    @property
    def best(self) -> EvaluatedGel:
        """The most probable gel so far."""
        return max(self.tried, key=_probability)

    def point(self, evaluated: EvaluatedGel) -> FloatArray:
        """What is sought, of a gel."""
        return np.array(evaluated.elasticity)[self.free]

    def at(self, point: ArrayLike, seek: Seek = "nothing") -> float:
        """Log probability of a gel, with the contacts of the best one or what is sought about them."""
        values, (low, high) = list(self.given), self.bounds
        for k, value in zip(self.free, np.clip(point, low, high), strict=True):
            values[k] = float(value)
        found = evaluate_gel(self.presses, Elasticity(*values), self.best.contacts, self.young_modulus, seek)
        self.tried.append(found)
        return found.log_probability

    def climb(self) -> None:
        """Go to the most probable gel (Nelder and Mead), seek its contacts anew, and go on from there."""
        side = GEL_CALIBRATION.simplex
        for _ in range(GEL_CALIBRATION.climbs):
            if self.free:
                self._descend(side)
            self.at(self.point(self.best), "both")
            before, self.tried = max(map(_probability, self.tried[:-1])), [self.best]
            side *= GEL_CALIBRATION.simplex
            if self.best.log_probability - before < GEL_CALIBRATION.close:
                break

    def _descend(self, share: float) -> None:
        (low, high), begin = self.bounds, self.point(self.best)
        side = share * np.maximum(begin, share * (high - low))
        corners = begin + np.diag(np.where(begin + side > high, -side, side))
        options: Any = {
            "initial_simplex": np.concatenate((begin[None], corners)),
            "maxfev": GEL_CALIBRATION.gels,
            "fatol": GEL_CALIBRATION.close,
            "xatol": math.inf,
        }
        search: Any = minimize  # whose types know no method by this name with bounds and a simplex
        search(lambda point: -self.at(point), begin, method="Nelder-Mead", bounds=_pairs(low, high), options=options)

    def look_around(self) -> None:
        """Try gels about the most probable one, as far from it as the probability falls by a little."""
        if not self.free:
            return
        low, high = self.bounds
        steps = np.array([self._step(axis) for axis in np.diag(high - low)])
        centre = self.point(self.best)
        for signs in product((-1.0, 1.0), repeat=len(steps)):
            self.at(centre + steps * signs / math.sqrt(len(steps)), "support")

    def _step(self, axis: FloatArray) -> float:
        """How far along one quantity, whose range is the length of its ``axis``, the probability falls by about
        ``GEL_CALIBRATION.fall``; both ways from the most probable gel.
        """
        share, centre, most = GEL_CALIBRATION.step, self.point(self.best), self.best.log_probability
        for _ in range(GEL_CALIBRATION.rounds):
            fall = most - min(self.at(centre + way * share * axis, "support") for way in (-1.0, 1.0))
            if share == 1.0 or 0.25 * GEL_CALIBRATION.fall < fall < 4.0 * GEL_CALIBRATION.fall:
                break
            share = min(1.0, share * math.sqrt(GEL_CALIBRATION.fall / max(fall, GEL_CALIBRATION.settled)))
        return share * float(axis.sum())


def _pairs(low: FloatArray, high: FloatArray) -> list[tuple[float, float]]:
    return [(float(a), float(b)) for a, b in zip(low, high, strict=True)]


def _probability(evaluated: EvaluatedGel) -> float:
    return evaluated.log_probability


def _thinnest(presses: Presses) -> float:
    """Thickness (m) below which none is sought: of a map, where it is thinnest."""
    thin = presses.marker_depth + GEL_CALIBRATION.thinnest * presses.nodes.grid.pitch[0]
    return thin if presses.relative_thickness is None else thin / min(map(min, presses.relative_thickness))


def _least_closeness(presses: Presses) -> float:
    """One over the thickness (1/m) above which none is sought: 0, or where a map becomes too steep."""
    if presses.relative_thickness is None:
        return 0.0
    steep = thickest(presses.relative_thickness, presses.rest)
    return (1.0 + GEL_CALIBRATION.least_precision) / min(steep, GEL.marker_depth)


def _calibration(search: _GelSearch) -> GelCalibration:
    """What was found, with what the misfit and the model add to the intervals."""
    found, properties = _found(search), (_young_modulus, _poisson_ratio, _thickness)
    estimates = tuple(made(search, found) for made in properties)
    of_presses = search.presses.marker_depth, search.presses.relative_thickness
    gel = Elasticity(*found.values[1:]).gel(math.exp(found.values[0]), *of_presses)
    sizes = np.sqrt(np.diag(found.covariance))
    sign = np.array([1.0, 1.0, -1.0])  # thickness grows as closeness falls
    scale = np.divide(sign, sizes, out=np.zeros(3), where=sizes > 0.0)
    best = search.best
    force = math.exp(best.modulus.logarithm) * best.resultant
    return GelCalibration(gel, estimates, found.covariance * np.outer(scale, scale), force, math.sqrt(best.misfit))


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """``values`` [3] and ``covariance`` of log Young's modulus, Poisson's ratio and one over the thickness; the
    ``posterior`` of those of the last two that were sought.
    """

    values: FloatArray
    covariance: FloatArray
    posterior: BoundedGaussian | None


def _found(search: _GelSearch) -> _Found:
    """The posterior from all gels that are nearly as probable as the best one; a misfit widens it."""
    best = search.best
    values, covariance = np.array([best.modulus.logarithm, *best.elasticity]), np.zeros((3, 3))
    covariance[0, 0] = max(1.0, best.misfit) * best.modulus.deviation**2
    if not search.free:
        return _Found(values, covariance, None)
    points = np.array([search.point(evaluated) for evaluated in search.tried])
    logarithm = np.array([evaluated.log_probability for evaluated in search.tried]) / max(1.0, best.misfit)
    posterior = through(points, logarithm, *search.bounds)
    weight = 1.0 / (1.0 + logarithm.max() - logarithm)
    terms = np.column_stack((np.ones(len(points)), points - posterior.mean))
    moduli = np.array([evaluated.modulus.logarithm for evaluated in search.tried])
    mean, *slope = np.linalg.lstsq(weight[:, None] * terms, weight * moduli, rcond=None)[0]
    rows, first = [k + 1 for k in search.free], posterior.covariance @ slope
    values[rows], values[0] = posterior.mean, mean
    covariance[np.ix_(rows, rows)] = posterior.covariance
    covariance[0, rows] = covariance[rows, 0] = first
    covariance[0, 0] += slope @ first
    return _Found(values, covariance, posterior)


def _young_modulus(search: _GelSearch, found: _Found) -> GelEstimate:
    value = math.exp(found.values[0])
    if search.young_modulus is not None:
        return _given("young_modulus", "Pa", value)
    if _confounded(search, found):
        return GelEstimate("young_modulus", "Pa", value, *GEL.young_modulus, 0.0, PRIORS)
    own = search.model_error * GEL_CALIBRATION.young_modulus_error
    away = _NORMAL * math.hypot(math.sqrt(found.covariance[0, 0]), own)
    return GelEstimate("young_modulus", "Pa", value, value * math.exp(-away), value * math.exp(away), 1.0)


def _poisson_ratio(search: _GelSearch, found: _Found) -> GelEstimate:
    value = float(found.values[1])
    if 0 not in search.free:
        return _given("poisson_ratio", "-", value)
    if _confounded(search, found):
        return GelEstimate("poisson_ratio", "-", value, GEL_CALIBRATION.least_ratio, 0.5, 0.0, PRIORS)
    (low, high), information = _interval(search, found, 0, GEL_CALIBRATION.poisson_ratio_error)
    low, high = max(low, GEL_CALIBRATION.least_ratio), min(high, 0.5)
    return GelEstimate("poisson_ratio", "-", value, low, high, information, _of_the_prior(information))


def _thickness(search: _GelSearch, found: _Found) -> GelEstimate:
    value = 1.0 / float(found.values[2]) if found.values[2] > 0.0 else math.inf
    if 1 not in search.free:
        return _given("thickness", "m", value)
    axis = search.free.index(1)
    (low, high), information = _interval(search, found, axis, GEL_CALIBRATION.thickness_error * float(found.values[2]))
    note = _of_the_prior(information)
    if not note and _may_be_a_half_space(search, found):
        low, note = 0.0, HALF_SPACE
    return GelEstimate("thickness", "m", value, 1.0 / high, 1.0 / low if low > 0.0 else math.inf, information, note)


def _may_be_a_half_space(search: _GelSearch, found: _Found) -> bool:
    if 1 not in search.free or search.presses.relative_thickness is not None:
        return search.given.closeness == 0.0
    assert found.posterior is not None
    return found.posterior.density(search.free.index(1), 0.0) > GEL_CALIBRATION.half_space


def _confounded(search: _GelSearch, found: _Found) -> bool:
    """Whether Young's modulus and Poisson's ratio show only together: in the plane a half-space moves in proportion to
    (1 + ν)(1 − 2ν)/E, and what separates them is the prior of shear.
    """
    return 0 in search.free and len(search.presses.axes) == 2 and _may_be_a_half_space(search, found)


def _interval(search: _GelSearch, found: _Found, axis: int, own: float) -> tuple[tuple[float, float], float]:
    """Of 95 % with the model's ``own`` error, and the share of information that is not the prior's."""
    posterior = found.posterior
    assert posterior is not None
    middle = float(posterior.mean[axis])
    tail = 0.5 - 0.5 * GEL_CALIBRATION.confidence
    ends = [posterior.quantile(axis, share) - middle for share in (tail, 1.0 - tail)]
    model = _NORMAL * search.model_error * own
    low, high = (middle + math.copysign(math.hypot(end, model), end) for end in ends)
    range_of = float(np.subtract(*(bound[axis] for bound in search.bounds)))
    information = 1.0 - 12.0 * float(posterior.covariance[axis, axis]) / range_of**2  # of a range with equal chances
    return (max(low, 0.0), high), max(information, 0.0)


def _given(name: str, unit: str, value: float) -> GelEstimate:
    return GelEstimate(name, unit, value, value, value, 0.0, GIVEN)


def _of_the_prior(information: float) -> str:
    return PRIORS if information < GEL_CALIBRATION.identified else ""
