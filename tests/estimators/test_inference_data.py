from collections.abc import Callable

import numpy as np
import pytest

from estimators import InvalidSamples, fit
from slipcore import FrictionSamples

pytestmark = pytest.mark.filterwarnings("ignore:.*ArviZ is undergoing:FutureWarning")


@pytest.mark.parametrize("likelihood", ["gaussian", "outlier", "student_t", "errors_in_variables"])
def test_draws_are_told_by_the_name_of_each_parameter(samples: Callable[..., FrictionSamples], likelihood: str) -> None:
    model = fit(samples(200), method="bayes", likelihood=likelihood, seed=1)
    assert model.draws is not None
    posterior = model.to_inference_data().posterior
    assert posterior.sizes["chain"] == 1
    assert posterior.sizes["draw"] == len(model.draws)
    assert np.array_equal(posterior["beta0"][0], model.draws[:, 0])
    assert np.array_equal(posterior["sigma"][0], model.draws[:, 3])
    assert len(posterior.data_vars) == model.draws.shape[1]


def test_a_model_without_draws_is_refused_by_name(samples: Callable[..., FrictionSamples]) -> None:
    with pytest.raises(InvalidSamples, match="draws is none of a model by ols"):
        fit(samples(50), method="ols").to_inference_data()
