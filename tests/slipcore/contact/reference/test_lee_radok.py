from itertools import pairwise

import mpmath
import numpy as np
import pytest

from slipcore.contact.reference import HertzContact, half_space
from slipcore.contact.reference.lee_radok import LeeRadok, PronySeries
from slipcore.errors import InvalidInput

GEL = PronySeries(0.6e6, (0.5e6, 0.3e6, 0.2e6), (0.01, 0.3, 20.0))
RADIUS = 15e-3


@pytest.mark.parametrize(
    "material",
    [GEL, PronySeries(0.0, (1e6, 2e5), (0.1, 5.0)), PronySeries(1e3, (1e6,), (1.0,)), PronySeries(1e6, (1.0,), (1e3,))],
)
@pytest.mark.parametrize("time", [1e-6, 0.05, 2.0, 300.0])
def test_creep_is_the_inverse_of_relaxation(material: PronySeries, time: float) -> None:
    with mpmath.workdps(40):
        moduli, times = map(mpmath.mpf, material.moduli), [mpmath.mpf(t) for t in material.times]
        terms = list(zip(moduli, times, strict=True))

        def transform(s: mpmath.mpf) -> mpmath.mpf:  # of the creep: 1/(s² Ê(s))
            return 1 / (s * (material.equilibrium + sum(e * s / (s + 1 / tau) for e, tau in terms)))

        exact = mpmath.invertlaplace(transform, mpmath.mpf(time), method="talbot", degree=40)
        integral = mpmath.invertlaplace(lambda s: transform(s) / s, mpmath.mpf(time), method="talbot", degree=40)
    assert material.creep(time) == pytest.approx(float(exact), rel=1e-11, abs=0.0)
    assert material.creep_integral(time) == pytest.approx(float(integral), rel=1e-11, abs=0.0)


def test_standard_solid_creeps_as_its_closed_form_says() -> None:
    solid, t = PronySeries(1e6, (3e6,), (0.5,)), np.array([0.0, 0.1, 1.0, 50.0])
    retardation = 0.5 * 4e6 / 1e6
    expected = 1e-6 - (1e-6 - 0.25e-6) * np.exp(-t / retardation)
    np.testing.assert_allclose(solid.creep(t), expected, rtol=1e-13)
    np.testing.assert_allclose(solid.relaxation(t), 1e6 + 3e6 * np.exp(-t / 0.5), rtol=1e-14)


def test_an_elastic_material_gives_hertz() -> None:
    hertz = HertzContact(RADIUS, 8.0, half_space(1e6, 0.5))
    case = LeeRadok(RADIUS, PronySeries(hertz.compliance.contact_modulus), np.array([0.0, 2.0]), np.array([0.0, 8.0]))
    assert case.contact_radius(3.0) == pytest.approx(hertz.contact_radius, rel=1e-13, abs=0.0)
    assert case.approach(3.0) == pytest.approx(hertz.approach, rel=1e-13, abs=0.0)
    r = np.linspace(0.0, 1.1, 9) * hertz.contact_radius
    np.testing.assert_allclose(case.pressure(r, 3.0), hertz.pressure(r), rtol=1e-12)
    assert case.contact_radius(-1.0) == 0.0


def test_a_sudden_force_creeps_between_two_hertz_contacts() -> None:
    case = LeeRadok(RADIUS, GEL, np.array([0.0]), np.array([5.0]))
    at_once, at_last = (float(np.cbrt(0.75 * RADIUS * 5.0 / modulus)) for modulus in (1.6e6, 0.6e6))
    assert case.contact_radius(0.0) == pytest.approx(at_once, rel=1e-13, abs=0.0)
    assert case.contact_radius(1e5) == pytest.approx(at_last, rel=1e-10, abs=0.0)
    a = case.contact_radius(np.geomspace(1e-4, 1e3, 50))
    assert (np.diff(a) > 0.0).all()


@pytest.mark.parametrize("time", [0.02, 1.7, 40.0])
def test_pressure_carries_the_force_of_the_moment(time: float) -> None:
    case = LeeRadok(RADIUS, GEL, np.array([0.0, 0.5, 1.0, 2.0]), np.array([1.0, 2.0, 2.0, 6.0]))
    a = float(case.contact_radius(time))
    nodes, weights = np.polynomial.legendre.leggauss(16)
    total = 0.0
    kinks = [float(case.contact_radius(t)) for t in (0.0, 0.5, 1.0, 2.0) if t < time]
    edges = [0.0, *kinks, a]  # old edges of the contact are kinks or roots of the pressure
    for low, high in pairwise(edges):
        angle = np.arcsin(low / high) + (0.5 * np.pi - np.arcsin(low / high)) * 0.5 * (nodes + 1)
        r = high * np.sin(angle)
        step = high * np.cos(angle) * (0.5 * np.pi - np.arcsin(low / high)) * 0.5 * weights
        total += float((case.pressure(r, time) * 2 * np.pi * r * step).sum())
    assert total == pytest.approx(float(np.interp(time, case.time, case.force)), rel=1e-5, abs=0.0)


def test_pressure_matches_the_hereditary_integral_in_high_precision() -> None:
    case, r, time = LeeRadok(RADIUS, GEL, np.array([0.0, 1.0]), np.array([0.0, 4.0])), 1.5e-3, 0.7
    n = 20001  # midpoint rule in u with τ = t_r + (t − t_r) u²
    start = case._touch(r, time)
    u = np.linspace(0.0, 1.0, n)
    w = case._root(r, start + (time - start) * u**2)
    middle = start + (time - start) * (0.5 * (u[1:] + u[:-1])) ** 2
    exact = 2 / (np.pi * RADIUS) * float((GEL.relaxation(time - middle) * np.diff(w)).sum())
    assert case.pressure(r, time) == pytest.approx(exact, rel=1e-7, abs=0.0)
    assert case.pressure(5e-3, time) == 0.0


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((-1.0, (), ()), "equilibrium"),
        ((0.0, (), ()), "instantaneous"),
        ((1.0, (1.0,), ()), "times"),
        ((1.0, (-1.0,), (1.0,)), "moduli"),
        ((1.0, (1.0,), (0.0,)), "times"),
    ],
)
def test_impossible_materials_are_refused_by_name(
    arguments: tuple[float, tuple[float, ...], tuple[float, ...]], name: str
) -> None:
    with pytest.raises(InvalidInput, match=name):
        PronySeries(*arguments)


@pytest.mark.parametrize(
    ("radius", "time", "force", "name"),
    [
        (0.0, [0.0], [1.0], "sphere_radius"),
        (1.0, [0.0, 1.0], [1.0, 0.5], "force"),
        (1.0, [0.0], [-1.0], "force"),
        (1.0, [0.0, 1.0], [1.0], "force"),
        (1.0, [1.0, 0.0], [1.0, 2.0], "time"),
        (1.0, [0.0, 1.0], [1.0, np.nan], "force"),
    ],
)
def test_impossible_loads_are_refused_by_name(radius: float, time: list[float], force: list[float], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        LeeRadok(radius, GEL, np.array(time), np.array(force))
