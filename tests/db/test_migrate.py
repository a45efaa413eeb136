from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, replace
from datetime import timedelta
from functools import partial
from pathlib import Path

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, select, text, update

from db import migrate
from db.database import Database
from db.errors import SchemaMismatch, StorageUnavailable
from db.paging import Window
from db.records import (
    Actor,
    CalibrationPress,
    Claim,
    Detection,
    Finding,
    Gel,
    NewCalibration,
    NewGraspLog,
    NewModel,
    SampleSummary,
    Scales,
    StoredModel,
)
from db.repositories import (
    access_keys,
    audit,
    browser_sessions,
    calibrations,
    detections,
    friction_models,
    grasp_logs,
    idempotency_keys,
    jobs,
    materials,
    runners,
    sensors,
    stores,
)
from db.tables import Base, DetectionRow, GraspLogRow, MaterialOwnerRow, SensorRow, now
from tests import forking

pytestmark = pytest.mark.usefixtures("real_migrations")
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
UNCHECKED = "unchecked_logs"
REVISIONS = [entry.revision for entry in ScriptDirectory.from_config(migrate._config()).walk_revisions()][::-1]


@pytest.fixture
def fill(
    database: Database,
    new_log: Callable[..., NewGraspLog],
    detection: Detection,
    samples: SampleSummary,
    new_model: Callable[..., NewModel],
) -> Callable[[], None]:
    """Store a row in every table."""

    def add() -> None:
        log = new_log(material_id=1)
        with database.write() as session:
            material = materials.create(session, "paper", "")
            session.add(MaterialOwnerRow(material_id=material.id, owner="group:lab"))
            log_id = grasp_logs.add(session, log)
            job = jobs.add(session, "ingest", "ols", material_id=material.id, grasp_log_id=log_id)
            detections.add(session, log_id, detection, samples)
            friction_models.add(session, material.id, job, new_model())
            calibrations.add(session, log.sensor, NewCalibration((CalibrationPress(log_id, 2.0),), {}, b"", None))
            stores.set_id(session, "0" * 32)
            idempotency_keys.claim(session, "", "once", log.sha256, timedelta(hours=1))
            access_keys.add(session, "0" * 12, "robot", "read", log.sha256)
            browser_sessions.add(session, log.sha256, "0" * 12, now() + timedelta(hours=1))
            audit.add(session, audit.SERVICE, "material.created", "paper")
            assert jobs.claim(session, runners.add(session, "host:1")) == Claim(job, runners.list_all(session)[0].id)

    return add


def unmarked(stored: StoredModel) -> StoredModel:
    """A model without the note that its logs were not checked: their findings are lost on the way back."""
    diagnostics = {name: told for name, told in stored.model.diagnostics.items() if name != UNCHECKED}
    return replace(stored, model=replace(stored.model, diagnostics=diagnostics))


def tables(database: Database) -> set[str]:
    return set(inspect(database.engine).get_table_names()) - {"alembic_version"}


def shape(database: Database) -> dict[tuple[str | None, str], tuple[set[str | None], ...]]:
    """The tables, each with the names of its columns, indexes and unique constraints."""
    with database.connect() as connection:  # one for all questions, of all tables at once
        found = inspect(connection)
        kinds = found.get_multi_columns(), found.get_multi_indexes(), found.get_multi_unique_constraints()
        return {
            table: tuple({each["name"] for each in of_kind.get(table, ())} for of_kind in kinds)
            for table in kinds[0]
            if table[1] != "alembic_version"
        }


def test_models_and_migrations_agree(database: Database) -> None:
    assert migrate.check(database) is None
    assert tables(database) == set(Base.metadata.tables)


def test_models_and_migrations_agree_on_check_constraints(
    database: Database, new_url: Callable[..., str], tmp_path: Path
) -> None:
    """Alembic does not compare these."""
    (tmp_path / "made").mkdir()
    made = Database(new_url(tmp_path / "made", empty=True))
    Base.metadata.create_all(made.engine)
    for table in Base.metadata.tables:
        assert sorted(map(str, inspect(database.engine).get_check_constraints(table))) == sorted(
            map(str, inspect(made.engine).get_check_constraints(table))
        )
    made.close()


def test_revisions_stand_in_one_line() -> None:
    assert REVISIONS[-1] == migrate.head()
    assert len(ScriptDirectory.from_config(migrate._config()).get_heads()) == 1


