from datetime import timedelta

import pytest

from db.database import Database
from db.errors import NotFound
from db.repositories import access_keys
from db.tables import now


def test_keys_are_listed_oldest_first_with_what_they_may_do(database: Database) -> None:
    with database.write() as session:
        assert not access_keys.any_valid(session)
        added = [access_keys.add(session, f"{n:012x}", f"robot {n}", "upload", "0" * 64) for n in (2, 1)]
        assert access_keys.any_valid(session)
    with database.read() as session:
        assert access_keys.list_all(session) == added
        assert access_keys.get(session, added[0].id).scope == "upload"


def test_a_revoked_key_stays_revoked_at_its_first_moment(database: Database) -> None:
    with database.write() as session:
        access_keys.add(session, "0" * 12, "robot", "read", "0" * 64)
        first = access_keys.revoke(session, "0" * 12)
        assert first.revoked_at is not None
        assert access_keys.revoke(session, "0" * 12) == first
        assert not access_keys.any_valid(session)


@pytest.mark.parametrize("act", [access_keys.get, access_keys.revoke])
def test_an_unknown_key_is_named(database: Database, act) -> None:  # type: ignore[no-untyped-def]
    with database.write() as session, pytest.raises(NotFound, match="no access key 'nobody' is stored"):
        act(session, "nobody")


def test_a_key_that_never_expires_or_will_later_lets_somebody_in(database: Database) -> None:
    with database.write() as session:
        access_keys.add(session, "0" * 12, "robot", "read", "0" * 64, expires_at=now() - timedelta(seconds=1))
        assert not access_keys.any_valid(session)
        access_keys.add(session, "1" * 12, "robot", "read", "1" * 64, expires_at=now() + timedelta(hours=1))
        assert access_keys.any_valid(session)
        access_keys.revoke(session, "1" * 12)
        assert not access_keys.any_valid(session)
        access_keys.add(session, "2" * 12, "robot", "read", "2" * 64)
        access_keys.lock(session, "2" * 12)
        assert access_keys.any_valid(session)


def test_one_key_that_is_revoked_leaves_the_others(database: Database) -> None:
    with database.write() as session:
        for number in range(3):
            access_keys.add(session, f"{number:012x}", "robot", "read", "0" * 64)
        access_keys.revoke(session, f"{1:012x}")
        revoked = {key.id: key.revoked_at is not None for key in access_keys.list_all(session)}
        assert revoked == {f"{number:012x}": number == 1 for number in range(3)}
        assert access_keys.get(session, f"{2:012x}").revoked_at is None
