from collections.abc import Callable

import pytest

from db.database import Database
from db.errors import AlreadyExists, NotFound
from db.records import NewGraspLog, NewModel
from db.repositories import friction_models, grasp_logs, jobs, materials, materials_of_logs


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
    assert set(counts) == {4}


def test_a_material_is_found_by_its_aliases_too(database: Database, new_model: Callable[..., NewModel]) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        job = jobs.add(session, "fit", "ols", material_id=paper)
        friction_models.add(session, paper, job, new_model())
        materials.rename(session, paper, "cardboard")
        materials.add_alias(session, paper, "Pappe")
        materials.add_alias(session, paper, "Pappe")
    with database.read() as session:
        found = [materials.get(session, name) for name in ("paper", "cardboard", "Pappe")]
        assert found[0] == found[1] == found[2]
        assert (found[0].name, found[0].aliases) == ("cardboard", ("Pappe", "paper"))
        for name in ("paper", "cardboard", "Pappe"):
            model = friction_models.current(session, name, "ols")
            assert model is not None
            assert model.material == "cardboard"


def test_a_name_belongs_to_one_material(database: Database) -> None:
    with database.write() as session:
        paper, steel = (materials.create(session, name, "").id for name in ("paper", "steel"))
        materials.add_alias(session, steel, "iron")
        for take in (materials.rename, materials.add_alias):
            for name in ("steel", "iron"):
                with pytest.raises(AlreadyExists, match=f"material '{name}'"):
                    take(session, paper, name)
        with pytest.raises(AlreadyExists):
            materials.create(session, "iron", "")
        for name in ("iron", "paper", "felt"):
            with pytest.raises(NotFound, match=f"no alias '{name}'"):
                materials.remove_alias(session, paper, name)
        materials.remove_alias(session, steel, "iron")
        materials.rename(session, paper, "iron")
        materials.rename(session, paper, "paper")
        assert materials.get(session, "iron").aliases == ("iron",)


def test_names_are_listed_in_the_same_order_everywhere(database: Database) -> None:
    with database.write() as session:
        for name in ("b", "a", "B", "A", "a b", "a-b", "10", "9"):
            materials.create(session, name, "")
    with database.read() as session:
        assert [entry.name for entry in materials.list_all(session)] == ["10", "9", "A", "B", "a", "a b", "a-b", "b"]


def test_a_merged_material_leaves_its_logs_names_and_unfinished_jobs(
    database: Database, new_log: Callable[..., NewGraspLog], new_model: Callable[..., NewModel]
) -> None:
    with database.write() as session:
        paper, papre, pepar = (materials.create(session, name, "").id for name in ("paper", "papre", "pepar"))
        twice = new_log(paper)
        logs = [grasp_logs.add(session, log) for log in (twice, new_log(papre), new_log(papre, twice.sha256))]
        waiting, done = (jobs.add(session, "fit", "ols", material_id=papre) for _ in range(2))
        jobs.cancel(session, done, "no longer wanted")
        friction_models.add(session, papre, done, new_model())
        materials.merge(session, pepar, papre)
        materials.merge(session, paper, pepar)
        for target, source in ((papre, paper), (paper, papre)):
            with pytest.raises(NotFound, match="no material 'papre'"):
                materials.merge(session, target, source)
    with database.read() as session:
        (merged,) = materials.list_all(session)
        assert (merged.name, merged.aliases, merged.grasp_logs, merged.models) == ("paper", ("papre", "pepar"), 2, ())
        assert materials.get(session, "papre") == merged
        assert materials.still(session, papre) == materials.still(session, pepar) == paper
        assert [materials_of_logs.get(session, log) for log in logs] == [paper, paper, pepar]
        assert [jobs.get(session, job).material for job in (waiting, done)] == ["paper", "papre"]


def test_the_name_of_a_merged_material_may_be_its_heirs(database: Database) -> None:
    with database.write() as session:
        paper, papre = (materials.create(session, name, "").id for name in ("paper", "papre"))
        materials.merge(session, papre, paper)
        materials.rename(session, papre, "paper")
        assert [(entry.id, entry.name) for entry in materials.list_all(session)] == [(papre, "paper")]
