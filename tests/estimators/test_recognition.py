"""Recognition: exact likelihoods, calibrated probabilities, and strangers known as such."""

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy import special, stats

import estimators
from benchmarks.estimators import scatter
from estimators import recognise
from estimators.defaults import RECOGNITION
from estimators.linear.fit_data import gather
from estimators.linear.place_errors import error_of_places
from estimators.recognition import (
    LogDensity,
    _belief,
    _integral,
    _known,
    _of_the_population,
    _root,
    _scatter,
    _shared,
    log_predictive,
)
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]

LEVELS = np.linspace(0.25, 0.7, 10)


def library(samples: Make) -> dict[str, estimators.FrictionModel]:
    """Ten materials, neighbours 2.5 scatters apart, each known from 200 samples."""
    return {
        f"m{k}": estimators.fit(
            samples(200, seed=900 + k, coefficients=np.array([level, 2.0, -0.8])), method="conjugate"
        )
        for k, level in enumerate(LEVELS)
    }


@pytest.mark.parametrize(("n", "width", "scale"), [(12, 0.1, 0.03), (12, 1.0, 0.2), (100, 0.0, 0.02)])
def test_log_predictive_is_the_dense_normal_density_summed_over_the_scatter(
    samples: Make, n: int, width: float, scale: float
) -> None:
    data, mean = samples(n), np.array([0.5, 0.0, 0.0])
    x = np.column_stack([np.ones(n), data.tangential_velocity, data.normal_force])
    covariance = width**2 * (np.diag([1.0, 100.0, 10.0]) + 0.1)
    prior = stats.norm(np.log(scale), 0.5)
    shared, away = x @ covariance @ x.T, data.friction_coefficient - x @ mean
    values, vectors = np.linalg.eigh(shared)
    square = (vectors.T @ away) ** 2

    def density(log_sigma: np.ndarray) -> np.ndarray:
        variance = values + np.exp(2.0 * log_sigma[:, None]) + RECOGNITION.least_scatter**2
        return prior.logpdf(log_sigma) - 0.5 * (np.log(variance) + square / variance).sum(axis=1)

    log_sigma = np.linspace(np.log(1e-4), np.log(10.0), 4001)
    wanted = special.logsumexp(density(log_sigma)) + np.log(log_sigma[1] - log_sigma[0])
    triangle = np.linalg.qr(np.column_stack([x, data.friction_coefficient]))[1]
    assert log_predictive(triangle, float(n), mean, covariance, prior.logpdf) == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize("scatter", [_known(0.05, 7.0), _known(1e-5, 3.0), _of_the_population])
def test_what_is_believed_of_the_scatter_sums_to_one(scatter: LogDensity) -> None:
    log_sigma = np.linspace(-200.0, 200.0, 400_001)
    with np.errstate(over="ignore"):
        total = np.exp(scatter(log_sigma)).sum() * (log_sigma[1] - log_sigma[0])
    assert total == pytest.approx(1.0, abs=1e-6)


def test_a_scatter_that_is_known_exactly_leaves_the_dense_normal_density(samples: Make) -> None:
    data = samples(12)
    x = np.column_stack([np.ones(12), data.tangential_velocity, data.normal_force])
    triangle = np.linalg.qr(np.column_stack([x, data.friction_coefficient]))[1]
    mean, covariance, scale = np.array([0.4, 2.0, -0.8]), np.diag([0.01, 1.0, 0.1]), 0.02
    dense = stats.multivariate_normal(x @ mean, scale**2 * np.eye(12) + x @ covariance @ x.T)
    wanted = dense.logpdf(data.friction_coefficient) + 6.0 * np.log(2.0 * np.pi)  # π's part is left out
    found = log_predictive(triangle, 12.0, mean, covariance, _known(scale, np.inf, spread=0.0))
    assert found == pytest.approx(wanted, abs=5e-3)  # a part n²/10⁴ of it is left of the degrees of freedom


