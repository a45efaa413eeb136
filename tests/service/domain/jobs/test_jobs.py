"""Jobs as use cases queue, cancel and ask for them, with what the audit trail then says."""

import logging
from typing import Any, cast

import pytest

from db.database import Database
from db.errors import BlobDamaged, NotFound, StorageUnavailable
from db.paging import Window
from db.records import AuditFilter, NewGraspLog
from db.repositories import access_keys, audit, friction_models, grasp_logs, jobs, materials, owners, runners
from db.tables import now
from service.domain.access.changes import record
from service.domain.access.principal import Principal
from service.domain.errors import JobEnded, KeyEnded, NotOwner, QuotaExceeded
from service.domain.jobs import queueing
from service.domain.jobs.cancel import cancel
from service.domain.logs import damage
from service.domain.materials import fit
from service.domain.resources.context import Context
from service.settings import Settings

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
KEY = Principal("a" * 12, "lab", False, "10.0.0.9", "r1")


@pytest.fixture
def paper(database: Database) -> int:
    with database.write() as session:
        access_keys.add(session, "a" * 12, "robot", "upload", "0" * 64)
        return materials.create(session, "paper", "").id


@pytest.fixture
def context(database: Database) -> Context:
    nothing = cast(Any, None)
    return Context(Settings(), database, nothing, nothing)


def changes(database: Database, action: str | None = None) -> list[tuple[str, str, str, dict[str, Any]]]:
    with database.read() as session:
        found = audit.list_all(session, Window("id"), AuditFilter(action=action))
    return [(each.actor.name, each.action, each.subject, dict(each.details)) for each in found]


def add(database: Database, paper: int | None) -> str:
    with database.write() as session:
        return jobs.add(session, "fit", "ols", material_id=paper)


def test_a_job_is_cancelled_once_and_on_record_once(database: Database, paper: int, context: Context) -> None:
    job = add(database, paper)
    for _ in range(2):
        found = cancel(context, job, KEY)
        assert (found.status, found.reason) == ("cancelled", "cancelled by request")
    assert changes(database) == [("key:" + "a" * 12, "job.cancelled", job, {"material": "paper"})]


def test_a_job_that_has_ended_otherwise_is_not_cancelled(database: Database, paper: int, context: Context) -> None:
    job = add(database, paper)
    with database.write() as session:
        claim = jobs.claim(session, runners.add(session, "host:1"))
        assert claim is not None
        jobs.finish(session, claim, "done")
    with pytest.raises(JobEnded, match=f"job {job} is done: it cannot be cancelled any more"):
        cancel(context, job)
    assert changes(database) == []
    with pytest.raises(NotFound):
        cancel(context, "none")


@pytest.mark.usefixtures("paper")
def test_a_change_is_none_by_a_key_that_has_ended(database: Database) -> None:
    with database.write() as session:
        record(session, KEY, "material.created", "paper", {"a": 1})
    with database.write() as session:
        access_keys.revoke(session, "a" * 12)
    with pytest.raises(KeyEnded), database.write() as session:
        record(session, KEY, "material.created", "felt")
    assert changes(database) == [("key:" + "a" * 12, "material.created", "paper", {"a": 1})]


def request(database: Database, **settings: Any) -> Any:
    with database.write() as session:
        return fit.request_fit(session, Settings(**settings), "paper", "ols", 7, KEY)


@pytest.mark.usefixtures("paper")
def test_a_fit_that_is_asked_for_is_queued_for_whom_and_on_record(database: Database) -> None:
    job = request(database)
    assert (job.kind, job.status, job.method, job.seed, job.material) == ("fit", "queued", "ols", 7, "paper")
    assert job.requested_by == "a" * 12
    told = {"job": job.id, "method": "ols", "seed": 7}
    assert changes(database) == [("key:" + "a" * 12, "fit.requested", "paper", told)]


