"""A command that takes long says so; one that does not stays quiet."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from service import formats
from service.cli import main, progress
from service.cli.exit_codes import INTERRUPTED
from service.cli.progress import counted, resumable, shown_progress
from slipcore.contact import Scene, simulate


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "MOMENT", 0.02)


@pytest.fixture
def on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "is_terminal", lambda: True)


def test_a_command_says_how_long_it_has_been_at_it_and_stays_quiet_if_quick(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with shown_progress("thinking"):
        pass
    assert capsys.readouterr() == ("", "")
    monkeypatch.setattr(progress, "MOMENT", 0.05)
    with shown_progress("thinking"):
        time.sleep(0.2)
    out, err = capsys.readouterr()
    assert out == ""
    assert "thinking: 0 s" in err
    assert " left" not in err
    assert err.endswith("\n")


@pytest.mark.usefixtures("impatient")
def test_it_is_said_that_kernels_are_being_compiled(capsys: pytest.CaptureFixture[str]) -> None:
    with shown_progress("thinking"):
        exec(compile("time.sleep(0.2)", "/lib/numba/core/dispatcher.py", "exec"), {"time": time})
    assert "thinking: 0 s, compiling numerics, which are kept\n" in capsys.readouterr().err
    with shown_progress("thinking"):
        time.sleep(0.2)
    assert "compiling" not in capsys.readouterr().err


@pytest.mark.usefixtures("impatient", "on_a_terminal")
def test_the_time_left_is_told_once_it_is_known_which_part_is_done(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    moments = iter([0.0, 30.0, *[600.0] * 1000])
    with monkeypatch.context() as patched:
        patched.setattr(progress, "perf_counter", lambda: next(moments))
        line = progress.Line("thinking")
        line.tell(0.25)
        line.say()
        line.tell(0.5)
        line.end()
    assert capsys.readouterr().err == "\rthinking: 30 s, 90 s left\rthinking: 10 min, 10 min left\n"


def test_ctrl_c_says_what_a_folder_holds_and_how_to_go_on(capsys: pytest.CaptureFixture[str]) -> None:
    def stopped() -> Iterator[int]:
        yield from range(2)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        resumable(stopped(), 3, "logs", Path("there"))
    assert "2 of 3 logs are in there; the same command makes the others" in capsys.readouterr().err
    assert resumable(range(3), 3, "logs", Path("there")) == [0, 1, 2]


@pytest.mark.usefixtures("impatient", "on_a_terminal")
def test_things_are_counted_as_they_are_done(capsys: pytest.CaptureFixture[str]) -> None:
    for _ in counted(range(3), 3, "logs"):
        time.sleep(0.05)
    err = capsys.readouterr().err
    assert re.search(r"\r1 of 3 logs: \d+ s, \d+ s left", err)
    assert re.search(r"\r3 of 3 logs: \d+ s *\n$", err)


@pytest.mark.usefixtures("on_a_terminal")
def test_a_line_that_becomes_shorter_covers_what_stood_there(capsys: pytest.CaptureFixture[str]) -> None:
    line = progress.Line("thinking hard")
    line.say()
    line.tell(0.0, "done")
    line.say()
    first, second = capsys.readouterr().err.strip("\r").split("\r")
    assert len(second) == len(first)
    assert second.startswith("done: 0 s  ")


@pytest.mark.parametrize("given", [{"accuracy": 0.3}, {}], ids=["accuracy", "neither"])
def test_a_simulation_tells_which_part_is_done(given: dict[str, float]) -> None:
    told: list[float] = []
    simulate(Scene.from_toml("lifting_10N"), **given, progress=told.append)
    assert all(0.0 < part <= 1.0 for part in told)
    if not given:
        assert told == sorted(told)
        assert told[-1] == 1.0


@pytest.mark.parametrize("options", [("--output", "log.npz"), ("--explain",)])
def test_an_interrupted_command_leaves_nothing_behind(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, options: tuple[str, ...]
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("slipcore.contact.tiers.boundary_elements._frames", interrupt)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["simulate", "lifting_10N", *options])
    assert end.value.code == INTERRUPTED
    assert capsys.readouterr().err == "stiction: interrupted; nothing is left half written\n"
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def heeds_interrupts() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.signal(signal.SIGINT, before) is signal.default_int_handler


@pytest.mark.usefixtures("heeds_interrupts")
def test_an_interrupt_that_is_lost_while_kernels_load_is_raised_where_progress_is_told() -> None:
    with pytest.raises(KeyboardInterrupt), shown_progress("thinking") as tell:  # noqa: PT012
        tell(0.2)
        with suppress(KeyboardInterrupt):  # as a callback of ctypes does
            signal.raise_signal(signal.SIGINT)
        tell(0.3)
        pytest.fail("gone on")


@pytest.mark.usefixtures("heeds_interrupts")
@pytest.mark.parametrize("interrupted", [True, False])
def test_a_failure_that_an_interrupt_has_caused_is_an_interrupt(interrupted: bool) -> None:
    with pytest.raises(KeyboardInterrupt if interrupted else RuntimeError), shown_progress("thinking"):  # noqa: PT012
        if interrupted:
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        raise RuntimeError("no kernel")


@pytest.mark.usefixtures("heeds_interrupts")
@pytest.mark.parametrize("compiler", ["llvmlite", "numba"])
def test_an_interrupt_within_the_compiler_is_raised_once_it_is_left(compiler: str) -> None:
    interrupt = "signal.raise_signal(signal.SIGINT); left.append(True)"
    within = {"signal": signal, "left": []}
    with pytest.raises(KeyboardInterrupt), shown_progress("thinking"):  # noqa: PT012
        exec(compile(interrupt, f"packages/{compiler}/engine.py", "exec"), within)
        assert within["left"]
        time.sleep(30.0)


@pytest.mark.usefixtures("heeds_interrupts")
@pytest.mark.parametrize("ends", ["told", "failed"])
def test_an_interrupt_within_the_compiler_comes_once(ends: str) -> None:
    """The second came upon who took away what was half written."""
    with pytest.raises(KeyboardInterrupt), shown_progress("thinking") as tell:  # noqa: PT012
        for _ in range(2):
            exec(compile("signal.raise_signal(signal.SIGINT)", "packages/numba/engine.py", "exec"), {"signal": signal})
        if ends == "failed":
            raise RuntimeError("no kernel")
        tell(0.2)
    time.sleep(3.0 * progress.AGAIN)


HEED_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
"""What a shell starts in the background ignores them, and so does all that is started by that: these tests, perhaps."""


def test_a_command_that_is_sent_an_interrupt_says_so_and_leaves_nothing_behind(tmp_path: Path) -> None:
    run = f"{HEED_INTERRUPTS}; import runpy; runpy.run_module('service.cli', run_name='__main__')"
    given = ["simulate", "lifting_10N", "--accuracy", "0.001", "--output", str(tmp_path / "log.npz")]
    with subprocess.Popen([sys.executable, "-c", run, *given], stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"simulating")  # it is at it
        process.send_signal(signal.SIGINT)
        try:
            _, told = process.communicate(timeout=60.0)
        finally:
            process.kill()
    assert process.returncode == INTERRUPTED, told.decode()
    kept = list(tmp_path.iterdir())
    assert kept in ([], [tmp_path / "log.npz"])  # the best until then, if there was any, and whole
    for log in kept:
        assert formats.read(log).metadata["stopped"] == "interrupted"
    assert kept or told.endswith(b"\nstiction: interrupted; nothing is left half written\n")


def test_in_a_file_whole_lines_follow_each_other_ever_more_seldom(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    moments = iter(range(100))
    with monkeypatch.context() as patched:
        patched.setattr(progress, "perf_counter", lambda: float(next(moments)))
        line = progress.Line("thinking")
        for _ in range(9):
            line.say()
        line.end()
    assert capsys.readouterr().err.splitlines() == [f"thinking: {seconds} s" for seconds in (1, 2, 4, 8, 10)]
