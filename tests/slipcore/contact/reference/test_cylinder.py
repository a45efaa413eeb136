from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from slipcore.contact.reference import elastic_pair, half_space
from slipcore.contact.reference.cylinder import CylinderContact
from slipcore.errors import InvalidInput

RUBBER = half_space(1e6, 0.5)


def loaded(ratio: float) -> CylinderContact:
    return CylinderContact(10e-3, 800.0, RUBBER, 0.5, ratio * 400.0)


def strip_slope(x: float, case: CylinderContact, traction: Callable[[np.ndarray], np.ndarray]) -> tuple[float, float]:
    """Slope −(2/πE*) PV∫ q(s)/(x − s) ds (Johnson, eq. 2.25) near x, by Gauss–Chebyshev."""
    a, n = case.half_width, 4001
    k = np.arange(1, n + 1)
    s = a * np.cos(np.pi * k / (n + 1))  # Chebyshev nodes of the second kind
    weight = np.pi * a / (n + 1) * np.sin(np.pi * k / (n + 1))
    m = np.arange(n + 1)
    t = np.cos(np.pi * (2 * m + 1) / (2 * (n + 1)))  # points at which the rule holds for the principal value
    at = a * t[np.argmin(np.abs(a * t - x))]
    return float(at), float(-2 / (np.pi * case.compliance.contact_modulus) * (traction(s) * weight / (at - s)).sum())


def test_pressure_and_traction_carry_the_loads() -> None:
    case = loaded(0.6)
    nodes, weights = np.polynomial.legendre.leggauss(60)

    def load(field: Callable[[np.ndarray], np.ndarray], low: float, high: float) -> float:
        half = 0.5 * (0.5 * np.pi - np.arcsin(low / high))  # x runs as the sine, which takes away the root at high
        angle = 0.5 * np.pi - half + half * nodes
        return 2.0 * float((field(high * np.sin(angle)) * high * np.cos(angle) * half * weights).sum())

    a, c = case.half_width, case.stick_half_width
    assert load(case.pressure, 0.0, a) == pytest.approx(800.0, rel=1e-12, abs=0.0)
    assert load(case.traction, 0.0, c) + load(case.traction, c, a) == pytest.approx(240.0, rel=1e-12, abs=0.0)
    assert case.stick_half_width == pytest.approx(case.half_width * np.sqrt(0.4), rel=1e-14, abs=0.0)
    assert case.peak_pressure == pytest.approx(2 * 800.0 / (np.pi * case.half_width), rel=1e-13, abs=0.0)


@pytest.mark.parametrize("place", [0.2, 0.55, 0.8, 0.95])
def test_displacements_have_the_slopes_that_the_kernel_gives(place: float) -> None:
    case, step = loaded(0.6), 1e-7
    at, slope = strip_slope(place * case.half_width, case, case.pressure)
    dip = np.diff(case.normal_displacement([at - step, at + step]))[0] / (2 * step)
    assert dip == pytest.approx(slope, rel=1e-4, abs=0.0)  # the rule loses order at the roots of the integrand
    at, slope = strip_slope(place * case.half_width, case, case.traction)
    gradient = np.diff(case.slip([at - step, at + step]))[0] / (2 * step)
    assert gradient == pytest.approx(slope, rel=1e-3, abs=2e-4 * 0.5 * case.half_width / 10e-3)


@pytest.mark.parametrize("place", [1.2, 2.0, 8.0])
def test_surface_beside_the_contact_has_the_slope_that_the_kernel_gives(place: float) -> None:
    case, step = loaded(0.0), 1e-7
    a, (nodes, weights) = case.half_width, np.polynomial.legendre.leggauss(80)
    s, width = a * np.sin(0.5 * np.pi * nodes), a * np.cos(0.5 * np.pi * nodes) * 0.5 * np.pi * weights
    at = place * a
    slope = -2 / (np.pi * RUBBER.contact_modulus) * float((case.pressure(s) * width / (at - s)).sum())
    dip = np.diff(case.normal_displacement([at - step, at + step]))[0] / (2 * step)
    assert dip == pytest.approx(slope, rel=1e-7, abs=0.0)  # rounding of the difference over 2e-7 m


def test_surface_follows_the_cylinder_in_contact_and_opens_outside() -> None:
    case = loaded(0.0)
    inside, outside = np.linspace(0, case.half_width, 20), case.half_width * np.array([1.01, 2.0, 10.0])
    np.testing.assert_allclose(case.normal_displacement(inside), -(inside**2) / 20e-3, rtol=1e-14)
    assert (case.normal_displacement(outside) > -(outside**2) / 20e-3).all()


@pytest.mark.parametrize("ratio", [1e-12, 1e-5, 0.3, 0.999999, 1.0])
@pytest.mark.parametrize("part", [0.1, 0.9])
def test_slip_and_traction_keep_their_digits(ratio: float, part: float) -> None:
    case = loaded(ratio)
    x = case.half_width * float(np.sqrt(1.0 - ratio + part * ratio))
    with mpmath.workdps(50):
        a = mpmath.mpf(case.half_width)
        share = mpmath.mpf(case.tangential_load) / 400
        c, at = a * mpmath.sqrt(1 - share), mpmath.mpf(x)
        rest = mpmath.sqrt(at**2 - c**2)
        slip = -(at * rest - (c**2 * mpmath.acosh(at / c) if c else 0)) / 2 * mpmath.mpf(0.5) / mpmath.mpf(10e-3)
        stuck = mpmath.mpf(RUBBER.contact_modulus) / (2 * mpmath.mpf(10e-3)) * 0.5 * (a - c)
    assert case.slip(x) == pytest.approx(
        float(slip), rel=1e-12 + 2e-16 / ratio * 10, abs=0.0
    )  # place in the annulus: rounding of x
    assert case.traction(0.0) == pytest.approx(float(stuck), rel=1e-12, abs=0.0)


def test_slip_is_zero_in_stick_and_nan_outside() -> None:
    case = loaded(0.6)
    assert (case.slip(np.linspace(0, case.stick_half_width * 0.999, 9)) == 0.0).all()
    assert np.isnan(case.slip(1.01 * case.half_width))
    assert case.slip(-0.9 * case.half_width) == case.slip(0.9 * case.half_width) < 0.0


def test_equal_bodies_are_twice_as_compliant() -> None:
    pair = elastic_pair(RUBBER, RUBBER)
    assert CylinderContact(1e-2, 800.0, pair).half_width == pytest.approx(
        np.sqrt(2) * CylinderContact(1e-2, 800.0, RUBBER).half_width, rel=1e-14, abs=0.0
    )


def test_loads_beyond_the_limit_are_refused_by_name() -> None:
    with pytest.raises(InvalidInput, match="tangential_load"):
        loaded(1.0001)
    with pytest.raises(InvalidInput, match="normal_load"):
        CylinderContact(1e-2, -1.0, RUBBER)
    with pytest.raises(InvalidInput, match="cylinder_radius"):
        CylinderContact(0.0, 1.0, RUBBER)


def test_without_load_nothing_touches() -> None:
    case = CylinderContact(1e-2, 0.0, RUBBER)
    assert case.half_width == case.stick_half_width == case.annulus == 0.0
    assert (case.traction([0.0, 1e-3]) == 0.0).all()
