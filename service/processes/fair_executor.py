"""A thread beside those that answer, for work that nobody waits for: shared out fairly among those who ask."""

from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from threading import Lock
from typing import Any, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class FairExecutor:
    """One thread: owners have their turns one after the other, each owner's work in the order in which it came.

    So a piece of work waits for those of its own owner and for one of each other owner's, however many that has.
    """

    def __init__(self) -> None:
        self._thread, self._lock = ThreadPoolExecutor(1), Lock()
        self._waiting: OrderedDict[str, deque[Callable[[], None]]] = OrderedDict()

    def of(self, owner: str) -> Executor:
        """The thread as this owner has it."""
        return _Share(partial(self._add, owner))

    def _add(self, owner: str, do: Callable[[], None]) -> None:
        with self._lock:
            self._waiting.setdefault(owner, deque()).append(do)
        self._thread.submit(self._do_next)

    def _do_next(self) -> None:
        with self._lock:
            owner, waiting = self._waiting.popitem(last=False)
            do = waiting.popleft()
            if waiting:
                self._waiting[owner] = waiting  # behind all others
        do()


class _Share(Executor):
    """What one owner is given; cancelled work costs a turn and no time."""

    def __init__(self, add: Callable[[Callable[[], None]], None]) -> None:
        self._add = add

    def submit(
        self, do: Callable[Arguments, Result], /, *arguments: Arguments.args, **options: Arguments.kwargs
    ) -> Future[Result]:
        future: Future[Result] = Future()
        self._add(partial(_run, future, partial(do, *arguments, **options)))
        return future


def _run(future: Future[Any], do: Callable[[], Any]) -> None:
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(do())
    except BaseException as error:  # for whoever asks for the result, as any executor does
        future.set_exception(error)
