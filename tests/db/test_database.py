import builtins
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError, StatementError

from db import database as module
from db.database import Database
from db.errors import DriverMissing, InvalidUrl, StorageUnavailable
from db.records import Claim, NewGraspLog, NewModel
from db.repositories import friction_models, grasp_logs, jobs, materials
from db.tables import JobRow

ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
ONLY_POSTGRESQL = pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)


def pragma(database: Database, name: str) -> object:
    with database.read() as session:
        return session.execute(text(f"PRAGMA {name}")).scalar_one()


@ONLY_SQLITE
@pytest.mark.parametrize(
    ("name", "value"),
    [("journal_mode", "wal"), ("foreign_keys", 1), ("synchronous", 2), ("busy_timeout", 200)],
)
def test_sqlite_is_set_up_to_keep_what_it_accepted(database: Database, name: str, value: object) -> None:
    assert pragma(database, name) == value


def test_a_write_is_kept_as_a_whole_or_not_at_all(database: Database) -> None:
    def change() -> None:
        with database.write() as session:
            materials.create(session, "paper", "")
            raise KeyError("something goes wrong afterwards")

    with pytest.raises(KeyError):
        change()
    with database.read() as session:
        assert materials.list_all(session) == []


def test_changes_made_while_reading_are_dropped(database: Database) -> None:
    with database.read() as session:
        materials.create(session, "paper", "")
    with database.read() as session:
        assert materials.list_all(session) == []


@ONLY_SQLITE
def test_a_writer_that_reads_first_waits_for_the_other_writer(database: Database) -> None:
    """With SQLite's deferred transactions, one of two that read and then write fails at once, whatever the timeout."""
    patient = Database(database.url, lock_timeout=10.0)
    first_has_read, second_started = threading.Event(), threading.Event()

    def first() -> None:
        with patient.write() as session:
            assert materials.list_all(session) == []
            first_has_read.set()
            second_started.wait(10)
            materials.create(session, "first", "")

    thread = threading.Thread(target=first)
    thread.start()
    assert first_has_read.wait(10)
    second_started.set()
    with patient.write() as session:
        seen = [material.name for material in materials.list_all(session)]
        materials.create(session, "second", "")
    thread.join()
    patient.close()
    assert seen == ["first"]


def test_readers_do_not_wait_for_a_writer(database: Database) -> None:
    with database.write() as writing:
        materials.create(writing, "paper", "")
        with database.read() as reading:
            assert materials.list_all(reading) == []


@ONLY_SQLITE
def test_a_lock_held_too_long_is_named(database: Database) -> None:
    with (
        database.write(),
        pytest.raises(StorageUnavailable, match="database is locked"),
        database.write(),
    ):
        raise AssertionError("two writers at once")


def test_a_database_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'no such folder' / 'x.sqlite3'}")
    with pytest.raises(StorageUnavailable, match="unable to open database file"):
        database.ping()
    database.close()


def test_ping_answers_when_all_is_well(database: Database) -> None:
    assert database.ping() is None


def test_a_reader_sees_one_moment_however_many_its_statements(database: Database) -> None:
    with database.read() as reading:
        assert materials.list_all(reading) == []
        with database.write() as writing:
            materials.create(writing, "paper", "")
        assert materials.list_all(reading) == []


def at_once(count: int, act: Callable[[int], None]) -> None:
    """Run ``act`` in threads that begin together; the first error is raised."""
    together, errors = threading.Barrier(count), []

    def run(number: int) -> None:
        together.wait(30)
        try:
            act(number)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(number,)) for number in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def test_writers_at_once_give_every_version_of_a_model_once(
    database: Database, new_model: Callable[..., NewModel]
) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
    with closing(Database(database.url, lock_timeout=60.0)) as patient:

        def store(_: int) -> None:
            for _ in range(5):
                with patient.write() as session:
                    job = jobs.add(session, "fit", "ols", material_id=material)
                    friction_models.add(session, material, job, new_model())

        at_once(4, store)
    with database.read() as session:
        stored = friction_models.versions(session, material, "ols")
    assert sorted(model.version for model in stored) == list(range(1, 21))
    assert [model.version for model in stored if model.current] == [20]


def test_writers_at_once_share_a_new_sensor(database: Database, new_log: Callable[..., NewGraspLog]) -> None:
    logs = [new_log() for _ in range(4)]
    with closing(Database(database.url, lock_timeout=60.0)) as patient:

        def store(number: int) -> None:
            with patient.write() as session:
                grasp_logs.add(session, logs[number])

        at_once(4, store)
    with database.read() as session:
        assert session.execute(text("SELECT count(*) FROM sensors")).scalar() == 1
        assert session.execute(text("SELECT count(*) FROM grasp_logs")).scalar() == 4


@ONLY_POSTGRESQL
def test_a_row_that_is_locked_too_long_is_named_and_others_are_free(
    database: Database, new_log: Callable[..., NewGraspLog]
) -> None:
    with database.write() as session:
        paper, steel = (materials.create(session, name, "").id for name in ("paper", "steel"))
    with database.write() as first:
        friction_models.lock(first, paper)
        with database.write() as second:
            friction_models.lock(second, steel)
            grasp_logs.add(second, new_log(paper))  # refers to the locked row without changing it
        with pytest.raises(StorageUnavailable, match="lock timeout"), database.write() as third:
            friction_models.lock(third, paper)


