import pytest

from db.database import Database
from db.errors import NotFound
from db.repositories import access_keys


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
