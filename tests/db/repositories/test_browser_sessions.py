from datetime import timedelta

import pytest
from sqlalchemy import func, select

from db.database import Database
from db.repositories import access_keys, browser_sessions
from db.tables import BrowserSessionRow, now

KEY, FIRST, SECOND = "0" * 12, "a" * 64, "b" * 64


@pytest.fixture
def keyed(database: Database) -> Database:
    """A database with one access key."""
    with database.write() as session:
        access_keys.add(session, KEY, "robot", "read", "0" * 64)
    return database


def test_a_session_is_found_by_its_digest_until_it_is_removed(keyed: Database) -> None:
    with keyed.write() as session:
        browser_sessions.add(session, FIRST, KEY, now() + timedelta(hours=1))
        found = browser_sessions.find_key(session, FIRST)
        assert found == access_keys.get(session, KEY)
        assert browser_sessions.find_key(session, SECOND) is None
        for _ in range(2):
            browser_sessions.remove(session, FIRST)
            assert browser_sessions.find_key(session, FIRST) is None


def test_a_session_that_is_over_is_not_found_and_goes_with_the_next_login(keyed: Database) -> None:
    with keyed.write() as session:
        browser_sessions.add(session, FIRST, KEY, now() - timedelta(seconds=1))
        assert browser_sessions.find_key(session, FIRST) is None
        browser_sessions.add(session, SECOND, KEY, now() + timedelta(hours=1))
        assert browser_sessions.find_key(session, SECOND) is not None
        assert session.scalar(select(func.count()).select_from(BrowserSessionRow)) == 1
