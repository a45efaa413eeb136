"""Models in memory, read by many at once."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from db.database import Database
from db.errors import NotFound
from db.paging import Window
from db.records import ContactFriction, Detection, Job, NewGraspLog, SampleSummary
from db.repositories import detections, grasp_logs, jobs, materials
from service.domain.errors import NoModel
from service.domain.models import model_cache
from service.domain.models.model_cache import KnownModel, ModelCache

pytestmark = [
    pytest.mark.usefixtures("store"),
    pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True),
]


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The materials that were read from the database."""
    names: list[str] = []
    original = ModelCache._read_all

    def noting(cache: ModelCache, database: Database, asked: list[str], method: str) -> dict[str, KnownModel]:
        names.extend(asked)
        return original(cache, database, asked, method)

    monkeypatch.setattr(ModelCache, "_read_all", noting)
    return names


def test_a_model_is_read_once_for_all_who_ask_at_once(database: Database, read: list[str]) -> None:
    async def ask(cache: ModelCache) -> None:
        found = await asyncio.gather(*(cache.get(database, "paper", "ols") for _ in range(20)))
        assert len(set(map(id, found))) == 1

    asyncio.run(ask(ModelCache(60.0)))
    assert read == ["paper"]
    asyncio.run(ask_each(ModelCache(0.0), database))
    assert len(read) == 1 + 3


async def ask_each(cache: ModelCache, database: Database) -> None:
    await asyncio.gather(*(cache.get(database, "paper", "ols") for _ in range(3)))


def test_a_change_that_is_known_of_is_not_missed_by_joining_a_reading_begun_before(
    database: Database, store: Callable[[], None]
) -> None:
    async def run() -> None:
        cache = ModelCache(60.0)
        before = asyncio.create_task(cache.get(database, "paper", "ols"))
        await asyncio.sleep(0)
        store()
        cache.seen()
        assert (await cache.get(database, "paper", "ols")).stored.version == 2
        await before

    asyncio.run(run())


def test_who_asks_all_the_time_never_waits(database: Database, read: list[str]) -> None:
    async def run() -> None:
        cache = ModelCache(0.4)
        first = await cache.get(database, "paper", "ols")
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            known = cache.fresh("paper", "ols")
            assert known is not None
            assert known.tag == first.tag
            cache.renew(database, known, "paper", "ols")
            await asyncio.sleep(0.01)

    asyncio.run(run())
    assert 3 <= len(read) <= 7


def test_who_waits_is_told_what_is_wrong_and_a_renewal_is_not(database: Database) -> None:
    async def run() -> None:
        cache = ModelCache(60.0)
        found = await asyncio.gather(*(cache.get(database, "x", "ols") for _ in range(3)), return_exceptions=True)
        assert [type(each) for each in found] == [NotFound] * 3
        known = await cache.get(database, "paper", "ols")
        database.close()
        cache.renew(database, replace(known, until=0.0), "nothing", "ols")
        await asyncio.sleep(0.1)
        assert cache.fresh("paper", "ols") is known

    asyncio.run(run())


def test_a_change_counts_once_whenever_it_was(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model_cache, "MOST_CHANGES", 3)
    cache = ModelCache(60.0)

    def forgets(*changes: str) -> bool:
        cache.read(database, "paper", "ols")
        assert cache.fresh("paper", "ols") is not None
        cache.seen(*changes)
        return cache.fresh("paper", "ols") is None

    assert [forgets("a"), forgets("a"), forgets("b", "a"), forgets("a", "b")] == [True, False, True, False]
    assert [forgets(), forgets()] == [True, True]
    assert [forgets("c", "d"), forgets("b", "c", "d"), forgets("a")] == [True, False, True]


@pytest.fixture
def ended(database: Database) -> Job:
    """A job of the material "paper" that has ended."""
    with database.read() as session:
        found = next(iter(jobs.list_all(session, Window("created_at"))))
    return replace(found, finished_at=found.created_at)


def test_the_end_of_a_job_renews_the_models_of_its_material_only(
    database: Database, store: Callable[[], None], ended: Job, read: list[str]
) -> None:
    cache = ModelCache(60.0)
    other = cache.read(database, "paper", "ols")
    cache._known["card", "ols"] = replace(other, stored=replace(other.stored, material="card"))
    store()
    cache.has_ended(database, ended)
    renewed, kept = cache.fresh("paper", "ols"), cache.fresh("card", "ols")
    assert renewed is not None
    assert renewed.stored.version == 2
    assert kept is not None
    assert kept.read_at == other.read_at
    cache.has_ended(database, ended)
    cache.has_ended(database, replace(ended, material=None))
    assert read == ["paper", "paper"]


