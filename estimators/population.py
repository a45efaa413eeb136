"""What other materials say of how much grasps of one differ, before it has grasps of its own (empirical Bayes).

Of a population of scale A, materials have scatter between grasps τ | A ~ half-normal(A). With A² ~ scaled inverse-χ² a
material then has the half-Student-t prior of ``defaults.PRIOR`` where no other is known, and A² would go on being so
were the others' τ known: on ν + n degrees of freedom, with the mean of the default's square and of theirs (Morris,
1983, Journal of the American Statistical Association 78:47; Gelman, 2006, Bayesian Analysis 1:515). What is known of
them is a posterior by that prior, which is taken out again (Hogg, Myers & Bovy, 2010, Astrophysical Journal 725:2166).
Any of them may be none of the population, so that one odd material changes little; so may the next one, which is then
as the default says: that keeps the tails heavy.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import special

from estimators.arguments import check_kind
from estimators.defaults import GRID, POPULATION
from estimators.errors import InvalidSamples
from estimators.friction_model import FrictionModel, Scale
from estimators.linear.normal_mixture import matched_student
from estimators.linear.priors import ScatterPrior
from estimators.methods.reporting import ALONE
from slipcore.arguments import shown

FloatArray = NDArray[np.float64]

__all__ = ["ScatterPrior", "population_scatter"]

SIZES = np.geomspace(POPULATION.least, POPULATION.most, POPULATION.nodes)
"""Scales A of a population."""


def population_scatter(models: Iterable[FrictionModel]) -> ScatterPrior:
    """The prior of scatter between grasps of a new material, by the ``models`` of others like it, one a material.

    Those count that have ``scales`` and were fitted to four grasps or more; without any it is the default. Their
    order does not matter. Raises ``InvalidSamples`` for anything else than models.
    """
    weak = ScatterPrior()
    try:
        given = list(models)
    except TypeError:
        raise InvalidSamples("models", shown(models), "a list of models") from None
    known = [scale for model in given if (scale := told_scale(model)) is not None]
    if not known:
        return weak
    log = -weak.degrees_of_freedom * (np.log(SIZES) + 0.5 * (weak.scale / SIZES) ** 2)
    before = special.softmax(log)
    for scale in sorted(known, key=_key):
        member, outlier = _ratios(scale, before)
        log = log + np.log((1.0 - POPULATION.outlier_share) * member + POPULATION.outlier_share * outlier)
    after = special.softmax(log)
    weight = after + POPULATION.outlier_share * (before - after)
    return ScatterPrior(*matched_student(weight, np.zeros(len(SIZES)), SIZES), materials=len(known))


def told_scale(model: FrictionModel) -> Scale | None:
    """What a model says of its scatter between grasps by the default prior; None of too few grasps."""
    check_kind("models", model, FrictionModel)
    grasps = model.diagnostics.get("clusters") if model.diagnostics.get("cluster_kind") == "grasp" else None
    if model.scales is None or grasps is None or not float(grasps) >= POPULATION.fewest:
        return None
    if ALONE in model.diagnostics:
        value, freedom = (float(model.diagnostics[name]) for name in (ALONE, f"{ALONE}_degrees_of_freedom"))
        return Scale(value, freedom)
    return model.scales.between_grasps


def _key(scale: Scale) -> tuple[float, float]:
    return scale.value, scale.degrees_of_freedom


def _ratios(scale: Scale, before: FloatArray) -> tuple[FloatArray, float]:
    """How much more probable than by the default prior a material's grasps are by each of ``SIZES``, [k], and where it
    is none of the population: τ is then anything, log-uniform over the same range.
    """
    freedom = min(scale.degrees_of_freedom, GRID.most_freedom)
    part = (np.arange(POPULATION.quantiles) + 0.5) / POPULATION.quantiles
    tau = scale.value * np.sqrt(freedom / special.chdtri(freedom, part))
    tau = np.clip(tau, POPULATION.least, POPULATION.most)
    member = np.sqrt(2.0 / np.pi) * np.exp(-0.5 * (tau / SIZES[:, None]) ** 2) / SIZES[:, None]
    outlier = 1.0 / (tau * np.log(POPULATION.most / POPULATION.least))
    default = before @ member
    return np.asarray((member / default).mean(axis=1)), float((outlier / default).mean())
