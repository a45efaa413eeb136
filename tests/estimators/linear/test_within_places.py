"""What varies within places, freed of the noise of v and f_n and of errors that go together over time."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import estimators
from benchmarks.estimators import lasting_errors
from estimators.linear.within_places import calibrated, within_places
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]
QUIET, ALIKE = np.zeros(2), np.ones(400)
PLACES, MOMENTS = 12, 100


def triangle(values: np.ndarray, noise: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Of values [moments, places, 3], all places seen at all moments."""
    flat, deviation = values.reshape(-1, 3), (values - values.mean(axis=0)).reshape(-1, 3)
    time = np.repeat(np.arange(len(values)) / 60.0, values.shape[1])
    lost = np.array(noise) * np.sqrt(len(flat) - values.shape[1])
    place = np.tile(np.arange(values.shape[1]), len(values))
    return within_places(flat, deviation, np.ones(len(flat)), time, lost, place)[0]


def slopes(factor: np.ndarray) -> np.ndarray:
    return np.linalg.solve(factor[:2, :2], factor[:2, 2])


def test_independent_errors_without_noise_are_left_as_they_are() -> None:
    rng = np.random.default_rng(0)
    values = np.array([1e-3, 0.1, 0.4]) + rng.standard_normal((MOMENTS, PLACES, 3)) * [1e-4, 0.01, 0.02]
    deviation = (values - values.mean(axis=0)).reshape(-1, 3)
    np.testing.assert_allclose(triangle(values).T @ triangle(values), deviation.T @ deviation, rtol=1e-11)


@pytest.mark.parametrize("noise", [(1e-3, 0.0), (0.0, 0.01), (1e-3, 0.01)], ids=["of v", "of f_n", "of both"])
def test_noise_makes_no_slope(noise: tuple[float, float]) -> None:
    rng = np.random.default_rng(0)
    f_n = 0.1 + 0.01 * rng.standard_normal((400, 20))
    v = 2e-3 + 0.05 * (f_n - 0.1) + 1e-3 * rng.standard_normal(f_n.shape)
    true = np.stack([v, f_n, 0.4 + 20.0 * v - 0.8 * f_n], axis=-1)
    values = true + np.append(noise, 0.0) * rng.standard_normal(true.shape)
    half = np.where(np.array(noise) > 0.0, 0.65, 1.1) * [20.0, 0.8]
    assert (np.abs(slopes(triangle(values))) < half).all()  # of which half of the variance is noise
    np.testing.assert_allclose(slopes(triangle(values, noise)), [20.0, -0.8], rtol=0.1)  # twice its standard error


def test_what_is_all_noise_says_nothing() -> None:
    regressors = np.array([[1.0, 0.2], [0.0, 0.5]])
    for noise, rank in (((0.0, 10.0), 1), ((10.0, 0.0), 1), ((10.0, 10.0), 0)):
        assert np.linalg.matrix_rank(calibrated(regressors, np.array(noise)), tol=1e-12) == rank, noise
    np.testing.assert_array_equal(calibrated(regressors, QUIET), regressors)
    level = regressors * [1.0, 0.0]  # all normal forces alike
    np.testing.assert_array_equal(calibrated(level, np.array([0.0, 1.0])), level)


def test_noise_of_a_force_that_stays_as_it_is_takes_nothing_from_velocity() -> None:
    """Of places pressed evenly, f_n deviates by the rounding of its mean alone."""
    v = np.random.default_rng(0).uniform(1e-3, 5e-3, (MOMENTS, PLACES))
    f_n = np.linspace(0.03, 0.17, PLACES) + 1e-17 * v / v.max()
    values = np.stack([v, np.broadcast_to(f_n, v.shape), 0.4 + 8.0 * v], axis=-1)
    values[..., 1] += np.spacing(values[..., 1]) * (v > 3e-3)
    told = triangle(values, (1e-7, 1e-3))
    assert told[0, 2] / told[0, 0] == pytest.approx(8.0, rel=1e-6)  # 1e-7 m/s of noise takes a part of 1e-8


def information(error: np.ndarray, seed: int = 0) -> float:
    """Of the slope of v, which all places share; the error [moments, 1 or places] is no part of it."""
    rng = np.random.default_rng(seed)
    v = 1e-3 * np.repeat(np.cumsum(rng.standard_normal(len(error)))[:, None], PLACES, axis=1)
    f_n = 0.1 + 0.01 * rng.standard_normal(v.shape)
    told = triangle(np.stack([v, f_n, 0.4 + error * np.ones(v.shape)], axis=-1))
    whole = triangle(np.stack([v, f_n, np.full(v.shape, 0.4)], axis=-1))
    return float((np.linalg.inv(whole[:2, :2].T @ whole[:2, :2]) / np.linalg.inv(told[:2, :2].T @ told[:2, :2]))[0, 0])


