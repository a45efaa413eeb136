"""An executor that does what it is told at once, in this process."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any


class Here(Executor):
    """Does what it is told at once, and remembers the options."""

    def __init__(self) -> None:
        self.options: list[dict[str, Any]] = []

    def submit(self, do: Callable[..., Any], /, *given: Any, **options: Any) -> Future[Any]:
        self.options.append(options)
        done: Future[Any] = Future()
        try:
            done.set_result(do(*given, **options))
        except Exception as error:
            done.set_exception(error)
        return done
