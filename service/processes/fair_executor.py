"""Threads beside those that answer, for work that nobody waits for: shared out fairly among those who ask."""

import time
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from functools import partial
from threading import Condition, Thread
from typing import Any, ParamSpec, TypeVar

LONG_SECONDS = 1.0
"""Of CPU time, from which on a piece of work is long."""

MOST_NOTED = 1000
"""Owners of whom it is known that theirs is, the last ones."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class FairExecutor:
    """So many threads, of which each owner has one at once: owners have their turns one after the other.

    Each owner's work is done in the order in which it came. Owners whose last piece took long leave one thread to the
    others, of two or more. What has not been done is given up when the process ends.
    """

    def __init__(self, threads: int = 1) -> None:
        self._most, self._begun, self._changed = threads, 0, Condition()
        self._waiting: OrderedDict[str, deque[Callable[[], None]]] = OrderedDict()
        self._served: set[str] = set()
        self._long: OrderedDict[str, None] = OrderedDict()

    def of(self, owner: str) -> Executor:
        """The threads as this owner has them."""
        return _Share(partial(self._add, owner))

    def _add(self, owner: str, do: Callable[[], None]) -> None:
        with self._changed:
            self._waiting.setdefault(owner, deque()).append(do)
            if self._begun < self._most:
                self._begun += 1
                Thread(target=self._work, daemon=True).start()
            self._changed.notify()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._next() is not None)
                owner, do = self._take()
            begun = time.thread_time()
            do()
            del do  # with all that it refers to, before the next one comes
            with self._changed:
                self._served.remove(owner)
                self._note(owner, time.thread_time() - begun)
                self._changed.notify_all()

    def _note(self, owner: str, seconds: float) -> None:
        self._long.pop(owner, None)
        if seconds > LONG_SECONDS:
            self._long[owner] = None
        if len(self._long) > MOST_NOTED:
            self._long.popitem(last=False)

    def _next(self) -> str | None:
        are_full = self._most > 1 and len(self._served & self._long.keys()) >= self._most - 1
        passed = self._served | (self._long.keys() if are_full else set())
        return next((owner for owner in self._waiting if owner not in passed), None)

    def _take(self) -> tuple[str, Callable[[], None]]:
        owner = self._next()
        assert owner is not None
        waiting = self._waiting.pop(owner)
        do = waiting.popleft()
        if waiting:
            self._waiting[owner] = waiting  # behind all others
        self._served.add(owner)
        return owner, do


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
