from collections.abc import Callable

import numpy as np
import pytest


@pytest.fixture(scope="session")
def circle_integrals() -> Callable[[float, float, float], dict[str, float]]:
    """Quadrature of ∬ √(c² − r'²) w(θ)/ρ dA in polar coordinates about the field point, for Cerruti and Boussinesq.

    θ is the direction from the field point to the load; w is 1, cos²θ, cos θ sin θ ("one", "xx", "xy"), and cos θ,
    sin θ for the coupling kernel (x − ξ)/ρ² ("x", "y"). Independent of the code under test: no closed form enters.
    """
    nodes, weights = np.polynomial.legendre.leggauss(160)

    def mapped(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        half = 0.5 * (high - low)[..., None]
        return half * nodes + 0.5 * (high + low)[..., None], half * weights

    def integrals(x: float, y: float, c: float) -> dict[str, float]:
        r, towards_axis = np.hypot(x, y), np.arctan2(-y, -x)
        reach = np.pi if r <= c else np.arcsin(c / r)
        theta, w_theta = mapped(np.array(towards_axis - reach), np.array(towards_axis + reach))
        b = x * np.cos(theta) + y * np.sin(theta)  # |field point + ρ e|² = r² + 2 b ρ + ρ²
        half_chord = np.sqrt(np.maximum(c * c - r * r + b * b, 0.0))
        start = np.arccos(np.clip(-b / half_chord, -1.0, 1.0)) if r <= c else np.zeros_like(b)
        tau, w_tau = mapped(start, np.full_like(b, np.pi))  # ρ = −b − half_chord cos τ
        along = half_chord**2 * (np.sin(tau) ** 2 * w_tau).sum(-1) * w_theta
        cosine, sine = np.cos(theta), np.sin(theta)
        kernels = {"one": 1.0, "xx": cosine**2, "xy": cosine * sine, "x": cosine, "y": sine}
        return {name: float((along * kernel).sum()) for name, kernel in kernels.items()}

    return integrals
