"""Frames of one contact: which they are, and what they say together."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from slipcore.forces.inverse.fit import TractionPrior, fit
from slipcore.forces.inverse.prior import usual
from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking import over_time
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.over_time import ContactRun, runs
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key, Tracker

PITCH, NOISE = 1e-3, 3e-6
LINE = PITCH * (np.arange(7) - 3.0)
POSITION = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((7, 7))), axis=-1)


@dataclass(frozen=True)
class Following:
    """A tracker whose key is what a frame says."""

    key: str

    def at(self, _: None, key: str) -> "Following":
        """Another frame."""
        return self if key == self.key else Following(key)


def followed(keys: str, strongest: int) -> list[tuple[str, list[int]]]:
    """Runs of frames that have these keys, a blank where nothing touches."""

    def frame(t: int) -> Any:
        return None, keys[t]

    touched = np.array([key != " " for key in keys])
    return cast("Any", list(runs(cast("Tracker", Following(keys[strongest])), frame, touched, strongest)))


def test_runs_are_frames_in_a_row_of_one_contact() -> None:
    assert followed("aabbbc", 3) == [("b", [2, 3, 4]), ("a", [0, 1]), ("c", [5])]
    assert followed("aa aab", 3) == [("a", [3, 4]), ("a", [0, 1]), ("b", [5])]
    assert followed("abb", 0) == [("a", [0]), ("b", [1, 2])]
    assert followed("ba", 1) == [("a", [1]), ("b", [0])]


def test_runs_do_not_grow_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(over_time, "OVER_TIME", over_time.OVER_TIME.__class__(frames=3))
    assert followed("aaaaaaa", 0) == [("a", [0, 1, 2]), ("a", [3, 4, 5]), ("a", [6])]


def made(force: float | None) -> tuple[SensorResponse, Key, np.ndarray]:
    """A disk pressed on a layer with some 2 N, in ten frames with noise; its normal force known to 1 %."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1))
    known = KnownForce.of(None if force is None else [force], None, 1)[0]
    disk = np.hypot(*sensor.nodes.places().T) < 2.1e-3
    observation = sensor.observation(np.full(len(sensor.response), np.hypot(NOISE, 1e-6)), known)
    clean = sensor.response[:, 2, disk].sum(axis=1) * 0.15
    noise = NOISE * np.random.default_rng(7).standard_normal((10, len(clean)))
    data = np.stack([sensor.data(each, known) for each in clean + noise])
    return sensor, Key(observation, data[0], fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.15))), data


def test_a_known_force_counts_in_each_frame_by_itself() -> None:
    """As one more datum of what the markers of all frames say, by the closed form."""
    _, free, alone = made(None)
    sensor, key, data = made(2.0)
    time = 0.1 * np.arange(len(data))
    before, after = ContactRun.of(free, alone, time, NOISE), ContactRun.of(key, data, time, NOISE)
    whole = np.concatenate((np.zeros((2, key.fit.support.sum())), np.full((1, key.fit.support.sum()), sensor.load)))
    whole = whole.ravel()
    prior = before.key.fit.root @ before.key.fit.root.T
    spread = whole @ prior @ whole + key.observation.noise[-1] ** 2
    covariance = prior - np.outer(prior @ whole, prior @ whole) / spread
    found = after.key.fit.root @ after.key.fit.root.T
    np.testing.assert_allclose(found, covariance, rtol=0.0, atol=1e-9 * np.abs(prior).max())
    for one, other in zip(before.estimates, after.estimates, strict=True):
        assert one is not None
        assert other is not None
        mean = one.mean.ravel() + prior @ whole * (2.0 - whole @ one.mean.ravel()) / spread
        np.testing.assert_allclose(other.mean.ravel(), mean, rtol=0.0, atol=1e-9 * np.abs(mean).max())
    assert np.sqrt(whole @ found @ whole) < key.observation.noise[-1]


def test_the_fit_of_a_run_gives_a_load_at_rest_as_its_frames_do() -> None:
    """Its operator is that of data which stay as they are."""
    _, key, data = made(2.0)
    still = np.repeat(data[:1], 9, axis=0)
    run = ContactRun.of(key, still, 0.1 * np.arange(9), NOISE)
    middle = run.estimates[4]
    assert middle is not None
    largest = np.abs(middle.mean).max()
    np.testing.assert_allclose(run.key.fit.mean(data[0]), middle.mean, rtol=0.0, atol=1e-6 * largest)


def test_one_frame_and_frames_without_noise_are_by_themselves() -> None:
    _, key, data = made(None)
    for frames, noise in ((data[:1], NOISE), (data[:2], 0.0)):
        run = ContactRun.of(key, frames, 0.1 * np.arange(len(frames)), noise)
        assert run.key is key
        assert set(run.estimates) == {None}
