"""Where the object touches: relevance of nodes against closed forms."""

import numpy as np
import pytest
from scipy.linalg import hadamard

from slipcore.contact.elasticity.grid import Grid
from slipcore.forces.defaults import SUPPORT
from slipcore.forces.inverse.covariance import covariance_root
from slipcore.forces.inverse.fit import ObservationModel, condensed, log_evidence
from slipcore.forces.inverse.prior import factors, usual
from slipcore.forces.inverse.support import SupportCandidate, better_support, node_relevance, relevant_nodes, widened
from slipcore.forces.operator.nodes import Nodes

NODES = 16


def known_spectrum(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A response [16, 3, 16] = U s Vᵀ, exact in binary: U and the parts of V are Hadamard matrices, s powers of 2."""
    u = hadamard(NODES) / 4.0
    v = np.zeros((3, NODES, NODES))
    for i in range(NODES):
        v[i % 3, :, i] = u[:, i]
    v = v.reshape(3 * NODES, NODES)
    return (u * values @ v.T).reshape(NODES, 3, NODES), u, v


@pytest.mark.parametrize("largest", [2.0**4, 2.0**22])
def test_relevance_is_that_of_the_singular_value_decomposition(largest: float) -> None:
    """Mean v s/(1 + s²) uᵀd and share v² s²/(1 + s²), also where 1 is nothing beside s²."""
    values = largest * 2.0 ** -np.arange(0.0, 2.0 * NODES, 2.0)
    response, u, v = known_spectrum(values)
    data = u @ values
    gain, freedom = node_relevance(response, data, np.ones(NODES))
    mean, share = v @ (values**2 / (1.0 + values**2)), v**2 @ (values**2 / (1.0 + values**2))
    np.testing.assert_allclose(gain, (mean.reshape(3, NODES) ** 2).sum(axis=0), rtol=1e-8)
    np.testing.assert_allclose(freedom, share.reshape(3, NODES).sum(axis=0), rtol=1e-8)


def test_the_root_of_a_covariance_keeps_what_is_small_beside_its_largest_eigenvalue() -> None:
    """1 + S Sᵀ of one strong direction: |det R| = √(1 + s²), and directions across it keep the variance 1."""
    direction = hadamard(NODES)[:, 3] / 4.0
    root = covariance_root(2.0**24 * np.outer(direction, [0.6, 0.8]))
    assert abs(np.prod(np.diag(root))) == pytest.approx(2.0**24, rel=1e-7)
    across = hadamard(NODES)[:, 5] / 4.0
    np.testing.assert_allclose(np.linalg.norm(np.linalg.solve(root.T, across)), 1.0, rtol=1e-7)
    np.testing.assert_array_equal(np.tril(root, -1), 0.0)


def test_more_data_than_unknowns_are_condensed_without_loss() -> None:
    rng = np.random.default_rng(1)
    response, data, deviation = rng.standard_normal((40, 3, 5)), rng.standard_normal(40), rng.random(5)
    fewer, of_them = condensed(response, data)
    assert fewer.shape == (15, 3, 5)
    for found, expected in zip(
        node_relevance(fewer, of_them, deviation), node_relevance(response, data, deviation), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-10)
    assert condensed(fewer, of_them)[0] is fewer


@pytest.mark.parametrize("noise", [1e-3, 1e-9])
def test_nodes_that_data_show_directly_are_found_with_the_row_beside_them(noise: float) -> None:
    """Every traction seen by itself: the support is where it is not zero, and as far as coupling reaches."""
    shape = (7, 8)
    count = shape[0] * shape[1]
    loaded = np.zeros(shape, dtype=bool)
    loaded[2:5, 3:7] = True
    response = np.eye(3 * count).reshape(3 * count, 3, count)
    data = np.concatenate([0.2 * loaded.ravel(), np.zeros(count), 0.7 * loaded.ravel()])
    found = relevant_nodes(ObservationModel(response, np.full(3 * count, noise)), data, np.ones(shape, dtype=bool))
    np.testing.assert_array_equal(found, widened(loaded, 1))


LATTICE = Nodes(Grid((9, 8), (1e-3, 1e-3)))


def directly_seen(loaded: np.ndarray, noise: float) -> tuple[ObservationModel, np.ndarray]:
    """Every traction seen by itself with this noise: pressure of 0.4 where it is loaded, and no shear."""
    count = loaded.size
    data = np.concatenate([np.zeros(2 * count), 0.4 * loaded.ravel()])
    data += noise * np.random.default_rng(5).standard_normal(3 * count)
    return ObservationModel(np.eye(3 * count).reshape(3 * count, 3, count), np.full(3 * count, noise)), data


def first(observation: ObservationModel, data: np.ndarray, support: np.ndarray) -> SupportCandidate:
    """A support from which better ones are sought."""
    return SupportCandidate(support, *log_evidence(observation, data, LATTICE, support.ravel(), usual()))


def test_a_support_is_judged_by_the_strength_that_speaks_for_it_most() -> None:
    """By the density of the data themselves: its maximum over strengths, but for what no support changes."""
    observation, data = directly_seen(np.ones((9, 8), dtype=bool), 0.05)
    support = np.zeros(72, dtype=bool)
    support[10:14] = True
    found, prior = log_evidence(observation, data, LATTICE, support, usual())
    root = factors(LATTICE.places()[support], 1e-3, usual())

    def density(strength: float) -> float:
        value = 0.0
        for axis, part in enumerate(root):
            covariance = np.eye(4) + (strength / 0.05) ** 2 * part @ part.T
            seen = data.reshape(3, -1)[axis, support] / 0.05
            value += -0.5 * (seen @ np.linalg.solve(covariance, seen) + np.linalg.slogdet(covariance)[1])
        return float(value + 0.5 * np.sum((data.reshape(3, -1)[:, support] / 0.05) ** 2))

    assert found == pytest.approx(density(prior.strength), rel=1e-8)
    assert found >= max(density(prior.strength * factor) for factor in (0.8, 0.95, 1.05, 1.25))


@pytest.mark.parametrize("beside", [1, 2])
def test_a_contact_that_is_cut_on_one_side_alone_is_found(beside: int) -> None:
    """From a support that is too wide on one side, to which growing and shrinking on all sides does not lead."""
    loaded = np.zeros((9, 8), dtype=bool)
    loaded[2:6, 2:5] = True
    observation, data = directly_seen(loaded, 0.02)
    wide = loaded.copy()
    wide[2:6, 5 : 5 + beside] = True
    found = better_support(observation, data, LATTICE, first(observation, data, wide))[0].support
    assert found[loaded].all()
    assert (found & ~loaded).sum() <= 4 * (beside - 1) + 1


def test_supports_that_data_cannot_distinguish_are_all_returned() -> None:
    loaded = np.zeros((9, 8), dtype=bool)
    loaded[2:6, 2:5] = True
    seen = [directly_seen(loaded, noise) for noise in (0.01, 0.4)]
    clear, blurred = (better_support(*each, LATTICE, first(*each, loaded)) for each in seen)
    assert len({each.support.tobytes() for each in clear}) == 1
    assert len({each.support.tobytes() for each in blurred}) > 2
    assert len({(each.support.tobytes(), each.prior.smoothness) for each in blurred}) == len(blurred)
    probability = np.array([each.log_probability for each in blurred])
    assert (np.diff(probability[1:]) <= 0.0).all()
    assert probability[-1] >= probability.max() + np.log(SUPPORT.least_probability)
    assert blurred[0].log_probability == max(
        each.log_probability for each in blurred if not each.prior.smoothness.falls
    )


@pytest.mark.parametrize("falls", [False, True])
def test_pressure_that_falls_to_a_rim_speaks_for_a_prior_that_does(falls: bool) -> None:
    """The support that comes first is by the usual prior all the same."""
    y, x = np.mgrid[:9, :8]
    away = np.hypot(x - 3.5, y - 4.0) / 3.6
    loaded = away < 1.0
    pressure = np.where(loaded, np.sqrt(np.maximum(1.0 - away**2, 0.0)) if falls else 0.7, 0.0)
    observation, data = directly_seen(loaded, 0.05)
    data[2 * loaded.size :] += 0.4 * (pressure - loaded).ravel()
    shape = usual()._replace(falls=falls)
    log_usual, log_falling = (
        log_evidence(observation, data, LATTICE, loaded.ravel(), usual()._replace(falls=each))[0]
        for each in (False, True)
    )
    assert (log_falling > log_usual) == falls
    found = better_support(observation, data, LATTICE, first(observation, data, loaded))
    assert not found[0].prior.smoothness.falls
    assert max(found, key=lambda each: each.log_probability).prior.smoothness == shape
