from collections.abc import Callable

import pytest

from db.database import Database
from db.errors import AlreadyExists, NotFound
from db.records import NewGraspLog, NewModel
from db.repositories import friction_models, grasp_logs, jobs, materials


def test_a_material_is_found_by_name(database: Database) -> None:
    with database.write() as session:
        made = materials.create(session, "paper", "80 g/m²")
    with database.read() as session:
        assert materials.get(session, "paper") == made
        assert materials.find_id(session, "paper") == made.id
    assert (made.name, made.description, made.grasp_logs, made.models) == ("paper", "80 g/m²", 0, ())


def test_a_second_material_of_that_name_is_refused_and_the_transaction_lives(database: Database) -> None:
    with database.write() as session:
        materials.create(session, "paper", "first")
        with pytest.raises(AlreadyExists, match="material 'paper'"):
            materials.create(session, "paper", "second")
        materials.create(session, "steel", "")
    with database.read() as session:
        assert [entry.description for entry in materials.list_all(session)] == ["first", ""]


@pytest.mark.parametrize("find", [materials.get, materials.find_id])
def test_an_unknown_material_is_named(database: Database, find: Callable[..., object]) -> None:
    with database.read() as session, pytest.raises(NotFound, match="no material 'felt' is stored"):
        find(session, "felt")


def test_materials_come_with_their_logs_and_current_models(
    database: Database, new_log: Callable[..., NewGraspLog], new_model: Callable[..., NewModel]
) -> None:
    with database.write() as session:
        steel, paper = (materials.create(session, name, "").id for name in ("steel", "paper"))
        for _ in range(3):
            grasp_logs.add(session, new_log(paper))
        grasp_logs.add(session, new_log(None))
        for material, method, mean in [(paper, "ols", 0.1), (paper, "ols", 0.2), (paper, "bayes", 0.3)]:
            job = jobs.add(session, "fit", method, material_id=material)
            friction_models.add(session, material, job, new_model(method, mean))
    with database.read() as session:
        found = materials.list_all(session)
    assert [(entry.name, entry.grasp_logs) for entry in found] == [("paper", 3), ("steel", 0)]
    assert [(entry.model.method, entry.version) for entry in found[0].models] == [("bayes", 1), ("ols", 2)]
    assert [entry.model.coefficients[0] for entry in found[0].models] == [0.3, 0.2]
    assert found[1].models == ()
    assert steel == found[1].id


def test_the_number_of_queries_does_not_grow_with_the_materials(database: Database, statements: list[str]) -> None:
    counts = []
    for number in range(1, 20):
        with database.write() as session:
            materials.create(session, f"material {number}", "")
        statements.clear()
        with database.read() as session:
            assert len(materials.list_all(session)) == number
        counts.append(len(statements))
    assert set(counts) == {2}
