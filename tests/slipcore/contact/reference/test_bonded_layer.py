import mpmath
import numpy as np
import pytest

from slipcore.contact.reference import half_space
from slipcore.contact.reference.bonded_layer import BondedLayer, half_space_modes
from slipcore.errors import InvalidInput

THICKNESS, MODULUS = 5e-3, 1e6


def navier(layer: BondedLayer, k: float) -> dict[str, mpmath.mpf]:
    """Navier's equations across the layer by a matrix exponential, in digits enough for the growing solutions.

    u_x = iU(z) e^{ikx}, u_z = W(z) e^{ikx}; clamped at the base. No formula of the code under test enters.
    """
    with mpmath.workdps(60 + int(4 * k * layer.thickness)):
        nu, k, h = mpmath.mpf(layer.poisson_ratio), mpmath.mpf(k), mpmath.mpf(layer.thickness)
        g = mpmath.mpf(layer.young_modulus) / (2 * (1 + nu))
        m = 2 * (1 - nu) / (1 - 2 * nu)
        growth = mpmath.matrix(
            [[0, 0, 1, 0], [0, 0, 0, 1], [m * k**2, 0, 0, -(m - 1) * k], [0, k**2 / m, (m - 1) * k / m, 0]]
        )
        across = mpmath.expm(growth * h)
        system = mpmath.matrix(4, 4)
        for j in range(4):
            system[0, j], system[1, j] = across[0, j], across[1, j]
        system[2, 1], system[2, 2] = -g * k, -g  # traction −σ_xz = −iG(U' + kW)
        system[3, 0], system[3, 3] = g * (m - 2) * k, -g * m  # pressure −σ_zz
        pulled = mpmath.lu_solve(system, mpmath.matrix([0, 0, 1, 0]))
        pressed = mpmath.lu_solve(system, mpmath.matrix([0, 0, 0, 1]))
        return {"longitudinal": pulled[0], "coupling": pulled[1], "reciprocal": pressed[0], "normal": pressed[1]}


@pytest.mark.parametrize("poisson_ratio", [-0.5, 0.0, 0.3, 0.49, 0.4999])
@pytest.mark.parametrize("kh", [1e-4, 0.03, 0.499, 0.501, 1.7, 9.0])
def test_modes_solve_the_equations_of_the_layer(poisson_ratio: float, kh: float) -> None:
    layer = BondedLayer(THICKNESS, MODULUS, poisson_ratio)
    modes, exact = layer.modes(kh / THICKNESS), navier(layer, kh / THICKNESS)
    assert modes.normal == pytest.approx(float(exact["normal"]), rel=1e-13, abs=0.0)
    assert modes.longitudinal == pytest.approx(float(exact["longitudinal"]), rel=1e-13, abs=0.0)
    scale = 1e-13 * float(modes.longitudinal) * min(kh, 1.0)  # the coupling passes through zero
    assert modes.coupling == pytest.approx(float(exact["coupling"]), rel=1e-12, abs=scale)
    assert modes.coupling == pytest.approx(float(exact["reciprocal"]), rel=1e-12, abs=scale)  # Betti


def test_transverse_mode_is_pure_shear() -> None:
    layer, k = BondedLayer(THICKNESS, MODULUS, 0.3), np.array([1e-3, 200.0, 5e4])
    np.testing.assert_allclose(layer.modes(k).transverse, np.tanh(k * THICKNESS) / k * 2.6 / MODULUS, rtol=1e-14)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.5])
def test_a_thick_layer_is_a_half_space(poisson_ratio: float) -> None:
    k = np.array([1.0, 1e3, 1e6])
    layer = BondedLayer(1e4, MODULUS, poisson_ratio)
    np.testing.assert_allclose(layer.modes(k), half_space_modes(k, half_space(MODULUS, poisson_ratio)), rtol=1e-15)
    near = BondedLayer(20.0, MODULUS, poisson_ratio).modes(1.0)  # the base shows as y² e^{−2y}
    np.testing.assert_allclose(near, half_space_modes(1.0, half_space(MODULUS, poisson_ratio)), rtol=1e-13, atol=1e-19)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.49, 0.5])
