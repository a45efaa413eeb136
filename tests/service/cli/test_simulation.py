"""What commands that simulate tell, without simulating."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.cli import main, simulation
from service.cli.exit_codes import INPUT_REFUSED
from service.jobs.campaign import Outcome
from slipcore import FrictionLaw, GraspLog
from slipcore.frames import GroundTruth


def simulated(ratio: tuple[float, ...] = (math.nan, 1.0, 0.25)) -> GraspLog:
    """Three frames of two by one elements, pressed with 1 N and 2 N each."""
    place = np.array([[[0.0, 0.0, 0.0]], [[1e-3, 0.0, 0.0]]])
    force = np.zeros((3, 2, 1, 3))
    force[1, ..., 2], force[2, ..., 2] = -1.0, -2.0
    touched = np.zeros((3, 2, 1), bool)
    truth = GroundTruth(touched, touched, touched, np.array(ratio), FrictionLaw((0.5, 0.25, -0.125)))
    metadata = {"tier": "beams", "seconds": "1.5", "scene": "a press"}
    return GraspLog(
        np.array([2.0, 3.0, 4.5]), place, np.zeros((3, 2, 1, 3)), 1e-6, force=force, truth=truth, metadata=metadata
    )


def test_a_simulated_grasp_is_told_by_what_was_simulated_and_how(capsys: pytest.CaptureFixture[str]) -> None:
    simulation._print(simulated(), "a press", json=False)
    assert [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()] == [
        "a press",
        "frames 3 of 2 x 1 points in 2.50 s",
        "normal force 4.00 N at its largest",
        "stick ratio 0.250 at its smallest",
        "friction β₀ 0.500, β₁ 0.250 s/m, β₂ −0.125 1/N",
        "tier beams",
        "computed in 1.50 s",
    ]
    simulation._print(replace(simulated(), metadata={}), "a press", json=False)
    assert "computed in" not in capsys.readouterr().out


def test_a_program_is_told_numbers_and_the_stick_ratio_over_time(capsys: pytest.CaptureFixture[str]) -> None:
    simulation._print(simulated(), "a press", json=True)
    assert json.loads(capsys.readouterr().out) == {
        "tier": "beams", "seconds": "1.5", "scene": "a press", "frames": 3, "points": "2 x 1", "duration_s": 2.5,
        "largest normal force_N": 4.0, "smallest stick ratio": 0.25, "friction": [0.5, 0.25, -0.125],
        "time": [2.0, 3.0, 4.5], "stick_ratio": [None, 1.0, 0.25],
    }  # fmt: skip


def test_a_grasp_that_never_touches_has_no_stick_ratio() -> None:
    assert simulation._summary(simulated((math.nan,) * 3))["smallest stick ratio"] is None


def test_logs_of_a_campaign_are_told_in_order_with_what_was_refused(capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path("there")
    made = [
        Outcome("pull", 0, folder / "pull-0.npz", "too fast"),
        Outcome("press", 10, folder / "press-10.npz"),
        Outcome("press", 9, folder / "deep" / "press-9.npz"),
    ]
    simulation._print_campaign(made, folder, json=False)
    title, _, _, *rows = capsys.readouterr().out.splitlines()
    assert title == "there"
    assert [row.strip().split(maxsplit=2) for row in rows] == [
        ["press", "9", "deep/press-9.npz"],
        ["press", "10", "press-10.npz"],
        ["pull", "0", "too fast"],
    ]
    simulation._print_campaign(made, folder, json=True)
    told = json.loads(capsys.readouterr().out)["logs"]
    assert told[2] == {"scene": "pull", "seed": 0, "path": "there/pull-0.npz", "refused": "too fast"}


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--accuracy=-1"], "accuracy is -1; allowed: above 0"),
        (["--seconds=0"], "seconds is 0 s; allowed: above 0 s"),
        (["--tier=nope"], "tier is nope; allowed: closed form, beams, boundary elements"),
    ],
)
def test_a_campaign_that_cannot_be_asked_for_leaves_its_folder_free(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], told: str
) -> None:
    with pytest.raises(SystemExit):
        main(["campaign", "table1_condition1", "--output", str(tmp_path / "new"), *options])
    assert told in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_folder_is_refused_as_a_log_before_it_is_simulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "_simulated", lambda *_: pytest.fail("simulated"))
    with pytest.raises(SystemExit) as left:
        main(["simulate", "table1_condition1", "--output", str(tmp_path)])
    assert left.value.code == INPUT_REFUSED
    assert f"{tmp_path}, a folder; allowed: a file that ends in .npz" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_log_of_another_name_is_written_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "_simulated", lambda *_: (simulated(), False))
    with pytest.raises(SystemExit) as left:
        main(["simulate", "table1_condition1", "--output", str(tmp_path / "log.txt")])
    assert left.value.code == 0
    assert "log.txt becomes an NPZ all the same; the next version refuses" in capsys.readouterr().err
    with np.load(tmp_path / "log.txt") as written:
        np.testing.assert_array_equal(written["time"], simulated().time)


@pytest.mark.parametrize(
    ("options", "left_out"),
    [
        (["--output=a.npz", "--picture=a.png"], "--output, --picture are left out, and refused by the next version"),
        (["--accuracy=0.1", "--seconds=3"], "--accuracy, --seconds are left out"),
        (["--tier=beams"], "--tier is left out, and refused by the next version"),
        ([], ""),
    ],
)
def test_an_explanation_makes_coarse_runs_and_says_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    options: list[str], left_out: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulation, "_explain", lambda *_, **__: None)
    with pytest.raises(SystemExit) as left:
        main(["simulate", "table1_condition1", "--explain", *options])
    assert left.value.code == 0
    err = capsys.readouterr().err
    assert f"--explain makes coarse runs and no log: {left_out}" in err if left_out else err == ""
    assert list(tmp_path.iterdir()) == []
