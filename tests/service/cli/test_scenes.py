"""What the command on scenes of physics engines tells, without an engine."""

import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from service.cli import main, scenes
from service.cli.exit_codes import INPUT_REFUSED

pytest.importorskip("mujoco", reason="mujoco-core is not installed")

from stiction_client import mujoco_scene
from stiction_client.mujoco_scene import PairCheck
from stiction_client.mujoco_scene.check import SceneCheck
from stiction_client.mujoco_scene.holding import Held

PAIR = PairCheck(
    ("pad", "cup\x1b[2J"), "max", "the larger of both", 0.5, 8.0, 0.25, 2e-3, Held(0.45, 5e-4), None, ("do this",)
)
FREE = PairCheck(("a", "b"), "pair", "the pair", 1.0, 1.0, 0.0, 0.0, Held(math.inf, math.inf), None, ())


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    given: list[Any] = []

    def check(path: Path, **options: Any) -> SceneCheck:
        given.append((path, options))
        return SceneCheck(0.5, (PAIR, FREE), ("a plane\x07",))

    monkeypatch.setattr(mujoco_scene, "check_scene", check)
    return given


def test_pairs_are_told_in_newtons_and_millimetres_with_what_to_change(
    asked: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    scenes.check_scene(Path("there/grasp.xml"))
    assert asked == [(Path("there/grasp.xml"), {"keyframe": None, "seconds": 1.0, "friction": None})]
    title, head, _, first, second, *others = capsys.readouterr().out.splitlines()
    assert title == "grasp.xml after 0.5 s: 2 pairs of geoms touch"
    assert " ".join(head.split()) == "geoms written μ by holds μ at 95 % it pressed with bears now creeps now"
    assert " ".join(first.split()) == "pad – cup�[2J 0.500 max 0.450 creeps 0.5 mm/s 8.00 N 0.250 N 2.00 mm/s"
    assert " ".join(second.split()) == "a – b 1.00 pair all that was tried slips 1.00 N 0 N 0 mm/s"
    assert others == ["pad – cup�[2J: the larger of both", "  do this", "a – b: the pair", "not measured: a plane�"]


def test_what_rounding_leaves_of_nothing_is_shown_as_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    still = replace(FREE, tangential_force=2e-17, speed=1e-19)
    monkeypatch.setattr(mujoco_scene, "check_scene", lambda *_, **__: SceneCheck(1.0, (still,), ()))
    scenes.check_scene(Path("grasp.xml"))
    title, _, _, row, *_ = capsys.readouterr().out.splitlines()
    assert title == "grasp.xml after 1 s: 1 pair of geoms touches"
    assert " ".join(row.split()) == "a – b 1.00 pair all that was tried slips 1.00 N 0 N 0 mm/s"


def test_a_program_is_told_the_name_and_all_that_was_measured(
    asked: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["check-scene", "grasp.xml", "--keyframe", "k", "--seconds", "2", "--friction", "0.4", "--json"])
    assert asked == [(Path("grasp.xml"), {"keyframe": "k", "seconds": 2.0, "friction": 0.4})]
    told = json.loads(capsys.readouterr().out)
    assert (told["scene"], told["seconds"], told["pairs"][0]["speed"]) == ("grasp.xml", 0.5, 2e-3)
    assert told["pairs"][1]["held"] == {"friction": None, "creep": None}


def test_without_the_engine_what_installs_it_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "stiction_client.mujoco_scene", None)
    monkeypatch.delattr("stiction_client.mujoco_scene", raising=False)
    with pytest.raises(SystemExit) as ending:
        main(["check-scene", "grasp.xml"])
    assert ending.value.code == INPUT_REFUSED
    told = "mujoco is not installed; allowed: mujoco-core, by the extra stiction-client[mujoco]"
    assert capsys.readouterr().err == f"stiction: {told}\n"