def test_every_migration_goes_up_and_down_and_up(empty_database: Database) -> None:
    shapes = [shape(empty_database)]
    for revision in REVISIONS:
        migrate.upgrade(empty_database, revision)
        assert migrate.current(empty_database) == revision
        shapes.append(shape(empty_database))
        assert shapes[-1] != shapes[-2], f"{revision} changes nothing"
    newest = shapes.pop()
    for revision in reversed(REVISIONS):
        migrate.downgrade(empty_database, "-1")
        assert shape(empty_database) == shapes.pop(), f"the way back from {revision}"
    migrate.upgrade(empty_database)
    assert shape(empty_database) == newest


def test_migrations_go_down_and_up_with_data_in_every_table(
    database: Database,
    fill: Callable[[], None],
) -> None:
    fill()
    with database.read() as session:
        counts = {name: session.execute(text(f"SELECT count(*) FROM {name}")).scalar() for name in tables(database)}
    assert set(counts.values()) == {1}
    for _ in REVISIONS:
        migrate.downgrade(database, "-1", lose=True)
    assert tables(database) == set()
    migrate.upgrade(database)
    fill()
    migrate.check(database)


def test_materials_of_before_aliases_are_found_by_name_and_merged_ones_stop_the_way_back(
    empty_database: Database,
) -> None:
    migrate.upgrade(empty_database, "0002")
    with empty_database.write() as session:
        for number, name in enumerate(("paper", "papre"), 1):
            row = {"id": number, "name": name, "description": "old", "created_at": "2026-01-01 00:00:00+00:00"}
            session.execute(text("INSERT INTO materials VALUES (:id, :name, :description, :created_at)"), row)
    migrate.upgrade(empty_database, "0003")
    with empty_database.write() as session:
        assert materials.find_id(session, "paper") == 1
        session.execute(text("UPDATE materials SET merged_into_id = 1 WHERE id = 2"))
    with pytest.raises(SchemaMismatch, match="migration refused: 1 materials were merged"):
        migrate.downgrade(empty_database, "0002")
    assert migrate.current(empty_database) == "0003"


def test_a_database_of_before_claims_keeps_its_jobs_and_models(
    database: Database,
    fill: Callable[[], None],
) -> None:
    fill()
    with database.write() as session:
        material = materials.find_id(session, "paper")
        unwanted = jobs.add(session, "fit", "ols", material_id=material)
        jobs.cancel(session, unwanted, "no longer wanted")
        models = friction_models.versions(session, material, None)
    migrate.downgrade(database, "0004", lose=True)
    with database.read() as session:
        assert set(session.execute(text("SELECT status, reason FROM jobs")).all()) == {
            ("running", None),  # until an older server takes it up
            ("failed", "no longer wanted"),
        }
    migrate.upgrade(database)
    migrate.check(database)
    with database.write() as session:
        assert sorted(job.status for job in jobs.list_all(session, Window("created_at"))) == ["failed", "queued"]
        assert [unmarked(each) for each in friction_models.versions(session, material, None)] == models
        stored = detections.samples_of_material(session, material)
        assert [found.moments for found in stored] == [None]
        detections.set_moments(session, stored[0].grasp_log_id, b"moments")
        assert detections.samples_of_material(session, material)[0].moments == b"moments"


def test_models_of_before_scales_are_read_with_those_that_their_diagnostics_tell(
    database: Database,
    fill: Callable[[], None],
    new_model: Callable[..., NewModel],
    scales: Scales,
) -> None:
    told: dict[str, float | str | None] = {}
    for name in ("between_grasps", "between_places", "within"):  # that between sensors was not there yet
        scale = asdict(scales)[name]
        told |= {f"scale_{name}": scale["value"], f"scale_{name}_degrees_of_freedom": scale["degrees_of_freedom"]}
    fill()
    with database.write() as session:
        job = jobs.add(session, "fit", "hierarchical", material_id=1)
        structured = replace(new_model("hierarchical", scales=scales), diagnostics=told)
        friction_models.add(session, 1, job, structured)
    migrate.downgrade(database, "0014", lose=True)
    migrate.upgrade(database)
    with database.read() as session:
        hierarchical, ols = map(unmarked, friction_models.versions(session, 1))
    assert hierarchical.model == structured
    assert ols.model == new_model()
    assert ols.model.scales is None


