"""What is noted beside the id of a store."""

from datetime import UTC, datetime

import pytest
from sqlalchemy import select

from db.database import Database
from db.errors import StorageUnavailable
from db.records import SeenClock
from db.repositories import stores
from db.tables import StoreRow

AT = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)


def test_a_store_has_one_id_which_may_be_another_later(database: Database) -> None:
    with database.write() as session:
        assert stores.has_table(session)
        first = stores.find_id(session)
        for store_id in ("1" * 32, "2" * 32):
            stores.set_id(session, store_id)
            session.flush()
            assert stores.find_id(session) == store_id != first
        assert session.scalars(select(StoreRow.number)).all() == [1]


def test_a_database_without_tables_has_none_of_stores(empty_database: Database) -> None:
    with empty_database.read() as session:
        assert not stores.has_table(session)


def test_what_the_webhook_has_had_is_noted_by_one_process_of_several(database: Database) -> None:
    with database.write() as session:
        stores.set_id(session, "1" * 32)
        assert stores.webhook_entry(session) is None
        stores.set_webhook_entry(session, 7, None)
        assert stores.webhook_entry(session) == 7
        stores.set_webhook_entry(session, 9, None)  # another has noted 7 meanwhile
        stores.set_webhook_entry(session, 9, 6)
        assert stores.webhook_entry(session) == 7
        stores.set_webhook_entry(session, 9, 7)
        assert stores.webhook_entry(session) == 9


@pytest.mark.parametrize("lock", [True, False])
def test_the_clock_is_as_it_was_last_noted(database: Database, lock: bool) -> None:
    with database.write() as session:
        stores.set_id(session, "1" * 32)
        session.flush()
        assert stores.seen_clock(session, lock=lock) is None
        for steady in (0.0, 12.5):
            stores.note_clock(session, SeenClock(AT, steady))
            assert stores.seen_clock(session, lock=lock) == SeenClock(AT, steady)


def test_without_an_id_no_clock_is_noted(database: Database) -> None:
    with database.write() as session:
        session.query(StoreRow).delete()
        assert stores.seen_clock(session) is None
        with pytest.raises(StorageUnavailable, match="has no store id, beside which the clock is noted"):
            stores.note_clock(session, SeenClock(AT, 0.0))


def test_a_touch_changes_nothing(database: Database) -> None:
    with database.write() as session:
        stores.set_id(session, "1" * 32)
        stores.note_clock(session, SeenClock(AT, 3.0))
        stores.touch(session)
        assert (stores.find_id(session), stores.seen_clock(session)) == ("1" * 32, SeenClock(AT, 3.0))


def test_another_database_in_the_place_of_the_first_is_told_with_both_ids(database: Database) -> None:
    with database.write() as session:
        stores.set_id(session, "2" * 32)
        session.flush()
        stores.require(session, "2" * 32)
        stores.require(session, None)
        with pytest.raises(
            StorageUnavailable, match=f"its store id was {'1' * 32} and is {'2' * 32}: another database"
        ):
            stores.require(session, "1" * 32)
