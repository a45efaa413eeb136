from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipcore import GraspLog, StrainRateOptions, detect_slip
from slipcore.detection.shared.records import Decision, DetectorSetup, Surface, for_setup, read_only
from slipcore.detection.strain_rate import step as kernel
from slipcore.detection.strain_rate.method import start
from slipcore.detection.strain_rate.reference import signed_rate, surface_strain
from slipcore.detection.strain_rate.step import step_strain_rate
from slipcore.surface.strain import Lattice, frobenius, lattice_steps

INTERVAL = 1 / 30
OPTIONS = StrainRateOptions()


def lattice() -> Lattice:
    i, j = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    return Lattice.at_rest(1e-3 * np.stack([i, j, 0 * i], axis=-1))


def stretched(stretch: float) -> np.ndarray:
    displacement = np.zeros_like(lattice().position)
    displacement[..., 0] = stretch * lattice().position[..., 0]
    return displacement


def step(
    elements: np.ndarray, displacement: np.ndarray, stays: np.ndarray, interval: float, noise: float = 1e-9
) -> tuple[np.ndarray, np.ndarray]:
    normal = np.broadcast_to([0.0, 0.0, 1.0], displacement.shape).copy()
    after, decision = np.empty_like(elements), Decision(np.empty(stays.shape, bool), np.empty(stays.shape))
    rest, nothing = lattice(), np.zeros(stays.shape)
    sensor = DetectorSetup(*for_setup(rest), np.zeros(0), np.zeros(0), start(rest, OPTIONS).settings)
    surface = Surface(normal, nothing, nothing, stays, np.array([noise, np.nan]))
    step_strain_rate(sensor, read_only(displacement), surface, interval, elements, after, decision)
    np.testing.assert_array_equal(decision.probability, decision.slip)
    return after, decision.slip


def play(stretches: list[float], stays_at_last: bool = True, interval: float = INTERVAL) -> tuple[np.ndarray, list]:
    """The state and the slip of one element while the surface is stretched uniformly, sticking at first."""
    everywhere = np.ones((5, 5), bool)
    state, _ = step(start(lattice(), OPTIONS).elements, stretched(stretches[0]), ~everywhere, np.inf)
    slips = []
    for k, stretch in enumerate(stretches[1:]):
        stays = everywhere & (stays_at_last or k < len(stretches) - 2)
        state, slip = step(state, stretched(stretch), stays, interval)
        assert (slip == slip[0, 0]).all()
        slips.append(bool(slip[0, 0]))
    return state, slips


QUIET = [0.0] * 10
ONSET = [*QUIET, 0.01, 0.02, 0.03]


def test_growing_strain_begins_slip_which_then_holds() -> None:
    _, slips = play([*ONSET, *[0.03] * 30])
    assert not any(slips[:9])
    assert all(slips[11:])


def test_falling_strain_ends_slip() -> None:
    _, slips = play([*ONSET, *[0.03] * 30, 0.02, 0.01])
    assert slips[-3]
    assert not slips[-1]


def test_strain_that_falls_without_slip_begins_none() -> None:
    _, slips = play([0.03] * 10 + [0.02, 0.01, 0.0])
    assert not any(slips)


def test_release_clears_slip_and_a_fresh_touch_sticks() -> None:
    _, slips = play(ONSET, stays_at_last=False)
    assert slips[-2]
    assert not slips[-1]


def test_strain_while_a_touch_settles_is_pressing() -> None:
    state, slips = play([0.0, 0.02])  # 33 ms after the stream began
    assert not any(slips)
    assert not state[kernel.VARIANCE].any()


def test_each_touch_begins_with_a_score_that_knows_nothing() -> None:
    state, _ = play([*ONSET, 0.01, 0.04])
    assert state[kernel.VARIANCE].all()
    state, _ = play([*ONSET, 0.01, 0.04], stays_at_last=False)
    assert not state[kernel.VARIANCE].any()
    assert not state[kernel.MEAN].any()


def test_growth_slow_against_the_strain_is_not_slip() -> None:
    crawling = [0.5 + 0.05 * INTERVAL * k for k in range(60)]  # 0.05/s on 50 % strain
    _, slips = play(crawling)
    assert not any(slips)
    _, slips = play([c - 0.5 for c in crawling])
    assert any(slips)