def test_models_of_logs_that_were_not_checked_say_so(
    database: Database,
    new_log: Callable[..., NewGraspLog],
    detection: Detection,
    samples: SampleSummary,
    new_model: Callable[..., NewModel],
) -> None:
    """By an older version's models they had counted as sound."""
    with database.write() as session:
        kinds: dict[str, list[tuple[Finding, ...] | None]] = {"old": [None, (), None], "new": [()]}
        for name, found in kinds.items():
            material = materials.create(session, name, "").id
            for findings in found:
                log_id = grasp_logs.add(session, new_log(material))
                job = jobs.add(session, "ingest", "ols", material_id=material, grasp_log_id=log_id)
                detections.add(session, log_id, replace(detection, findings=findings), samples)
            grasp_logs.withdraw(session, log_id, "wet") if name == "old" else None
            friction_models.add(session, material, job, new_model())
    migrate.downgrade(database, "0025")
    migrate.upgrade(database)
    with database.read() as session:
        told = {stored.material: stored.model for stored in friction_models.with_ids(session, [1, 2])}
    note = "1 of 2 logs was stored before logs were checked: what is sent again is looked at"
    noted = replace(new_model(), diagnostics={**new_model().diagnostics, UNCHECKED: note})
    assert told == {"new": new_model(), "old": noted}


def test_logs_of_before_are_numbered_by_time(database: Database, new_log: Callable[..., NewGraspLog]) -> None:
    with database.write() as session:
        ids = [grasp_logs.add(session, new_log()) for _ in range(3)]
        for log_id, hours in zip(ids, (2, 3, 1), strict=True):
            moved = update(GraspLogRow).where(GraspLogRow.id == log_id)
            session.execute(moved.values(created_at=now() + timedelta(hours=hours)))
    migrate.downgrade(database, "0027")
    migrate.upgrade(database)
    with database.write() as session:
        ids.append(grasp_logs.add(session, new_log()))
        assert [session.get_one(GraspLogRow, log_id).number for log_id in ids] == [2, 3, 1, 4]


def test_models_of_one_job_get_jobs_of_their_own_on_the_way_back(
    database: Database,
    fill: Callable[[], None],
    new_model: Callable[..., NewModel],
) -> None:
    fill()
    with database.write() as session:
        ingest = jobs.list_all(session, Window("created_at"))[0]
        friction_models.add(session, 1, ingest.id, new_model("hierarchical"))
        models = friction_models.versions(session, 1)
    migrate.downgrade(database, "0017", lose=True)
    migrate.upgrade(database)
    with database.read() as session:
        assert [unmarked(each) for each in friction_models.versions(session, 1)] == models
        found = session.execute(text("SELECT j.kind, m.method FROM friction_models m JOIN jobs j ON j.id = m.job_id"))
        assert set(found.all()) == {("ingest", "ols"), ("fit", "hierarchical")}


