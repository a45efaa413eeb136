"""The posterior of a model's parameters, as the numbers that pictures of it are drawn from.

Of a stored model the coefficients follow a Student-t distribution, and ν s²/σ² a χ² distribution: its intervals are of
these, too.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from db.records import StoredModel
from service.domain.models.stored_results import to_friction_model
from service.web.charts import BOTTOM, LEFT, RIGHT, TOP, WIDTH, Axis, Tick, points

FloatArray = NDArray[np.float64]

HEIGHT = 200.0
"""Of a density's picture, in units of the SVG."""

POINTS = 81
"""At which a curve is computed."""

SHOWN, INTERVAL = 0.995, 0.95
"""Of a density's probability, between the ends of its axis and in its darker part."""

ELLIPSES = (0.5, 0.95)
"""Probability inside of each."""

LABELS = ("β₀", "β₁, s/m", "β₂, 1/N")
PAIRS = ((0, 2), (0, 1))
"""Which coefficients are shown together: friction at rest and without load with each slope."""

X_TICKS = 5


@dataclass(frozen=True, slots=True)
class Density:
    """A parameter's density as a line, and the part of it in the 95 % interval; ``zero``: where 0 stands, if in sight.

    ``is_told``: whether the data determine it.
    """

    label: str
    line: str
    inside: str
    zero: float | None
    x_ticks: Sequence[Tick]
    is_told: bool

    y_ticks: Sequence[Tick] = ()
    width, height, left, right, top, bottom = WIDTH, HEIGHT, LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM


@dataclass(frozen=True, slots=True)
class Pair:
    """Two coefficients together: ellipses with half and with 95 % of the probability in them."""

    x_label: str
    y_label: str
    ellipses: Sequence[str]
    middle: tuple[float, float]
    correlation: float
    x_ticks: Sequence[Tick]
    y_ticks: Sequence[Tick]

    width, height, left, right, top, bottom = WIDTH, 300.0, LEFT, WIDTH - RIGHT, TOP, 300.0 - BOTTOM


def densities(stored: StoredModel) -> list[Density]:
    """Of each coefficient and of σ; none of a parameter that is known without doubt, or by nothing but a bound."""
    model = to_friction_model(stored.model)
    found = []
    for k, (low, high) in enumerate(model.interval(SHOWN).tolist()):
        if 0.0 < high - low < math.inf:
            x = np.linspace(low, high, POINTS)
            z = (x - model.coefficients[k]) / model.standard_errors[k]
            log = _log_student(z, model.degrees_of_freedom)
            inside = model.interval(INTERVAL)[k].tolist()
            found.append(_density(LABELS[k], x, log, inside, is_told=bool(model.identifiable[k])))
    low, high = model.scale_interval(SHOWN)
    if 0.0 < high - low < math.inf:
        sigma = np.linspace(low, high, POINTS)
        log = _log_scale(sigma / model.scale, model.scatter_degrees_of_freedom)
        found.append(_density("σ", sigma, log, model.scale_interval(INTERVAL), is_told=True))
    return found


def pairs(stored: StoredModel) -> list[Pair]:
    """Each of ``PAIRS`` of which both are uncertain, by more than the last digit of their numbers."""
    model = to_friction_model(stored.model)
    radius = [_radius(level, model.degrees_of_freedom) for level in ELLIPSES]
    is_uncertain = model.coefficients + model.standard_errors > model.coefficients
    chosen = (list(pair) for pair in PAIRS)
    return [
        _pair(pair, model.coefficients[pair], model.covariance[np.ix_(pair, pair)], radius)
        for pair in chosen
        if is_uncertain[pair].all()
    ]


def _log_student(z: FloatArray, freedom: float) -> FloatArray:
    """Log density of Student's t, but for a constant."""
    return -0.5 * z**2 if math.isinf(freedom) else -0.5 * (freedom + 1.0) * np.log1p(z**2 / freedom)


def _log_scale(ratio: FloatArray, freedom: float) -> FloatArray:
    """Log density of σ/s where ν s²/σ² follows χ² with ν degrees of freedom, but for a constant."""
    return np.asarray(-(freedom + 1.0) * np.log(ratio) - 0.5 * freedom / ratio**2)


def _density(label: str, x: FloatArray, log: FloatArray, ends: Sequence[float], *, is_told: bool) -> Density:
    across = Axis(float(x[0]), float(x[-1]), LEFT, WIDTH - RIGHT)
    up = Axis(0.0, 1.0, HEIGHT - BOTTOM, TOP)
    height = np.exp(log - log.max())
    inside = np.linspace(ends[0], ends[1], POINTS)
    under = np.interp(inside, x, height)
    closed = np.concatenate([inside, inside[::-1]]), np.concatenate([under, np.zeros(POINTS)])
    return Density(
        label=label,
        line=points(across, up, x.tolist(), height.tolist()),
        inside=points(across, up, *(part.tolist() for part in closed)),
        zero=across.place(0.0) if x[0] < 0.0 < x[-1] else None,
        x_ticks=across.ticks(X_TICKS),
        is_told=is_told,
    )


def _radius(level: float, freedom: float) -> float:
    """Of the circle that holds this probability of two Student-t variables, uncorrelated and of scale 1."""
    if math.isinf(freedom):
        return math.sqrt(-2.0 * math.log1p(-level))
    return math.sqrt(freedom * math.expm1(-2.0 / freedom * math.log1p(-level)))


def _pair(pair: Sequence[int], mean: FloatArray, covariance: FloatArray, radius: Sequence[float]) -> Pair:
    spread = np.sqrt(np.diag(covariance))
    correlation = float(np.clip(covariance[0, 1] / spread.prod(), -1.0, 1.0))
    angle = np.linspace(0.0, 2.0 * np.pi, POINTS)
    tilted = correlation * np.cos(angle) + math.sqrt(1.0 - correlation**2) * np.sin(angle)
    circle = np.stack([np.cos(angle), tilted])
    low, high = (mean + sign * 1.1 * max(radius) * spread for sign in (-1.0, 1.0))
    across = Axis(float(low[0]), float(high[0]), LEFT, WIDTH - RIGHT)
    up = Axis(float(low[1]), float(high[1]), Pair.bottom, TOP)
    drawn = [mean[:, None] + size * spread[:, None] * circle for size in radius]
    return Pair(
        x_label=LABELS[pair[0]],
        y_label=LABELS[pair[1]],
        ellipses=[points(across, up, *ellipse.tolist()) for ellipse in drawn],
        middle=(across.place(float(mean[0])), up.place(float(mean[1]))),
        correlation=correlation,
        x_ticks=across.ticks(X_TICKS),
        y_ticks=up.ticks(),
    )
