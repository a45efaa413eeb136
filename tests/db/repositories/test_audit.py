from contextlib import suppress
from datetime import timedelta
from random import Random

import pytest
from sqlalchemy import delete, text, update
from sqlalchemy.exc import DBAPIError

from db.database import Database
from db.errors import AlreadyExists
from db.paging import Window
from db.records import Actor, AuditEntry, AuditFilter
from db.repositories import audit, materials
from db.repositories.audit import SERVICE
from db.tables import AuditEntryRow, now

NEWEST = Window("id", descending=True)
ROBOT = Actor("key:0123456789ab", "10.0.0.9", "request-1")
EVERYTHING = AuditFilter()


def entries(database: Database, wanted: AuditFilter = EVERYTHING) -> list[AuditEntry]:
    with database.read() as session:
        return audit.list_all(session, NEWEST, wanted)


def store(database: Database, *ages: timedelta) -> None:
    """Entries as old as that."""
    with database.write() as session:
        for age in ages:
            session.add(AuditEntryRow(at=now() - age, actor="service", action="x", subject="y", details={}))


def test_an_entry_tells_who_did_what_when_and_from_where(database: Database) -> None:
    with database.write() as session:
        audit.add(session, ROBOT, "material.created", "paper", {"description": "80 g/m²"})
        audit.add(session, audit.SERVICE, "blob.damaged", "0" * 64)
    damaged, created = entries(database)
    assert (created.actor, created.action, created.subject) == (ROBOT, "material.created", "paper")
    assert created.details == {"description": "80 g/m²"}
    assert damaged.actor == Actor("service")
    assert timedelta(0) <= now() - created.at < timedelta(minutes=1)


@pytest.mark.parametrize(
    "wanted", [AuditFilter(actor=ROBOT.name), AuditFilter(action="fit.requested"), AuditFilter(subject="felt")]
)
def test_entries_are_found_by_actor_action_and_subject(database: Database, wanted: AuditFilter) -> None:
    with database.write() as session:
        audit.add(session, audit.SERVICE, "material.created", "paper")
        audit.add(session, ROBOT, "fit.requested", "felt")
    assert [entry.subject for entry in entries(database, wanted)] == ["felt"]


def test_a_change_that_is_rolled_back_leaves_no_entry(database: Database) -> None:
    with database.write() as session:
        materials.create(session, "paper", "")
    with suppress(AlreadyExists), database.write() as session:
        audit.add(session, ROBOT, "material.created", "paper")
        materials.create(session, "paper", "")
    assert entries(database) == []


def test_what_the_service_itself_recorded_is_counted_by_subject(database: Database) -> None:
    with database.write() as session:
        for actor, action, subject in (
            (SERVICE, "blob.damaged", "a"),
            (SERVICE, "blob.damaged", "a"),
            (SERVICE, "blob.damaged", "b"),
            (SERVICE, "key.created", "c"),
            (Actor("somebody"), "blob.damaged", "d"),
        ):
            audit.add(session, actor, action, subject, {})
        assert audit.count_of_service(session, "blob.damaged") == 2


@pytest.mark.parametrize(
    "change",
    [
        update(AuditEntryRow).values(actor="somebody else"),
        delete(AuditEntryRow),
        text("UPDATE audit_entries SET at = '2000-01-01'"),
        text(
            "INSERT INTO audit_entries SELECT * FROM audit_entries WHERE true "
            "ON CONFLICT (id) DO UPDATE SET actor = 'x'"
        ),
    ],
    ids=str,
)
def test_the_database_refuses_to_change_or_delete_an_entry(database: Database, change: object) -> None:
    store(database, timedelta(days=29, hours=23))
    with pytest.raises(DBAPIError, match="audit entries"), database.write() as session:
        session.execute(change)  # type: ignore[call-overload]
    assert len(entries(database)) == 1


def test_an_entry_is_not_replaced_by_an_older_one_that_may_be_deleted(database: Database) -> None:
    if not database.is_sqlite:
        pytest.skip("only SQLite knows REPLACE, which no trigger on deletion sees")
    store(database, timedelta(0))
    (entry,) = entries(database)
    replaced = text(
        "REPLACE INTO audit_entries (id, at, actor, action, subject, details) "
        f"VALUES ({entry.id}, '2000-01-01 00:00:00.000000', 'nobody', 'x', 'y', '{{}}')"
    )
    with pytest.raises(DBAPIError, match="audit entries"), database.write() as session:
        session.execute(replaced)
    assert entries(database) == [entry]


def test_the_trail_is_not_emptied_at_once(database: Database) -> None:
    if database.is_sqlite:
        pytest.skip("SQLite knows no TRUNCATE")
    store(database, timedelta(days=400))
    with pytest.raises(DBAPIError, match="audit entries"), database.write() as session:
        session.execute(text("TRUNCATE audit_entries"))


def test_old_entries_go_and_the_trail_tells_so(database: Database) -> None:
    store(database, timedelta(days=100), timedelta(days=91), timedelta(days=89))
    with database.write() as session:
        assert audit.delete_before(session, now() - timedelta(days=90)) == 2
    with database.write() as session:
        assert audit.delete_before(session, now() - timedelta(days=90)) == 0
    told, young = entries(database)
    assert (told.action, told.details["entries"], young.subject) == ("audit.deleted", 2, "y")


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_an_upload_takes_the_room_in_the_trail_that_operations_md_states(database: Database) -> None:
    def size() -> int:
        with database.read() as session:
            pages, page = (
                session.connection().exec_driver_sql(f"PRAGMA {name}") for name in ("page_count", "page_size")
            )
            return int(pages.scalar_one()) * int(page.scalar_one())

    random, count, before = Random(0), 2000, size()
    with database.write() as session:
        for number in range(count):
            made = f"{random.getrandbits(256):064x}"
            actor = Actor("key:3f9c2a7b51de", "192.168.100.17", f"{random.getrandbits(128):032x}")
            told = {"material": "paper", "sha256": made, "bytes": 1_000_000 + number, "new": True}
            audit.add(session, actor, "grasp_log.uploaded", f"{random.getrandbits(128):032x}", told)
    assert (size() - before) / count == pytest.approx(440.0, rel=0.03)
