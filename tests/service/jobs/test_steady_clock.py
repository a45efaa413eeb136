from datetime import UTC, datetime, timedelta

import pytest

from service.jobs import steady_clock
from service.jobs.steady_clock import STEADY, SteadyClock

BEGIN = datetime(2026, 11, 26, tzinfo=UTC)


class Clocks:
    """The clock that somebody may set, and the one that nobody does, s."""

    def __init__(self) -> None:
        self.wall, self.monotonic_ = BEGIN, 1000.0

    def go(self, passed: timedelta, set_by: timedelta = timedelta()) -> None:
        self.wall += passed + set_by
        self.monotonic_ += passed.total_seconds()

    def now(self) -> datetime:
        return self.wall

    def monotonic(self) -> float:
        return self.monotonic_


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    made = Clocks()
    monkeypatch.setattr(steady_clock, "now", made.now)
    monkeypatch.setattr(steady_clock, "time", made)
    return made


LOOK = timedelta(minutes=1)


@pytest.mark.parametrize("by", [timedelta(days=200), timedelta(days=-200), timedelta(hours=1)])
def test_a_clock_that_jumps_is_not_believed_for_a_day(clocks: Clocks, by: timedelta) -> None:
    """One that was 200 days ahead for a minute had deleted all uploads."""
    clock = SteadyClock()
    assert clock.is_believed(BEGIN)
    clocks.go(LOOK, by)
    assert not clock.is_believed(BEGIN)
    clocks.go(LOOK)
    assert not clock.is_believed(BEGIN)
    clocks.go(LOOK, -by)  # set right again
    assert not clock.is_believed(BEGIN)
    clocks.go(STEADY - LOOK)
    assert not clock.is_believed(BEGIN)
    clocks.go(LOOK)
    assert clock.is_believed(BEGIN)


def test_a_clock_that_is_set_by_seconds_is_believed(clocks: Clocks) -> None:
    clock = SteadyClock()
    for step in (0.0, 5.0, -5.0, 30.0):
        assert clock.is_believed(BEGIN)
        clocks.go(LOOK, timedelta(seconds=step))


@pytest.mark.parametrize(("days", "is_believed"), [(0.5, True), (2.0, False), (200.0, False)])
def test_at_a_start_far_beyond_what_is_stored_it_is_believed_a_day_later(
    clocks: Clocks, days: float, is_believed: bool
) -> None:
    clock, newest = SteadyClock(), BEGIN - timedelta(days=days)
    assert clock.is_believed(newest) == is_believed
    clocks.go(STEADY)
    assert clock.is_believed(newest)


def test_where_nothing_is_stored_there_is_nothing_to_compare_with(clocks: Clocks) -> None:
    assert SteadyClock().is_believed(None)
    assert clocks.now() == BEGIN