@pytest.mark.parametrize("grasps", [100, pytest.param(300, marks=pytest.mark.long)])
def test_ten_materials_are_told_apart_with_calibrated_probabilities(samples: Make, grasps: int) -> None:
    known, right, claimed = library(samples), 0, []
    rng = np.random.default_rng(0)
    for trial in range(grasps):
        k = int(rng.integers(10))
        grasp = samples(
            4 + int(rng.integers(4)), seed=5000 + trial, coefficients=np.array([LEVELS[k], 2.0, -0.8]), scale=0.02
        )
        answer = recognise(grasp, known)
        best = max(answer, key=answer.__getitem__)
        right += best == f"m{k}"
        claimed.append(answer[best])
        assert sum(answer.values()) == pytest.approx(1.0)
    assert right >= 0.9 * grasps
    spread = np.sqrt(np.sum(np.array(claimed) * (1.0 - np.array(claimed))))
    assert abs(right - np.sum(claimed)) < 4.0 * max(spread, 1.5)  # as often right as it says


def test_a_stranger_is_called_unknown_and_an_old_friend_is_not(samples: Make) -> None:
    known = library(samples)
    strange = recognise(samples(60, coefficients=np.array([1.1, 2.0, -0.8])), known)
    assert strange["unknown"] > 0.99
    rough = recognise(samples(60, coefficients=np.array([0.4, 2.0, -0.8]), scale=0.15), known)
    assert rough["unknown"] > 0.5  # the same friction, seven times the scatter: odd, and no proof
    assert recognise(samples(60, coefficients=np.array([0.4, 2.0, -0.8])), known)["unknown"] < 0.01
    assert recognise(samples(60, coefficients=np.array([1.1, 2.0, -0.8])), known, unknown=0.0)["unknown"] == 0.0


@pytest.mark.parametrize("scatter", [0.0, 1e-5, 0.02])
def test_a_quarter_of_the_friction_is_a_stranger_also_to_a_model_of_one_grasp(samples: Make, scatter: float) -> None:
    """However smooth its samples: a stranger's level has nothing to do with how they scatter."""
    learnt = samples(120, coefficients=np.array([0.4, 0.0, 0.0]), scale=scatter)
    known = {"m": estimators.fit(learnt, method="auto")}
    slippery = samples(120, seed=1, coefficients=np.array([0.1, 0.0, 0.0]), scale=0.25 * scatter)
    assert recognise(slippery, known)["unknown"] > 0.9
    again = samples(120, seed=2, coefficients=np.array([0.4, 0.0, 0.0]), scale=scatter)
    assert recognise(again, known)["m"] > 0.99


def test_alike_materials_share_the_probability_as_the_prior_says(samples: Make) -> None:
    model = estimators.fit(samples(500), method="conjugate")
    twins = {"a": model, "b": model}
    even, odd = recognise(samples(30), twins), recognise(samples(30), twins, prior={"a": 3.0, "b": 1.0})
    assert even["a"] == pytest.approx(even["b"])
    assert odd["a"] / odd["b"] == pytest.approx(3.0)


def test_moments_of_a_grasp_do_as_well_and_scatter_between_grasps_is_allowed_for(samples: Make) -> None:
    known = library(samples)
    grasp = samples(30, coefficients=np.array([0.4, 2.0, -0.8]))
    by_samples, by_moments = (recognise(data, known) for data in (grasp, estimators.Moments.from_samples(grasp)))
    assert by_samples == pytest.approx(by_moments, rel=1e-6)
    grasps = [samples(40, seed=g, offset=0.05 * np.random.default_rng(g).standard_normal()) for g in range(12)]
    varied = {"varied": estimators.fit(grasps, method="bayes")}
    shifted = samples(40, seed=99, offset=0.08)
    assert recognise(shifted, varied)["varied"] > 0.5
    assert recognise(shifted, {"rigid": estimators.fit(samples(480), method="conjugate")})["unknown"] > 0.9


def test_elements_of_another_size_are_compared_by_pressure(samples: Make) -> None:
    known = {"m": estimators.fit(samples(300), method="conjugate")}
    grasp = samples(100, seed=5)
    alike = recognise(grasp.at_element_area(4e-6), known)
    assert alike["m"] == pytest.approx(recognise(grasp, known)["m"], abs=0.02)  # "unknown" has spans of its own


