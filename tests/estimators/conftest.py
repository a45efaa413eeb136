"""Samples with known truth."""

from collections.abc import Callable

import numpy as np
import pytest

from slipcore.samples import FrictionSamples

TRUTH = np.array([0.4, 2.0, -0.8])
SIGMA = 0.02


def make_samples(
    n: int = 400,
    seed: int = 0,
    coefficients: np.ndarray = TRUTH,
    scale: float = SIGMA,
    offset: float = 0.0,
    elements: int = 20,
    **columns: np.ndarray,
) -> FrictionSamples:
    """Samples of one grasp; ``columns`` replaces what is drawn (tangential_velocity, normal_force, noise, weight)."""
    rng = np.random.default_rng(seed)
    v = columns.get("tangential_velocity", rng.uniform(0.0, 5e-3, n))
    f_n = columns.get("normal_force", rng.uniform(0.02, 0.1, n))
    noise = columns.get("noise", rng.standard_normal(n))
    mu = coefficients[0] + coefficients[1] * v + coefficients[2] * f_n + offset + scale * noise
    return FrictionSamples(
        friction_coefficient=mu,
        tangential_velocity=np.asarray(v),
        normal_force=np.asarray(f_n),
        tangential_force=mu * f_n,
        time=np.arange(n) * 0.01,
        element=rng.integers(0, elements, n),
        weight=columns.get("weight", np.ones(n)),
        element_area=1e-6,
    )


@pytest.fixture
def samples() -> Callable[..., FrictionSamples]:
    return make_samples


@pytest.fixture
def places_as_grasps() -> Callable[[FrictionSamples], list[FrictionSamples]]:
    """The samples of each element as a grasp of its own, for what is about clusters and not about how grasps differ."""
    return lambda data: [data.take(data.element == place) for place in np.unique(data.element)]


@pytest.fixture
def truth() -> np.ndarray:
    return TRUTH


@pytest.fixture
def sigma() -> float:
    return SIGMA
