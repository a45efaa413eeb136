"""What tests of live detectors share."""

from collections.abc import Iterator
from concurrent.futures import Executor, Future
from typing import Any

import pytest

from service.stream import detectors, friction_looks, reconstructing


class AtOnce(Executor):
    """Does what it is given before it goes on."""

    def of(self, _owner: str) -> Executor:
        return self

    def submit(self, do: Any, /, *arguments: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(do(*arguments, **options))
        except Exception as error:
            future.set_exception(error)
        return future


@pytest.fixture
def looks_at_once(monkeypatch: pytest.MonkeyPatch) -> Iterator[Executor]:
    """So that answers are the same each time; the session of the name ``one`` is dropped at the end."""
    at_once = AtOnce()
    for module in (reconstructing, friction_looks):
        monkeypatch.setattr(module, "_LOOKS", at_once)
    yield at_once
    detectors.drop("one")
