"""Kernels against integration in high precision."""

import mpmath
import numpy as np
import pytest

from slipcore.contact.defaults import INFLUENCE
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import INTEGRANDS, HalfSpace, MirroredBody, Scaled, cell_integral
from slipcore.errors import InvalidInput

ANTIDERIVATIVES = {
    "r": lambda x, y: x * mpmath.asinh(y / abs(x)) + y * mpmath.asinh(x / abs(y)),
    "xx": lambda x, y: y * mpmath.asinh(x / abs(y)),
    "yy": lambda x, y: x * mpmath.asinh(y / abs(x)),
    "xy": lambda x, y: -mpmath.sqrt(x * x + y * y),
    "x": lambda x, y: y * mpmath.log(x * x + y * y) / 2 + x * mpmath.atan(y / x),
    "y": lambda x, y: x * mpmath.log(x * x + y * y) / 2 + y * mpmath.atan(x / y),
}


def exact(name: str, i: int, j: int, hx: float, hy: float) -> float:
    """The corner sum with 60 digits: cancellation takes a dozen of them."""
    with mpmath.workdps(60):
        f, half = ANTIDERIVATIVES[name], mpmath.mpf(1) / 2
        x = [(j + s * half) * mpmath.mpf(hx) for s in (-1, 1)]
        y = [(i + s * half) * mpmath.mpf(hy) for s in (-1, 1)]
        return float(f(x[1], y[1]) - f(x[0], y[1]) - f(x[1], y[0]) + f(x[0], y[0]))


@pytest.mark.parametrize("name", INTEGRANDS)
@pytest.mark.parametrize("pitch", [(1e-4, 1e-4), (3e-4, 1e-4), (1e-4, 1e-3)])
def test_cell_integrals_hold_near_and_far_and_for_any_aspect(name: str, pitch: tuple[float, float]) -> None:
    grid = Grid((600, 600), pitch)
    got = cell_integral(name, grid)
    edge = int(INFLUENCE.near)
    for i, j in (
        (0, 0),
        (0, 1),
        (1, 0),
        (3, 2),
        (edge, edge),
        (edge + 1, 0),
        (240, edge + 1),
        (599, 0),
        (0, 599),
        (599, 599),
    ):
        # corner sums within INFLUENCE.near lose up to INFLUENCE.near²·aspect² roundings; nothing is lost beyond
        np.testing.assert_allclose(
            got[i, j], exact(name, i, j, *pitch), rtol=3e-11, atol=1e-13 * got.max(), err_msg=f"{i}, {j}"
        )


def test_far_integrals_lose_nothing_to_cancellation() -> None:
    got = cell_integral("r", Grid((1, 2000), (1.0, 1.0)))
    assert got[0, 1999] == pytest.approx(exact("r", 0, 1999, 1.0, 1.0), rel=1e-14)


def test_half_space_is_boussinesq_far_away() -> None:
    grid = Grid((1, 400), (1e-3, 1e-3))
    body = HalfSpace(shear_modulus=2e6, poisson=0.3)
    distance, load = 399e-3, 1e-6  # m, N of 1 Pa on a cell
    assert body.influence("nn", grid)[0, -1] == pytest.approx(0.7 * load / (2 * np.pi * 2e6 * distance), rel=1e-5)
    assert body.influence("xx", grid)[0, -1] == pytest.approx(load / (2 * np.pi * 2e6 * distance), rel=1e-5)
    assert body.influence("yy", grid)[0, -1] == pytest.approx(0.7 * load / (2 * np.pi * 2e6 * distance), rel=1e-5)
    assert body.influence("zx", grid)[0, -1] == pytest.approx(0.4 * load / (4 * np.pi * 2e6 * distance), rel=1e-5)


def test_what_is_zero_is_absent() -> None:
    grid = Grid((2, 2), (1.0, 1.0))
    assert HalfSpace(1.0, 0.0).influence("xy", grid) is None
    assert HalfSpace(1.0, 0.5).influence("zx", grid) is None


def test_scaled_and_opposite_bodies() -> None:
    grid, body = Grid((3, 3), (1.0, 1.0)), HalfSpace(1.0, 0.3)
    np.testing.assert_array_equal(Scaled(body, 2.0).influence("nn", grid), 2.0 * body.influence("nn", grid))
    np.testing.assert_array_equal(MirroredBody(body).influence("zx", grid), -body.influence("zx", grid))
    np.testing.assert_array_equal(MirroredBody(body).influence("xx", grid), body.influence("xx", grid))


@pytest.mark.parametrize(
    ("shear_modulus", "poisson"), [(0.0, 0.3), (-1.0, 0.3), (np.nan, 0.3), (1.0, 0.51), (1.0, -0.1)]
)
def test_impossible_materials_are_refused(shear_modulus: float, poisson: float) -> None:
    with pytest.raises(InvalidInput):
        HalfSpace(shear_modulus, poisson)
