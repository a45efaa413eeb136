import math

import pytest

from slipcore.contact.reference.elastic_pair import RIGID, elastic_pair, half_space
from slipcore.errors import InvalidInput


def test_contact_modulus_is_the_textbook_one_for_two_bodies() -> None:
    pair = elastic_pair(half_space(1e6, 0.45), half_space(3e6, 0.3))
    expected = 1.0 / ((1 - 0.45**2) / 1e6 + (1 - 0.3**2) / 3e6)
    assert pair.contact_modulus == pytest.approx(expected, rel=1e-14, abs=0.0)


def test_a_rigid_object_leaves_the_sensor_alone() -> None:
    sensor = half_space(1e6, 0.3)
    assert elastic_pair(sensor, RIGID) == sensor
    assert RIGID.contact_modulus == math.inf


def test_equal_bodies_decouple_normal_and_tangential_problem() -> None:
    body = half_space(2e6, 0.2)
    assert elastic_pair(body, body).dundurs == 0.0
    assert half_space(1e6, 0.5).dundurs == 0.0


def test_dundurs_constant_of_a_rigid_object_is_half_of_one_minus_two_nu_over_one_minus_nu() -> None:
    assert half_space(1e6, 0.3).dundurs == pytest.approx(0.5 * 0.4 / 0.7, rel=1e-14, abs=0.0)


@pytest.mark.parametrize(
    ("modulus", "ratio", "name"),
    [
        (0.0, 0.3, "young_modulus"),
        (math.nan, 0.3, "young_modulus"),
        (1e6, 0.51, "poisson_ratio"),
        (1e6, -1.0, "poisson_ratio"),
    ],
)
def test_impossible_materials_are_refused_by_name(modulus: float, ratio: float, name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        half_space(modulus, ratio)
