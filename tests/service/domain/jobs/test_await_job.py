"""How long the answer about a job that goes on is kept back."""

import asyncio
import time
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from db.database import Database
from db.repositories import access_keys, jobs, materials
from service.domain.access import keys
from service.domain.access.principal import ANONYMOUS
from service.domain.errors import KeyEnded
from service.domain.jobs import await_job
from service.processes.fair_threads import FairThreads

SECONDS = 0.4


@pytest.fixture
def wait(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Any, float]]:
    """Ask for a job whose looks are given, the last for good; what was told, and after how many seconds."""

    def asked(
        *finished_at: str | None,
        most: float = SECONDS,
        ends_after: float | None = None,
        others: Counter[str] | None = None,
    ) -> tuple[Any, float]:
        looks = list(finished_at)
        found = lambda *_: SimpleNamespace(finished_at=looks.pop(0) if len(looks) > 1 else looks[0])  # noqa: E731
        monkeypatch.setattr(await_job, "_look", found)

        async def ask() -> Any:
            ending = asyncio.Event()
            if ends_after is not None:
                asyncio.get_running_loop().call_later(ends_after, ending.set)
            context: Any = SimpleNamespace(
                jobs=SimpleNamespace(ending=lambda _: ending),
                threads=FairThreads(),
                waits=Counter() if others is None else others,
            )
            return await await_job.await_job(context, "id", most)

        began = time.monotonic()
        return asyncio.run(ask()).finished_at, time.monotonic() - began

    return asked


def test_one_that_goes_on_is_waited_for_as_long_as_was_asked(wait: Callable[..., tuple[Any, float]]) -> None:
    finished_at, seconds = wait(None)
    assert finished_at is None
    assert seconds >= SECONDS


def test_one_that_has_ended_is_told_at_once(
    wait: Callable[..., tuple[Any, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(await_job, "LOOK_SECONDS", 60.0)
    assert wait("now")[0] == "now"


def test_one_that_ends_elsewhere_is_found_at_the_next_look(wait: Callable[..., tuple[Any, float]]) -> None:
    assert wait(None, "now")[0] == "now"


def test_one_that_ends_here_is_not_waited_for_until_the_next_look(
    wait: Callable[..., tuple[Any, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(await_job, "LOOK_SECONDS", 60.0)
    finished_at, seconds = wait(None, "now", most=60.0, ends_after=0.05)
    assert finished_at == "now"
    assert 0.05 <= seconds < 30.0


def test_the_more_waits_of_a_client_there_are_the_more_seldom_each_looks(
    wait: Callable[..., tuple[Any, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(await_job, "LOOK_SECONDS", SECONDS / 8)
    others = Counter({ANONYMOUS.share: 8 * await_job.LOOKERS})
    finished_at, _ = wait(None, None, "now", others=others)
    assert finished_at is None, "it looked at the begin and at the end"
    assert others == {ANONYMOUS.share: 8 * await_job.LOOKERS}, "its own wait is over"
    finished_at, _ = wait(None, None, "now", others=Counter({"somebody else": 1000}))
    assert finished_at == "now"


@pytest.mark.parametrize("ends", ["expired", "revoked", None])
def test_who_waits_is_told_nothing_more_once_his_key_has_ended(
    database: Database, make: Callable[..., str], ends: str | None
) -> None:
    """However long before it he began to wait."""
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        job = jobs.add(session, "fit", "ols", material_id=material)
    key_id = str(keys.key_id(make(expires_at=keys.NO_KEY.created_at if ends == "expired" else None)))
    if ends == "revoked":
        with database.write() as session:
            access_keys.revoke(session, key_id)
    context: Any = SimpleNamespace(database=database)
    with nullcontext() if ends is None else pytest.raises(KeyEnded):
        assert await_job._look(context, job, key_id).id == job
