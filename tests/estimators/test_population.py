"""What other materials tell of the scatter between grasps of one, and what a fit makes of it."""

from collections.abc import Sequence
from dataclasses import astuple, replace

import numpy as np
import pytest

import estimators
from estimators import FrictionModel, Scale, ScatterPrior, population, population_scatter
from estimators.defaults import POPULATION, PRIOR
from slipcore.samples import FrictionSamples

WEAK = ScatterPrior()
LAW = np.array([0.45, 8.0, -0.8])


def grasp(seed: int, tau: float = 0.04) -> FrictionSamples:
    """Eight places, five samples each."""
    rng = np.random.default_rng([seed, 23])
    place = np.repeat(np.arange(8), 5)
    v, f_n = rng.uniform(1e-4, 5e-3, 40), rng.uniform(0.05, 0.2, 8)[place]
    law = (LAW @ [np.ones(40), v, f_n]) * (1.0 + tau * rng.standard_normal())
    mu = law + 0.02 * rng.standard_normal(8)[place] + 0.03 * rng.standard_normal(40)
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(40) * 0.01, place, np.ones(40), 1e-6)


@pytest.fixture(scope="module")
def model() -> FrictionModel:
    return estimators.fit([grasp(seed) for seed in range(6)], method="hierarchical")


def others(model: FrictionModel, values: Sequence[float], freedom: float = 12.0) -> list[FrictionModel]:
    """Models of six grasps each with these scales between them."""
    assert model.scales is not None
    scales = [replace(model.scales, between_grasps=Scale(value, freedom)) for value in values]
    return [replace(model, scales=each) for each in scales]


def test_without_other_materials_the_prior_is_the_default() -> None:
    assert population_scatter([]) == WEAK
    assert (WEAK.scale, WEAK.degrees_of_freedom) == (PRIOR.grasp_scatter, PRIOR.grasp_degrees_of_freedom)
    plain, given = (
        estimators.fit(grasp(0), method="hierarchical", **options) for options in ({}, {"scatter_prior": WEAK})
    )
    np.testing.assert_array_equal(plain.covariance, given.covariance)
    assert dict(plain.diagnostics) == dict(given.diagnostics)
    assert "the default" in str(plain.diagnostics["prior"])


def test_a_model_of_three_grasps_or_without_scales_does_not_count(model: FrictionModel) -> None:
    few = replace(model, diagnostics={**model.diagnostics, "clusters": 3.0})
    elements = replace(model, diagnostics={**model.diagnostics, "cluster_kind": "element"})
    assert population_scatter([few, elements, replace(model, scales=None)]) == WEAK
    assert population_scatter([model]).materials == 1


