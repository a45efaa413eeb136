"""How alarms of a changed surface are counted in series of grasps."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from benchmarks.estimators import change_alarm
from benchmarks.estimators.change_alarm import DROP, ERROR, KINDS, QUIET, delays, falls, false_alarms, known, levels
from estimators.defaults import ALARM


@pytest.mark.parametrize("kind", KINDS)
def test_levels_scatter_about_one_as_told_whatever_their_tails(kind: str) -> None:
    found = levels(kind, 0.1, 20_000, np.random.default_rng(1))
    assert found.mean() == pytest.approx(1.0, abs=4.0 * 0.1 / np.sqrt(20_000))
    assert found.std() == pytest.approx(np.hypot(0.1, ERROR), rel=0.05)
    kurtosis = np.mean((found - found.mean()) ** 4) / found.var() ** 2
    assert (kurtosis > 4.0) == (kind != KINDS[0])  # 3 of a normal, 9 of Student-t on 5 degrees
    assert levels(kind, 0.0, 20_000, np.random.default_rng(2)).std() == pytest.approx(ERROR, rel=0.03)


@dataclass(frozen=True)
class Counting:
    """An alarm by the second level below 0.9, or by the fifth that it sees if it is ``hasty``."""

    hasty: bool = False
    seen: int = 0
    low: int = 0

    @classmethod
    def init(cls) -> "Counting":
        return cls()

    @property
    def changed(self) -> bool:
        return self.low >= 2 or (self.hasty and self.seen >= 5)

    def step(self, level: float, variance: float) -> "Counting":
        assert variance == ERROR**2
        assert not self.changed
        return type(self)(self.hasty, self.seen + 1, self.low + (level < 0.9))


@dataclass(frozen=True)
class Hasty(Counting):
    hasty: bool = True


def test_alarms_of_surfaces_that_stay_are_told_in_a_thousand_grasps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(change_alarm, "ChangeAlarm", Hasty)
    assert false_alarms(KINDS[0], 0.0, 3) == 200.0  # every fifth, for each begins anew
    monkeypatch.setattr(change_alarm, "ChangeAlarm", Counting)
    assert false_alarms(KINDS[0], 0.0, 3) == 0.0
    assert QUIET % 5 == 0


@pytest.mark.parametrize(("alarm", "before", "delay"), [(Counting, 5, 2.0), (Hasty, 8, 2.0), (Hasty, 4, 1.0)])
def test_a_delay_counts_the_grasps_from_the_drop_on(
    alarm: type[Counting], before: int, delay: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hasty ones that come before the drop begin anew: the fifth of eight, and the fifth that is the first after it."""
    monkeypatch.setattr(change_alarm, "ChangeAlarm", alarm)
    np.testing.assert_array_equal(delays(KINDS[0], 0.0, before, 3), [delay] * 3)


def test_what_is_not_noticed_within_twenty_grasps_is_never(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(change_alarm, "DROP", 0.0)
    monkeypatch.setattr(change_alarm, "ChangeAlarm", Counting)
    np.testing.assert_array_equal(delays(KINDS[0], 0.0, 5, 2), [np.inf] * 2)


@pytest.mark.parametrize("between", [0.05, 0.1, 0.15])
def test_who_knows_all_adds_up_likelihood_ratios(between: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of levels that are all as expected after the drop, each ratio is L = exp(DROP²/2σ²): L + L² + … ≥ 1/rate."""
    monkeypatch.setattr(change_alarm, "levels", lambda _, __, count, ___: np.ones(count))
    ratio = np.exp(DROP**2 / (2.0 * (between**2 + ERROR**2)))
    sums = np.cumsum(ratio ** np.arange(1.0, 21.0))
    np.testing.assert_array_equal(known(KINDS[0], between, 2), [1.0 + np.argmax(sums >= 1.0 / ALARM.rate)] * 2)


def test_who_is_told_nothing_by_any_grasp_never_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(change_alarm, "levels", lambda _, __, count, ___: np.full(count, 1.0 + DROP))
    assert np.isinf(known(KINDS[0], 0.05, 1)).all()


def test_a_fall_is_asked_for_after_so_many_grasps_and_the_median_told(monkeypatch: pytest.MonkeyPatch) -> None:
    told = iter([0.3, 0.1, 0.2])
    seen: list[Any] = []
    monkeypatch.setattr(change_alarm, "noticeable", lambda alarm: seen.append(alarm) or next(told))
    assert falls(KINDS[0], 0.05, 4, 3) == 0.2
    assert [len(alarm.levels) for alarm in seen] == [4, 4, 4]
    assert {alarm.variances for alarm in seen} == {(ERROR**2,) * 4}
