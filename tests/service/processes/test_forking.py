"""That processes forked for the tests are what new interpreters would be, and sooner."""

import os
import signal
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest

from service.processes import spawned
from tests import forking


def is_warm() -> bool:
    return "numba" in sys.modules


def test_a_process_has_what_is_there_when_it_starts(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    forking.begin()
    monkeypatch.setenv("TOLD_BY_A_TEST", "now")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = os.umask(0o067)
    try:
        with ProcessPoolExecutor(1, forking.Context()) as pool:
            assert pool.submit(os.getenv, "TOLD_BY_A_TEST").result() == "now"
            assert pool.submit(eval, "__import__('sys').path[0]").result() == str(tmp_path)
            assert pool.submit(forking.umask).result() == 0o067
            pool.submit(os.write, 2, b"said").result()
    finally:
        os.umask(before)
    assert capfd.readouterr().err.startswith("said")


def test_a_process_is_told_of_by_its_exit_code_and_does_not_go_on_for_ever() -> None:
    assert forking.exit_code(sys.exit, 3) == 3
    assert forking.exit_code(time.sleep, 600.0, seconds=0.01) == -signal.SIGKILL


def test_processes_of_servers_begin_warm() -> None:
    with ProcessPoolExecutor(1, spawned.CONTEXT) as pool:
        assert pool.submit(is_warm).result()
