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
TOLERANCE = 0.005
"""Relative, of measures: another processor rounds otherwise."""
COUNTED = 0.05
"""Relative, of whole numbers: an event more or less follows."""


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
    return words[0] == words[1] and all(
        value == pytest.approx(other, rel=COUNTED if text.isdecimal() else TOLERANCE, abs=0)
        for text, value, other in zip(NUMBER.findall(told), numbers(told), numbers(printed), strict=True)
    )


def test_figures_of_the_text_are_those_of_its_commands() -> None:
    page = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    text = re.sub(r"^```console\n.*?^```$", "", page, flags=re.M | re.S)
    printed = {figure for _, lines in transcript() for line in lines for figure in NUMBER.findall(line)}
    assert {figure for figure in re.findall(r"\b\d\.\d{3}\b", text) if figure not in printed} == set()


@pytest.mark.parametrize(
    ("printed", "is_close"),
    [
        ("μ 0.448, of 564 samples", True),
        ("μ 0.450, of 560 samples", True),
        ("μ 0.451, of 564 samples", False),
        ("μ 0.448, of 500 samples", False),
        ("μ 0.448, of 564 grasps", False),
    ],
)
def test_a_figure_that_drifts_is_noticed(printed: str, is_close: bool) -> None:
    """Within 5 % the page had said 4.25 N where 4.20 was printed."""
    assert agree("μ 0.448, of 564 samples", printed) == is_close


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
