"""What every method reports of its data and of what it found, in one form."""

import math
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.defaults import IDENTIFIABILITY, REFERENCE
from estimators.friction_model import Cost, FrictionModel, Scales
from estimators.likelihoods.posterior import PosteriorSummary
from estimators.linear.assumed_slope import AssumedSlope
from estimators.linear.fit_data import FitData, GraspData
from estimators.linear.least_squares import LinearFit, solve
from estimators.linear.mixture_summary import scatter_alone
from estimators.linear.normal_mixture import mixture_quantile
from estimators.linear.posterior_grid import ScaleNodes
from estimators.linear.priors import ScatterPrior
from estimators.linear.sensor_gains import Gains
from estimators.linear.statistics import SufficientStatistics
from estimators.methods.identifiability import effects, identifiable, takes_as_independent, what_to_record
from estimators.methods.unknown_velocity import in_words, slope_inflation, widened
from stiction_client.support import (
    ASSUMED_CHANGE,
    ELEMENT_AREAS,
    ONE_RECORD,
    ONLY_SENSOR,
    SENSOR_GAIN,
    SLOWEST_SLIP,
)

FloatArray = NDArray[np.float64]
Diagnostics = dict[str, float | str]

ALONE = "scale_between_grasps_alone"
"""Diagnostic: the scale between grasps by the default prior, where the model was fitted by another."""


def by_coefficient(name: str, values: FloatArray) -> Diagnostics:
    """One diagnostic a coefficient, under names that JSON can carry."""
    return {f"{name}_beta{k}": float(value) for k, value in enumerate(values)}


def pooled_prior(nodes: ScaleNodes, scatter_prior: ScatterPrior) -> Diagnostics:
    """Of a prior of τ that is not the default: where it is from, in a sentence, and what the data say without it."""
    if scatter_prior == ScatterPrior():
        return {}
    alone = scatter_alone(nodes, scatter_prior)
    count = scatter_prior.materials
    origin = f"{count} other material{'s' * (count > 1)}" if count else "the prior that was given"
    return {
        "scatter_prior": f"how much its grasps differ is expected from {origin}, as far as they do not show it",
        ALONE: alone.value,
        f"{ALONE}_degrees_of_freedom": alone.degrees_of_freedom,
    }


def slope_assumed(slope: AssumedSlope | None) -> Diagnostics:
    """Where data do not show how friction changes with velocity: below which speed, and what is assumed of it."""
    if slope is None:
        return {}
    most = special.ndtri(IDENTIFIABILITY.ends[1]) * slope.change
    return {
        SLOWEST_SLIP: slope.slowest,
        ASSUMED_CHANGE: "its samples do not show how friction changes with velocity: between rest and the "
        f"{slope.speed:.4g} m/s at which they slid on average it is assumed to change by at most ± {most:.0%} (95 %); "
        "record slip at other speeds, best slower",
    }


def element_areas(samples: GraspData) -> Diagnostics:
    """Of grasps whose elements differ in their area: in a sentence, of which element the model's forces are."""
    parts = samples if isinstance(samples, Sequence) else [samples]
    least, most = (f"{1e6 * choose(part.element_area for part in parts):.3g}" for choose in (min, max))
    if least == most:
        return {}
    areas = f"its grasps are by elements of {least} to {most} mm²"
    return {ELEMENT_AREAS: f"{areas}: normal forces are those of one of {least} mm², unless its area is given"}


def areas_of_sensors(samples: GraspData) -> dict[str, float]:
    """The element area of each sensor, m²: the smallest, where its grasps have several."""
    areas: dict[str, float] = {}
    for part in samples if isinstance(samples, Sequence) else [samples]:
        named = [grasp.sensor for grasp in part.grasps] if isinstance(part, SufficientStatistics) else [part.sensor]
        for name in named:
            areas[name] = min(areas.get(name, math.inf), part.element_area)
    return areas


def only_sensor(samples: GraspData) -> Diagnostics:
    """The name of the sensor that all grasps are of, where there is one."""
    names = [*areas_of_sensors(samples)]
    return {ONLY_SENSOR: names[0]} if len(names) == 1 and names[0] else {}


