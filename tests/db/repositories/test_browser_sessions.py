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


def test_only_the_sessions_of_a_key_that_were_begun_last_are_kept(keyed: Database) -> None:
    other = "1" * 12
    with keyed.write() as session:
        access_keys.add(session, other, "robot", "read", "1" * 64)
        browser_sessions.add(session, "f" * 64, other, now() + timedelta(hours=1))
        for letter in "cab":
            browser_sessions.add(session, letter * 64, KEY, now() + timedelta(hours=1))
        browser_sessions.keep_newest(session, KEY, 2)
        kept = [letter for letter in "abcf" if browser_sessions.find_key(session, letter * 64) is not None]
    assert kept == ["a", "b", "f"]
