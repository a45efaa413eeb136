"""Every example runs, and prints what its grasp's true friction calls for."""

import json
import re
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipcore
from slipcore.contact import tangential_ramp
from stiction_client import container

EXAMPLES = {path.stem: path for path in sorted((Path(__file__).parents[2] / "examples").glob("*.py"))}


def printed(example: str, capsys: pytest.CaptureFixture[str]) -> str:
    runpy.run_path(str(EXAMPLES[example]), run_name="__main__")
    return capsys.readouterr().out


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found, text
    return float(found[1])


def test_a_grip_is_planned_without_a_service(capsys: pytest.CaptureFixture[str]) -> None:
    text = printed("detect_fit_plan", capsys)
    assert number(r"friction ([\d.]+)", text) == pytest.approx(0.4, abs=0.02)
    assert 1.5 / 0.4 < number(r"press with ([\d.]+) N", text) < 1.5 / 0.25  # one grasp: others may differ


def test_a_grip_is_planned_with_a_service(
    service_url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("STICTION_URL", service_url)
    pressed = number(r"press with ([\d.]+) N", printed("use_a_service", capsys))
    assert 1.5 / 0.4 < pressed < 1.5 / 0.2  # one grasp does not tell how others differ


def test_a_scene_is_simulated_to_an_accuracy(capsys: pytest.CaptureFixture[str]) -> None:
    text = printed("simulate_to_an_accuracy", capsys)
    assert 0.0 < number(r"([\d.]+) of the contact sticks", text) < 1.0
    assert number(r"at most ([\d.]+) away", text) < 0.3


def test_a_detector_is_added(capsys: pytest.CaptureFixture[str]) -> None:
    try:
        assert number(r"far_from_mean: right for (\d+) %", printed("add_a_detector", capsys)) > 60.0
    finally:
        slipcore.METHODS.pop("far_from_mean", None)


def test_a_program_joins_the_slip_benchmark(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tangential_ramp(points=6, pitch=2e-3)
    seen, said = container.write(log, tmp_path / "input.npz"), tmp_path / "output.npz"
    monkeypatch.setattr(sys, "argv", ["adapter", str(seen), str(said)])
    assert printed("slip_benchmark_adapter", capsys) == ""
    with np.load(said) as prediction:
        assert prediction["slip"].shape == log.displacement.shape[:3]
        assert prediction["slip"][-1].all()
        assert not prediction["slip"][0].any()


@pytest.mark.filterwarnings("ignore:.*ArviZ is undergoing:FutureWarning")
def test_the_cells_of_the_notebook_run_one_after_the_other() -> None:
    names: dict[str, Any] = {}
    notebook = json.loads((EXAMPLES["use_a_service"].parent / "friction_in_a_notebook.ipynb").read_text("utf-8"))
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
            assert cell["outputs"] == []  # what it prints is not kept: it would go stale
    assert names["model"].predict(0.0, 0.1) == pytest.approx(0.45, abs=0.02)
    assert 1.5 / 0.5 < names["grip"].normal_force < 1.5 / 0.3


def test_a_box_lifted_in_mujoco_is_held_and_slips_with_less_friction(
    service_url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco", reason="mujoco-core is not installed")
    monkeypatch.setenv("STICTION_URL", service_url)
    text = printed("lift_in_mujoco", capsys)
    weight = 0.2 * 9.81
    assert 1.1 * weight / 2.0 / 0.47 < number(r"with ([\d.]+) N", text) < 1.1 * weight / 2.0 / 0.3
    assert number(r"100% of that friction the box slips (-?[\d.]+) mm", text) < 0.5
    assert number(r"80% of that friction the box slips ([\d.]+) mm", text) > 50.0


def test_a_box_is_held_in_drake_at_95_percent_of_its_friction_and_slips_at_105(
    service_url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pydrake", reason="drake is not installed")
    monkeypatch.setenv("STICTION_URL", service_url)
    text = printed("hold_in_drake", capsys)
    assert 2.0 * 0.3 * 8.0 < number(r"hold ([\d.]+) N", text) < 2.0 * 0.47 * 8.0
    assert abs(number(r"at 95% of that the box moves at (-?[\d.]+) mm/s", text)) < 1.0
    assert number(r"at 105% of that the box moves at ([\d.]+) mm/s", text) > 20.0


def test_every_example_is_run_here() -> None:
    assert set(re.findall(r'printed\("(\w+)"', Path(__file__).read_text())) == set(EXAMPLES)
