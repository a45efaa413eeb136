"""The page on the simulator: complete, and its code does what it says."""

import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from slipcore.contact.effects import EFFECTS
from slipcore.contact.scene import Scene, library

ROOT = Path(__file__).parents[4]
PAGE = (ROOT / "docs" / "simulator.md").read_text(encoding="utf-8")


def row(name: str) -> str:
    found = re.search(rf"^\| `{name}` \|.*$", PAGE, re.MULTILINE)
    assert found, f"docs/simulator.md has no row for {name}"
    return found.group()


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_documented_with_its_entries_and_its_cost(name: str) -> None:
    for entry in fields(EFFECTS[name]):
        assert f"`{entry.name}`" in row(name)
    assert EFFECTS[name].cost in row(name)


@pytest.mark.parametrize("name", library())
def test_every_scene_is_documented_as_it_describes_itself(name: str) -> None:
    assert Scene.from_toml(name).description in row(name)


def test_the_code_on_the_page_says_what_it_prints(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = re.findall(r"```python\n(.*?)```.*?```text\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == PAGE.count("```python") == 2
    for code, printed in blocks:
        exec(code, {})
        assert capsys.readouterr().out == printed


def test_the_scene_file_on_the_page_can_be_read() -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    scene = Scene.from_mapping(tomllib.loads(text))
    assert [type(effect).__name__ for effect in scene.effects] == ["TangentialLoad", "SensorSampling"]


def test_the_picture_on_the_page_is_there() -> None:
    for path in re.findall(r"\]\((images/[^)]*)\)", PAGE):
        assert (ROOT / "docs" / path).read_bytes().startswith(b"\x89PNG")