def sensor_gain(nodes: ScaleNodes) -> Diagnostics:
    """Of grasps of several sensors: in a sentence, whether they separate its gain from scatter."""
    if nodes.gains is None:
        return {}
    compared = _compared(nodes.weight, nodes.gains)
    mean, covariance = nodes.gains.moments(nodes.weight, compared)
    own = np.diag(covariance)
    variance = np.maximum(own[:, None] + own - 2.0 * covariance, np.finfo(float).tiny)
    apart = np.abs(mean[:, None] - mean) / np.sqrt(variance)
    first, second = (compared[place] for place in np.unravel_index(int(np.argmax(apart)), apart.shape))
    low, high = _difference(nodes.weight, nodes.gains, first, second)
    names = nodes.gains.names[first], nodes.gains.names[second]
    if low * high > 0.0:
        more, less = names if low > 0.0 else names[::-1]
        least, most = sorted((abs(low), abs(high)))
        return {
            SENSOR_GAIN: f"sensor {more!r} shows {least:.1%} to {most:.1%} more friction than {less!r}: calibrate them "
            "against each other, or ask for friction of the one that grasps"
        }
    first, second = (compared[place] for place in np.unravel_index(int(np.argmax(variance)), variance.shape))
    low, high = _difference(nodes.weight, nodes.gains, first, second)
    most = max(-low, high)
    if most <= IDENTIFIABILITY.effect:
        return {SENSOR_GAIN: f"its {len(nodes.gains.names)} sensors agree to within {most:.1%} of friction"}
    return {
        SENSOR_GAIN: "a sensor's own gain cannot be separated from scatter between grasps (two of its sensors may "
        f"differ by {most:.0%}): record more grasps with each sensor"
    }


def _compared(weight: FloatArray, gains: Gains) -> list[int]:
    """Places of the sensors whose gains are compared: of many those at either end, and the two that are known least."""
    count, ends = len(gains.names), IDENTIFIABILITY.compared
    if count <= 2 * ends:
        return list(range(count))
    mean, variance = np.array([gains.of(place).moments(weight) for place in range(count)]).T
    order = np.argsort(mean / np.sqrt(variance))
    return sorted({*order[:ends].tolist(), *order[-ends:].tolist(), *np.argsort(variance)[-2:].tolist()})


def _difference(weight: FloatArray, gains: Gains, first: int, second: int) -> tuple[float, float]:
    """The 95 % interval of how much one sensor's gain exceeds another's."""
    mean, variance = gains.difference(first, second)
    deviation = np.sqrt(np.maximum(variance, 0.0))
    low, high = mixture_quantile(weight, mean, deviation, IDENTIFIABILITY.ends)
    return float(low), float(high)


def describe(data: FitData, linear: LinearFit) -> Diagnostics:
    """The data: how many, in how many clusters, and how well they spread over v and f_n."""
    remarks: Diagnostics = {"unknown_velocity": in_words(data)} if data.unknown_velocity > 0.0 else {}
    return remarks | {
        "effective_n": data.effective_n,
        "clusters": float(data.clusters),
        "cluster_kind": data.cluster_kind,
        "condition_number": linear.condition,
        "rank": float(linear.rank + 1),
        "variance_inflation_tangential_velocity": float(linear.inflation[0]),
        "variance_inflation_normal_force": float(linear.inflation[1]),
    }


def report(
    data: FitData,
    method: str,
    found: PosteriorSummary,
    begin: float,
    diagnostics: Diagnostics,
    linear: LinearFit | None = None,
) -> FrictionModel:
    """The friction model, with what its uncertainty does to friction; ``begin``: when the fit began.

    A method that has ``scales`` allows for unknown velocities by itself; the errors of all others are widened here.
    """
    linear = solve(data.factor, REFERENCE.spans(data.element_area)) if linear is None else linear
    if found.scales is None and data.unknown_velocity > 0.0:
        found = widened(found, data, linear)
    if found.scales is not None:
        diagnostics = diagnostics | _scale_diagnostics(found.scales)
    effect = effects(found.covariance, found.degrees_of_freedom, data)
    effect[1] *= slope_inflation(data, linear)
    prior_shift = np.array([float(diagnostics.get(f"prior_sensitivity_beta{k}", 0.0)) for k in range(3)])
    slopes_open = data.of_one_record or takes_as_independent(method, data)
    known = identifiable(effect, prior_shift, slopes_open=slopes_open)
    advice = what_to_record(known, method, data)
    diagnostics = diagnostics | ({ONE_RECORD: advice} if advice else {})
    return FrictionModel(
        method=method,
        coefficients=np.asarray(found.coefficients, dtype=float),
        covariance=found.covariance,
        scale=found.scale,
        n=data.n,
        degrees_of_freedom=found.degrees_of_freedom,
        domain=data.domain,
        identifiable=known,
        element_area=data.element_area,
        diagnostics=describe(data, linear) | by_coefficient("effect", effect) | diagnostics,
        cost=Cost(time.perf_counter() - begin, found.monte_carlo_error),
        draws=found.draws,
        scales=found.scales,
        scatter_degrees_of_freedom=found.scatter_degrees_of_freedom,
    )


def _scale_diagnostics(scales: Scales) -> Diagnostics:
    """Scales as diagnostics, under names that JSON can carry."""
    found: Diagnostics = {}
    for name in ("between_grasps", "between_places", "within"):
        scale = getattr(scales, name)
        found |= {f"scale_{name}": scale.value, f"scale_{name}_degrees_of_freedom": scale.degrees_of_freedom}
    if scales.between_sensors is not None:
        found["scale_between_sensors"] = scales.between_sensors.scale.value
    return found