def test_errors_that_go_together_tell_of_a_slope_as_fewer_samples_would() -> None:
    rng = np.random.default_rng(0)
    own = [information(0.02 * rng.standard_normal((MOMENTS, PLACES)), seed) for seed in range(50)]
    shared = [information(0.02 * rng.standard_normal((MOMENTS, 1)), seed) for seed in range(50)]
    lasting = [information(0.02 * np.repeat(rng.standard_normal((MOMENTS // 5, 1)), 5, axis=0), k) for k in range(50)]
    assert np.median(own) == pytest.approx(1.0, rel=1e-9)
    assert np.mean(own) > 0.88
    assert 0.9 < PLACES * np.median(shared) < 1.5
    assert 0.18 < PLACES * np.median(lasting) < 0.3


@pytest.mark.parametrize("error", [0.0, 1e-17], ids=["none", "rounding"])
def test_without_errors_none_go_together(error: float) -> None:
    assert information(error * np.arange(MOMENTS)[:, None]) == pytest.approx(1.0, rel=1e-9)


def test_what_varies_by_rounding_alone_tells_nothing() -> None:
    values = np.ones((20, 1, 3)) * [1e-3, 0.1, 0.4] + 1e-17 * np.arange(20)[:, None, None]
    values[..., 2] += 0.02 * np.random.default_rng(0).standard_normal((20, 1))
    found = triangle(values)
    np.testing.assert_array_equal(found[:, :2], 0.0)
    assert np.linalg.norm(found) == pytest.approx(np.sqrt(20) * values[..., 2].std(), rel=1e-12)
    np.testing.assert_array_equal(triangle(values[:1]), 0.0)


def drifting(samples: Make, seed: int) -> FrictionSamples:
    """A grasp of 25 frames, from each to the next of which friction and velocity change in all 16 places at once."""
    steps = np.repeat(np.random.default_rng(seed).standard_normal((2, 25)), 16, axis=1)
    data = samples(400, seed=seed, tangential_velocity=2e-3 + 5e-4 * steps[0], noise=steps[1], scale=0.004)
    return replace(data, element=np.tile(np.arange(16), 25), time=np.repeat(np.arange(25.0), 16))


def test_friction_that_drifts_within_grasps_makes_no_slope_certain(samples: Make) -> None:
    held = []
    for seed in range(0, 160, 4):
        model = estimators.fit([drifting(samples, seed + k) for k in range(4)], method="hierarchical")
        low, high = model.interval()[1]
        held.append(low <= 2.0 <= high)
    assert np.mean(held) >= 0.8  # of intervals for 95 %, from 25 moments each; 0.4, were all samples independent


def test_the_order_of_samples_is_that_of_their_times(samples: Make) -> None:
    data = drifting(samples, 0)
    order = np.random.default_rng(0).permutation(len(data))
    shuffled = replace(data, **{name: getattr(data, name)[order] for name in data.arrays()})
    ours, theirs = (estimators.fit(each, method="hierarchical") for each in (data, shuffled))
    np.testing.assert_allclose(ours.covariance, theirs.covariance, rtol=1e-8)


@pytest.mark.parametrize("lasting", [0.98, 0.995], ids=["an eighth", "half"])
def test_slopes_of_one_record_allow_for_errors_that_last_for_a_part_of_it(lasting: float) -> None:
    held = []
    for seed in range(40):
        record = lasting_errors.grasp(np.random.default_rng(seed), 1, lasting)
        low, high = estimators.fit(estimators.Moments.from_samples(record), method="hierarchical").interval().T
        held.append((low <= lasting_errors.LAW) & (high >= lasting_errors.LAW))
    assert (np.mean(held, axis=0) >= 0.85).all()  # of 95 %; 0.4 to 0.6, were stretches of time independent


@pytest.mark.parametrize("lasting", [0.0, 0.995], ids=["independent", "lasting"])
def test_one_record_of_one_place_and_its_moments_say_the_same(lasting: float) -> None:
    record = lasting_errors.grasp(np.random.default_rng(0), 1, lasting)
    samples, moments = (
        estimators.fit(each, "hierarchical") for each in (record, estimators.Moments.from_samples(record))
    )
    np.testing.assert_allclose(samples.coefficients, moments.coefficients, rtol=1e-9)
    np.testing.assert_allclose(samples.covariance, moments.covariance, rtol=1e-6)


def one_place(error: np.ndarray, slope: float = 20.0) -> np.ndarray:
    """Of a record in which velocity steps from 2 to 4 mm/s half way, and the force wanders by itself."""
    rng = np.random.default_rng(5)
    v, f_n = np.repeat([2e-3, 4e-3], len(error) // 2), 0.1 + 0.01 * rng.standard_normal(len(error))
    values = np.stack([v, f_n, 0.4 + slope * v + error], axis=-1)
    return within_places(values, values - values.mean(axis=0), ALIKE, np.arange(400.0), QUIET, np.zeros(400, int))[1]


def test_a_step_of_velocity_in_one_record_stays_as_large_and_shows() -> None:
    """Errors that wander for a tenth of the record, of a tenth of what the step changes."""
    white = np.random.default_rng(1).standard_normal(400)
    wander = np.convolve(white, np.exp(-np.arange(200) / 40.0), mode="full")[:400]
    found = one_place(0.004 * wander / wander.std())
    slope = slopes(found)[0]
    error = found[2, 2] / np.sqrt(400) * np.sqrt(np.linalg.inv(found[:2, :2].T @ found[:2, :2])[0, 0])
    assert slope == pytest.approx(20.0, abs=3.0 * error)
    assert 2.5 * error < slope < 40.0 * error  # were all samples independent, 100 errors


def test_independent_errors_of_one_place_cost_a_step_half_its_information() -> None:
    """Errors that last put each half of the record off, which twenty stretches do not quite rule out."""
    errors = 0.02 * np.random.default_rng(0).standard_normal((50, 400))
    whole = np.linalg.det(one_place(np.zeros(400))[:2, :2])
    shares = [np.linalg.det(one_place(error)[:2, :2]) / whole for error in errors]
    assert 0.4 < np.median(np.square(shares)) < 0.6


def test_a_record_too_short_for_lasting_errors_counts_its_stretches() -> None:
    values = np.random.default_rng(0).standard_normal((5, 3))
    found = within_places(values, values - values.mean(axis=0), np.ones(5), np.arange(5.0), QUIET, np.zeros(5, int))
    np.testing.assert_array_equal(*found)
