"""Gains of sensors one by one against the formula for all of them at once, and what many sensors take."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import estimators
from estimators.defaults import GRID
from estimators.likelihoods.hierarchical import hierarchical as sampled
from estimators.linear import hierarchical as sums
from estimators.linear.fit_data import FitData, gather
from estimators.linear.hierarchical import Hierarchical, Products
from estimators.linear.posterior_grid import PosteriorGrid, ScaleNodes, posterior_grid
from estimators.methods.reporting import sensor_gain
from slipcore.samples import FrictionSamples
from stiction_client.support import SENSOR_GAIN

FIRST, SECOND = np.triu_indices(4)


def grasp(seed: int, gain: float, sensor: str, unknown: bool = False, n: int = 40) -> FrictionSamples:
    """A grasp of eight places as a sensor of this gain shows it."""
    rng = np.random.default_rng([seed, 31])
    place = np.arange(n) % 8
    v, f_n = rng.uniform(1e-4, 5e-3, n), rng.uniform(0.05, 0.2, 8)[place] * rng.uniform(0.8, 1.2, n)
    law = (0.45 + 8.0 * v - 0.8 * f_n) * (1.0 + gain) * (1.0 + 0.03 * rng.standard_normal())
    mu = law + 0.02 * rng.standard_normal(8)[place] + 0.03 * rng.standard_normal(n)
    seen = FrictionSamples(
        mu, v, f_n, mu * f_n, 0.01 * np.arange(n, dtype=float), place, np.ones(n), 1e-6, sensor=sensor
    )
    return replace(seen, velocity_is_relative=np.full(n, unknown))


def material(gains: list[float], unknown: int = 0, each: int = 2) -> FitData:
    """Grasps of each sensor in turn, so that those of one are apart; the first ones of unknown velocity."""
    count = len(gains)
    return gather([grasp(k, gains[k % count], f"s{k % count}", k < unknown) for k in range(each * count)])


def full(square: np.ndarray) -> np.ndarray:
    """Symmetric matrices [..., 4, 4] from the ten products kept of each."""
    whole = np.empty((*square.shape[:-1], 4, 4))
    whole[..., FIRST, SECOND] = whole[..., SECOND, FIRST] = square
    return whole


def at_once(model: Hierarchical, products: Products, nodes: ScaleNodes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean [m, s], covariance [m, s, s] and that with β [m, s, 3] of all gains, for sums [m, s] at each node."""
    h, nu = model.direction, (nodes.scatter[:, 3] / nodes.scatter[:, 0])[:, None] ** 2
    column = full(products.square) @ np.append(h, 0.0)
    weight = nu / (1.0 + nu * (column[..., :3] @ h))
    off = weight[..., None] * ((full(products.unknown)[..., :3, :3] @ h) @ model.off_by.T)
    slope = -weight[..., None] * (column[..., :3] @ np.linalg.inv(model.pooled.root))
    mean = weight * column[..., 3] + np.einsum("msi,mi->ms", slope, nodes.mean - model.pooled.mean)
    with_coefficients = slope @ nodes.covariance
    covariance = with_coefficients @ slope.swapaxes(1, 2) + model.offset * off @ off.swapaxes(1, 2)
    covariance += (nodes.scatter[:, :1] ** 2 * weight)[..., None] * np.eye(weight.shape[1])
    return mean, covariance, with_coefficients


def at_nodes(grid: PosteriorGrid) -> Products:
    """The grid's sums at each of its nodes, found again by their scales."""
    sigma, tau, omega = grid.nodes.scatter.T[:3]
    places = [
        np.abs(2.0 * np.log(scale / sigma)[:, None] - axis).argmin(axis=1)
        for scale, axis in zip((tau, omega), grid.axes[:2], strict=True)
    ]
    return grid.products.at(places[0] * len(grid.axes[1]) + places[1])