@ONLY_POSTGRESQL
def test_a_server_that_takes_no_writes_is_named(database: Database) -> None:
    def create() -> None:
        with database.write() as session:
            session.execute(text("SET TRANSACTION READ ONLY"))
            materials.create(session, "paper", "")

    with pytest.raises(StorageUnavailable, match="read-only transaction"):
        create()


@ONLY_POSTGRESQL
def test_a_connection_that_the_server_has_ended_is_replaced(database: Database) -> None:
    database.ping()
    with closing(Database(database.url)) as other, other.read() as session:
        ended = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = current_database()"
        assert session.execute(text(f"{ended} AND pid <> pg_backend_pid()")).scalars().all() == [True]
    assert database.ping() is None


def test_a_server_that_is_not_there_is_named_without_its_password(tmp_path: Path) -> None:
    with closing(Database(f"postgresql://someone:secret@/stiction?host={tmp_path}")) as database:
        with pytest.raises(StorageUnavailable, match="connection to server"):
            database.ping()
        with pytest.raises(StorageUnavailable, match=r"someone:\*\*\*@") as seen, database.connect():
            pass
    assert "secret" not in str(seen.value)


def test_a_driver_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without_driver(name: str, *rest: object) -> object:
        if name == "psycopg":
            raise ModuleNotFoundError("No module named 'psycopg'", name="psycopg")
        return real(name, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", without_driver)
    with pytest.raises(DriverMissing, match=r"postgresql://u:\*\*\*@h/d, whose driver psycopg is not installed"):
        Database("postgresql://u:secret@h/d")


@pytest.mark.parametrize("durable", [True, False])
def test_only_a_durable_transaction_waits_for_the_disk(database: Database, durable: bool) -> None:
    asked = "PRAGMA synchronous" if database.is_sqlite else "SHOW synchronous_commit"
    with database.write() as session:
        if not database.is_sqlite:  # the tests' own server makes no promise for power cuts
            session.execute(text("SET synchronous_commit = on"))
        full = session.execute(text(asked)).scalar()
    with database.write(durable=durable) as session:
        assert (session.execute(text(asked)).scalar() == full) is durable
        materials.create(session, "paper", "")
    with database.write() as session:
        assert session.execute(text(asked)).scalar() == full
        assert materials.find_id(session, "paper")


def test_a_number_that_json_does_not_know_is_refused(database: Database, claim: Callable[[], Claim]) -> None:
    with database.write() as session:
        job = jobs.add(session, "fit", "ols", material_id=materials.create(session, "paper", "").id, seed=2**63 - 1)
    mine = claim()
    with pytest.raises((StatementError, ValueError), match="not JSON compliant"), database.write() as session:
        jobs.start_stage(session, mine, "frames", {"frames": float("nan")})
    with database.read() as session:
        assert (jobs.get(session, job).seed, session.get_one(JobRow, job).seconds) == (2**63 - 1, {})


def test_names_that_differ_in_case_are_two_and_stand_in_the_order_of_their_bytes(database: Database) -> None:
    with database.write() as session:
        for name in ("paper", "Zinc", "Paper", "brass"):
            materials.create(session, name, "")
    with database.read() as session:
        assert [material.name for material in materials.list_all(session)] == ["Paper", "Zinc", "brass", "paper"]


@pytest.mark.parametrize(
    "url", ["stiction", "hush@", "postgresql://user:hush@host:port/name", "nosql://user:hush@host/name"]
)
def test_what_is_no_url_of_a_database_is_refused_without_being_repeated(url: str) -> None:
    with pytest.raises(InvalidUrl, match=r"database URL .*; allowed: .*sqlite://") as refusal:
        Database(url)
    assert "hush" not in str(refusal.value)


def test_a_connection_that_a_thread_has_when_all_are_closed_is_closed_when_it_is_given_back(
    new_url: Callable[..., str], tmp_path: Path
) -> None:
    """As those of a server's watchers are, whose threads go on for a moment after it has stopped."""
    database = Database(new_url(tmp_path))
    with database.read() as session:
        connection = session.connection().connection.dbapi_connection
        database.close()
        assert session.execute(text("SELECT 1")).scalar() == 1
    with pytest.raises(Exception, match="closed"):
        connection.cursor().execute("SELECT 1")  # type: ignore[union-attr]
    database.ping()  # who goes on with it all the same gets another
    database.close()


def test_what_two_writers_held_of_each_other_is_not_told_to_clients() -> None:
    told = Exception("deadlock detected\nDETAIL:  Process 17 waits for ShareLock on transaction 812; blocked by 18.")
    with pytest.raises(StorageUnavailable) as refused, module._unavailable_named():
        raise OperationalError("UPDATE jobs", {}, told)
    assert str(refused.value) == "database: deadlock detected"
