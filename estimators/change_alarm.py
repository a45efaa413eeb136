"""Whether a material's surface has changed: new grasps beside those before, looked at after each of them.

The friction of a grasp as a part of what the law expects scatters about one level with τ between grasps and the error
of its own samples. For each grasp after which it may have changed, the evidence is the probability of all levels with a
shift from there on, over that with none; level, shift and τ are integrated out. Were nothing changed, each would be a
martingale of mean 1 from its start, and their sum over all starts grows by 1 a grasp: it reaches 1/``rate`` no sooner
than after 1/``rate`` grasps on average, however often one looks (Shiryaev–Roberts; Shin, Ramdas & Rinaldo, 2024,
"E-detectors", New England Journal of Statistics in Data Science 2:229). Changes of the newest grasp alone are left out
of the sum: what is less reaches no bound sooner, and one odd grasp is no change.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.arguments import above_zero, at_least_zero, between_zero_and_one, check_kind, check_number, check_whole
from estimators.defaults import ALARM, CHANGE
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.grasp_statistics import GraspStatistics
from estimators.linear.log_sum import log_sum
from estimators.linear.priors import WEAK, ScatterPrior

FloatArray = NDArray[np.float64]

TAUS = np.geomspace(ALARM.least_tau, ALARM.most_tau, ALARM.nodes)
"""Scatter between grasps, as a part of friction, over which is summed."""


@dataclass(frozen=True, slots=True)
class ChangeAlarm:
    """Grasps so far: ``levels`` of their friction, as parts of what the law expects, and their ``variances``.

    ``rate``: at most so many false alarms a grasp, on average; ``shift``: standard deviation of a change of friction,
    up or down, as a part of it; ``reference``: grasps before which none can have happened; ``scatter_prior``: what is
    expected of the scatter between grasps.
    """

    rate: float = ALARM.rate
    shift: float = ALARM.shift
    reference: int = ALARM.reference
    levels: tuple[float, ...] = ()
    variances: tuple[float, ...] = ()
    scatter_prior: ScatterPrior = WEAK

    @classmethod
    def init(
        cls,
        rate: float = ALARM.rate,
        shift: float = ALARM.shift,
        reference: int = ALARM.reference,
        scatter_prior: ScatterPrior = WEAK,
    ) -> "ChangeAlarm":
        """An alarm that has seen no grasp; raises ``InvalidSamples`` for settings that cannot be."""
        check_number("rate", rate, between_zero_and_one, "above 0 and below 1")
        check_number("shift", shift, above_zero, "above 0")
        check_whole("reference", reference, 1)
        check_kind("scatter_prior", scatter_prior, ScatterPrior)
        return cls(rate, shift, reference, scatter_prior=scatter_prior)

    def step(self, level: float, variance: float) -> "ChangeAlarm":
        """The alarm after one more grasp; see ``grasp_level``."""
        check_number("level", level, math.isfinite, "finite")
        check_number("variance", variance, at_least_zero, "finite, at least 0")
        levels, variances = (*self.levels, level), (*self.variances, variance)
        return replace(self, levels=levels[-ALARM.longest :], variances=variances[-ALARM.longest :])

    @property
    def e_values(self) -> FloatArray:
        """Evidence [grasps] that friction has changed just before each grasp; 0 for those of the ``reference``, and for
        the newest, by which no change is seen to last.
        """
        count = len(self.levels)
        if count <= self.reference:
            return np.zeros(count)
        log = _log_evidence(np.array(self.levels), np.array(self.variances), self.shift, self.scatter_prior)
        log[: self.reference] = -np.inf
        log[count - ALARM.lasting + 1 :] = -np.inf
        return np.exp(np.minimum(log, CHANGE.largest_exponent))

    @property
    def e_detector(self) -> float:
        """Their sum; were nothing changed, the number of grasps after the reference is its mean."""
        return float(self.e_values.sum())

    @property
    def changed(self) -> bool:
        """Whether the sum has reached 1/``rate``."""
        return self.e_detector >= 1.0 / self.rate

    @property
    def since(self) -> int | None:
        """Index of the first grasp of the changed surface, the likeliest; None while there is no alarm."""
        return int(np.argmax(self.e_values)) if self.changed else None

    @property
    def change(self) -> float:
        """By what part friction differs since then, on average; 0 while there is no alarm."""
        if self.since is None:
            return 0.0
        before, after = np.mean(self.levels[: self.since]), np.mean(self.levels[self.since :])
        return float(after / before - 1.0) if before else 0.0


def noticeable(alarm: ChangeAlarm, grasps: int = ALARM.soon) -> float:
    """The least part by which friction would have to fall for so many ``grasps`` in a row to raise the alarm.

    These are taken to scatter as the last ones do. 1 where no fall would; raises ``InvalidSamples`` without grasps.
    """
    check_kind("alarm", alarm, ChangeAlarm)
    check_whole("grasps", grasps, 1)
    if not alarm.levels:
        raise InvalidSamples("grasps", 0, "at least 1, and one or more before")
    last = np.resize(alarm.levels[-grasps:], grasps)
    coming = last - last.mean() + np.mean(alarm.levels)
    variances = (*alarm.variances, *np.resize(alarm.variances[-grasps:], grasps).tolist())

    def noticed(fall: float) -> bool:
        return replace(alarm, levels=(*alarm.levels, *((1.0 - fall) * coming).tolist()), variances=variances).changed

    missed, found = 0.0, 1.0
    if not noticed(found):
        return found
    while found - missed > ALARM.fall_digits:
        middle = 0.5 * (missed + found)
        missed, found = (missed, middle) if noticed(middle) else (middle, found)
    return found


def grasp_level(model: FrictionModel, grasp: GraspStatistics) -> tuple[float, float]:
    """Friction of a grasp as a part of what the ``model`` expects of its places, and the variance of that part.

    Places are weighted by the scatter between and within them; the law's own error is all grasps' alike.
    """
    places, within = model.scale, 0.0
    if model.scales is not None:
        places, within = model.scales.between_places.value, model.scales.within.value
    largest = float(np.abs(grasp.mean[:, 2]).max())
    least = (ALARM.least_scatter * max(largest, ALARM.least_scatter)) ** 2
    weight = grasp.independent / (places**2 + within**2 / grasp.weight + least)
    expected = model.coefficients[0] + grasp.mean[:, :2] @ model.coefficients[1:]
    information = float(weight @ expected**2)
    if not information > 0.0:
        raise InvalidSamples("friction expected of a grasp", 0.0, "not 0 at all of its places")
    return float(weight @ (expected * grasp.mean[:, 2])) / information, 1.0 / information


def watched(
    model: FrictionModel,
    grasps: Sequence[GraspStatistics],
    rate: float = ALARM.rate,
    scatter_prior: ScatterPrior = WEAK,
) -> ChangeAlarm:
    """The alarm after these grasps, oldest first; ``scatter_prior``: that by which the model was fitted.

    Each is compared with what its sensor shows, so that another sensor's gain passes for no change.
    """
    alarm = ChangeAlarm.init(rate, scatter_prior=scatter_prior)
    levels = [grasp_level(model.of_sensor(grasp.sensor), grasp) for grasp in grasps[-ALARM.longest :]]
    return replace(alarm, levels=tuple(level for level, _ in levels), variances=tuple(error for _, error in levels))


def _log_evidence(level: FloatArray, variance: FloatArray, shift: float, scatter_prior: ScatterPrior) -> FloatArray:
    """Log of p(levels | shifted from grasp j on) over p(levels | not), for each j [n].

    Given τ all is Gaussian: with w = 1/(τ² + s²), flat level m and δ ~ N(0, shift²), sums of w, wy, wy² suffice.
    """
    centred = level - level.mean()
    weight = 1.0 / (TAUS[:, None] ** 2 + variance)
    whole = [(weight * power).sum(axis=1)[:, None] for power in (np.ones_like(centred), centred, centred**2)]
    later = [np.cumsum((weight * power)[:, ::-1], axis=1)[:, ::-1] for power in (np.ones_like(centred), centred)]
    unchanged = 0.5 * (np.log(weight).sum(axis=1)[:, None] - np.log(whole[0]) - whole[2] + whole[1] ** 2 / whole[0])
    # δ given τ: what is left of the later grasps' deviation once the common level is taken away
    information = later[0] * (1.0 - later[0] / whole[0])
    deviation = later[1] - later[0] * whole[1] / whole[0]
    precision = information + shift**-2
    gain = 0.5 * (deviation**2 / precision - np.log(precision * shift**2))
    prior = scatter_prior.log_density(TAUS) + np.log(TAUS)
    null = prior[:, None] + unchanged
    return np.asarray(log_sum(null + gain, axis=0) - log_sum(null))
