"""What is said where a start is refused."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from db.errors import StorageUnavailable
from service.domain.access.keys import NoKeys
from service.http.middleware.start_refusal import StartRefusal


def said(error: Exception | None, scope_type: str = "lifespan", kind: str = "lifespan.startup.failed") -> list[Any]:
    sent: list[Any] = []

    async def app(_: Any, __: Any, send: Any) -> None:
        await send({"type": kind, "message": "Traceback"})

    async def send(message: Any) -> None:
        sent.append(message)

    state = SimpleNamespace() if error is None else SimpleNamespace(start_error=error)
    scope: Any = {"type": scope_type, "app": SimpleNamespace(state=state)}
    asyncio.run(StartRefusal(app)(scope, None, send))  # type: ignore[arg-type]
    return sent


@pytest.mark.parametrize("error", [StorageUnavailable("no disk"), NoKeys("no disk"), OSError("no disk")])
def test_what_can_be_mended_is_said_in_its_own_words(error: Exception) -> None:
    assert said(error) == [{"type": "lifespan.startup.failed", "message": "no disk"}]


@pytest.mark.parametrize("error", [ValueError("no disk"), None])
def test_a_defect_keeps_its_traceback(error: Exception | None) -> None:
    assert said(error) == [{"type": "lifespan.startup.failed", "message": "Traceback"}]


def test_nothing_else_is_changed() -> None:
    assert said(OSError("x"), kind="lifespan.startup.complete")[0]["message"] == "Traceback"
    assert said(OSError("x"), scope_type="http")[0]["message"] == "Traceback"
