import numpy as np
import pytest
from scipy import special

from estimators.linear.log_sum import log_sum


@pytest.mark.parametrize("axis", [None, 0, 1, -1])
def test_a_log_sum_is_that_of_an_independent_library(axis: int | None) -> None:
    log = 50.0 * np.random.default_rng(1).standard_normal((4, 6))
    log[2] = -np.inf
    log[:, 3] = -np.inf
    np.testing.assert_allclose(log_sum(log, axis), special.logsumexp(log, axis=axis), rtol=1e-14)


@pytest.mark.parametrize("shift", [-1e4, 1e4])
def test_what_no_number_holds_has_a_log_sum(shift: float) -> None:
    assert log_sum(np.full(8, shift)) == pytest.approx(shift + np.log(8.0), rel=1e-15)
    assert log_sum(np.full(3, -np.inf)) == -np.inf
