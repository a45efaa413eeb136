from collections.abc import Callable

import numpy as np
import pytest

from slipcore.contact.reference import RIGID, HertzContact, elastic_pair, half_space
from slipcore.errors import InvalidInput

Integrals = Callable[[float, float, float], dict[str, float]]
SENSOR = half_space(1e6, 0.3)


@pytest.fixture
def contact() -> HertzContact:
    return HertzContact(15e-3, 10.0, SENSOR)


def test_pressure_carries_the_normal_force(contact: HertzContact) -> None:
    a = contact.contact_radius
    s, weight = np.polynomial.legendre.leggauss(40)
    angle = 0.25 * np.pi * (s + 1.0)  # r = a sin θ makes the integrand smooth
    integrand = contact.pressure(a * np.sin(angle)) * 2 * np.pi * a * np.sin(angle) * a * np.cos(angle)
    assert float((0.25 * np.pi * weight * integrand).sum()) == pytest.approx(10.0, rel=1e-12, abs=0.0)
    assert contact.peak_pressure == pytest.approx(1.5 * 10.0 / (np.pi * a**2), rel=1e-13, abs=0.0)


def test_surface_follows_the_sphere_in_contact_and_stays_below_it_outside(contact: HertzContact) -> None:
    a = contact.contact_radius
    inside, outside = np.linspace(0.0, a, 50), np.linspace(1.001 * a, 5 * a, 50)
    sphere = contact.approach - inside**2 / (2 * 15e-3)
    np.testing.assert_allclose(contact.normal_displacement(inside), sphere, rtol=1e-13)
    assert (contact.normal_displacement(outside) > contact.approach - outside**2 / (2 * 15e-3)).all()


def test_displacements_match_quadrature_of_the_kernels(contact: HertzContact, circle_integrals: Integrals) -> None:
    a, slope = contact.contact_radius, contact.pressure_slope
    for ratio in (0.1, 0.6, 1.3, 4.0):
        expected = circle_integrals(ratio * a, 0.0, a)
        u_z = slope * (SENSOR.shear - SENSOR.poisson) / (2 * np.pi) * expected["one"]
        u_r = slope * SENSOR.coupling / (4 * np.pi) * expected["x"]
        np.testing.assert_allclose(contact.normal_displacement(ratio * a), u_z, rtol=1e-11)
        np.testing.assert_allclose(contact.radial_displacement(ratio * a), u_r, rtol=1e-11)


def test_radial_displacement_points_inwards_and_vanishes_at_half() -> None:
    r = np.linspace(0.0, 0.02, 9)
    assert (HertzContact(15e-3, 10.0, SENSOR).radial_displacement(r)[1:] < 0.0).all()
    assert (HertzContact(15e-3, 10.0, half_space(1e6, 0.5)).radial_displacement(r) == 0.0).all()


def test_approach_and_radius_grow_as_hertz_says() -> None:
    one, eight = HertzContact(15e-3, 1.0, SENSOR), HertzContact(15e-3, 8.0, SENSOR)
    assert eight.contact_radius / one.contact_radius == pytest.approx(2.0, rel=1e-14, abs=0.0)
    assert eight.approach / one.approach == pytest.approx(4.0, rel=1e-14, abs=0.0)
    assert eight.peak_pressure / one.peak_pressure == pytest.approx(2.0, rel=1e-14, abs=0.0)


def test_an_elastic_object_shares_the_indentation() -> None:
    target = half_space(2e6, 0.3)
    contact = HertzContact(15e-3, 10.0, elastic_pair(SENSOR, target))
    r = np.linspace(0.0, 2.0, 11) * contact.contact_radius
    both = contact.normal_displacement(r, SENSOR) + contact.normal_displacement(r, target)
    np.testing.assert_allclose(both, contact.normal_displacement(r), rtol=1e-13)
    np.testing.assert_allclose(
        contact.normal_displacement(r, SENSOR), 2 * contact.normal_displacement(r, target), rtol=1e-13
    )


def test_without_force_nothing_touches() -> None:
    contact = HertzContact(15e-3, 0.0, SENSOR)
    r = np.array([0.0, 1e-3])
    for field in (contact.pressure(r), contact.normal_displacement(r), contact.radial_displacement(r)):
        assert (field == 0.0).all()


@pytest.mark.parametrize(
    ("radius", "force", "compliance", "name"),
    [(0.0, 1.0, SENSOR, "sphere_radius"), (1e-2, -1.0, SENSOR, "normal_force"), (1e-2, 1.0, RIGID, "contact_modulus")],
)
def test_impossible_contacts_are_refused_by_name(radius: float, force: float, compliance: object, name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        HertzContact(radius, force, compliance)
