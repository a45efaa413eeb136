from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimators import InvalidSamples, Moments, fit, needs_samples
from slipcore.samples import FrictionSamples


@pytest.mark.parametrize("method", ["ols", "conjugate", "bayes"])
def test_grasps_are_fitted_from_their_moments_as_from_their_samples(
    samples: Callable[..., FrictionSamples], method: str
) -> None:
    """To rounding: a chain of the same seed takes the same steps."""
    grasps = [samples(200, seed=seed) for seed in range(6)]
    assert not needs_samples(method, len(grasps))
    stored = [Moments.from_bytes(Moments.from_samples(grasp).to_bytes()) for grasp in grasps]
    whole, merged = fit(grasps, method=method, seed=3), fit(stored, method=method, seed=3)
    spread = np.sqrt(np.diag(whole.covariance))
    np.testing.assert_allclose((merged.coefficients - whole.coefficients) / spread, 0.0, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(
        merged.covariance / np.outer(spread, spread), whole.covariance / np.outer(spread, spread), rtol=0.0, atol=1e-9
    )
    assert merged.scale == pytest.approx(whole.scale, rel=1e-9)
    assert (merged.n, merged.domain, merged.degrees_of_freedom) == (
        whole.n,
        whole.domain,
        pytest.approx(whole.degrees_of_freedom, rel=1e-6),
    )


@pytest.mark.parametrize(
    ("method", "grasps"), [("robust", 5), ("auto", 5), ("ols", 1), ("bayes", 1)], ids=lambda value: str(value)
)
def test_what_looks_at_samples_or_at_elements_of_one_grasp_needs_them(method: str, grasps: int) -> None:
    assert needs_samples(method, grasps)
    assert not needs_samples("conjugate", grasps)


@pytest.mark.parametrize("method", ["ols", "auto"])
def test_a_model_says_of_which_element_forces_are_where_these_differ(
    samples: Callable[..., FrictionSamples], method: str
) -> None:
    grasps = [samples(seed=seed) for seed in range(4)]
    assert fit(grasps, method=method).notes == ()
    mixed = [*grasps[:3], replace(grasps[3], element_area=4e-6)]
    told = "its grasps are by elements of 1 to 4 mm²: normal forces are those of one of 1 mm², unless its area is given"
    for data in (mixed, [Moments.from_samples(grasp) for grasp in mixed]):
        if method == "ols" or data is mixed:
            model = fit(data, method=method)
            assert (model.notes, model.element_area) == ((told,), 1e-6)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [(None, "NoneType"), (5, "int"), ("grasp.npz", "str of str"), ([1.0], "list of float"), ({}, "dict")],
)
def test_what_are_no_samples_are_refused_as_such(wrong: Any, told: str) -> None:
    with pytest.raises(InvalidSamples, match=rf"^samples is {told}; allowed: FrictionSamples or Moments"):
        fit(wrong, method="auto")


@pytest.mark.parametrize("method", ["auto", "ols"])
def test_a_model_names_the_sensor_that_all_grasps_are_of(samples: Callable[..., FrictionSamples], method: str) -> None:
    grasps = [replace(samples(50, seed=seed), sensor="left") for seed in range(3)]
    assert fit(grasps, method=method).diagnostics["sensor"] == "left"
    for others in ([*grasps[:2], replace(grasps[2], sensor="right")], [replace(grasp, sensor="") for grasp in grasps]):
        assert "sensor" not in fit(others, method=method).diagnostics
