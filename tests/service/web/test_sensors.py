from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from urllib.parse import quote

import pytest

from db.database import Database
from db.records import CalibrationPress, Gel, NewCalibration
from db.repositories import calibrations, sensors
from service.web.routes.sensors import count_findings
from tests.service.web.conftest import HOSTILE, HTML, OWN

ON_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

SENT = {"young_modulus": "2.5e5", "poisson_ratio": " 0.48 ", "thickness": "", "marker_depth": "5e-4"}
GEL = Gel(2.5e5, 0.48, None, 5e-4)


@pytest.fixture
def sensor(database: Database) -> str:
    """A sensor that a log named, with a slash in its name."""
    with database.write() as session:
        sensors.find_or_add(session, "tac 3/a")
    return "tac 3/a"


def path_of(name: str) -> str:
    return f"/sensors/{quote(name, safe='')}"


def gel(database: Database, name: str) -> Gel | None:
    with database.read() as session:
        return sensors.get(session, name).gel


@ON_SQLITE
def test_whoever_may_upload_describes_a_gel_once(session_of: Any, database: Database, sensor: str) -> None:
    caller = session_of("upload")
    assert "not described" in caller.get("/sensors").text
    assert "Describe the gel" in caller.get(path_of(sensor)).text
    answer = caller.request("POST", path_of(sensor), data=SENT)
    assert answer.status_code == 303, answer.text
    page = caller.get(answer.headers["location"]).text
    assert "250000 Pa" in page
    assert "thick against any contact" in page
    assert gel(database, sensor) == GEL
    assert "Describe the gel" not in page
    assert caller.request("POST", path_of(sensor), data=SENT | {"marker_depth": "0"}).status_code == 403
    assert gel(database, sensor) == GEL


@ON_SQLITE
def test_a_form_leads_back_to_its_sensor_whatever_that_is_named(session_of: Any, database: Database) -> None:
    with database.write() as session:
        sensors.find_or_add(session, "100%25")
    answer = session_of("upload").request("POST", path_of("100%25"), data=SENT)
    assert (answer.status_code, answer.headers["location"]) == (303, path_of("100%25"))


@ON_SQLITE
def test_a_sensor_shows_its_newest_calibration(session_of: Any, database: Database, sensor: str) -> None:
    caller = session_of("read")
    assert "Never calibrated" in caller.get(path_of(sensor)).text
    known = {"name": "crosstalk_x", "unit": "-", "value": 0.08, "low": 0.077, "high": 0.083, "not_identified": None}
    unknown = {"name": "gain", "unit": "-", "value": None, "low": None, "high": None, "not_identified": "no <force>"}
    with database.write() as session:
        for value in (0.01, 0.08):
            model = {"estimates": [known | {"value": value}, unknown]}
            new = NewCalibration((CalibrationPress("a" * 32, 2.0),), model, None, None)
            calibrations.add(session, sensor, new)
    page = caller.get(path_of(sensor)).text
    assert "Version 2 corrects" in page
    assert "by 1 press:" in page
    assert "Earlier: version 1" in page
    assert "0.0770 to 0.0830" in page
    assert "not identified: no &lt;force&gt;" in page
    assert "0.0100" not in page


@ON_SQLITE
def test_only_admins_change_a_gel(session_of: Any, database: Database, sensor: str) -> None:
    with database.write() as session:
        sensors.describe(session, sensor, GEL)
    admin = session_of("admin")
    assert 'value="250000"' in admin.get(path_of(sensor)).text
    assert admin.request("POST", path_of(sensor), data=SENT | {"thickness": "4e-3"}).status_code == 303
    assert gel(database, sensor) == Gel(2.5e5, 0.48, 4e-3, 5e-4)
    (entry,) = admin.get("/v1/audit?action=sensor.described").json()["items"]
    assert (entry["subject"], entry["details"]["thickness"]) == (sensor, 4e-3)


