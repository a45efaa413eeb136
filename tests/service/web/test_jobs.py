from typing import Any

import pytest

from db.database import Database
from db.repositories import jobs, materials, runners
from tests.service.web.conftest import OWN

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def job(database: Database) -> str:
    """A fit that waits for a worker, of which there is none."""
    with database.write() as session:
        return jobs.add(session, "fit", "ols", material_id=materials.create(session, "paper", "").id)


def status(database: Database, job_id: str) -> str:
    with database.read() as session:
        return jobs.get(session, job_id).status


def test_an_admin_cancels_a_job_by_its_button(session_of: Any, database: Database, job: str, elements: Any) -> None:
    admin = session_of("admin")
    forms = [given for tag, given in elements(admin.get("/jobs").text).found if tag == "form"]
    assert f"/jobs/{job}/cancel" in [each["action"] for each in forms]
    answer = admin.request("POST", f"/jobs/{job}/cancel")
    assert (answer.status_code, answer.headers["location"]) == (303, "/jobs")
    assert status(database, job) == "cancelled"
    assert f"/jobs/{job}/cancel" not in admin.get("/jobs").text
    (entry,) = admin.get("/v1/audit?action=job.cancelled").json()["items"]
    assert (entry["subject"], entry["actor"][:4]) == (job, "key:")


@pytest.mark.parametrize("scope", ["read", "upload"])
def test_who_is_no_admin_has_no_button_and_cancels_nothing(
    session_of: Any, database: Database, job: str, scope: str
) -> None:
    caller = session_of(scope)
    assert "paper" in caller.get("/jobs").text
    assert "Cancel" not in caller.get("/jobs").text
    assert caller.request("POST", f"/jobs/{job}/cancel").status_code == 403
    assert status(database, job) == "queued"


def test_a_page_of_another_site_cancels_nothing(browser: Any, database: Database, job: str) -> None:
    answer = browser.request("POST", f"/jobs/{job}/cancel", headers={"sec-fetch-site": "cross-site"})
    assert answer.status_code == 403
    assert status(database, job) == "queued"


def test_a_job_that_has_ended_or_was_never_there_is_told_as_a_page(browser: Any, database: Database, job: str) -> None:
    with database.write() as session:
        claim = jobs.claim(session, runners.add(session, "host:1"))
        assert claim is not None
        jobs.finish(session, claim, "done")
    for job_id, code, told in ((job, 409, "has ended"), ("0" * 32, 404, "No such job")):
        answer = browser.request("POST", f"/jobs/{job_id}/cancel", headers=OWN)
        assert (answer.status_code, told in answer.text) == (code, True)
