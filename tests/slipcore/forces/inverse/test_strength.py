"""The strength of the prior where all singular values are equal: each criterion has its optimum in closed form."""

import numpy as np
import pytest

from slipcore.forces.inverse.strength import Criterion, Spectrum

SINGULAR, COUNT, REST = 2.0, 4, 1.6
"""Value of both singular directions; number of data, and the sum of squares of those that neither reaches."""
DATA = np.array([1.5, -1.0])
REACHED = float(DATA @ DATA)


@pytest.mark.parametrize(
    ("criterion", "spread"),
    [
        ("evidence", REACHED / 2),  # the variance 1 + g² s² that the two show
        ("gcv", REACHED / 2 / (REST / (COUNT - 2))),  # the same, over the noise that the rest shows
        ("discrepancy", np.sqrt(REACHED / (COUNT - REST))),  # what leaves residuals of variance 1
    ],
)
def test_each_criterion_has_its_optimum(criterion: Criterion, spread: float) -> None:
    found = Spectrum(np.full(2, SINGULAR), DATA).choose(REST, COUNT, criterion)
    assert found == pytest.approx(np.sqrt(spread - 1.0) / SINGULAR, rel=1e-4)
