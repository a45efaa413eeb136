"""The one entrance: samples in, friction model out."""

from dataclasses import replace
from types import NoneType

from estimators.arguments import check_choice, check_kind, check_number, check_whole
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel
from estimators.linear.fit_data import FitData, GraspData, gather
from estimators.linear.m_estimate import LOSSES
from estimators.linear.priors import ScatterPrior
from estimators.method_names import METHODS, SCATTER_METHODS
from estimators.methods import conjugate, hierarchical, ols, robust
from estimators.methods.automatic import choose, compared
from estimators.methods.reporting import Diagnostics, areas_of_sensors, element_areas, only_sensor


def needs_samples(method: str, grasps: int) -> bool:
    """Whether a ``method``, by default options, fits so many grasps from less than their samples worse than from them.

    Moments hold exactly what a grasp and its places share. Least squares and the Bayesian default look at the elements
    of a single grasp, which they take from its samples. Raises ``InvalidSamples`` for an unknown method.
    """
    check_method(method)
    check_whole("grasps", grasps, 0)
    return method not in {"conjugate", "hierarchical"} and (grasps < 2 or method not in {"ols", "bayes"})


def check_method(method: str) -> None:
    """Raises ``InvalidSamples`` for a ``method`` that ``fit`` does not have; worth a call before slip is looked for,
    which takes long.
    """
    check_choice("method", method, METHODS)


def fit(
    samples: GraspData,
    method: str = "ols",
    accuracy: float | None = None,
    seconds: float | None = None,
    seed: int = 0,
    likelihood: str | None = None,
    loss: str = "tukey",
    scatter_prior: ScatterPrior | None = None,
) -> FrictionModel:
    """Fit ``μ = β₀ + β₁ v + β₂ f_n + ε`` to the samples of one grasp, or of several given as a sequence.

    Moments may stand for the samples where the method needs no more.

    ``method``: "ols" (weighted least squares, cluster-robust), "robust" (M-estimate with the ``loss`` "tukey" or
    "huber", cluster-robust), "conjugate" (exact posterior for independent Gaussian errors), "hierarchical" (exact
    posterior with scatter between grasps, between places and within, told apart in ``scales``) or "bayes" (emcee),
    whose ``likelihood`` is "hierarchical" (the default wherever samples come in clusters), "gaussian", "student_t",
    "outlier" (a part of false slip) or "errors_in_variables" (noise in the forces). "auto", recommended, takes
    "hierarchical", without what lies far off its place; ``diagnostics["chosen_because"]`` says why, and
    ``diagnostics["check"]`` whether least squares agrees. ``scatter_prior``: how much grasps are thought to differ
    before the samples are seen, by default a weak prior; ``population_scatter`` learns one from other materials. A
    sampled method stops once the Monte-Carlo error of its means and 5/95 % quantiles is under ``accuracy`` posterior
    standard deviations, or after ``seconds``; ``seed`` makes it repeatable.

    Raises ``TooFewSamples`` where no slip or hardly any was seen, ``InvalidSamples`` naming what cannot be used, and
    ``NotConverged``, which carries its model, where a chain cannot be trusted.
    """
    check_method(method)
    for name, value in (("accuracy", accuracy), ("seconds", seconds)):
        if value is not None:
            check_number(name, value, lambda found: found > 0.0, "above 0")
    check_whole("seed", seed, 0)
    check_kind("likelihood", likelihood, str | NoneType)
    check_kind("scatter_prior", scatter_prior, ScatterPrior | NoneType)
    check_choice("loss", loss, LOSSES)
    if likelihood is not None and method != "bayes":
        raise InvalidSamples("likelihood", likelihood, f'none with method "{method}", only with "bayes"')
    if scatter_prior is not None and (method not in SCATTER_METHODS or likelihood not in {None, "hierarchical"}):
        raise InvalidSamples("scatter_prior", scatter_prior, f"none but with {', '.join(SCATTER_METHODS)}")
    scatter_prior = scatter_prior or ScatterPrior()
    data, origin = gather(samples), element_areas(samples) | only_sensor(samples)
    if method != "auto":
        model = _fit(data, method, accuracy, seconds, seed, likelihood, loss, scatter_prior)
        return _with_areas(model, samples, origin)
    choice = choose(data)
    model = hierarchical.fit(choice.data, scatter_prior)
    added = {"chosen_because": choice.reason, "check": compared(model, choice.data), **origin}
    return _with_areas(model, samples, added)


def _with_areas(model: FrictionModel, samples: GraspData, added: Diagnostics) -> FrictionModel:
    """The model with these diagnostics, and with the area of the elements of each sensor that it knows."""
    model = replace(model, diagnostics={**model.diagnostics, **added}) if added else model
    known = None if model.scales is None else model.scales.between_sensors
    if model.scales is None or known is None:
        return model
    own = areas_of_sensors(samples)
    sensors = {name: replace(each, element_area=own.get(name)) for name, each in known.sensors.items()}
    return replace(model, scales=replace(model.scales, between_sensors=replace(known, sensors=sensors)))


def _fit(
    data: FitData,
    method: str,
    accuracy: float | None,
    seconds: float | None,
    seed: int,
    likelihood: str | None,
    loss: str,
    scatter_prior: ScatterPrior,
) -> FrictionModel:
    if method == "ols":
        return ols.fit(data)
    if method == "robust":
        return robust.fit(data, loss, seed)
    if method == "conjugate":
        return conjugate.fit(data)
    if method == "hierarchical":
        return hierarchical.fit(data, scatter_prior)
    from estimators.methods import bayes  # emcee takes a second to load

    return bayes.fit(data, likelihood, accuracy, seconds, seed, scatter_prior)
