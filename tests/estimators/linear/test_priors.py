"""Priors in words say what they are in numbers."""

import re

import pytest

from estimators.defaults import PRIOR, REFERENCE
from estimators.linear.priors import conjugate_prior, positive_friction, structured


@pytest.mark.parametrize("told", [conjugate_prior(), positive_friction(), structured(), structured(sensors=2)])
def test_the_inverse_gamma_of_the_scatter_has_its_squared_reference_for_its_middle(told: str) -> None:
    found = re.search(r"sigma\^2 ~ IG\(([^,]+), ([^)]+)\)", told)
    assert found is not None
    shape, scale = map(float, found.groups())
    assert shape == PRIOR.degrees_of_freedom / 2.0
    assert scale / shape == pytest.approx(REFERENCE.scatter**2, rel=1e-5)


def test_between_sensors_something_is_assumed_only_where_there_are_several() -> None:
    assert "between sensors" in structured(sensors=2)
    assert "between sensors" not in structured(sensors=1)
