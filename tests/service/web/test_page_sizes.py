"""How much a page of a list holds, to the last entry, and what leads on."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from db.database import Database
from db.records import CalibrationPress, NewCalibration, NewGraspLog, NewModel
from db.repositories import calibrations, friction_models, grasp_logs, jobs, materials, sensors

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

LOG = NewGraspLog("", 1, "npz", "filter", None, "left", 3, 1.0, (2, 2))


def leads_on(page: str) -> bool:
    return "cursor=" in page


@pytest.mark.parametrize(("count", "shown"), [(50, 50), (51, 50)])
def test_a_page_lists_fifty_materials(browser: Any, add: Callable[..., int], count: int, shown: int) -> None:
    for number in range(count):
        add(f"m{number:02}")
    page = browser.get("/").text
    assert len(set(re.findall(r'href="/materials/(m\d\d)"', page))) == shown
    assert leads_on(page) is (count > shown)


@pytest.mark.parametrize(("count", "shown"), [(50, 50), (51, 50)])
def test_a_page_lists_fifty_sensors_with_the_number_of_their_logs(
    browser: Any, database: Database, count: int, shown: int
) -> None:
    with database.write() as session:
        for number in range(count):
            sensors.find_or_add(session, f"s{number:02}")
        for number in range(3):
            grasp_logs.add(session, replace(LOG, sha256=f"{number:064}", sensor="s07"))
    page = browser.get("/sensors").text
    assert len(set(re.findall(r'href="/sensors/(s\d\d)"', page))) == shown
    assert leads_on(page) is (count > shown)
    row = page.partition('href="/sensors/s07"')[2].partition("</tr>")[0]
    assert re.findall(r"<td[^>]*>\s*(\d+)\s*</td>", row)[:1] == ["3"]


@pytest.mark.parametrize(("count", "shown"), [(50, 50), (51, 50)])
def test_a_page_lists_fifty_jobs_the_newest_first(browser: Any, database: Database, count: int, shown: int) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        made = [jobs.add(session, "fit", "ols", material_id=material) for _ in range(count)]
    page = browser.get("/jobs").text
    listed = re.findall(r"/jobs/([0-9a-f]{32})/cancel", page)
    assert len(listed) == shown
    assert set(listed) <= set(made)
    assert leads_on(page) is (count > shown)
    assert not re.findall(r"/jobs/([0-9a-f]{32})/cancel", browser.get("/jobs?status=done").text)
    assert len(re.findall(r"/jobs/([0-9a-f]{32})/cancel", browser.get("/jobs?status=queued").text)) == shown


@pytest.mark.parametrize(("count", "shown"), [(25, 25), (26, 25)])
def test_a_page_of_a_material_and_of_a_sensor_lists_twenty_five_logs(
    browser: Any, database: Database, count: int, shown: int
) -> None:
    with database.write() as session:
        paper, other = (materials.create(session, name, "").id for name in ("paper", "other"))
        logs = [replace(LOG, sha256=f"{number:064}", material_id=paper) for number in range(count)]
        for log in [*logs, replace(LOG, sha256="f" * 64, material_id=other, sensor="right")]:
            added = grasp_logs.add(session, log)
            jobs.add(session, "ingest", "ols", material_id=log.material_id, grasp_log_id=added)
    for path in ("/materials/paper", "/sensors/left"):
        page = browser.get(path).text
        assert len(set(re.findall(r'href="/logs/([0-9a-f]{32})"', page))) == shown
        assert leads_on(page) is (count > shown)
    assert len(set(re.findall(r'href="/logs/([0-9a-f]{32})"', browser.get("/materials/other").text))) == 1


def test_a_material_has_its_twenty_newest_versions(browser: Any, database: Database, new_model: NewModel) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        for _ in range(21):
            job = jobs.add(session, "fit", "ols", material_id=material)
            friction_models.add(session, material, job, new_model)
    page = browser.get("/materials/paper").text
    listed = sorted(set(map(int, re.findall(r'name="model" value="(\d+)"', page))))
    assert len(listed) == 20
    assert listed[-1] - listed[0] == 19


def test_a_sensor_has_its_five_newest_calibrations(browser: Any, database: Database) -> None:
    with database.write() as session:
        sensors.find_or_add(session, "left")
        for _ in range(6):
            press = CalibrationPress("a" * 32, 2.0)
            calibrations.add(session, "left", NewCalibration((press,), {"estimates": []}, None, None))
    page = browser.get("/sensors/left").text
    assert "Version 6 corrects" in page
    assert [f"version {number}" in page for number in range(1, 6)] == [False, True, True, True, True]