def test_a_thin_layer_is_springs(poisson_ratio: float) -> None:
    nu, layer = poisson_ratio, BondedLayer(THICKNESS, MODULUS, poisson_ratio)
    shear = 2 * (1 + nu) / MODULUS
    at_rest = layer.modes(0.0)
    assert at_rest.normal == pytest.approx(THICKNESS * shear * (1 - 2 * nu) / (2 * (1 - nu)), rel=1e-14, abs=1e-30)
    np.testing.assert_allclose([at_rest.longitudinal, at_rest.transverse], THICKNESS * shear, rtol=1e-15)
    assert at_rest.coupling == 0.0
    k = 1e-3 / THICKNESS
    if nu == 0.5:  # incompressible: the gel must flow out sideways, h³k²/3G
        assert layer.modes(k).normal == pytest.approx(THICKNESS**3 * k**2 * shear / 3, rel=1e-5, abs=0.0)
    expected = ((1 - 2 * nu) * (3 - 4 * nu) - 1) / (8 * (1 - nu) ** 2) * THICKNESS**2 * k * shear
    assert layer.modes(k).coupling == pytest.approx(expected, rel=1e-5, abs=1e-18)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.4999, 0.5])
def test_nothing_overflows_or_jumps_from_zero_to_very_short_waves(poisson_ratio: float) -> None:
    layer = BondedLayer(THICKNESS, MODULUS, poisson_ratio)
    k = np.concatenate([[0.0], np.geomspace(1e-12, 1e12, 4001)])
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        modes = layer.modes(k)
    for mode in modes:
        assert np.isfinite(mode).all()
    for mode in (modes.longitudinal, modes.transverse):
        assert (np.diff(mode) <= 1e-15 * mode[0]).all()
    assert (modes.normal[1:] > 0.0).all()


def test_matrix_is_hermitian_positive_and_turns_with_the_wave() -> None:
    layer = BondedLayer(THICKNESS, MODULUS, 0.3)
    angle = np.linspace(0.1, 6.0, 7)
    matrix = layer.compliance(300.0 * np.cos(angle), 300.0 * np.sin(angle))
    np.testing.assert_allclose(matrix, np.conj(np.swapaxes(matrix, -1, -2)), rtol=1e-15)
    assert (np.linalg.eigvalsh(matrix) > 0.0).all()
    modes = layer.modes(300.0)
    along, across = (
        np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1),
        np.stack([-np.sin(angle), np.cos(angle), 0 * angle], -1),
    )
    up = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(np.einsum("aij,aj,ai->a", matrix, along, along), modes.longitudinal, rtol=1e-12)
    np.testing.assert_allclose(np.einsum("aij,aj,ai->a", matrix, across, across), modes.transverse, rtol=1e-12)
    np.testing.assert_allclose(np.einsum("aij,aj,i->a", matrix, along, up), -1j * modes.coupling, rtol=1e-12)
    np.testing.assert_allclose(layer.compliance(0.0, 0.0)[2, 2], layer.modes(0.0).normal, rtol=1e-15)


def test_coupling_has_the_sign_of_the_half_space_kernel() -> None:
    # u_z = (1 − 2ν)/4πG x/ρ² under a unit force along x (Johnson, eq. 3.75c); x/ρ² transforms to −2πi k_x/k²
    layer, k = BondedLayer(1e3, MODULUS, 0.2), 50.0
    expected = (1 - 0.4) / (4 * np.pi) * 2.4 / MODULUS * (-2j * np.pi / k)
    np.testing.assert_allclose(layer.compliance(k, 0.0)[2, 0], expected, rtol=1e-13)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [((0.0, 1e6, 0.3), "thickness"), ((1e-3, 0.0, 0.3), "young_modulus"), ((1e-3, 1e6, 0.6), "poisson_ratio")],
)
def test_impossible_layers_are_refused_by_name(arguments: tuple[float, float, float], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        BondedLayer(*arguments)
