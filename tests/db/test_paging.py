from collections.abc import Callable, Sequence
from typing import Any

import pytest
from sqlalchemy import update

from db.database import Database
from db.paging import Window
from db.records import LogFilter, NewGraspLog, NewModel
from db.repositories import friction_models, grasp_logs, jobs, materials, runners
from db.tables import GraspLogRow, MaterialRow, now

NAMES = ("steel", "Paper", "paper", "felt", "zinc")


@pytest.fixture
def stocked(database: Database) -> Database:
    with database.write() as session:
        for name in NAMES:
            materials.create(session, name, "")
        session.execute(update(MaterialRow).values(created_at=now()))  # all at one moment: only ids tell them apart
    return database


def walk(list_part: Callable[[Window], Sequence[Any]], sort: str, *, descending: bool, limit: int) -> list[Any]:
    """Every entry, a part at a time."""
    found: list[Any] = []
    after = None
    while part := list_part(Window(sort, descending, after, limit)):
        assert len(part) <= limit
        found += part
        after = (getattr(part[-1], sort), part[-1].id)
    return found


@pytest.mark.parametrize("limit", [1, 2, 5, 9])
@pytest.mark.parametrize("descending", [False, True])
def test_the_parts_of_a_list_are_the_list(stocked: Database, limit: int, descending: bool) -> None:
    with stocked.read() as session:

        def part(window: Window) -> list[Any]:
            return materials.list_all(session, window)

        by_name = [found.name for found in walk(part, "name", descending=descending, limit=limit)]
        assert by_name == sorted(NAMES, reverse=descending)
        by_age = [found.name for found in walk(part, "created_at", descending=descending, limit=limit)]
        assert by_age == list(NAMES[::-1] if descending else NAMES)


def test_what_comes_or_goes_before_the_cursor_shifts_nothing(stocked: Database) -> None:
    with stocked.write() as session:
        first, second = materials.list_all(session, Window("name", limit=2))
        assert (first.name, second.name) == ("Paper", "felt")
        materials.create(session, "A new one", "")
        materials.merge(session, second.id, first.id)
        rest = materials.list_all(session, Window("name", after=("felt", second.id)))
    assert [found.name for found in rest] == ["paper", "steel", "zinc"]


def test_materials_are_searched_by_all_their_names(stocked: Database) -> None:
    with stocked.write() as session:
        materials.add_alias(session, materials.find_id(session, "zinc"), "50% PAPER_foil")
        for search, expected in (
            ("paper", ["Paper", "paper", "zinc"]),
            ("0%", ["zinc"]),
            ("r_f", ["zinc"]),
            ("_", ["zinc"]),
        ):
            assert [found.name for found in materials.list_all(session, search=search)] == expected
        assert materials.list_all(session, search="' OR 1=1 --") == []


def test_logs_are_listed_by_what_is_wanted_of_them(
    database: Database, new_log: Callable[..., NewGraspLog], statements: list[str]
) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        ids = [grasp_logs.add(session, new_log(material)) for material in (paper, None, paper)]
        made = [jobs.add(session, "ingest", "ols", material_id=None, grasp_log_id=log) for log in ids]
        mine = jobs.claim(session, runners.add(session, "host:1"))
        assert mine is not None
        assert mine.job_id == made[0]
        jobs.finish(session, mine, "refused", reason="no slip")
        grasp_logs.withdraw(session, ids[2], "wet")
        session.execute(update(GraspLogRow).values(created_at=now()))
    with database.read() as session:

        def those(wanted: LogFilter) -> set[int]:
            return {ids.index(log.id) for log in grasp_logs.list_all(session, Window("created_at"), wanted)}

        assert those(LogFilter()) == {0, 1, 2}
        assert those(LogFilter(material_id=paper)) == {0, 2}
        assert those(LogFilter(status="refused")) == {0}
        assert those(LogFilter(withdrawn=True)) == {2}
        assert those(LogFilter(withdrawn=False, status="queued")) == {1}
        assert those(LogFilter(sensor="sensor")) == {0, 1, 2}
        assert those(LogFilter(sensor="other")) == set()
        statements.clear()
        parts = walk(
            lambda window: grasp_logs.list_all(session, window, LogFilter()), "created_at", descending=True, limit=2
        )
    assert [log.id for log in parts] == sorted(ids, reverse=True)
    assert len(statements) == 3


def test_versions_are_listed_newest_first_and_by_what_is_wanted(
    database: Database, new_model: Callable[..., NewModel]
) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        for method in ("ols", "bayes", "ols"):
            job = jobs.add(session, "fit", method, material_id=paper)
            friction_models.add(session, paper, job, new_model(method))
        every = friction_models.versions(session, paper)
        assert [(found.model.method, found.version) for found in every] == [("ols", 2), ("bayes", 1), ("ols", 1)]
        assert friction_models.versions(session, paper, "ols", current=True) == every[:1]
        assert friction_models.versions(session, paper, current=False) == every[2:]

        def part(window: Window) -> list[Any]:
            return friction_models.versions(session, paper, window=window)

        assert walk(part, "id", descending=True, limit=1) == every