@pytest.mark.parametrize("quota", ["key_queued_jobs", "key_changes_a_day"])
@pytest.mark.usefixtures("paper")
def test_a_key_asks_for_no_more_fits_than_it_may(database: Database, quota: str) -> None:
    request(database, **{quota: 1})
    with pytest.raises(QuotaExceeded):
        request(database, **{quota: 1})


def test_a_material_is_fitted_for_its_owners(database: Database, paper: int) -> None:
    with database.write() as session:
        owners.add(session, paper, "group:shop")
    with pytest.raises(NotOwner):
        request(database)
    assert changes(database) == []
    with pytest.raises(NotFound), database.write() as session:
        fit.request_fit(session, Settings(), "felt", "ols", 0)


@pytest.mark.parametrize(
    ("kind", "method", "told", "is_long"),
    [
        ("fit", "ols", False, False),
        ("fit", "conjugate", False, False),
        ("fit", "hierarchical", False, False),
        ("fit", "robust", False, True),
        ("fit", "bayes", False, True),
        ("ingest", "robust", False, False),
        ("ingest", "auto", True, True),
    ],
)
def test_a_fit_that_is_not_cheap_is_long(
    database: Database, paper: int, kind: Any, method: str, told: bool, is_long: bool, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "service.domain.jobs.queueing")
    with database.write() as session:
        log = grasp_logs.add(session, NewGraspLog("0" * 64, 4, "npz", "filter", None, "s", 9, 1.0, (3, 3)))
        about: Any = {"grasp_log_id": log} if kind == "ingest" else {}
        job = queueing.queue(session, kind, method, material_id=paper, requested_by=None, is_long=told, **about)
        claim = jobs.claim(session, runners.add(session, "host:1"))
    assert claim is not None
    assert (claim.job_id, claim.is_long) == (job, is_long)
    assert caplog.messages == ["job queued"]


def test_outdated_models_are_fitted_again_once_where_that_is_cheap(
    database: Database, paper: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(friction_models, "outdated_methods", lambda *_: ["ols", "robust", "hierarchical"])
    with database.write() as session:
        jobs.add(session, "fit", "hierarchical", material_id=paper)
        queueing.queue_cheap_refits(session, paper, "a" * 12)
        queueing.queue_cheap_refits(session, paper, None, besides=["robust"])
        found = [(job.method, job.requested_by) for job in jobs.list_all(session, Window("created_at"))]
    assert sorted(found, key=str) == [("hierarchical", None), ("ols", "a" * 12), ("robust", None)]


def test_damage_of_a_file_is_on_record_once_a_day(
    database: Database, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    error = BlobDamaged("0" * 64, "1" * 64)
    for _ in range(2):
        damage.record_damage(database, error, "GET /x")
    assert changes(database) == [("service", "blob.damaged", "0" * 64, {"found": "1" * 64, "by": "GET /x"})]
    assert caplog.messages == [f"{error} (found by GET /x)"] * 2
    damage.record_damage(database, BlobDamaged("2" * 64, "1" * 64), "scrub")
    assert len(changes(database)) == 2
    later = now() + damage.TOLD_AGAIN_AFTER
    monkeypatch.setattr(damage, "now", lambda: later)
    damage.record_damage(database, error, "scrub")
    assert len(changes(database)) == 3
    assert damage.TOLD_AGAIN_AFTER.total_seconds() == 24 * 3600


def test_damage_is_logged_where_nothing_can_be_recorded(
    monkeypatch: pytest.MonkeyPatch, database: Database, caplog: pytest.LogCaptureFixture
) -> None:
    def gone(*_: object, **__: object) -> None:
        raise StorageUnavailable("the database does not answer")

    monkeypatch.setattr(Database, "write", gone)
    damage.record_damage(database, BlobDamaged("0" * 64, "1" * 64), "scrub")
    assert (
        caplog.messages[1] == f"the damage of blob {'0' * 64} is not in the audit trail: the database does not answer"
    )
