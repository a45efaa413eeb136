"""Young's modulus by known forces: its closed form."""

import numpy as np
import pytest

from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.gel_calibration.likelihood import Elasticity, _modulus

TOLERANCE = RECONSTRUCTION.force_tolerance


def test_the_modulus_is_the_geometric_mean_of_forces_over_resultants_by_their_weights() -> None:
    """Ratios of 4e5 and 1e6, of which the second has three times the variance, half of it its force's; a press of
    unknown force is left out.
    """
    own = 1e-5 * np.sqrt(1.5) * TOLERANCE
    yields = np.array([[1e-5, 0.0], [-1e-5, own], [7.0, 0.1]])
    forces = [[4.0, TOLERANCE], [10.0, np.sqrt(1.5) * TOLERANCE], [np.nan, np.nan]]
    found = _modulus(yields, np.array(forces), None)
    assert found.logarithm == pytest.approx((3.0 * np.log(4e5) + np.log(1e6)) / 4.0, rel=1e-12)
    assert found.deviation == pytest.approx(TOLERANCE * np.sqrt(3.0 / 4.0), rel=1e-12)


def test_a_known_modulus_stays() -> None:
    found = _modulus(np.array([[1e-5, 1e-6]]), np.array([[4.0, TOLERANCE]]), 3e5)
    assert (found.logarithm, found.deviation) == (pytest.approx(np.log(3e5)), 0.0)


def test_of_an_unknown_modulus_the_probability_is_the_integral_over_all_that_might_be_known() -> None:
    yields, force = np.array([[1e-5, 2e-7], [2e-5, 3e-6]]), np.array([[4.0, TOLERANCE], [9.0, 0.05]])
    logarithms = np.linspace(np.log(1e5), np.log(2e6), 4001)
    known = [np.exp(_modulus(yields, force, np.exp(each)).log_probability) for each in logarithms]
    whole = np.sqrt(2.0 * np.pi) * np.exp(_modulus(yields, force, None).log_probability)
    assert np.trapezoid(known, logarithms) == pytest.approx(whole, rel=1e-6)


def test_a_gel_is_a_half_space_where_its_base_is_endlessly_far() -> None:
    assert Elasticity(0.45, 200.0).gel(1e6, 1e-3).thickness == pytest.approx(5e-3)
    gel = Elasticity(0.45, 0.0).gel(2e6, 1e-3)
    assert (gel.young_modulus, gel.poisson_ratio, gel.thickness, gel.marker_depth) == (2e6, 0.45, np.inf, 1e-3)
