from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import estimators
from estimators.linear.fit_data import gather
from estimators.linear.shared_errors import shared_by_elements
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


def test_errors_shared_within_elements_lead_to_clusters_and_the_share_is_told(samples: Make) -> None:
    shares = []
    for seed in range(10):
        data = gather(places_that_differ(samples, seed))
        assert choose(data).method == "ols"
        shares.append(shared_by_elements(data))
    assert np.mean(shares) == pytest.approx(0.5, abs=4 * np.std(shares) / np.sqrt(10))
    told = estimators.fit(places_that_differ(samples, 0), method="bayes").diagnostics["shared_by_elements"]
    assert told == pytest.approx(shares[0], rel=1e-12)
    moments = [estimators.Moments.from_samples(part) for part in places_that_differ(samples, 0)]
    assert "shared_by_elements" not in estimators.fit(moments, method="bayes").diagnostics
    model = estimators.fit(places_that_differ(samples, 0), method="auto")
    assert model.method == "ols"
    assert str(model.diagnostics["chosen_because"]).startswith("samples of an element share 5")


def test_independent_errors_are_hardly_ever_taken_for_shared_ones(samples: Make) -> None:
    found = [gather([samples(60, seed=10 * k + g) for g in range(6)]) for k in range(40)]
    assert sum(shared_by_elements(e) > 0.0 for e in found) <= 1  # 0.04 expected
    one_each = samples(15, seed=3)
    alone = gather(replace(one_each, element=np.arange(15)))
    assert shared_by_elements(alone) == 0.0


def test_labels_of_elements_may_be_any_whole_numbers(samples: Make) -> None:
    plain = places_that_differ(samples, 0)
    far = [replace(part, element=(part.element.astype(np.int64) - 10) * 2**58) for part in plain]
    assert shared_by_elements(gather(far)) == pytest.approx(shared_by_elements(gather(plain)), rel=1e-12)


@pytest.mark.parametrize("n", [4, 5])
def test_few_samples_are_no_evidence_of_outliers(samples: Make, n: int) -> None:
    assert all(choose(gather(samples(n, seed=seed))).method == "ols" for seed in range(10))


@pytest.mark.parametrize("method", ["ols", "robust", "conjugate", "auto"])
def test_a_likelihood_for_a_method_that_has_none_is_refused(samples: Make, method: str) -> None:
    with pytest.raises(estimators.InvalidSamples, match="student_t"):
        estimators.fit(samples(50), method=method, likelihood="student_t")