def test_the_rate_of_a_steady_stretch_settles_at_its_closed_form() -> None:
    speed = 0.03
    state, _ = play([speed * INTERVAL * k for k in range(40)])
    stretch = speed * INTERVAL * 39
    expected = speed * (1.0 + stretch)  # d/dt of the Green–Lagrange strain
    np.testing.assert_allclose(state[kernel.RATE_XX], expected, rtol=0.01)  # the low-pass lags 0.1 s behind a slow rise


def test_the_low_passed_rate_depends_on_time_not_on_frames() -> None:
    def after(frames: int) -> np.ndarray:
        stretches = [1e-5 * k / frames for k in range(frames + 1)]
        return play(stretches, interval=1.0 / frames)[0][kernel.RATE_XX]

    np.testing.assert_allclose(after(10), after(80), rtol=1e-4)  # the strain is quadratic at 1e-5 only


@pytest.mark.parametrize("forgotten", [1.0, 0.3, 0.02])
def test_noise_gain_is_what_white_noise_shows(forgotten: float) -> None:
    noise = np.random.default_rng(30).standard_normal((2000, 200))
    rate = np.zeros(200)
    for before, after in pairwise(noise):
        rate = rate + forgotten * ((after - before) / INTERVAL - rate)
    assert rate.std() == pytest.approx(noise_gain(forgotten), rel=0.2)  # 200 series: 5 % standard error


def noise_gain(forgotten: float) -> float:
    """Standard deviation of the low-passed rate, 1/s, for white noise of 1 in the strain at equal intervals."""
    return forgotten / INTERVAL * np.sqrt(2.0 / (2.0 - forgotten))


def by_numpy(displacements: np.ndarray, noise: float) -> list[np.ndarray]:
    """The method for elements that stay in contact from the first frame on, written out with whole arrays."""
    sensor = lattice()
    normal = np.broadcast_to([0.0, 0.0, 1.0], displacements[0].shape)
    strain_noise = noise * sensor.strain_noise
    smoothing = np.clip(
        strain_noise.mean() / OPTIONS.rate_floor, OPTIONS.smoothing_time, OPTIONS.longest_smoothing_time
    )
    low_pass, forgotten = -np.expm1(-INTERVAL / np.array([smoothing, OPTIONS.memory_time]))
    floor = np.maximum(OPTIONS.rate_floor, strain_noise * noise_gain(low_pass))
    before = surface_strain(sensor, lattice_steps(displacements[0]), normal)
    rate, mean, variance, slip = np.zeros((3, 5, 5)), np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((5, 5), bool)
    slips = []
    for k, displacement in enumerate(displacements[1:], start=1):
        strain = surface_strain(sensor, lattice_steps(displacement), normal)
        rate = rate + low_pass * ((strain - before) / INTERVAL - rate)
        before = strain
        if k * INTERVAL > OPTIONS.settling_time * (1.0 + 1e-12):
            signal = signed_rate(strain, rate)
            surprise = signal - mean
            extreme = np.abs(surprise) > OPTIONS.threshold * np.maximum(np.sqrt(variance), floor)
            least = OPTIONS.threshold * floor
            onset = extreme & (surprise > 0.0) & (signal > np.maximum(least, OPTIONS.growth_rate * frobenius(strain)))
            slip = (slip | onset) & ~(extreme & (surprise < 0.0) & (signal < -least))
            learnt = surprise * np.where(extreme, OPTIONS.influence, 1.0)
            mean = mean + forgotten * learnt
            variance = (1.0 - forgotten) * (variance + forgotten * learnt**2)
        slips.append(slip)
    return slips


def test_the_kernel_says_what_whole_arrays_say() -> None:
    rng, noise = np.random.default_rng(31), 2e-6
    wander = 4e-5 * np.cumsum(rng.standard_normal((80, 5, 5, 3)) * (np.arange(80) > 20)[:, None, None, None], axis=0)
    displacements = wander + noise * rng.standard_normal(wander.shape)
    everywhere, found = np.ones((5, 5), bool), []
    state, _ = step(start(lattice(), OPTIONS).elements, displacements[0], ~everywhere, np.inf, noise)
    for displacement in displacements[1:]:
        state, slip = step(state, displacement, everywhere, INTERVAL, noise)
        found.append(slip)
    np.testing.assert_array_equal(found, by_numpy(displacements, noise))
    assert 100 < np.count_nonzero(found) < 1900


def test_an_option_changes_the_decision(short_ramp: GraspLog) -> None:
    log = replace(short_ramp, truth=None)
    assert detect_slip(log, "strain_rate", threshold=50.0).slip.sum() < detect_slip(log, "strain_rate").slip.sum()
