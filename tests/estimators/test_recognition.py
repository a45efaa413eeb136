"""Recognition: exact likelihoods, calibrated probabilities, and strangers known as such."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators import recognise
from estimators.recognition import log_predictive
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


def test_log_predictive_is_the_dense_student_density(samples: Make) -> None:
    data = samples(12)
    x = np.column_stack([np.ones(12), data.tangential_velocity, data.normal_force])
    triangle = np.linalg.qr(np.column_stack([x, data.friction_coefficient]))[1]
    found, wanted = [], []
    for mean, width, scale, freedom in (([0.4, 2.0, -0.8], 0.1, 0.02, 5.0), ([0.5, 0.0, 0.0], 1.0, 0.1, 40.0)):
        covariance = np.diag([width**2, 100.0 * width, width]) + 1e-3
        dense = stats.multivariate_t(x @ mean, scale**2 * np.eye(12) + x @ covariance @ x.T, freedom)
        wanted.append(dense.logpdf(data.friction_coefficient))
        found.append(log_predictive(triangle, 12.0, np.array(mean), covariance, scale, freedom))
    np.testing.assert_allclose(found[0] - found[1], wanted[0] - wanted[1], rtol=1e-8)  # π's part left out of both


def test_ten_materials_are_told_apart_with_calibrated_probabilities(samples: Make) -> None:
    known, right, claimed = library(samples), 0, []
    rng = np.random.default_rng(0)
    for trial in range(300):
        k = int(rng.integers(10))
        grasp = samples(
            4 + int(rng.integers(4)), seed=5000 + trial, coefficients=np.array([LEVELS[k], 2.0, -0.8]), scale=0.02
        )
        answer = recognise(grasp, known)
        best = max(answer, key=answer.__getitem__)
        right += best == f"m{k}"
        claimed.append(answer[best])
        assert sum(answer.values()) == pytest.approx(1.0)
    assert right >= 0.9 * 300
    spread = np.sqrt(np.sum(np.array(claimed) * (1.0 - np.array(claimed))))
    assert abs(right - np.sum(claimed)) < 4.0 * max(spread, 1.5)  # as often right as it says


def test_a_stranger_is_called_unknown_and_an_old_friend_is_not(samples: Make) -> None:
    known = library(samples)
    strange = recognise(samples(60, coefficients=np.array([1.1, 2.0, -0.8])), known)
    assert strange["unknown"] > 0.99
    rough = recognise(samples(60, coefficients=np.array([0.4, 2.0, -0.8]), scale=0.15), known)
    assert rough["unknown"] > 0.99  # the same friction, seven times the scatter
    assert recognise(samples(60, coefficients=np.array([0.4, 2.0, -0.8])), known)["unknown"] < 0.01
    assert recognise(samples(60, coefficients=np.array([1.1, 2.0, -0.8])), known, unknown=0.0)["unknown"] == 0.0


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