@pytest.mark.parametrize(
    "options", [{"materials": {}}, {"unknown": 1.0}, {"prior": {"m": 0.0}}, {"prior": {"other": 1.0}}]
)
def test_what_makes_no_sense_is_refused(samples: Make, options: dict[str, object]) -> None:
    known = {"m": estimators.fit(samples(50), method="conjugate")}
    with pytest.raises(estimators.InvalidSamples, match=next(iter(options))):
        recognise(samples(20), **({"materials": known} | options))
    with pytest.raises(estimators.InvalidSamples, match="materials"):
        recognise(samples(20), {"unknown": known["m"]})


def scattering(levels: tuple[float, ...], grasps: int, seed: int) -> dict[str, list[FrictionSamples]]:
    """Grasps of materials whose friction scatters by 7 % between grasps, and from place to place."""
    rng, kind = np.random.default_rng(seed), scatter.KINDS["grasp and place"]
    return {f"{level:g}": [_times(scatter.grasp(kind, rng), level) for _ in range(grasps)] for level in levels}


def _times(samples: FrictionSamples, level: float) -> FrictionSamples:
    return replace(
        samples,
        friction_coefficient=level * samples.friction_coefficient,
        tangential_force=level * samples.tangential_force,
    )


@pytest.mark.parametrize(("other", "least", "most"), [(1.03, 0.3, 0.8), (1.6, 0.98, 1.0)])
def test_materials_are_told_apart_where_they_differ_by_more_than_grasps_of_one(
    other: float, least: float, most: float
) -> None:
    learnt, new = (scattering((1.0, other), grasps, seed) for grasps, seed in ((6, 1), (8, 2)))
    known = {name: estimators.fit(grasps, method="auto") for name, grasps in learnt.items()}
    told = [recognise(grasp, known, unknown=0.0)[name] for name, grasps in new.items() for grasp in grasps]
    assert least <= np.mean(told) <= most
    assert min(told) > 1e-3  # nobody is sure of what is wrong


def test_few_grasps_leave_it_open_how_far_the_next_one_may_differ() -> None:
    learnt = scattering((1.0,), 2, 3)["1"]
    model = estimators.fit(learnt, method="auto")
    assert model.scales is not None
    sure = replace(model.scales, between_grasps=replace(model.scales.between_grasps, degrees_of_freedom=np.inf))
    far = _times(learnt[0], 1.0 + 8.0 * model.scales.between_grasps.value)
    by_two, by_many = (recognise(far, {"m": each})["m"] for each in (model, replace(model, scales=sure)))
    assert by_two > by_many


@pytest.mark.parametrize(("within", "least", "most"), [(0.015, 0.0, 0.01), (0.06, 0.0, 0.01), (0.4, 0.3, 1.0)])
def test_a_grasp_with_other_noise_is_no_stranger_until_it_is_far_rougher(
    within: float, least: float, most: float
) -> None:
    learnt, new = (scatter.grasp(scatter.Kind(within=part), np.random.default_rng(4)) for part in (0.03, within))
    known = {"m": estimators.fit(learnt, method="auto")}
    assert recognise(learnt, known)["m"] > 0.99
    assert least <= recognise(new, known)["unknown"] <= most


def test_what_places_shift_is_what_least_squares_scatters_by() -> None:
    rng = np.random.default_rng(0)
    grasp = scatter.grasp(scatter.Kind(within=0.0), rng)
    x = np.column_stack([np.ones(len(grasp)), grasp.tangential_velocity, grasp.normal_force])
    shifts = rng.standard_normal((grasp.element.max() + 1, 4000))[grasp.element]
    found = np.linalg.lstsq(x, shifts, rcond=None)[0]
    expected = error_of_places(gather(grasp))
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(np.cov(found) / np.outer(size, size), expected / np.outer(size, size), atol=0.08)
    moments = error_of_places(gather(estimators.Moments.from_samples(grasp)))
    np.testing.assert_allclose(moments, expected, rtol=1e-6)


