"""What two ask for at the same moment, on a database that lets both begin: one is answered as if it had come later."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

import pytest
from sqlalchemy import select

from db.blobs import BlobStore
from db.database import Database
from db.records import Gel, NewCalibration
from db.repositories import calibrations, materials, sensors
from db.tables import MaterialRow
from service.domain.access import quotas
from service.domain.access.principal import Principal
from service.domain.errors import InsufficientScope
from service.domain.materials import curate
from service.domain.resources.context import Context
from service.domain.sensors import calibrate, gels
from service.settings import Settings

GEL, ANOTHER = Gel(2.5e5, 0.48, None, 0.0), Gel(1e6, 0.49, 4e-3, 1e-3)
SOMEBODY = Principal(is_admin=False)
MEANWHILE = 0.2
"""s that the first waits for the second, which may be waiting for the first."""

TIMEOUT = 30.0


@pytest.fixture
def context(database: Database, blobs: BlobStore) -> Context:
    nobody: Any = None
    return Context(Settings(), database, blobs, nobody)


Second = Callable[[Any, str, Callable[[], Any]], Future[Any]]


@pytest.fixture
def second(monkeypatch: pytest.MonkeyPatch) -> Iterator[Second]:
    """Have something done at the moment at which a function of a module is called for the first time."""
    with ThreadPoolExecutor(1) as threads:

        def have_done(module: Any, name: str, do: Callable[[], Any]) -> Future[Any]:
            called, end = getattr(module, name), Future[Any]()

            def in_the_middle(*arguments: Any) -> Any:
                monkeypatch.setattr(module, name, called)
                done = threads.submit(do)
                done.add_done_callback(lambda _: pass_on(done, end))
                wait([done], MEANWHILE)
                return called(*arguments)

            monkeypatch.setattr(module, name, in_the_middle)
            return end

        yield have_done


def pass_on(done: Future[Any], end: Future[Any]) -> None:
    if (error := done.exception()) is not None:
        end.set_exception(error)
    else:
        end.set_result(done.result())


def test_a_new_sensor_is_described_by_one_of_two(context: Context, second: Second) -> None:
    late = second(quotas, "check_change", lambda: gels.describe(context, "s", ANOTHER, SOMEBODY))
    assert gels.describe(context, "s", GEL, SOMEBODY).gel == GEL
    with pytest.raises(InsufficientScope):
        late.result(TIMEOUT)
    assert gels.find(context, "s").gel == GEL


def test_a_sensor_is_calibrated_by_one_of_two(context: Context, second: Second) -> None:
    with context.database.write() as session:
        sensors.find_or_add(session, "s")
    store = lambda: calibrate._store(context, "s", NewCalibration((), {}, None, None), SOMEBODY)  # noqa: E731
    late = second(calibrations, "newest_version", store)
    assert store().version == 1
    with pytest.raises(InsufficientScope):
        late.result(TIMEOUT)


def test_a_material_is_not_merged_into_another_while_it_is_renamed(context: Context, second: Second) -> None:
    with context.database.write() as session:
        for name in ("a", "b"):
            materials.create(session, name, "")
    late = second(materials, "rename", lambda: curate.merge(context, "b", "a"))
    curate.change(context, "a", "c", None)
    merged, _ = late.result(TIMEOUT)
    assert (merged.name, merged.aliases) == ("b", ("a", "c"))


def test_an_upload_into_a_merged_material_does_not_keep_the_next_merge_waiting(database: Database) -> None:
    """It held the row of the one and waited for that of the other, and who merged held that and waited for the one."""
    with database.write() as session:
        one, other = (materials.create(session, name, "").id for name in ("a", "b"))
        materials.merge(session, one, other)

    def upload() -> int:
        with database.write() as session:
            return materials.still(session, other)

    row = select(MaterialRow.id).with_for_update()
    with ThreadPoolExecutor(1) as threads:
        with database.write() as session:
            session.scalar(row.where(MaterialRow.id == one))
            late = threads.submit(upload)
            wait([late], MEANWHILE)
            assert session.scalar(row.where(MaterialRow.id == other)) == other
        assert late.result(TIMEOUT) == one
