from contextlib import closing
from datetime import timedelta
from threading import Event, Thread
from typing import Any

import pytest
from sqlalchemy import func, select, update

from db.database import Database
from db.defaults import EXPIRED_KEYS_PER_CLAIM
from db.errors import AlreadyExists
from db.repositories import idempotency_keys
from db.tables import IdempotencyKeyRow, now

HOUR = timedelta(hours=1)


def age(database: Database, by: timedelta) -> None:
    with database.write() as session:
        session.execute(update(IdempotencyKeyRow).values(created_at=now() - by))


def test_a_key_gives_its_answer_again_to_its_owner_and_its_request(database: Database) -> None:
    with database.write() as session:
        assert idempotency_keys.claim(session, "robot", "k", "asked", HOUR) is None
        idempotency_keys.keep(session, "robot", "k", {"status": 202})
        assert idempotency_keys.claim(session, "", "k", "asked", HOUR) is None
    with database.write() as session:
        assert idempotency_keys.claim(session, "robot", "k", "asked", HOUR) == {"status": 202}
        with pytest.raises(AlreadyExists, match="idempotency key 'k'"):
            idempotency_keys.claim(session, "robot", "k", "other", HOUR)


def test_an_old_key_is_free_again_and_old_ones_do_not_pile_up(database: Database) -> None:
    with database.write() as session:
        for number in range(3 * EXPIRED_KEYS_PER_CLAIM):
            idempotency_keys.claim(session, "robot", f"k{number}", "asked", HOUR)
    age(database, 2 * HOUR)
    with database.write() as session:
        assert idempotency_keys.claim(session, "robot", "k29", "other", HOUR) is None
        left = session.scalar(select(func.count()).select_from(IdempotencyKeyRow))
        assert left in {2 * EXPIRED_KEYS_PER_CLAIM, 2 * EXPIRED_KEYS_PER_CLAIM + 1}


def test_whoever_claims_a_key_at_the_same_time_waits_for_the_answer(database: Database) -> None:
    began, seen = Event(), list[Any]()

    def ask_too() -> None:
        with closing(Database(database.url)) as own:
            began.set()
            with own.write() as session:
                seen.append(idempotency_keys.claim(session, "robot", "k", "asked", HOUR))

    with database.write() as session:
        idempotency_keys.claim(session, "robot", "k", "asked", HOUR)
        other = Thread(target=ask_too)
        other.start()
        began.wait()
        other.join(0.1)
        assert other.is_alive()
        idempotency_keys.keep(session, "robot", "k", {"status": 202})
    other.join()
    assert seen == [{"status": 202}]
