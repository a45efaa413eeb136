from types import SimpleNamespace

import pytest

from service.http import rate_limit
from service.http.rate_limit import RateLimit


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(rate_limit, "time", SimpleNamespace(monotonic=lambda: clock.now))
    return clock


def test_as_many_as_come_up_in_a_second_may_come_at_once_and_then_at_the_rate(clock: SimpleNamespace) -> None:
    limit = RateLimit(4.0)
    assert [limit.wait("a") for _ in range(5)] == [0.0] * 4 + [0.25]
    assert limit.wait("b") == 0.0
    clock.now += 0.125
    assert limit.wait("a") == pytest.approx(0.125)
    clock.now += 0.125
    assert [limit.wait("a"), limit.wait("a")] == pytest.approx([0.0, 0.25])
    clock.now += 3600.0
    assert sum(limit.wait("a") == 0.0 for _ in range(9)) == 4


@pytest.mark.usefixtures("clock")
def test_a_rate_below_one_lets_one_in_and_none_lets_all() -> None:
    slow = RateLimit(0.1)
    assert [slow.wait("a"), slow.wait("a")] == [0.0, 10.0]
    assert not any(RateLimit(0.0).wait("a") for _ in range(9))


@pytest.mark.usefixtures("clock")
def test_who_asked_least_recently_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rate_limit, "MOST_BUCKETS", 2)
    limit = RateLimit(1.0)
    assert [limit.wait(who) for who in "abacab"] == [0.0, 0.0, 1.0, 0.0, 1.0, 0.0]
