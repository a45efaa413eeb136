"""Several models in one picture, in process."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from db.database import Database
from db.records import NewModel, StoredModel
from db.repositories import friction_models, jobs, materials
from service.web.comparison import common_force
from tests.service.web.conftest import HOSTILE

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def model_of(database: Database, new_model: NewModel) -> Callable[..., StoredModel]:
    """Store a model of a material, which is made known."""

    def add(name: str, friction: float = 0.4, forces: tuple[float, float] = (0.01, 0.1)) -> StoredModel:
        model = replace(new_model, coefficients=(friction, 0.0, 0.0), normal_force=forces)
        with database.write() as session:
            known = {each.name: each.id for each in materials.list_all(session)}
            material = known.get(name) or materials.create(session, name, "").id
            job = jobs.add(session, "fit", "ols", material_id=material)
            friction_models.add(session, material, job, model)
            return friction_models.versions(session, material)[0]

    return add


def test_materials_and_versions_stand_in_one_picture(browser: Any, model_of: Any, elements: Any) -> None:
    old = model_of("paper", 0.3)
    model_of("paper", 0.4)
    model_of("rubber", 0.9)
    page = elements(browser.get(f"/compare?material=paper&material=rubber&material=&model={old.id}").text)
    lines = [given for tag, given in page.found if tag == "polyline"]
    bands = [given for tag, given in page.found if tag == "polygon"]
    assert len(lines) == len(bands) == 3
    heights = [float(line["points"].split(",")[1].split()[0]) for line in lines]
    assert heights[1] < heights[0] < heights[2]  # rubber is the highest, paper's old version the lowest
    for told in ("0.300", "0.400", "0.900", "ols v1", "ols v2"):
        assert told in page.text


def test_the_same_version_asked_for_twice_stands_there_once(browser: Any, model_of: Any) -> None:
    stored = model_of("paper")
    page = browser.get(f"/compare?material=paper&model={stored.id}&model={stored.id}&model=9999").text
    assert page.count("<polyline") == 1


def test_they_are_compared_where_all_have_data(model_of: Any) -> None:
    models = [model_of("paper", forces=(0.02, 0.1)), model_of("rubber", forces=(0.06, 0.4))]
    assert common_force(models) == pytest.approx(0.08)
    apart = [models[0], model_of("wood", forces=(0.2, 0.3))]
    assert common_force(apart) == pytest.approx(0.15)


def test_a_page_without_models_says_how_to_choose_some(browser: Any, add: Any) -> None:
    add("cardboard")
    assert "Name materials" in browser.get("/compare").text
    page = browser.get("/compare?material=cardboard&fn=").text
    assert "has no model yet" in page
    assert "<polyline" not in page


def test_what_cannot_be_compared_is_told(browser: Any, model_of: Any) -> None:
    assert browser.get("/compare?material=unheard").status_code == 404
    for number in range(7):
        model_of(f"m{number}")
    many = "&".join(f"material=m{number}" for number in range(7))
    answer = browser.get(f"/compare?{many}")
    assert answer.status_code == 422
    assert "6 in one picture" in answer.text
    assert browser.get("/compare?model=x").status_code == 422


@pytest.mark.parametrize("typed", [each[:100] for each in HOSTILE])
def test_names_are_text(browser: Any, model_of: Any, elements: Any, typed: str) -> None:
    model_of(typed)
    answer = browser.get("/compare", params={"material": typed})
    page = elements(answer.text)
    assert answer.status_code == 200
    assert page.foreign() == []
    assert typed in page.text


def test_versions_are_chosen_on_the_page_of_their_material(browser: Any, model_of: Any, elements: Any) -> None:
    ids = [model_of("paper").id, model_of("paper", 0.5).id]
    page = elements(browser.get("/materials/paper").text)
    chosen = [given["value"] for tag, given in page.found if tag == "input" and given.get("type") == "checkbox"]
    assert chosen == [str(each) for each in reversed(ids)]
    assert "/compare?material=paper" in [given.get("href") for _, given in page.found]
