"""Tractions by all frames of one contact, against the whole Gaussian of all frames at once."""

import numpy as np
import pytest
import scipy.linalg

from slipcore.forces.inverse.fit import ObservationModel, TractionFit, TractionPrior, fit
from slipcore.forces.inverse.over_time import Modes, Persistence
from slipcore.forces.inverse.prior import usual
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import FloatArray

PITCH = 1e-3
WHITE = 0.7
TIME = np.array([0.0, 0.1, 0.15, 0.4])
LASTS = 0.3


def problem(seen: int, scale: float = 1.0) -> tuple[ObservationModel, TractionFit, FloatArray]:
    """Nine nodes of a small lattice seen by so many data, and data of four frames."""
    x, y = np.meshgrid(np.arange(5), np.arange(4), indexing="ij")
    nodes = Nodes.around(PITCH * np.stack((x.ravel(), y.ravel()), axis=-1), PITCH**2)
    rng = np.random.default_rng(3)
    noise = scale * np.where(np.arange(seen) % 7 == 3, np.inf, 1e-2)
    observation = ObservationModel(scale * rng.standard_normal((seen, 3, len(nodes))), noise)
    support = np.abs(nodes.places() - nodes.places().mean(axis=0)).max(axis=1) < 1.6 * PITCH
    data = scale * rng.standard_normal((len(TIME), seen)) * 0.05
    return observation, fit(observation, nodes, support, TractionPrior(usual(), 0.02)), data


def all_at_once(observation: ObservationModel, fitted: TractionFit, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean [t, 3 j] and covariance [t, 3 j, 3 j] of tractions by one Gaussian of all frames."""
    own = np.isfinite(observation.noise)
    response = observation.response[own][:, :, fitted.support].reshape(own.sum(), -1)
    root = scipy.linalg.block_diag(*fitted.prior_root)
    noise = observation.noise[own]
    in_time = np.exp(-np.abs(TIME[:, None] - TIME) / LASTS)
    tractions = np.kron(in_time, root @ root.T)
    seen = np.kron(np.eye(len(TIME)), response)
    between = np.kron(in_time * (1.0 - WHITE) + np.eye(len(TIME)) * WHITE, np.diag(noise**2))
    gain = tractions @ seen.T @ np.linalg.inv(seen @ tractions @ seen.T + between)
    covariance = tractions - gain @ seen @ tractions
    size = response.shape[1]
    parts = [slice(k * size, (k + 1) * size) for k in range(len(TIME))]
    return (gain @ data[:, own].ravel()).reshape(len(TIME), -1), np.stack([covariance[part, part] for part in parts])


@pytest.mark.parametrize("count", [60, 20])
def test_filter_and_smoother_are_the_gaussian_of_all_frames_at_once(count: int) -> None:
    """Also where data are fewer than the 36 tractions, and where some are not seen."""
    observation, fitted, data = problem(count)
    modes = Modes.of(observation, fitted, WHITE)
    assert len(modes.s) == 3 * fitted.support.sum() == 36
    memory = Persistence.over(np.diff(TIME), LASTS)
    found = modes.tractions(modes.smoothed(data @ modes.components.T, memory))
    mean, covariance = all_at_once(observation, fitted, data)
    np.testing.assert_allclose(found.mean @ modes.root.T, mean, rtol=0.0, atol=1e-9 * np.abs(mean).max())
    by_modes = np.einsum("ar,tr,br->tab", modes.root, found.variance, modes.root)
    np.testing.assert_allclose(by_modes, covariance, rtol=0.0, atol=1e-9 * np.abs(covariance).max())


def test_what_does_not_last_is_each_frame_by_itself() -> None:
    observation, fitted, data = problem(60)
    modes = Modes.of(observation, fitted, WHITE)
    found = modes.tractions(modes.smoothed(data @ modes.components.T, Persistence.over(np.diff(TIME), 1e-6)))
    alone = np.stack([fitted.mean(each).ravel() for each in data])
    np.testing.assert_allclose(found.mean @ modes.root.T, alone, rtol=0.0, atol=1e-12 * np.abs(alone).max())
    covariance = np.einsum("ar,r,br->ab", modes.root, found.variance[2], modes.root)
    before = fitted.root @ fitted.root.T
    np.testing.assert_allclose(covariance, before, rtol=0.0, atol=1e-12 * np.abs(before).max())


def test_the_time_over_which_tractions_last_is_that_of_the_data() -> None:
    """Half a second, of 400 frames drawn so: within a factor of two."""
    observation, fitted, _ = problem(60)
    modes, rng = Modes.of(observation, fitted, WHITE), np.random.default_rng(5)
    steps = np.full(399, 0.05)
    truth = Persistence.over(steps, 0.5)
    lasts, seen = np.zeros(len(modes.s)), []
    for kept, new in zip(*truth, strict=True):
        lasts = kept * lasts + np.sqrt(new * modes.lasting) * rng.standard_normal(len(modes.s))
        seen.append(lasts + np.sqrt(WHITE) * rng.standard_normal(len(modes.s)))
    found = modes.memory(np.array(seen), 0.05 * np.arange(400))
    assert 0.25 < -0.05 / np.log(found.kept[1]) < 1.0


def test_a_load_at_rest_is_averaged_over_its_frames_to_what_noise_does_not_change() -> None:
    """As one frame with as many times less noise, by closed form."""
    observation, fitted, _ = problem(60)
    modes, rng = Modes.of(observation, fitted, WHITE), np.random.default_rng(6)
    lasts = np.sqrt(modes.lasting) * rng.standard_normal(len(modes.s))
    seen = lasts + np.sqrt(WHITE) * rng.standard_normal((50, len(modes.s)))
    time = 0.1 * np.arange(50)
    expected = 1.0 / (50.0 / WHITE + 1.0 / modes.lasting)
    resting = modes.smoothed(seen, Persistence.over(np.diff(time), 1e12)).variance
    np.testing.assert_allclose(resting, np.broadcast_to(expected, resting.shape), rtol=1e-6)
    found = modes.smoothed(seen, modes.memory(seen, time))
    np.testing.assert_allclose(found.variance[25].mean(), expected.mean(), rtol=0.3)  # by the data's own memory
    away = (found.mean[25] - lasts) / np.sqrt(found.variance[25])
    assert np.mean(away**2) < 1.0 + 3.0 * np.sqrt(2.0 / len(away))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_of_length_change_no_traction(factor: float) -> None:
    found = []
    for scale in (1.0, factor):
        observation, fitted, data = problem(60, scale)
        modes = Modes.of(observation, fitted, WHITE)
        seen = data @ modes.components.T
        found.append(modes.tractions(modes.smoothed(seen, modes.memory(seen, TIME))).mean @ modes.root.T)
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-9 * np.abs(found[0]).max())
