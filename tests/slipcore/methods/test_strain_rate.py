from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipcore import GraspLog, StrainRateOptions, detect_slip
from slipcore.methods.interface import Observation
from slipcore.methods.strain_rate import StrainRateState, _noise_gain, init, step
from slipcore.strain import Lattice, lattice_steps

INTERVAL = 1 / 30
OPTIONS = StrainRateOptions()


def lattice() -> Lattice:
    i, j = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    return Lattice.at_rest(1e-3 * np.stack([i, j, 0 * i], axis=-1))


def seen(stretch: float, touched: bool = False, contact: bool = True, interval: float = INTERVAL) -> Observation:
    sensor = lattice()
    displacement = np.zeros_like(sensor.position)
    displacement[..., 0] = stretch * sensor.position[..., 0]
    everywhere = np.ones((5, 5), bool)
    normal = np.broadcast_to([0.0, 0.0, 1.0], displacement.shape)
    return Observation(
        time=0.0,
        interval=interval,
        displacement=displacement,
        steps=lattice_steps(displacement),
        normal=normal,
        forces=None,
        contact=contact & everywhere,
        touched=touched & everywhere,
        object_pose=None,
        noise=1e-9,
    )


def play(stretches: list[float], **last: bool) -> tuple[StrainRateState, list[bool]]:
    """The state and the slip of one element while the surface is stretched uniformly, sticking at first."""
    state, slips = init(lattice(), seen(stretches[0]), OPTIONS), []
    for k, stretch in enumerate(stretches[1:]):
        ending = k == len(stretches) - 2
        state, decision = step(state, lattice(), seen(stretch, **(last if ending else {})), OPTIONS)
        assert (decision.slip == decision.slip[0, 0]).all()
        np.testing.assert_array_equal(decision.probability, decision.slip)
        slips.append(bool(decision.slip[0, 0]))
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
    _, slips = play(ONSET, contact=False)
    assert slips[-2]
    assert not slips[-1]
    _, slips = play([*ONSET, 0.04], touched=True)
    assert not slips[-1]


def test_strain_while_a_touch_settles_is_pressing() -> None:
    state = init(lattice(), seen(0.0), OPTIONS)
    state, decision = step(state, lattice(), seen(0.02), OPTIONS)  # 33 ms after the stream began
    assert not decision.slip.any()
    assert not state.score.variance.any()


def test_each_touch_begins_with_a_score_that_knows_nothing() -> None:
    state, _ = play([*ONSET, 0.01, 0.04])
    assert state.score.variance.all()
    state, _ = play([*ONSET, 0.01, 0.04], contact=False)
    assert not state.score.variance.any()
    assert not state.score.mean.any()


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
    np.testing.assert_allclose(state.rate[0], expected, rtol=0.01)  # the low-pass lags 0.1 s behind a slow rise


def test_the_low_passed_rate_depends_on_time_not_on_frames() -> None:
    def after(frames: int) -> np.ndarray:
        interval = 1.0 / frames
        state = init(lattice(), seen(0.0), OPTIONS)
        for k in range(frames):
            observation = seen(1e-5 * (k + 1) / frames, interval=interval)
            state, _ = step(state, lattice(), observation, OPTIONS)
        return state.rate[0]

    np.testing.assert_allclose(after(10), after(80), rtol=1e-4)  # the strain is quadratic at 1e-5 only


@pytest.mark.parametrize("forgotten", [1.0, 0.3, 0.02])
def test_noise_gain_is_what_white_noise_shows(forgotten: float) -> None:
    noise = np.random.default_rng(30).standard_normal((2000, 200))
    rate = np.zeros(200)
    for before, after in pairwise(noise):
        rate = rate + forgotten * ((after - before) / INTERVAL - rate)
    assert rate.std() == pytest.approx(_noise_gain(INTERVAL, forgotten), rel=0.2)  # 200 series: 5 % standard error


def test_an_option_changes_the_decision(short_ramp: GraspLog) -> None:
    log = replace(short_ramp, truth=None)
    assert detect_slip(log, "strain_rate", threshold=50.0).slip.sum() < detect_slip(log, "strain_rate").slip.sum()
