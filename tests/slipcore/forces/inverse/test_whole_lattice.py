"""Pressure anywhere under the lattice, against the same regression with dense matrices."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.forces.defaults import LATTICE
from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.inverse.prior import factors, usual
from slipcore.forces.inverse.whole_lattice import whole_lattice
from slipcore.forces.operator.nodes import Nodes

NODES = Nodes(Grid((3, 4), (1e-3, 1e-3), (0.0, 0.0)))


@pytest.fixture
def observation() -> ObservationModel:
    """Twenty data of noise between 1 and 2 µm."""
    rng = np.random.default_rng(3)
    return ObservationModel(1e-5 * rng.standard_normal((20, 3, 12)), rng.uniform(1e-6, 2e-6, 20))


def test_pressure_is_the_mean_of_a_normal_posterior(observation: ObservationModel) -> None:
    """Where unknowns of a joint normal distribution are conditioned on data, by the covariance of both."""
    typical = 4e-6
    found = whole_lattice(observation, NODES, typical, usual())
    root = factors(NODES.places(), 1e-3, usual())
    prior = np.stack([part @ part.T for part in root])
    of_data = np.einsum("mai,aij,naj->mn", observation.response, prior, observation.response)
    whitened = of_data / np.outer(observation.noise, observation.noise)
    squared = (LATTICE.concentration * typical / np.median(observation.noise)) ** 2 * 20.0 / np.trace(whitened)
    covariance = squared * of_data + np.diag(observation.noise**2)
    with_data = squared * np.einsum("ij,mj->im", prior[2], observation.response[:, 2])
    gain = with_data @ np.linalg.inv(covariance)
    np.testing.assert_allclose(found.operator, gain, rtol=1e-8, atol=1e-8 * np.abs(gain).max())
    variance = np.diag(squared * prior[2] - gain @ with_data.T)
    np.testing.assert_allclose(found.deviation, np.sqrt(variance), rtol=1e-8)
