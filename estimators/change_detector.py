"""Whether single samples still follow a model: a sequential test. ``change_alarm`` tests whole grasps."""

import math
import warnings
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from estimators.arguments import above_zero, between_zero_and_one, check_kind, check_number, check_whole
from estimators.defaults import CHANGE
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel


@dataclass(frozen=True, slots=True)
class ChangeDetector:
    """Whether samples still follow a model, by a two-sided test that may look after every sample.

    Standardised deviations z from the model's prediction are, while nothing changes, as likely above as below and at
    most as spread as a standard normal. For λ > 0, exp(λ Σz − n λ²/2) then is a non-negative martingale of mean 1, and
    so is its mean over λ ~ N(0, ``spread``²): by Ville's inequality the probability that it *ever* exceeds 1/``alarm``
    is at most ``alarm`` (Robbins, 1970; Howard et al., 2021). Samples of one element follow each other closely: give
    one sample an element and correlation time, or the rate of false alarms is not what is stated.

    ``total`` Σz and ``count`` n since the last ``restart``; ``reset_after``: samples after which the sum starts afresh,
    so that a late change is not buried under a long quiet past; the false-alarm rate then holds for each such stretch.
    """

    model: FrictionModel
    alarm: float = CHANGE.alarm
    spread: float = CHANGE.spread
    reset_after: int = CHANGE.reset_after
    total: float = 0.0
    count: int = 0

    def __post_init__(self) -> None:
        check_kind("model", self.model, FrictionModel)
        check_number("alarm", self.alarm, between_zero_and_one, "above 0 and below 1")
        check_number("spread", self.spread, above_zero, "above 0")
        check_whole("reset_after", self.reset_after, 1)

    @property
    def e_value(self) -> float:
        """How many times likelier the deviations are under some constant shift than under none, mixed over λ."""
        precision = 1.0 / self.spread**2 + self.count
        log = 0.5 * self.total**2 / precision - 0.5 * np.log(precision * self.spread**2)
        return float(np.exp(min(log, CHANGE.largest_exponent)))

    @property
    def evidence(self) -> float:
        """The e-value by its former name; deprecated."""
        warnings.warn("ChangeDetector.evidence is now e_value", DeprecationWarning, stacklevel=2)
        return self.e_value

    @property
    def changed(self) -> bool:
        """Whether the e-value has reached 1/``alarm``."""
        return self.e_value >= 1.0 / self.alarm

    def step(self, tangential_velocity: float, normal_force: float, friction_coefficient: float) -> "ChangeDetector":
        """The detector after one more sample; once it has seen a change it stays so until ``restart``."""
        if self.changed:
            return self
        z = self._deviation(tangential_velocity, normal_force, friction_coefficient)
        if self.count >= self.reset_after:
            return replace(self, total=z, count=1)
        return replace(self, total=self.total + z, count=self.count + 1)

    def restart(self, model: FrictionModel) -> "ChangeDetector":
        """A fresh detector for another model, with the same settings."""
        return replace(self, model=model, total=0.0, count=0)

    def _deviation(self, v: float, f_n: float, mu: float) -> float:
        """Normal score of a sample in the model's predictive distribution, which allows for uncertain coefficients."""
        model = self.model
        for name, value in (("tangential_velocity", v), ("normal_force", f_n), ("friction_coefficient", mu)):
            check_number(name, value, math.isfinite, "a finite number")
        x = np.array([1.0, v, f_n])
        spread = float(np.sqrt(model.scale**2 + x @ model.covariance @ x))
        freedom = model.n - 3.0 if model.scatter_degrees_of_freedom is None else model.scatter_degrees_of_freedom
        deviation = (mu - float(x @ model.coefficients)) / max(spread, np.finfo(float).tiny)
        if not np.isfinite(deviation):
            raise InvalidSamples("sample", (v, f_n, mu), "numbers whose deviation from the model is finite")
        score = special.ndtri(special.stdtr(freedom, -abs(deviation)))
        return float(np.copysign(min(-score, CHANGE.farthest), deviation))
