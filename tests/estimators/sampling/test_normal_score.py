"""The map to normal scores against distributions whose quantiles are known."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from estimators.sampling.normal_score import normal_score

CASES = [stats.norm(3.0, 0.01), stats.gumbel_l(0.0, 2.0), stats.gamma(3.0), stats.t(4.0)]


@pytest.mark.parametrize("law", CASES, ids=lambda law: law.dist.name)
def test_scores_map_to_the_quantiles_of_the_density(law: Any) -> None:
    score = normal_score(law.logpdf, law.ppf(1e-9) - 0.1, law.ppf(1.0 - 1e-9) + 5.0)
    u = np.linspace(-3.0, 3.0, 25)
    value, _ = score(u)
    np.testing.assert_allclose(stats.norm.ppf(law.cdf(value)), u, atol=0.06)  # as close as 400 knots


def test_the_slope_is_that_of_the_map_also_beyond_its_knots() -> None:
    score = normal_score(stats.gumbel_l.logpdf, -30.0, 10.0)
    u = np.array([-9.0, -2.3, 0.1, 2.2, 9.0])
    ahead, behind = score(u + 1e-7)[0], score(u - 1e-7)[0]
    np.testing.assert_allclose(np.exp(score(u)[1]), (ahead - behind) / 2e-7, rtol=1e-6)  # rounding over 2e-7
    assert (np.diff(score(np.linspace(-12.0, 12.0, 1000))[0]) > 0.0).all()
