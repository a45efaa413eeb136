from collections.abc import Callable
from dataclasses import replace

import pytest
from sqlalchemy import text

from db.database import Database
from db.records import NewGraspLog, NewModel, Scales
from db.repositories import friction_models, grasp_logs, jobs, materials


@pytest.fixture
def material(database: Database) -> int:
    with database.write() as session:
        return materials.create(session, "paper", "").id


def store(database: Database, material: int, model: NewModel) -> int:
    with database.write() as session:
        job = jobs.add(session, "fit", model.method, material_id=material)
        return friction_models.add(session, material, job, model)


def test_a_model_comes_back_to_the_last_bit(
    database: Database, material: int, new_model: Callable[..., NewModel]
) -> None:
    store(database, material, new_model())
    with database.read() as session:
        found = friction_models.current(session, "paper", "ols")
    assert found is not None
    assert found.model == new_model()
    assert (found.material, found.version, found.current) == ("paper", 1, True)


def test_scales_come_back_to_the_last_bit(
    database: Database, material: int, new_model: Callable[..., NewModel], scales: Scales
) -> None:
    store(database, material, new_model("hierarchical", scales=scales))
    with database.read() as session:
        found = friction_models.current(session, "paper", "hierarchical")
    assert found is not None
    assert found.model.scales == scales


def test_a_model_without_scales_holds_no_json_in_their_place(
    database: Database, material: int, new_model: Callable[..., NewModel]
) -> None:
    store(database, material, new_model())
    with database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM friction_models WHERE scales IS NULL")) == 1


def test_versions_count_up_for_each_method_and_the_newest_is_current(
    database: Database, material: int, new_model: Callable[..., NewModel]
) -> None:
    made = [store(database, material, new_model(method)) for method in ("ols", "ols", "bayes", "ols")]
    assert made == [1, 2, 1, 3]
    with database.read() as session:
        every = friction_models.versions(session, material, None)
        only = friction_models.versions(session, material, "ols")
    assert [(entry.model.method, entry.version, entry.current) for entry in every] == [
        ("ols", 3, True),
        ("bayes", 1, True),
        ("ols", 2, False),
        ("ols", 1, False),
    ]
    assert [entry.version for entry in only] == [3, 2, 1]


def test_there_may_be_no_current_model(database: Database, material: int) -> None:
    with database.read() as session:
        assert friction_models.current(session, "paper", "ols") is None
        assert friction_models.versions(session, material, None) == []


def test_other_materials_count_where_their_logs_are_of_the_same_sensors(
    database: Database, material: int, new_model: Callable[..., NewModel], new_log: Callable[..., NewGraspLog]
) -> None:
    """And where they are materials still, with a current model by the method, fitted to the logs that they have."""
    sensors = {
        "same": "s",
        "first": "s",
        "another": "st",
        "partly": "t",
        "was partly": "u",
        "outdated": "s",
        "gone": "s",
    }
    with database.write() as session:
        grasp_logs.add(session, replace(new_log(material), sensor="s"))
        others = {name: materials.create(session, name, "").id for name in (*sensors, "of no log")}
        logs = {
            (name, sensor): grasp_logs.add(session, replace(new_log(others[name]), sensor=sensor))
            for name, all_ in sensors.items()
            for sensor in {"s", all_} - ({"s"} if all_ == "st" else set())
        }
        grasp_logs.withdraw(session, logs["was partly", "u"], "another sensor", None)
    for each in (material, *others.values()):
        store(database, each, new_model("hierarchical"))
    store(database, others["first"], new_model("hierarchical", mean=0.5))
    store(database, others["same"], new_model("ols"))
    with database.write() as session:
        friction_models.mark_outdated(session, others["outdated"])
        materials.merge(session, others["outdated"], others["gone"])
        found = friction_models.of_same_sensors(session, material, "hierarchical", 10)
        assert [(each.material, each.version) for each in found] == [
            ("first", 2),
            ("of no log", 1),
            ("was partly", 1),
            ("same", 1),
        ]
        assert friction_models.of_same_sensors(session, material, "hierarchical", 2) == found[:2]