def test_places_shift_nothing_along_what_samples_do_not_tell() -> None:
    grasp = scatter.grasp(scatter.Kind(), np.random.default_rng(0))
    still = error_of_places(gather(replace(grasp, tangential_velocity=np.zeros(len(grasp)))))
    assert not still[1].any()
    assert 0.0 < still[0, 0] < 1.0


def test_an_integral_closes_in_on_what_matters() -> None:
    """Of a normal density a thousandth as wide as the range, and its height."""
    found = _integral(lambda x: 3.0 - 0.5 * ((x - 0.3) / 1e-2) ** 2, np.array(-5.0), np.array(5.0))
    assert found == pytest.approx(3.0 + np.log(1e-2 * np.sqrt(2.0 * np.pi)), abs=1e-6)


def test_the_root_of_a_covariance_may_be_singular_and_of_any_units() -> None:
    turned = np.array([1e-3, 1e4, 0.0])
    covariance = np.outer(turned, turned) + np.diag([1e-6, 0.0, 0.0])
    root = _root(covariance)
    np.testing.assert_allclose(root @ root.T, covariance, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(_root(np.stack([covariance, 4.0 * covariance]))[1], 2.0 * root, rtol=1e-12)


def test_a_prior_is_relative_and_of_each_material() -> None:
    materials = dict.fromkeys("ab", cast("estimators.FrictionModel", None))
    assert _belief(materials, {"a": 3.0, "b": 1.0}) == pytest.approx({"a": np.log(0.75), "b": np.log(0.25)})
    assert _belief(materials, None) == pytest.approx({"a": np.log(0.5), "b": np.log(0.5)})
    for wrong in ({"a": 1.0}, {"a": 1.0, "b": 0.0}, {"a": 1.0, "b": 1.0, "c": 1.0}):
        with pytest.raises(estimators.InvalidSamples, match="prior"):
            _belief(materials, wrong)


def test_the_scatter_of_a_sample_is_that_of_places_and_within_together(samples: Make) -> None:
    """3² + 4² on 9 and 16 degrees of freedom: 25²/(3⁴/9 + 4⁴/16)."""
    model = estimators.fit(samples(50))
    assert _scatter(model) == (model.scale, model.scatter_degrees_of_freedom)
    scales = estimators.Scales(*(estimators.Scale(*each) for each in ((7.0, 3.0), (3.0, 9.0), (4.0, 16.0))))
    assert _scatter(replace(model, scales=scales)) == (5.0, pytest.approx(625.0 / 25.0))
    none = estimators.Scale(0.0, 5.0)
    assert _scatter(replace(model, scales=replace(scales, between_places=none, within=none))) == (0.0, 50.0)


def test_a_grasps_law_is_off_by_coefficients_places_and_whole_grasps(samples: Make) -> None:
    """With scales on endless degrees of freedom one covariance; on few, quantiles of equal probability."""
    data, places = gather(samples(50)), np.diag([1.0, 2.0, 3.0])
    model = replace(estimators.fit(samples(50)), coefficients=np.array([0.5, 2.0, -1.0]), covariance=np.eye(3))
    np.testing.assert_array_equal(_shared(data, places, model), [np.eye(3)])
    tau, omega = estimators.Scale(0.1, np.inf), estimators.Scale(0.2, 5.0)
    known = replace(model, scales=estimators.Scales(tau, omega, omega))
    law = np.outer(model.coefficients, model.coefficients)
    np.testing.assert_allclose(_shared(data, places, known), [np.eye(3) + 0.04 * places + 0.01 * law], rtol=1e-12)
    open_ = replace(model, scales=estimators.Scales(replace(tau, degrees_of_freedom=8.0), omega, omega))
    ratio = (_shared(data, places, open_) - np.eye(3) - 0.04 * places)[:, 0, 0] / (0.01 * 0.25)
    shares = (np.arange(RECOGNITION.nodes) + 0.5) / RECOGNITION.nodes
    np.testing.assert_allclose(np.sort(ratio), np.sort(8.0 / stats.chi2(8.0).isf(shares)), rtol=1e-9)
