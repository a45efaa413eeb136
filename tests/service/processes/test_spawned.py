"""Processes that a server starts: known by their id, ended at once, and less urgent than the server."""

import multiprocessing
import os
import signal
import threading
from types import SimpleNamespace
from typing import Any

import pytest

from service.processes import spawned


class Child:
    """A process that only notes that it was killed."""

    def __init__(self) -> None:
        self.killed = 0

    def kill(self) -> None:
        self.killed += 1


def test_all_processes_of_a_pool_are_killed_and_its_first_one_named() -> None:
    children = {7: Child(), 8: Child()}
    pool: Any = SimpleNamespace(_processes=children)
    assert spawned.process_id(pool) == 7
    spawned.kill(pool)
    assert [child.killed for child in children.values()] == [1, 1]


@pytest.mark.parametrize(
    "pool", [None, SimpleNamespace(), SimpleNamespace(_processes=None), SimpleNamespace(_processes={})]
)
def test_a_pool_without_a_process_has_none_to_kill(pool: Any) -> None:
    assert spawned.process_id(pool) is None
    spawned.kill(pool)


def test_work_that_can_wait_is_less_urgent_by_five(monkeypatch: pytest.MonkeyPatch) -> None:
    nice: list[int] = []
    monkeypatch.setattr(os, "nice", nice.append)
    spawned.lower_priority()
    assert nice == [5]


def test_a_process_ends_by_the_server_and_not_by_an_interrupt_meant_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[Any] = []
    monkeypatch.setattr(signal, "signal", lambda number, action: done.append((number, action)))
    monkeypatch.setattr(
        threading, "Thread", lambda **given: SimpleNamespace(start=lambda: done.append(given["daemon"]))
    )
    monkeypatch.setattr("service.processes.spawned.logs.configure", lambda chosen: done.append(chosen))
    monkeypatch.setattr("service.processes.spawned.freed_memory.keep", lambda: done.append("keep"))
    monkeypatch.setattr("service.processes.spawned.traces.start", lambda: done.append("traces"))
    spawned.start(None, lambda: done.append("prepared"))
    assert done[:2] == [(signal.SIGINT, signal.SIG_IGN), (signal.SIGTERM, signal.SIG_IGN)]
    assert done[2:] == [True, None, "keep", "traces", "prepared"]
    done.clear()
    spawned.start(None)
    assert "prepared" not in done


def test_a_process_whose_server_is_gone_ends_with_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[Any] = []
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: SimpleNamespace(sentinel=3))
    monkeypatch.setattr(spawned, "wait", ended.append)
    monkeypatch.setattr(os, "_exit", ended.append)
    spawned._end_with_parent()
    assert ended == [[3], 1]
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)
    spawned._end_with_parent()
    assert ended == [[3], 1]