def same(found: NDArray[np.float64], expected: NDArray[np.float64]) -> None:
    """Equal to the rounding of sums in another order."""
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("count", "unknown"), [(2, 0), (5, 0), (5, 3)])
def test_gains_one_by_one_are_those_of_all_at_once(count: int, unknown: int) -> None:
    grid = posterior_grid(material([0.1, -0.05, 0.0, 0.02, -0.1][:count], unknown))
    nodes, found = grid.nodes, grid.nodes.gains
    assert found is not None
    mean, covariance, with_coefficients = at_once(grid.model, at_nodes(grid), nodes)
    for place in range(count):
        own = found.of(place)
        same(own.mean, mean[:, place])
        same(own.variance, covariance[:, place, place])
        same(own.with_coefficients, with_coefficients[:, place])
    between, variance = found.difference(0, count - 1)
    same(between, mean[:, 0] - mean[:, -1])
    exact = covariance[:, 0, 0] + covariance[:, -1, -1] - 2.0 * covariance[:, 0, -1]
    same(variance, exact)
    average = nodes.weight @ mean
    away = mean - average
    together = np.einsum("m,mij->ij", nodes.weight, covariance) + (nodes.weight * away.T) @ away
    moments = found.moments(nodes.weight, range(count))
    same(moments[0], average)
    same(moments[1], together)
    same(np.array(found.of(1).moments(nodes.weight)), np.array([average[1], together[1, 1]]))


@pytest.mark.parametrize("unknown", [0, 3])
def test_blocks_of_points_change_nothing(unknown: int, monkeypatch: pytest.MonkeyPatch) -> None:
    posterior = sampled(material([0.1, -0.05, 0.0], unknown))
    model, products = posterior.grid.model, posterior.grid.products
    log_nu = np.linspace(-3.0, 3.0, 3 * len(products.square))
    whitened = np.random.default_rng(0).standard_normal((20, 4))
    found = []
    for size in (GRID.block_bytes, 2**10):
        monkeypatch.setattr(sums, "GRID", replace(GRID, block_bytes=size))
        found.append((model.whole(products, log_nu), posterior.log_probability(whitened)))
    assert len(sums.blocks_of(20, 1000)) == 20
    for one, other in zip(found[0][0], found[1][0], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(one).max())  # order of sums
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-10)


def test_gains_of_draws_are_those_of_the_sums_between_nodes() -> None:
    posterior = sampled(material([0.1, -0.05]))
    nodes = posterior.nodes(np.random.default_rng(1).standard_normal((30, 4)))
    assert nodes.gains is not None
    sigma, tau, omega = nodes.scatter.T[:3]
    products = posterior.products(2.0 * np.log(tau / sigma), 2.0 * np.log(omega / sigma))
    mean, covariance, _ = at_once(posterior.grid.model, products, nodes)
    for place in range(2):
        own = nodes.gains.of(place)
        same(own.mean, mean[:, place])
        same(own.variance, covariance[:, place, place])


def test_the_pair_that_differs_most_is_found_among_many() -> None:
    gains = [0.0, 0.01, -0.01, 0.0, 0.25, 0.01, 0.0, -0.2, 0.02, -0.01, 0.0, 0.01]
    nodes = posterior_grid(material(gains)).nodes
    assert nodes.gains is not None
    mean, covariance = nodes.gains.moments(nodes.weight, range(len(gains)))
    own = np.diag(covariance)
    apart = (mean[:, None] - mean) / np.sqrt(own[:, None] + own - 2.0 * covariance + 1e-12)
    first, second = np.unravel_index(int(apart.argmax()), apart.shape)
    assert (nodes.gains.names[first], nodes.gains.names[second]) == ("s4", "s7")
    assert "sensor 's4' shows" in str(sensor_gain(nodes)[SENSOR_GAIN])
    assert "than 's7'" in str(sensor_gain(nodes)[SENSOR_GAIN])


def test_memory_of_many_sensors_is_little() -> None:
    grasps = [grasp(k, 0.01 * (k % 5), f"s{k}") for k in range(40)]
    tracemalloc.start()
    try:
        model = estimators.fit(grasps, method="hierarchical")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert model.scales is not None
    assert model.scales.between_sensors is not None
    assert len(model.scales.between_sensors.sensors) == 40
    assert peak < 40e6  # a number for each pair of sensors at each node: 130 MB