@ON_SQLITE
@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"young_modulus": ""}, "“Young&#39;s modulus, Pa” is missing"),
        ({"poisson_ratio": "0.6"}, "“Poisson&#39;s ratio” is 0.6"),
        ({"young_modulus": "<b>"}, "“Young&#39;s modulus, Pa” is &lt;b&gt;"),
        ({"thickness": "1e-4"}, "marker_depth below the thickness"),
    ],
)
def test_a_refused_gel_stays_in_its_form(
    browser: Any, database: Database, sensor: str, changed: dict[str, str], told: str
) -> None:
    answer = browser.request("POST", path_of(sensor), data=SENT | changed, headers=OWN)
    assert answer.status_code == 422
    assert told in answer.text
    assert 'name="marker_depth" inputmode="decimal" value="5e-4"' in answer.text
    assert gel(database, sensor) is None


@ON_SQLITE
def test_who_may_only_read_has_no_form(session_of: Any, sensor: str) -> None:
    caller = session_of("read")
    assert "Describe the gel" not in caller.get(path_of(sensor)).text
    assert caller.request("POST", path_of(sensor), data=SENT).status_code == 403


@ON_SQLITE
def test_a_page_of_another_site_describes_nothing(browser: Any, database: Database, sensor: str) -> None:
    answer = browser.request("POST", path_of(sensor), data=SENT, headers={"sec-fetch-site": "cross-site"})
    assert answer.status_code == 403
    assert gel(database, sensor) is None


@ON_SQLITE
def test_a_sensor_that_nobody_named_has_no_page_and_gets_none(browser: Any) -> None:
    assert browser.get("/sensors/nobody").status_code == 404
    assert browser.request("POST", "/sensors/nobody", data=SENT, headers=OWN).status_code == 404
    assert "No log has named a sensor" in browser.get("/sensors").text


@ON_SQLITE
@pytest.mark.parametrize("typed", [text[:200] for text in HOSTILE])
def test_what_a_sensor_is_named_is_text(browser: Any, database: Database, elements: Any, typed: str) -> None:
    with database.write() as session:
        sensors.find_or_add(session, typed)
    page = elements(browser.get("/sensors").text)
    assert page.foreign() == []
    (link,) = [given["href"] for tag, given in page.found if tag == "a" and given["href"].startswith("/sensors/")]
    own = elements(browser.get(link).text)
    assert own.foreign() == []
    assert typed in own.text


@ON_SQLITE
def test_a_sensor_has_its_logs_with_what_was_found_against_them(
    client: Any, fitted: Any, elements: Any, links_of_list: Any
) -> None:
    log = elements(client.get(f"/logs/{fitted['id']}", headers=HTML).text)
    (link,) = [given["href"] for tag, given in log.found if tag == "a" and given["href"].startswith("/sensors/")]
    assert link == path_of(fitted["sensor"])
    assert f"/logs/{fitted['id']}" in links_of_list(client, link)
    logs = client.get("/v1/grasp-logs", params={"sensor": fitted["sensor"], "limit": 1000}).json()["items"]
    listed = client.get("/sensors", headers=HTML).text.partition(f'href="{link}"')[2].partition("</tr>")[0]
    assert f'data-label="Logs">{len(logs)}<' in listed


@pytest.mark.parametrize("kind", [None, (), ("weak normal forces", "few frames")])
def test_findings_are_counted_by_the_logs_that_they_were_made_against(kind: Any) -> None:
    found = None if kind is None else tuple(SimpleNamespace(name=name) for name in kind)
    logs: Any = [SimpleNamespace(detection=SimpleNamespace(findings=found))] * 2 + [SimpleNamespace(detection=None)]
    assert count_findings(logs) == [(name, 2) for name in kind or ()]


def test_the_form_keeps_a_map_of_the_thickness(session_of: Any, database: Database) -> None:
    """Which it has no field for; the page tells how thick the gel is by it."""
    uneven = Gel(2.5e5, 0.48, 4e-3, 5e-4, ((1.0, 0.9), (0.75, 1.0)))
    with database.write() as session:
        sensors.describe(session, "dome", uneven)
    admin = session_of("admin")
    assert ", by its map 0.75" in admin.get(path_of("dome")).text
    assert admin.request("POST", path_of("dome"), data=SENT | {"thickness": "5e-3"}).status_code == 303
    assert gel(database, "dome") == replace(uneven, thickness=5e-3)
    refused = admin.request("POST", path_of("dome"), data=SENT | {"thickness": "6e-4"})
    assert (refused.status_code, "marker_depth below the thickness everywhere" in refused.text) == (422, True)
