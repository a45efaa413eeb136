"""What data of an observation determine, and the prior that they speak for."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore.forces.inverse.fit import (
    ObservationModel,
    TractionPrior,
    choose_prior,
    choose_strength,
    fit,
    fit_mean,
    log_evidence,
    mean_traction,
    most_probable,
)
from slipcore.forces.inverse.prior import Smoothness, factors, usual
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import BoolArray, FloatArray

PITCH = 1e-3


@pytest.fixture(scope="module")
def nodes() -> Nodes:
    x, y = np.meshgrid(np.arange(6), np.arange(5), indexing="ij")
    return Nodes.around(PITCH * np.stack((x.ravel(), y.ravel()), axis=-1), PITCH**2)


@pytest.fixture(scope="module")
def support(nodes: Nodes) -> BoolArray:
    """In the middle of the nodes."""
    return np.abs(nodes.places() - nodes.places().mean(axis=0)).max(axis=1) < 2.6 * PITCH


def drawn(nodes: Nodes, support: BoolArray, strength: float, shape: Smoothness) -> tuple[ObservationModel, FloatArray]:
    """Data of a traction that the prior of this strength and shape gives, which each see all of it."""
    rng = np.random.default_rng(8)
    count, seen = len(nodes), 400
    observation = ObservationModel(rng.standard_normal((seen, 3, count)), np.full(seen, 1e-3))
    root = strength * factors(nodes.places()[support], PITCH, shape)
    traction = np.einsum("akj,aj->ak", root, rng.standard_normal((3, support.sum())))
    data = np.einsum("mak,ak->m", observation.response[:, :, support], traction)
    return observation, data + observation.noise * rng.standard_normal(seen)


@pytest.mark.parametrize("fewer", [0, 1])
def test_as_many_data_as_tractions_determine_them_and_one_fewer_does_not(fewer: int) -> None:
    """Data that were not seen are none: their noise is infinite."""
    rng, nodes = np.random.default_rng(3), np.array([True, True, False])
    response, noise = rng.standard_normal((8, 3, 3)), rng.uniform(0.5, 2.0, 8)
    noise[: 2 + fewer] = np.inf
    whitened = (response[..., nodes] / noise[:, None, None]).reshape(8, -1)
    wanted = np.inf if fewer else np.linalg.cond(whitened)
    assert ObservationModel(response, noise).condition(nodes) == pytest.approx(wanted)


def test_a_strength_is_found_as_it_was_drawn_and_scales_with_its_data(nodes: Nodes, support: BoolArray) -> None:
    observation, data = drawn(nodes, support, 0.03, usual())
    found = choose_strength(observation, data, nodes, support, usual(), "evidence")
    assert found.smoothness == usual()
    assert found.strength == pytest.approx(0.03, rel=0.25)
    larger = replace(observation, noise=5.0 * observation.noise)
    scaled = choose_strength(larger, 5.0 * data, nodes, support, usual(), "evidence")
    assert scaled.strength == pytest.approx(5.0 * found.strength, rel=1e-3)


def test_a_shape_that_is_known_has_the_strength_that_the_whole_choice_gives_it(
    nodes: Nodes, support: BoolArray
) -> None:
    observation, data = drawn(nodes, support, 0.03, usual()._replace(shear=0.1))
    chosen = choose_prior(observation, data, nodes, support)
    again = choose_strength(observation, data, nodes, support, chosen.smoothness, "evidence")
    assert chosen.smoothness != usual()
    # Newton's last step gains 0.2 nats: of 90 coefficients, 0.05 of the strength, and it errs by the square of that.
    assert again.strength == pytest.approx(chosen.strength, rel=2e-3)


def test_the_most_probable_prior_is_found_from_another(nodes: Nodes, support: BoolArray) -> None:
    """With its log probability: that of the same prior by singular values, and no less than any other's."""
    observation, data = drawn(nodes, support, 0.03, usual()._replace(shear=0.1))
    near = TractionPrior(usual(), 0.01)
    found, prior = most_probable(observation, data, nodes, support, near)
    assert prior.smoothness == choose_prior(observation, data, nodes, support).smoothness
    exact = log_evidence(observation, data, nodes, support, prior.smoothness)
    assert found == pytest.approx(exact[0], abs=0.03)
    for shape in (usual(), prior.smoothness._replace(pressure=3.0), prior.smoothness._replace(traction=6.0)):
        assert log_evidence(observation, data, nodes, support, shape)[0] <= found + 0.03


def test_no_share_is_from_data_that_were_not_seen_and_none_is_below_zero(nodes: Nodes, support: BoolArray) -> None:
    observation, _ = drawn(nodes, support, 0.1, usual())
    unseen = replace(observation, noise=np.full(400, np.inf))
    share = fit(unseen, nodes, support, TractionPrior(usual(), 0.1)).information()
    np.testing.assert_array_equal(share, np.zeros(3))


@pytest.mark.parametrize("seen", [400, 40])
def test_a_mean_alone_is_that_of_the_whole_fit(nodes: Nodes, support: BoolArray, seen: int) -> None:
    """Of more data than tractions, and of fewer."""
    observation, data = drawn(nodes, support, 0.03, usual())
    observation = ObservationModel(observation.response[:seen], observation.noise[:seen])
    prior = TractionPrior(usual(), 0.03)
    whole = fit(observation, nodes, support, prior)
    np.testing.assert_allclose(fit_mean(observation, nodes, support, prior).operator, whole.operator, atol=1e-9)
    alone = mean_traction(observation, data[:seen], nodes, support, prior)
    np.testing.assert_allclose(alone, whole.mean(data[:seen]), atol=1e-9)
