from collections.abc import Callable

import numpy as np
import pytest

from slipcore.contact.reference import half_space
from slipcore.contact.reference.flat_punch import FlatPunch
from slipcore.errors import InvalidInput

Integrals = Callable[[float, float, float], dict[str, float]]
SOIL = half_space(1e6, 0.4)
PUNCH = FlatPunch(3e-3, 5.0, SOIL, 1.2)


def test_tractions_carry_the_forces() -> None:
    nodes, weights = np.polynomial.legendre.leggauss(40)
    angle = 0.25 * np.pi * (nodes + 1)
    r = 3e-3 * np.sin(angle)
    ring = 2 * np.pi * r * 3e-3 * np.cos(angle) * weights * 0.25 * np.pi
    assert (PUNCH.pressure(r) * ring).sum() == pytest.approx(5.0, rel=1e-12, abs=0.0)
    assert (PUNCH.traction(r) * ring).sum() == pytest.approx(1.2, rel=1e-12, abs=0.0)
    np.testing.assert_array_equal(PUNCH.pressure([3e-3, 4e-3]), [np.inf, 0.0])


def test_the_punch_stays_flat_and_moves_as_a_whole() -> None:
    r = np.linspace(0.0, 3e-3, 9)
    np.testing.assert_allclose(PUNCH.normal_displacement(r), PUNCH.approach, rtol=1e-14)
    np.testing.assert_allclose(PUNCH.displacement(r, 0.0), [[PUNCH.rigid_displacement, 0.0]] * 9, rtol=1e-14)
    assert PUNCH.approach == pytest.approx(5.0 / (2 * SOIL.contact_modulus * 3e-3), rel=1e-14, abs=0.0)
    shear_modulus = 1e6 / 2.8
    assert PUNCH.rigid_displacement == pytest.approx(1.6 * 1.2 / (8 * shear_modulus * 3e-3), rel=1e-13, abs=0.0)


@pytest.mark.parametrize(("x", "y"), [(1.3, 0.5), (-2.0, 3.0), (0.0, 1.1), (0.3, 0.2)])
def test_displacement_is_the_derivative_of_the_ellipsoidal_one(circle_integrals: Integrals, x: float, y: float) -> None:
    a, step = 3e-3, 3e-6

    def derivative(name: str) -> float:  # d√(a² − r²)/da = a/√(a² − r²): fourth-order central difference
        values = [circle_integrals(x * a, y * a, a + k * step)[name] for k in (-2, -1, 1, 2)]
        return float(np.dot(values, [1, -8, 8, -1])) / (12 * step)

    one, xx, xy = (derivative(name) for name in ("one", "xx", "xy"))
    scale = 1.2 / (2 * np.pi * a**2) / (2 * np.pi)
    u_x = scale * ((SOIL.shear - SOIL.poisson) * one + SOIL.poisson * xx)
    u_y = scale * SOIL.poisson * xy
    np.testing.assert_allclose(PUNCH.displacement(x * a, y * a), [u_x, u_y], rtol=1e-7, atol=1e-9 * u_x)
    u_z = 5.0 / (2 * np.pi * a**2) * (SOIL.shear - SOIL.poisson) / (2 * np.pi) * one
    assert PUNCH.normal_displacement(np.hypot(x * a, y * a)) == pytest.approx(u_z, rel=1e-8, abs=0.0)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((0.0, 1.0, SOIL), "punch_radius"),
        ((1e-3, -1.0, SOIL), "normal_force"),
        ((1e-3, 1.0, SOIL, np.nan), "tangential_force"),
    ],
)
def test_impossible_punches_are_refused_by_name(arguments: tuple[object, ...], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        FlatPunch(*arguments)