def test_the_end_of_a_job_is_not_missed_by_joining_a_reading_begun_before(
    database: Database, store: Callable[[], None], ended: Job
) -> None:
    async def run() -> None:
        cache = ModelCache(60.0)
        before = asyncio.create_task(cache.get(database, "paper", "ols"))
        await asyncio.sleep(0)
        store()
        cache.has_ended(database, ended)
        assert (await cache.get(database, "paper", "ols")).stored.version == 2
        await before
        assert (await cache.get(database, "paper", "ols")).stored.version == 2

    asyncio.run(run())


def test_whoever_is_told_of_the_end_meanwhile_does_not_get_ahead_of_the_reading(
    database: Database, ended: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache, depths = ModelCache(60.0), list[int]()
    cache.read(database, "paper", "ols")
    original = ModelCache._read_all

    def told_meanwhile(*given: Any) -> dict[str, KnownModel]:
        depths.append(len(depths))
        if len(depths) == 1:
            cache.has_ended(database, ended)
        return original(*given)

    monkeypatch.setattr(ModelCache, "_read_all", told_meanwhile)
    cache.has_ended(database, ended)
    assert depths == [0, 1]


def test_a_model_that_cannot_be_renewed_is_not_believed(database: Database, ended: Job) -> None:
    cache = ModelCache(60.0)
    cache.read(database, "paper", "ols")
    with database.write() as session:
        materials.rename(session, materials.find_id(session, "paper"), "card")
        materials.remove_alias(session, materials.find_id(session, "card"), "paper")
    cache.has_ended(database, ended)
    assert cache.fresh("paper", "ols") is None


def test_a_material_of_many_names_is_read_once_a_method_at_the_end_of_a_job(
    database: Database, ended: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of names that were asked lately. Each was read by itself: 0.4 s of CPU for a hundred aliases by six methods."""
    cache, names = ModelCache(60.0), [f"paper {number}" for number in range(100)]
    with database.write() as session:
        for name in names:
            materials.add_alias(session, materials.find_id(session, "paper"), name)
    for name in names:
        cache.read(database, name, "ols")
    old = cache.read(database, "paper", "ols")
    cache._known["paper", "ols"] = replace(old, until=old.read_at - 1.0)
    queries = list[list[str]]()
    original = ModelCache._read_all

    def noting(own: ModelCache, stored: Database, asked: list[str], method: str) -> dict[str, KnownModel]:
        queries.append(asked)
        return original(own, stored, asked, method)

    monkeypatch.setattr(ModelCache, "_read_all", noting)
    cache.has_ended(database, ended)
    assert queries == [names]
    assert all(cache.fresh(name, "ols") for name in names)


def test_without_a_model_few_logs_are_read_for_a_bound_of_friction(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 8,000 logs each such look-up took a second of the server, and all others waited for it."""
    monkeypatch.setattr(model_cache, "MOST_BOUNDS", 2)
    none = SampleSummary(0, "no slip", 1e-6, None, None, None, "2" * 64)
    with database.write() as session:
        material_id = materials.create(session, "held", "").id
        for number, low in enumerate([0.5, 0.2, 0.3]):
            log = NewGraspLog(f"{number:064x}", 1, "npz", "filter", material_id, "s", 82, 2.7, (8, 8))
            contact = ContactFriction(low, low, None, is_bound=True, reason="held")
            detection = Detection("filter", None, None, 0, 0, 0, 0, 0, 0, 0.1, "0" * 64, (), contact)
            detections.add(session, grasp_logs.add(session, log), detection, none)
    with pytest.raises(NoModel, match=r"newest grasps .* friction was at least 0\.3:"):
        ModelCache().read(database, "held", "ols")


def test_without_a_model_and_a_bound_it_is_told_what_became_of_the_newest_log(database: Database) -> None:
    with database.write() as session:
        material_id = materials.create(session, "held", "").id
    with pytest.raises(NoModel, match=r"it has no grasp log; upload one in which the contact slips$"):
        ModelCache().read(database, "held", "auto")
    with database.write() as session:
        ids = list[str]()
        for number in range(2):
            log = NewGraspLog(f"{number:064x}", 1, "npz", "filter", material_id, "s", 82, 2.7, (8, 8))
            ids.append(grasp_logs.add(session, log))
            job = jobs.add(session, "ingest", "auto", material_id=material_id, grasp_log_id=ids[-1])
    with pytest.raises(NoModel, match=r"its newest log is queued$"):
        ModelCache().read(database, "held", "auto")
    with database.write() as session:
        jobs.cancel(session, job, "nobody wants it")
    with pytest.raises(NoModel, match=r"its newest log is cancelled: nobody wants it$"):
        ModelCache().read(database, "held", "auto")
    with database.write() as session:
        grasp_logs.withdraw(session, ids[-1], "mislabelled")
    with pytest.raises(NoModel, match=r"its newest log is queued$"):
        ModelCache().read(database, "held", "auto")