def test_moments_of_unknown_velocities_are_not_left_to_a_version_that_cannot_read_them(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    told = {b"SMo2 of known velocities": False, b"SMo3 of unknown ones": True}
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        for moments, relative in told.items():
            log_id = grasp_logs.add(session, new_log(material_id=material))
            jobs.add(session, "ingest", "ols", material_id=material, grasp_log_id=log_id)
            summary = replace(samples, moments=moments, velocity_is_relative=relative)
            detections.add(session, log_id, detection, summary)
    migrate.downgrade(database, "0020")
    migrate.upgrade(database)
    with database.read() as session:
        found = detections.samples_of_material(session, material)
        assert {each.moments for each in found} == {b"SMo2 of known velocities", None}
        stored = [grasp_logs.get(session, each.grasp_log_id).samples for each in found]
        assert [None if each is None else each.velocity_is_relative for each in stored] == [None, None]


def test_a_database_of_a_newer_version_is_refused_by_name(database: Database) -> None:
    with database.write() as session:
        migrate.require_head(session)
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    for step in (migrate.check, migrate.upgrade, lambda database: migrate.downgrade(database, "base")):
        with pytest.raises(SchemaMismatch, match=r"9999; allowed: at most .*run a newer version"):
            step(database)
    with database.read() as session, pytest.raises(SchemaMismatch, match="run a newer version"):
        migrate.require_head(session)


def test_upgrading_again_changes_nothing(database: Database) -> None:
    with database.write() as session:
        materials.create(session, "paper", "")
    migrate.upgrade(database)
    with database.read() as session:
        assert [material.name for material in materials.list_all(session)] == ["paper"]


@pytest.mark.parametrize("engine_name", ["postgresql"], indirect=True)
def test_servers_that_start_at_once_upgrade_once(empty_database: Database) -> None:
    upgrade = f"from db import database, migrate; migrate.upgrade(database.Database({empty_database.url!r}))"
    assert forking.exit_codes(*[(exec, upgrade, {})] * 3) == [0, 0, 0]
    assert migrate.check(empty_database) is None


def test_a_column_that_0029_had_at_first_goes(database: Database) -> None:
    migrate.downgrade(database, "0029", lose=True)
    with database.connect() as connection:
        connection.exec_driver_sql("ALTER TABLE store ADD COLUMN clock_log_number INTEGER")
        connection.commit()
    migrate.upgrade(database)
    migrate.check(database)


@ONLY_SQLITE
@pytest.mark.parametrize("made", ["CREATE TABLE notes (line TEXT)", "CREATE VIEW notes AS SELECT 1 AS line"])
def test_a_file_of_another_program_is_refused_by_name_and_left_alone(empty_database: Database, made: str) -> None:
    with empty_database.connect() as connection:
        connection.exec_driver_sql(made)
        connection.commit()
    with pytest.raises(SchemaMismatch, match="tables of another program, such as notes; allowed: a file of its own"):
        migrate.upgrade(empty_database)
    with pytest.raises(SchemaMismatch, match="tables of another program"):
        migrate.downgrade(empty_database, "base")
    with empty_database.connect() as connection:
        found = inspect(connection)
        assert [*found.get_table_names(), *found.get_view_names()] == ["notes"]


@ONLY_SQLITE
def test_a_file_of_another_program_with_a_revision_of_our_names_is_refused_too(empty_database: Database) -> None:
    with empty_database.connect() as connection:
        for line in ("alembic_version (version_num TEXT)", "users (name TEXT)"):
            connection.exec_driver_sql(f"CREATE TABLE {line}")
        connection.exec_driver_sql("INSERT INTO alembic_version VALUES ('0005')")
        connection.commit()
    for change in (migrate.upgrade, partial(migrate.downgrade, revision="0003")):
        with pytest.raises(SchemaMismatch, match="tables of another program, such as users"):
            change(empty_database)


def test_a_revision_that_there_is_not_is_refused_by_name(database: Database) -> None:
    with pytest.raises(SchemaMismatch, match=r"nonsense.*allowed: head, base, .*0001"):
        migrate.downgrade(database, "nonsense")
    assert migrate.current(database) == migrate.head()


@ONLY_SQLITE
def test_foreign_keys_are_on_again_after_a_migration(empty_database: Database) -> None:
    migrate.upgrade(empty_database)
    with empty_database.read() as session:
        assert session.execute(text("PRAGMA foreign_keys")).scalar() == 1


def test_an_old_database_is_named(empty_database: Database) -> None:
    assert migrate.current(empty_database) is None
    with pytest.raises(SchemaMismatch, match="revision is None; allowed: "):
        migrate.check(empty_database)


def test_a_table_that_someone_changed_is_named(database: Database) -> None:
    with database.write() as session:
        session.execute(text("ALTER TABLE materials ADD COLUMN colour TEXT"))
    with pytest.raises(SchemaMismatch, match="colour"):
        migrate.check(database)


def test_who_described_a_sensor_before_that_was_noted_is_known_by_the_audit_trail(database: Database) -> None:
    """Else logs of the very sensors whose gels somebody had described wrongly said nothing of it."""
    gel = Gel(2e5, 0.48, None, 0.0)
    with database.write() as session:
        for name, scope in (("robot", "upload"), ("chief", "admin")):
            access_keys.add(session, name * 2, name, scope, 64 * name[0])
        for name, actors in {"left": ("chief", "robot"), "right": ("robot", "chief"), "thumb": (), "other": ()}.items():
            sensors.describe(session, name, gel)
            for actor in actors:
                audit.add(session, Actor(f"key:{actor * 2}", None, None), "sensor.described", name, {})
        audit.add(session, Actor("anybody", None, None), "sensor.described", "other", {})
        sensors.find_or_add(session, "bare")
    migrate.downgrade(database, "0030")
    migrate.upgrade(database)
    with database.read() as session:
        found = {each.name: each.described_by for each in sensors.list_all(session)}
    assert found == {"left": "robotrobot", "right": None, "thumb": None, "other": None, "bare": None}


@ONLY_SQLITE
def test_a_migration_that_breaks_references_is_named(database: Database) -> None:
    row = "'1', 'fit', 'queued', '{}', 99, 'ols', 0, 0, '2026-01-01'"
    columns = "id, kind, status, seconds, material_id, method, seed, deaths, created_at"

    def broken_migration() -> None:
        with migrate._migrating(database) as config:
            config.attributes["connection"].exec_driver_sql(f"INSERT INTO jobs ({columns}) VALUES ({row})")

    with pytest.raises(SchemaMismatch, match="jobs"):
        broken_migration()


@pytest.mark.parametrize("step", [migrate.current, migrate.check, migrate.upgrade])
def test_a_database_that_cannot_be_opened_is_named(tmp_path: Path, step: Callable[[Database], object]) -> None:
    damaged = tmp_path / "damaged.sqlite3"
    damaged.write_text("not a database, and longer than a header of one hundred bytes " * 4)
    for path, cause in ((tmp_path / "missing" / "x.sqlite3", "unable to open"), (damaged, "not a database")):
        with closing(Database(f"sqlite:///{path}")) as database, pytest.raises(StorageUnavailable, match=cause) as seen:
            step(database)
        assert path.name in str(seen.value)


@pytest.mark.parametrize(
    ("revision", "told"),
    [
        ("0030", "1 keys by which gels are described would be lost"),
        ("0029", "1 keys by which gels are described, 1 logs that share frames with others would be lost"),
        ("0026", "1 signatures of grasps would be lost"),
        ("0025", "1 signatures of grasps, 1 fingerprints of grasps would be lost"),
        ("0022", "1 fingerprints of grasps, 1 calibrations of sensors would be lost"),
        (
            "0016",
            "1 calibrations of sensors, 1 descriptions of sensors' gels, .*1 logs with findings would be lost",
        ),
        ("0007", "1 owners of materials, .*1 entries of the audit trail would be lost"),
        (
            "base",
            "1 withdrawals of grasp logs, 1 aliases of materials, .*1 grasp logs, 1 friction models would be lost",
        ),
    ],
)
def test_what_the_way_back_would_lose_is_named_and_kept(
    database: Database,
    fill: Callable[[], None],
    revision: str,
    told: str,
) -> None:
    fill()
    found = [{"name": "zero offset", "evidence": "", "remedy": ""}]
    with database.write() as session:
        session.execute(update(DetectionRow).values(findings=found, fingerprint="1" * 64, signature=b"f", alike=["2"]))
        session.execute(update(GraspLogRow).values(withdrawn_at=now(), withdrawn_because="wet"))
        session.execute(update(SensorRow).values(young_modulus=1e5, poisson_ratio=0.45, described_by="0" * 12))
        materials.add_alias(session, 1, "A4")
    before = migrate.current(database)
    with pytest.raises(SchemaMismatch, match=told):
        migrate.downgrade(database, revision)
    assert migrate.current(database) == before
    migrate.downgrade(database, revision, lose=True)


@pytest.mark.parametrize("alike", [None, ["2" * 64]])
def test_logs_that_share_frames_are_looked_at_again_after_a_way_back(
    database: Database, fill: Callable[[], None], alike: list[str] | None
) -> None:
    """They counted beside those others for good, also where they were sent again."""
    fill()
    with database.write() as session:
        session.execute(update(DetectionRow).values(fingerprint="1" * 64, signature=b"f", alike=alike))
    migrate.downgrade(database, "0029", lose=True)
    migrate.upgrade(database)
    with database.read() as session:
        assert detections.has_signature(session, session.scalars(select(DetectionRow.grasp_log_id)).one()) == (
            not alike
        )


def test_a_key_that_expires_stops_the_way_back(database: Database) -> None:
    with database.write() as session:
        access_keys.add(session, "0" * 12, "guest", "read", "0" * 64, expires_at=now() + timedelta(days=1))
    with pytest.raises(SchemaMismatch, match="migration refused: 1 access keys expire"):
        migrate.downgrade(database, "0009")
    with database.write() as session:
        access_keys.revoke(session, "0" * 12)
    migrate.downgrade(database, "0009")


def test_gels_are_kept_by_the_way_to_maps_of_their_thickness(database: Database) -> None:
    """And a map is named by the way back, which has no place for it."""
    gel = Gel(2e5, 0.48, 4e-3, 1e-3)
    with database.write() as session:
        sensors.describe(session, "flat", gel)
    migrate.downgrade(database, "0031")
    migrate.upgrade(database)
    uneven = replace(gel, relative_thickness=[[1, 0.9], [0.8, 1.0]])
    with database.write() as session:
        assert sensors.get(session, "flat").gel == gel
        assert sensors.describe(session, "dome", uneven).gel == uneven
    assert uneven.relative_thickness == ((1.0, 0.9), (0.8, 1.0))
    with pytest.raises(SchemaMismatch, match="1 maps of gels' thickness"):
        migrate.downgrade(database, "0031")
