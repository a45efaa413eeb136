from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators.defaults import REFERENCE
from estimators.linear.fit_data import gather
from estimators.linear.least_squares import solve
from estimators.linear.shared_errors import plane, shared_by_elements
from estimators.methods.automatic import choose
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def places_that_differ(samples: Make, seed: int, grasps: int = 5, n: int = 300) -> list[FrictionSamples]:
    """Half of the errors' variance goes with the place: element and grasp."""
    parts, rng = [samples(n, seed=10 * seed + g) for g in range(grasps)], np.random.default_rng([seed, 5])
    return [
        replace(part, friction_coefficient=part.friction_coefficient + 0.02 * rng.standard_normal(20)[part.element])
        for part in parts
    ]


def test_errors_shared_within_elements_are_told_where_a_likelihood_ignores_them(samples: Make) -> None:
    shares = []
    for seed in range(10):
        data = gather(places_that_differ(samples, seed))
        shares.append(shared_by_elements(data))
    assert np.mean(shares) == pytest.approx(0.5, abs=4 * np.std(shares) / np.sqrt(10))
    independent = {"method": "bayes", "likelihood": "gaussian"}
    told = estimators.fit(places_that_differ(samples, 0), **independent).diagnostics["shared_by_elements"]
    assert told == pytest.approx(shares[0], rel=1e-12)
    moments = [estimators.Moments.from_samples(part) for part in places_that_differ(samples, 0)]
    assert "shared_by_elements" not in estimators.fit(moments, **independent).diagnostics
    assert "shared_by_elements" not in estimators.fit(places_that_differ(samples, 0), method="bayes").diagnostics


def test_few_samples_a_place_tell_the_same_share(samples: Make) -> None:
    shares = [shared_by_elements(gather(places_that_differ(samples, seed, n=60))) for seed in range(20)]
    assert np.mean(shares) == pytest.approx(0.5, abs=4 * np.std(shares) / np.sqrt(20))
    assert np.std(shares) < 0.1


def test_independent_errors_are_hardly_ever_taken_for_shared_ones(samples: Make) -> None:
    found = [gather([samples(60, seed=10 * k + g) for g in range(6)]) for k in range(40)]
    assert sum(shared_by_elements(e) > 0.0 for e in found) <= 1  # 0.04 expected
    one_each = samples(15, seed=3)
    alone = gather(replace(one_each, element=np.arange(15)))
    assert shared_by_elements(alone) == 0.0


def test_the_plane_of_friction_without_scatter_is_friction(samples: Make) -> None:
    data = gather(samples(50, scale=0.0))
    assert data.observations is not None
    found = plane(solve(data.factor, REFERENCE.spans(data.element_area)), data.observations)
    np.testing.assert_allclose(found, data.observations.friction, rtol=1e-10)


def test_labels_of_elements_may_be_any_whole_numbers(samples: Make) -> None:
    plain = places_that_differ(samples, 0)
    far = [replace(part, element=(part.element.astype(np.int64) - 10) * 2**58) for part in plain]
    assert shared_by_elements(gather(far)) == pytest.approx(shared_by_elements(gather(plain)), rel=1e-12)


@pytest.mark.parametrize("n", [4, 5])
def test_few_samples_show_no_outliers(samples: Make, n: int) -> None:
    assert all(choose(gather(samples(n, seed=seed))).data.n == n for seed in range(10))


@pytest.mark.parametrize("method", ["ols", "robust", "conjugate", "auto"])
def test_a_likelihood_for_a_method_that_has_none_is_refused(samples: Make, method: str) -> None:
    with pytest.raises(estimators.InvalidSamples, match="student_t"):
        estimators.fit(samples(50), method=method, likelihood="student_t")