def test_of_known_scatter_the_prior_is_the_closed_form(model: FrictionModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """A² stays scaled inverse-χ², on the default's degrees of freedom and one for each material."""
    monkeypatch.setattr(population, "POPULATION", replace(POPULATION, outlier_share=1e-9))
    tau = np.array([0.02, 0.05, 0.03, 0.08, 0.04])
    prior = population_scatter(others(model, tau.tolist(), 1e4))
    freedom = WEAK.degrees_of_freedom + len(tau)
    scale = np.sqrt((WEAK.degrees_of_freedom * WEAK.scale**2 + tau @ tau) / freedom)
    np.testing.assert_allclose((prior.scale, prior.degrees_of_freedom), (scale, freedom), rtol=0.01)


def test_the_more_materials_agree_the_sharper_the_prior(model: FrictionModel) -> None:
    """Friction that is told after one grasp then rises, and the force that it asks for falls."""
    priors = [population_scatter(others(model, [0.03] * count)) for count in (0, 1, 3, 10, 30)]
    scales = [prior.scale for prior in priors]
    assert (np.diff(scales) < 0.0).all()
    assert 0.9 < scales[1] / scales[0] < 1.0, "one material hardly changes it"
    told = [
        estimators.fit(grasp(0), method="hierarchical", scatter_prior=prior).predict(
            1e-3, 0.12, 0.01, of="contact", elements=60
        )
        for prior in priors
    ]
    assert (np.diff(told) > 0.0).all()


def test_materials_that_scatter_more_widen_the_prior(model: FrictionModel) -> None:
    assert population_scatter(others(model, [0.15] * 10)).scale > 1.5 * WEAK.scale


def test_one_odd_material_decides_nothing(model: FrictionModel) -> None:
    values = [0.03] * 10
    alone = population_scatter(others(model, values))
    for odd in (1e-4, 1.0):
        prior = population_scatter(others(model, [*values, odd]))
        assert prior.scale == pytest.approx(alone.scale, rel=0.15)
        assert prior.degrees_of_freedom <= 1.15 * alone.degrees_of_freedom
        first = population_scatter(others(model, [odd]))
        assert first.scale == pytest.approx(WEAK.scale, rel=0.15)
        assert first.degrees_of_freedom <= 9.0


def test_the_order_of_the_materials_has_no_effect(model: FrictionModel) -> None:
    known = others(model, [0.02, 0.09, 0.05, 0.03])
    assert population_scatter(known) == population_scatter(known[::-1])


def test_units_of_force_have_no_effect() -> None:
    prior = ScatterPrior(0.04, 12.0, 5)
    grasps = [grasp(seed) for seed in range(4)]
    models = [
        estimators.fit(
            [part.at_element_area(unit * 1e-6) for part in grasps], method="hierarchical", scatter_prior=prior
        )
        for unit in (1.0, 1e6)
    ]
    first, second = (population_scatter([each]) for each in models)
    np.testing.assert_allclose(
        (first.scale, first.degrees_of_freedom), (second.scale, second.degrees_of_freedom), rtol=1e-4
    )


def test_a_borrowed_prior_is_taken_out_before_a_model_tells_others(model: FrictionModel) -> None:
    """Else materials would tell one another again what they had from one another."""
    grasps = [grasp(seed) for seed in range(6)]
    lent = estimators.fit(grasps, method="hierarchical", scatter_prior=ScatterPrior(0.03, 15.0, 8))
    assert lent.scales is not None
    assert model.scales is not None
    assert lent.scales.between_grasps.value < 0.95 * model.scales.between_grasps.value
    alone = population.told_scale(lent)
    assert alone is not None
    np.testing.assert_allclose(astuple(alone), astuple(model.scales.between_grasps), rtol=0.03)
    assert "half-Student-t on 15 degrees of freedom with scale 0.03, from 8 other materials" in str(
        lent.diagnostics["prior"]
    )
    assert "expected from 8 other materials" in str(lent.diagnostics["scatter_prior"])


def test_sampling_finds_the_same_as_the_grid() -> None:
    grasps, prior = [grasp(seed) for seed in range(3)], ScatterPrior(0.03, 15.0, 8)
    grid, sampled = (estimators.fit(grasps, method=method, scatter_prior=prior) for method in ("hierarchical", "bayes"))
    assert grid.scales is not None
    assert sampled.scales is not None
    assert sampled.scales.between_grasps.value == pytest.approx(grid.scales.between_grasps.value, rel=0.05)
    assert sampled.diagnostics["scatter_prior"] == grid.diagnostics["scatter_prior"]
    assert sampled.diagnostics["prior"] == grid.diagnostics["prior"]


@pytest.mark.parametrize("options", [{"method": "ols"}, {"method": "bayes", "likelihood": "student_t"}])
def test_a_method_without_such_a_prior_takes_none(options: dict[str, str]) -> None:
    with pytest.raises(estimators.InvalidSamples, match="scatter_prior"):
        estimators.fit(grasp(0), scatter_prior=WEAK, **options)


@pytest.mark.parametrize(
    "values", [(0.0, 7.0), (np.nan, 7.0), (np.inf, 7.0), (0.07, 0.5), (0.07, np.inf), (0.07, 7.0, -1)]
)
def test_a_prior_that_cannot_be_is_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(estimators.InvalidSamples, match="prior of scatter"):
        ScatterPrior(*values)


@pytest.mark.parametrize("scale", [Scale(0.0, 1e4), Scale(1e-9, 1.0), Scale(3.0, 1.0), Scale(0.05, np.inf)])
def test_extremes_of_what_a_material_tells_give_a_prior(model: FrictionModel, scale: Scale) -> None:
    assert model.scales is not None
    prior = population_scatter([replace(model, scales=replace(model.scales, between_grasps=scale))] * 3)
    assert 0.01 < prior.scale < 1.0
    assert 1.0 <= prior.degrees_of_freedom < 30.0


def test_a_material_is_none_of_the_population_by_the_ratio_of_both_densities() -> None:
    """Of a τ that is known to be A: log-uniform over all scales, against half-normal of scale A."""
    known = np.zeros(len(population.SIZES))
    known[40] = 1.0
    member, outlier = population._ratios(Scale(population.SIZES[40], 1e9), known)
    assert member[40] == pytest.approx(1.0, rel=1e-12)
    log_uniform = 1.0 / np.log(POPULATION.most / POPULATION.least)
    half_normal = 2.0 * np.exp(-0.5) / np.sqrt(2.0 * np.pi)
    assert outlier == pytest.approx(log_uniform / half_normal, rel=0.01)
