"""The main job, from the command to the report."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from service.cli import main
from service.cli.output import print_table
from service.demo import inputs, run, server, tables
from service.demo.inputs import FRICTION
from service.report.page import Table
from stiction_client import NoFeasibleForce, required_normal_force
from tests import forking
from tests.service.report.test_material import MODEL

ROOT = Path(__file__).parents[2]
RECORDINGS = ROOT / ".cache" / "tac3d" / "PyTac3D" / "example_data"


def demo(output: Path, *options: str) -> str:
    command = [sys.executable, "-m", "service.cli", "demo", "--output", str(output), *options]
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.mark.parametrize("kind", ["friction", "grasps"])
def test_a_reason_stands_in_lines_of_words_within_100_columns(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    reason = "the samples tell too little: 12 samples in 1 grasp, and 30 are needed for a fit of three coefficients"
    for table in _refused(kind, "example_2/HDL1-GWH0021", reason):
        print_table(table.caption, table.columns, table.rows, width=100)
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 100
    assert "samples tell too little: 12 samples in 1" in printed
    assert "refused" in printed


def test_the_planner_answers_or_says_why_no_force_holds() -> None:
    asked = {"slip_probability": 1e-3, "contact_area": 6e-5}
    certain = replace(MODEL, scale=1e-3, covariance=1e-4 * MODEL.covariance)
    assert run._grip(certain) == required_normal_force(certain, 1.5, **asked)
    refused = run._grip(replace(certain, coefficients=-MODEL.coefficients))
    assert isinstance(refused, NoFeasibleForce)
    assert tables.grips([tables.Answer("paper", "ols", None, certain, refused)]).rows[0][2:] == ["none", str(refused)]  # type: ignore[arg-type]


def test_jobs_that_end_well_have_no_table_of_reasons() -> None:
    done: Any = SimpleNamespace(status="done", reason=None)
    assert tables.reasons([("cardboard by ols", done)]) == []


def test_a_server_that_compiles_is_waited_for_and_told_of_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looks, said = iter([False, False, False, True]), list[str]()
    monkeypatch.setattr(server, "SAID_AFTER", 0.0)
    monkeypatch.setattr(server, "_is_ready", lambda *_: next(looks))
    alive: Any = SimpleNamespace(poll=lambda: None)
    assert server._address("http://127.0.0.1:1", alive, tmp_path / "server.log", said.append) == "http://127.0.0.1:1"
    assert len(said) == 1
    assert "compiled" in said[0]


def test_the_demo_s_server_is_ready_on_a_small_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It waited ten minutes, and then said nothing of the disk."""
    started: list[dict[str, str]] = []

    def start(*_: object, env: dict[str, str], **__: object) -> Any:
        started.append(env)
        return SimpleNamespace(terminate=lambda: None, wait=lambda **_: 0)

    monkeypatch.delenv("STICTION_LEAST_FREE_BYTES", raising=False)
    monkeypatch.setattr(subprocess, "Popen", start)
    with server.starting_server(tmp_path):
        assert started[0]["STICTION_LEAST_FREE_BYTES"] == "0"


def test_a_server_that_ended_is_not_waited_for(tmp_path: Path) -> None:
    (tmp_path / "server.log").write_text("the port is taken")
    ended: Any = SimpleNamespace(poll=lambda: 1)
    with pytest.raises(RuntimeError, match="the port is taken"):
        server._address("http://127.0.0.1:1", ended, tmp_path / "server.log", print)


def _refused(kind: str, name: str, reason: str) -> list[Table]:
    """The tables of a job that was refused: of a fit, or of an upload in which nothing was detected."""
    job: Any = SimpleNamespace(status="refused", reason=reason, seconds={"frames": 0.5})
    if kind == "friction":
        answers = [tables.Answer(name, "bayes", job, None, None)]
        return [tables.friction(answers, {name: None}), *tables.reasons([(f"{name} by bayes", job)])]
    receipt: Any = SimpleNamespace(job=job, detection=None, frames=82)
    log: Any = SimpleNamespace(name=name)
    return [tables.grasps([tables.Upload(log, receipt)]), *tables.reasons([(name, job)])]


@pytest.mark.long  # the demo once more, half a minute
def test_demo_without_recordings_says_so_and_goes_on(tmp_path: Path) -> None:
    printed = demo(tmp_path / "out", "--recordings", str(tmp_path / "absent"))
    assert "left out" in printed
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for material in FRICTION:
        assert material in page
        assert material in printed
    assert page.count("<svg") == 3 * len(FRICTION)  # plane, posterior and slip map of each simulated material


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the real Tac3D recordings could not be fetched")
@pytest.mark.parametrize("is_whole", [False, pytest.param(True, marks=pytest.mark.long)])
def test_demo_takes_the_real_recordings_all_the_way(
    tmp_path: Path, is_whole: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beside two grasps of one simulated material; as a command beside all of them, as ``make demo`` does."""
    if is_whole:
        printed = demo(tmp_path / "out", "--recordings", str(RECORDINGS))
    else:
        monkeypatch.setattr(inputs, "FRICTION", {"cardboard": 0.45})
        monkeypatch.setattr(inputs, "NORMAL_FORCES", (4.0, 13.0))
        monkeypatch.setattr(subprocess, "Popen", forking.Command)
        with pytest.raises(SystemExit, match="0"):
            main(["demo", "--output", str(tmp_path / "out"), "--recordings", str(RECORDINGS)])
        printed = capsys.readouterr().out
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "left out" not in printed
    for name in ("example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022", "cardboard"):
        assert name in page
    assert "failed" not in page[page.index("<main>") :]
    tables = [line for line in printed.splitlines() if not line.startswith("Report: ")]
    assert max(map(len, tables)) <= 100
    assert page.count("<svg") == (14 if is_whole else 8)
    assert {each.name for each in (tmp_path / "out").iterdir()} == {"logs", "report.html", "service"}
