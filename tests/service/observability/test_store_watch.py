"""What is seen of database and files when they are looked at."""

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

from db.errors import DatabaseError, StorageUnavailable
from service.observability import store_watch
from service.observability.store_watch import StoreWatch


@pytest.fixture
def database(monkeypatch: pytest.MonkeyPatch) -> Mock:
    monkeypatch.setattr(store_watch, "stores", Mock())
    monkeypatch.setattr(store_watch, "free_room", Mock())
    return Mock(write=Mock(side_effect=lambda **_: nullcontext()), store_id="s")


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(store_watch, "time", SimpleNamespace(monotonic=lambda: clock.now))
    return clock


def test_a_look_asks_both_stores_writes_and_finds_nothing_wrong(database: Mock) -> None:
    blobs: Any = Mock()
    watch = StoreWatch(database, blobs, 1000)
    assert watch.trouble is None
    watch.look()
    assert watch.trouble is None
    database.ping.assert_called_once()
    blobs.ping.assert_called_once()
    database.write.assert_called_once_with(durable=False)
    store_watch.stores.require.assert_called_once_with(None, "s")  # type: ignore[attr-defined]
    store_watch.stores.touch.assert_called_once_with(None)  # type: ignore[attr-defined]
    database.checkpoint.assert_called_once()
    database.check_pages.assert_called_once()
    store_watch.free_room.require.assert_called_once_with(database, blobs, 1000)  # type: ignore[attr-defined]


def test_trouble_is_told_until_it_is_over(database: Mock) -> None:
    watch = StoreWatch(database, Mock(), 0)
    for error in (StorageUnavailable("database: locked"), OSError("no space")):
        database.ping.side_effect = error
        watch.look()
        assert watch.trouble == str(error)
    database.ping.side_effect = None
    watch.look()
    assert watch.trouble is None


def test_what_nobody_thought_of_is_trouble_too_and_is_raised(database: Mock) -> None:
    watch = StoreWatch(database, Mock(), 0)
    database.ping.side_effect = ZeroDivisionError
    with pytest.raises(ZeroDivisionError):
        watch.look()
    assert watch.trouble == "unexpected ZeroDivisionError; the server's log has it whole"


def test_pages_are_read_for_a_hundredth_of_the_time_and_their_damage_stands_meanwhile(
    database: Mock, clock: SimpleNamespace
) -> None:
    def read() -> None:
        clock.now += 0.5
        raise DatabaseError("page 7 is damaged")

    database.check_pages.side_effect = read
    watch = StoreWatch(database, Mock(), 0)
    watch.look()
    assert watch.trouble == "page 7 is damaged"
    clock.now += 49.9
    watch.look()
    assert (watch.trouble, database.check_pages.call_count) == ("page 7 is damaged", 1)
    clock.now += 0.2
    database.check_pages.side_effect = None
    watch.look()
    assert (watch.trouble, database.check_pages.call_count) == (None, 2)
