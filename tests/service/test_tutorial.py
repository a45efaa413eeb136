"""The tutorial's transcripts are what its commands print."""

import re
import shlex
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import httpx
import pytest

from service.cli import main
from service.settings import Settings

Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"\d+(?:\.\d+)?")
TOLERANCE = 0.05
"""Relative: another processor rounds otherwise, and an event more or less follows."""


def transcript() -> list[tuple[str, list[str]]]:
    """Each command of the page with the lines that it is said to print."""
    page = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```console\n(.*?)^```$", page, re.M | re.S)
    commands = [part for block in blocks for part in block.split("$ stiction ")[1:]]
    return [(lines[0], lines[1:]) for lines in (command.splitlines() for command in commands)]


def numbers(line: str) -> list[float]:
    return [float(text) for text in NUMBER.findall(line)]


def agree(told: str, printed: str) -> bool:
    """The same words, and numbers within the tolerance."""
    words = [NUMBER.sub("#", line).split() for line in (told, printed)]
    return words[0] == words[1] and numbers(told) == pytest.approx(numbers(printed), rel=TOLERANCE, abs=0)


def test_the_tutorial_goes_as_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], serving: Serving
) -> None:
    shutil.copytree(ROOT / "examples" / "practice", tmp_path / "examples" / "practice")
    monkeypatch.chdir(tmp_path)
    with serving(Settings(data_folder=tmp_path / "service")) as client:
        monkeypatch.setenv("STICTION_URL", str(client.base_url))
        for command, told in transcript():
            with pytest.raises(SystemExit):
                main(shlex.split(command))
            out, err = capsys.readouterr()
            printed = [*out.splitlines(), *err.splitlines()]
            unsaid = [line for line in told if not any(agree(line, other) for other in printed)]
            assert not unsaid, f"stiction {command} printed\n{out}{err}"
    assert (tmp_path / "slip.png").stat().st_size > 0
