from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from slipcore.contact.reference.ellipsoidal import deviator_over_square, potential, sin_minus_x_cos, x_minus_sin

Integrals = Callable[[float, float, float], dict[str, float]]
POINTS = [(0.0, 0.0), (0.3, 0.0), (0.2, -0.5), (-0.7, 0.6), (1.2, 0.4), (-0.3, 2.5), (9.0, -4.0)]


@pytest.mark.parametrize("x", [0.0, 1e-9, 1e-4, 0.05, 0.99, 1.01, 2.5, np.pi])
def test_trigonometric_differences_keep_all_digits(x: float) -> None:
    with mpmath.workdps(60):
        sin_cos, x_sin = mpmath.sin(x) - x * mpmath.cos(x), x - mpmath.sin(x)
    argument = np.array([x])
    np.testing.assert_allclose(sin_minus_x_cos(argument), float(sin_cos), rtol=4e-15)
    np.testing.assert_allclose(x_minus_sin(argument), float(x_sin), rtol=4e-15)


@pytest.mark.parametrize(("x", "y"), POINTS)
def test_potential_and_deviator_match_quadrature_inside_and_outside(
    circle_integrals: Integrals, x: float, y: float
) -> None:
    c, r = 0.95, np.array(np.hypot(x, y))
    expected = circle_integrals(x, y, c)
    v, d = float(potential(r, c)), float(deviator_over_square(r, c))
    assert v == pytest.approx(expected["one"], rel=1e-11, abs=0.0)  # quadrature: about 1e-13
    assert v / 2 + d * (x * x - y * y) / 2 == pytest.approx(expected["xx"], rel=1e-11, abs=0.0)
    assert d * x * y == pytest.approx(expected["xy"], rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("distance", [1.0 + 1e-9, 3.0, 1e3, 1e6])
def test_far_from_the_circle_no_digits_are_lost(distance: float) -> None:
    with mpmath.workdps(80):
        r = mpmath.mpf(distance)
        angle, root = mpmath.asin(1 / r), mpmath.sqrt(1 - 1 / r**2)
        v = mpmath.pi / 2 * ((2 - r**2) * angle + r * root)
        d = mpmath.pi / 4 * (angle + (2 - r**2) * root / r**3)
    np.testing.assert_allclose(potential(np.array(distance), 1.0), float(v), rtol=2e-14)
    np.testing.assert_allclose(deviator_over_square(np.array(distance), 1.0), float(d), rtol=2e-14)


def test_a_vanishing_circle_displaces_nothing() -> None:
    r = np.array([0.0, 1e-3])
    assert (potential(r, 0.0) == 0.0).all()
    assert (deviator_over_square(r[1:], 0.0) == 0.0).all()
