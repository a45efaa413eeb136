from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from sqlalchemy import event

from db.database import Database
from db.records import NewModel
from db.repositories import friction_models, jobs, materials
from tests.service.web.conftest import HOSTILE, OWN

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


def test_an_empty_database_greets_with_two_next_steps(browser: Any, elements: Callable[..., Any]) -> None:
    page = elements(browser.get("/").text)
    assert [tag for tag, _ in page.found].count("li") == 2
    assert "stiction simulate" in page.text
    assert ("a", {"class": "button", "href": "/upload"}) in page.found
    assert ("form", {"method": "post", "action": "/practice"}) in page.found


def test_who_may_only_read_is_offered_no_simulated_grasps(session_of: Any) -> None:
    caller = session_of("read")
    assert "Load simulated grasps" not in caller.get("/").text
    assert caller.request("POST", "/practice").status_code == 403


@pytest.mark.usefixtures("store")
def test_a_material_is_listed_with_friction_and_interval(browser: Any) -> None:
    page = browser.get("/").text
    assert '<a href="/materials/paper">' in page
    assert "<strong>0.400</strong>" in page  # β₀ of the stored model
    assert "0.362 … 0.438" in page  # 0.4 ± √((1.645·0.02)² + 1.833²·(1e-4 + 0.05²·1e-4))
    assert "ols v1" in page


@pytest.mark.usefixtures("store")
def test_a_working_point_outside_the_data_is_marked(browser: Any) -> None:
    assert "outside the data" not in browser.get("/?fn=0.05").text
    assert "outside the data" in browser.get("/?fn=5").text
    assert 'value="0.1234567"' in browser.get("/?fn=0.1234567").text


@pytest.mark.usefixtures("store")
def test_a_material_shows_friction_where_it_has_a_model_and_says_where_it_has_none(
    browser: Any, add: Callable[..., int]
) -> None:
    add("cardboard")
    page = browser.get("/materials/paper").text
    assert "<dt>Friction coefficient μ</dt><dd>0.400</dd>" in page  # β₀ of the stored model
    assert "There is no model yet." in browser.get("/materials/cardboard").text


@pytest.mark.usefixtures("store")
@pytest.mark.parametrize(
    ("path", "told", "kept"),
    [
        ("/materials/paper?fn=0,1&v=0.001", "“Normal force on an element, N” is 0,1", ['value="0,1"', 'value="0.001"']),
        ("/materials/paper?fn=0.1&v=-1", "“Tangential velocity, m/s” is -1", ['value="0.1"', 'value="-1"']),
        ("/materials/paper?fn=0.1&method=lasso", "“Method” is lasso", ['value="0.1"', "<option selected>ols"]),
        ("/?fn=abc&search=pap", "“Normal force on an element, N” is abc", ['value="abc"', 'value="pap"']),
        ("/compare?material=paper&fn=abc", "“Normal force on an element, N” is abc", ['value="abc"', 'value="paper"']),
    ],
)
def test_a_wrong_working_point_is_told_above_the_page_and_stays_in_its_form(
    browser: Any, path: str, told: str, kept: list[str]
) -> None:
    answer = browser.get(path)
    assert answer.status_code == 422
    for words in (told, "paper", *kept):
        assert words in answer.text


@pytest.mark.usefixtures("store")
def test_a_material_shows_why_its_method_was_taken(browser: Any, database: Database, new_model: NewModel) -> None:
    because = "without the 48 beyond 3 deviations"
    with database.write() as session:
        material = materials.create(session, "felt", "").id
        job = jobs.add(session, "fit", "ols", material_id=material)
        told = replace(new_model, diagnostics={**new_model.diagnostics, "chosen_because": because})
        friction_models.add(session, material, job, told)
    assert f"Method {new_model.method}: {because}." in browser.get("/materials/felt").text
    assert "Method ols:" not in browser.get("/materials/paper").text


def test_a_search_finds_parts_of_names_and_says_when_there_are_none(browser: Any, add: Callable[..., int]) -> None:
    for name in ("paper", "cardboard"):
        add(name)
    assert "cardboard" not in browser.get("/?search=PAP").text
    assert "No material's name has" in browser.get("/?search=wood").text


def test_a_long_list_comes_in_parts_that_lead_on(
    browser: Any, add: Callable[..., int], elements: Callable[..., Any]
) -> None:
    for number in range(70):
        add(f"m{number:02}")
    seen: list[str] = []
    path = "/?sort=-name&fn="
    while path:
        found = elements(browser.get(path).text).found
        links = [attributes["href"] for tag, attributes in found if tag == "a"]
        seen += [link for link in links if link.startswith("/materials/")]
        path = next((link for link in links if "cursor=" in link), "")
    assert seen == [f"/materials/m{number:02}" for number in reversed(range(70))]


@pytest.mark.usefixtures("store")
def test_the_first_page_asks_the_database_no_more_often_for_many_materials(
    browser: Any, database: Database, new_model: NewModel
) -> None:
    asked: list[str] = []
    event.listen(database.engine, "before_cursor_execute", lambda *given: asked.append(given[2]))
    browser.get("/")
    for_one = len([each for each in asked if each.startswith("SELECT")])
    with database.write() as session:
        for number in range(40):
            material = materials.create(session, f"m{number:02}", "").id
            job = jobs.add(session, "fit", "ols", material_id=material)
            friction_models.add(session, material, job, new_model)
    asked.clear()
    page = browser.get("/").text
    assert page.count("ols v1") == 41
    assert 0 < len([each for each in asked if each.startswith("SELECT")]) <= for_one


@pytest.mark.parametrize("typed", HOSTILE)
def test_what_somebody_typed_is_text_and_never_markup(
    browser: Any, add: Callable[..., int], elements: Callable[..., Any], typed: str
) -> None:
    add("plain", typed)
    for path in ("/", f"/?search={typed[:90]}"):
        assert elements(browser.get(path).text).foreign() == []
    assert typed[:100] in elements(browser.get("/").text).text


def test_a_form_makes_a_material_known_and_leads_to_it(browser: Any) -> None:
    answer = browser.request("POST", "/materials", data={"name": " sheet 1 ", "description": "80 g/m²"}, headers=OWN)
    assert (answer.status_code, answer.headers["location"]) == (303, "/materials/sheet%201")
    assert "80 g/m²" in browser.get("/").text


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"name": "<b>"}, "“Name of the material” is &lt;b&gt;"),
        ({}, "“Name of the material” is missing"),
        ({"name": "paper"}, "The material exists already"),
    ],
)
def test_a_refused_form_is_told_as_a_page(browser: Any, add: Callable[..., int], data: Any, told: str) -> None:
    add("paper")
    answer = browser.request("POST", "/materials", data=data, headers=OWN)
    assert answer.status_code in {409, 422}
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert told in answer.text
