import numpy as np
import pytest

from slipcore.contact.reference.wavy import WavyContact
from slipcore.errors import InvalidInput

AMPLITUDE, WAVELENGTH, MODULUS = 20e-6, 2e-3, 1.3e6
FULL = np.pi * MODULUS * AMPLITUDE / WAVELENGTH


def wave(share: float, traction: float = 0.0) -> WavyContact:
    return WavyContact(AMPLITUDE, WAVELENGTH, MODULUS, share * FULL, 0.5, traction)


def surface(pressure: np.ndarray) -> np.ndarray:
    """Displacement under a periodic pressure, by its Fourier series: û = 2p̂/(E*|k|), the mean left out."""
    n = len(pressure)
    k = 2 * np.pi * np.fft.rfftfreq(n, WAVELENGTH / n)
    k[0] = np.inf
    return np.fft.irfft(np.fft.rfft(pressure) * 2 / (MODULUS * k), n)


@pytest.mark.parametrize("share", [0.05, 0.4, 0.9, 1.0, 1.5])
def test_deformed_surfaces_touch_where_there_is_pressure_and_nowhere_else(share: float) -> None:
    n = 2**14
    x = np.arange(n) * WAVELENGTH / n
    case = wave(share)
    pressure = case.pressure(x)
    assert pressure.mean() == pytest.approx(share * FULL, rel=1e-5, abs=0.0)  # sampled: roots at the edges
    gap = AMPLITUDE * (1 - np.cos(2 * np.pi * x / WAVELENGTH)) + surface(pressure)
    gap -= gap[0]
    touching = pressure > 0.0
    np.testing.assert_allclose(gap[touching], 0.0, atol=1e-5 * AMPLITUDE)  # aliasing of the roots at the edges
    assert (gap[~touching] > -1e-5 * AMPLITUDE).all()
    assert touching.mean() == pytest.approx(min(2 * case.half_width / WAVELENGTH, 1.0), abs=2 / n)


def test_small_loads_approach_the_line_contact_of_the_crest() -> None:
    case = wave(1e-6)
    curvature = AMPLITUDE * (2 * np.pi / WAVELENGTH) ** 2
    hertz = np.sqrt(4 * case.mean_pressure * WAVELENGTH / (np.pi * MODULUS * curvature))
    assert case.half_width == pytest.approx(hertz, rel=1e-6, abs=0.0)


def test_traction_carries_its_mean_and_is_at_the_limit_in_slip() -> None:
    case = wave(0.6, 0.5 * 0.4 * FULL)
    n = 2**14
    x = np.arange(n) * WAVELENGTH / n
    assert case.traction(x).mean() == pytest.approx(0.2 * FULL, rel=1e-5, abs=0.0)
    sliding = np.array([0.5 * (case.stick_half_width + case.half_width)])
    np.testing.assert_allclose(case.traction(sliding), 0.5 * case.pressure(sliding), rtol=1e-13)
    stuck = x[x < 0.99 * case.stick_half_width]
    assert (case.traction(stuck) < 0.5 * case.pressure(stuck)).all()
    displacement = surface(case.traction(x))  # the same kernel in plane strain without coupling
    np.testing.assert_allclose(displacement[: len(stuck)], displacement[0], atol=1e-5 * AMPLITUDE)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"amplitude": 0.0}, "amplitude"),
        ({"wavelength": -1.0}, "wavelength"),
        ({"contact_modulus": np.inf}, "contact_modulus"),
        ({"mean_pressure": -1.0}, "mean_pressure"),
        ({"friction": 0.0}, "friction"),
        ({"mean_traction": 51.0}, "mean_traction"),
    ],
)
def test_impossible_waves_are_refused_by_name(change: dict[str, float], name: str) -> None:
    good = {"amplitude": 1e-5, "wavelength": 1e-3, "contact_modulus": 1e6, "mean_pressure": 100.0, "friction": 0.5}
    with pytest.raises(InvalidInput, match=name):
        WavyContact(**(good | change))
