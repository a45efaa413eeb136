"""The strength found from one nearby, against singular values and closed forms."""

import numpy as np
import pytest

from slipcore.forces.defaults import STRENGTH
from slipcore.forces.inverse.nearby_strength import TriangularResponse
from slipcore.forces.inverse.strength import Spectrum

SHAPES = [(1, 1), (40, 90), (90, 40), (64, 64)]


def drawn(m: int, p: int, strength: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """A response of singular values over four decades, and data of this strength."""
    rng = np.random.default_rng(m)
    response = rng.standard_normal((m, p)) * 10.0 ** rng.uniform(-1.0, 3.0, p)
    return response, strength * response @ rng.standard_normal(p) + rng.standard_normal(m)


def by_singular_values(response: np.ndarray, data: np.ndarray, strength: float) -> float:
    spectrum = Spectrum.of(response, data)
    return spectrum.log_evidence(strength) + 0.5 * float(spectrum.y @ spectrum.y)


@pytest.mark.parametrize(("m", "p"), SHAPES)
@pytest.mark.parametrize("strength", [1e-3, 0.05, 1.0])
def test_the_log_probability_is_that_of_singular_values(m: int, p: int, strength: float) -> None:
    response, data = drawn(m, p)
    before = response.copy(), data.copy()
    found = TriangularResponse.of(response, data).evidence(strength)
    assert found.log_probability == pytest.approx(by_singular_values(response, data, strength), rel=1e-10, abs=1e-9)
    np.testing.assert_array_equal(response, before[0])
    np.testing.assert_array_equal(data, before[1])


@pytest.mark.parametrize(("m", "p"), SHAPES)
def test_slope_and_curvature_are_its_derivatives(m: int, p: int) -> None:
    response, data = drawn(m, p)
    triangular = TriangularResponse.of(response, data)
    step, at = 1e-4, triangular.evidence(0.03)
    above, below = (triangular.evidence(0.03 * np.exp(sign * step)) for sign in (1.0, -1.0))
    slope = (above.log_probability - below.log_probability) / (2.0 * step)
    assert at.slope == pytest.approx(slope, rel=1e-5, abs=1e-5)
    assert at.curvature == pytest.approx((above.slope - below.slope) / (2.0 * step), rel=1e-5, abs=1e-5)


def test_the_most_probable_strength_of_equal_directions_is_met_in_closed_form() -> None:
    """1 + g² s² is the mean square of the data; the last step leaves a hundredth of a nat."""
    data = np.array([30.0, -20.0, 25.0])
    triangular = TriangularResponse.of(100.0 * np.eye(3), data)
    strength, log_probability = triangular.best(0.1)
    spread = float(data @ data) / 3.0
    assert strength == pytest.approx(np.sqrt(spread - 1.0) / 100.0, rel=0.05)
    assert log_probability == pytest.approx(1.5 * (spread - 1.0) - 1.5 * np.log(spread), abs=0.02)


@pytest.mark.parametrize(("m", "p"), SHAPES[1:])
@pytest.mark.parametrize("near", [1e-3, 0.02, 0.05, 0.1, 1.0])
def test_it_is_found_from_far_and_near(m: int, p: int, near: float) -> None:
    response, data = drawn(m, p)
    best = Spectrum.of(response, data).choose(0.0, m, "evidence")
    strength, log_probability = TriangularResponse.of(response, data).best(near)
    assert strength == pytest.approx(best, rel=0.01)
    assert log_probability == pytest.approx(by_singular_values(response, data, best), abs=0.03)


def test_no_strength_exceeds_the_largest() -> None:
    response, data = drawn(40, 20, strength=30.0)
    strength, log_probability = TriangularResponse.of(response, data).best(0.2)
    assert strength == pytest.approx(STRENGTH.largest)
    assert log_probability == pytest.approx(by_singular_values(response, data, STRENGTH.largest), abs=0.03)


def test_what_is_not_worth_it_is_not_refined() -> None:
    response, data = drawn(90, 40)
    triangular = TriangularResponse.of(response, data)
    _, exact = triangular.best(0.035)
    _, roughly = triangular.best(0.035, worth=exact + 1e3)
    assert 0.03 < abs(roughly - exact) < 20.0
    assert triangular.best(0.035, worth=exact - 1.0)[1] == exact


def test_a_triangular_response_stays_one_times_lower_triangles() -> None:
    response, data = drawn(90, 40)
    root = np.tril(np.random.default_rng(4).standard_normal((2, 20, 20)))
    both = np.zeros((40, 40))
    both[:20, :20], both[20:, 20:] = root
    found = TriangularResponse.of(response, data).times(root)
    np.testing.assert_array_equal(found.upper, np.triu(found.upper))
    expected = TriangularResponse.of(response @ both, data).evidence(0.05)
    np.testing.assert_allclose(found.evidence(0.05), expected, rtol=1e-8)


def test_what_is_small_beside_the_largest_keeps_its_digits() -> None:
    """Of two directions 1e9 and 1e-3 the second shows noise alone; squares would lose that noise."""
    rng = np.random.default_rng(5)
    u, v = (np.linalg.qr(rng.standard_normal((2, 2)))[0] for _ in range(2))
    data = u @ np.array([1e9, 2.0])
    found = TriangularResponse.of(u * np.array([1e9, 1e-3]) @ v.T, data).evidence(1.0)
    assert found.log_probability == pytest.approx(0.5 * (1e18 - 1.0) - np.log(1e9), rel=1e-15)
    assert found.slope == pytest.approx(0.0, abs=1e-4)
