"""The choice of method: each fault of the data leads to what deals with it, and clean data to least squares."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators.linear.fit_data import gather
from estimators.methods.automatic import choose, force_noise
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def clean(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    return samples(n, seed=seed)


def correlated(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    """Errors shared within an element."""
    data, shared = samples(n, seed=seed), np.random.default_rng([seed, 1]).standard_normal(20)
    return replace(data, friction_coefficient=data.friction_coefficient + 0.015 * shared[data.element])


def heteroscedastic(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    rng = np.random.default_rng([seed, 2])
    f_n = rng.uniform(0.02, 0.1, n)
    return samples(n, seed=seed, normal_force=f_n, noise=rng.standard_normal(n) * f_n / 0.06)


def outliers(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    rng, data = np.random.default_rng([seed, 3]), samples(n, seed=seed)
    low = rng.uniform(0.0, 0.3, n)
    return replace(data, friction_coefficient=np.where(rng.random(n) < 0.08, low, data.friction_coefficient))


def noisy_forces(samples: Make, seed: int, n: int = 400) -> FrictionSamples:
    rng = np.random.default_rng([seed, 4])
    data = samples(n, seed=seed, normal_force=rng.uniform(0.05, 0.15, n))
    f_n, f_t = (f + 8e-3 * rng.standard_normal(n) for f in (data.normal_force, data.tangential_force))
    return replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)


@pytest.mark.parametrize(
    ("spoil", "method", "likelihood"),
    [
        (clean, "ols", None),
        (correlated, "ols", None),
        (outliers, "robust", None),
        (noisy_forces, "bayes", "errors_in_variables"),
    ],
)
def test_each_fault_leads_to_its_method(
    samples: Make, spoil: Callable[..., FrictionSamples], method: str, likelihood: str | None
) -> None:
    choices = [choose(gather(spoil(samples, seed, n=3000))) for seed in range(10)]
    assert sum((choice.method, choice.likelihood) == (method, likelihood) for choice in choices) >= 9


def test_several_grasps_lead_to_grasp_effects_and_the_reason_is_told(samples: Make) -> None:
    model = estimators.fit([samples(60, seed=g) for g in range(6)], method="auto")
    assert model.diagnostics["likelihood"] == "grasp_effects"
    assert model.diagnostics["chosen_because"] == "6 grasps, which may differ from each other"
    alone = estimators.Moments.from_samples(samples(60)).fit("auto")
    assert alone.method == "conjugate"


def test_force_noise_is_found_in_the_residuals(samples: Make) -> None:
    data = gather(noisy_forces(samples, 0, n=20_000))
    noise, bias = force_noise(data, data.raw("a test"))
    assert noise == pytest.approx(8e-3, rel=0.15)
    assert bias > 3.0
    quiet = gather(samples(20_000))
    assert force_noise(quiet, quiet.raw("a test"))[1] == 0.0


@pytest.mark.parametrize("spoil", [clean, correlated, heteroscedastic, outliers])
def test_intervals_cover_whatever_the_fault(
    samples: Make, truth: np.ndarray, spoil: Callable[..., FrictionSamples]
) -> None:
    fits, inside = 20, np.zeros(3)
    for seed in range(fits):
        low, high = estimators.fit(spoil(samples, seed), method="auto").interval(0.95).T
        inside += (low <= truth) & (truth <= high)
    assert (inside >= stats.binom(fits, 0.93).ppf(1e-3)).all()
