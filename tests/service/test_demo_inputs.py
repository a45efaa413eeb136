"""What the demo uploads: each material at each force, each with noise of its own."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service import formats
from service.demo import drawing
from service.demo.inputs import FRICTION, NORMAL_FORCES, RECORDINGS, Ramp, ramps, recorded_logs, simulated_logs
from service.demo.tables import METHODS, Answer
from slipcore import FrictionLaw, FrictionSamples
from slipcore.contact import RampSchedule, tangential_ramp

SHORT = RampSchedule(rest=0.1, press=0.1, settle=0.1, shear=0.1, hold=0.1)


def test_every_material_is_pressed_with_every_force_and_no_noise_is_another_s() -> None:
    made = list(ramps(0))
    assert [(each.material, each.friction, each.normal_force) for each in made] == [
        (name, friction, force) for name, friction in FRICTION.items() for force in NORMAL_FORCES
    ]
    assert len({each.noise.standard_normal() for each in made}) == len(made) == 12
    again, other = next(ramps(0)), next(ramps(1))
    assert again.noise.standard_normal() == next(ramps(0)).noise.standard_normal() != other.noise.standard_normal()


def test_a_ramp_is_one_of_a_good_sensor() -> None:
    log = Ramp("paper", 0.5, 6.0, np.random.default_rng(0)).simulate()
    assert log.truth is not None
    assert log.truth.friction.coefficients == (0.5, 0.0, 0.0)
    assert log.force is not None
    assert -log.force[-1, ..., 2].sum() == pytest.approx(6.0, abs=0.3)
    still = log.displacement[:5]
    assert still.std() == pytest.approx(1e-6, rel=0.1)
    assert log.force[:5].std() == pytest.approx(2e-3, rel=0.1)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    log = tangential_ramp(points=6, pitch=2e-3, schedule=SHORT)
    monkeypatch.setattr(Ramp, "simulate", lambda _: log)


@pytest.mark.usefixtures("quick")
def test_simulated_logs_are_written_by_their_names_with_what_is_true_of_them(tmp_path: Path) -> None:
    logs = list(simulated_logs(tmp_path / "logs", 0))
    assert (logs[0].name, logs[0].path, logs[0].material) == (
        "polished steel 4 N", tmp_path / "logs" / "polished-steel-4-N.npz", "polished steel"
    )  # fmt: skip
    assert len({log.path for log in logs}) == len(list((tmp_path / "logs").iterdir())) == 12
    assert all(isinstance(log.truth, FrictionLaw) for log in logs)


def test_recordings_are_those_that_are_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []
    monkeypatch.setattr(formats, "read", lambda path: read.append(path))
    assert list(recorded_logs(None)) == list(recorded_logs(tmp_path)) == []
    names = list(RECORDINGS)
    (tmp_path / names[2]).mkdir(parents=True)
    (found,) = recorded_logs(tmp_path)
    assert (found.name, found.material, found.truth, found.path) == (
        names[2], "tac3d example 2", None, tmp_path / names[2]
    )  # fmt: skip
    assert read == [tmp_path / names[2]]


def grasp(name: str, material: str, truth: object) -> Any:
    entry = SimpleNamespace(name=name, material=material, truth=truth, log=None)
    return SimpleNamespace(entry=entry, history=None, samples=None)


def test_each_recording_is_drawn_and_the_last_simulated_grasp_of_each_material(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(drawing, "slip_over_time", lambda *_: None)
    seen = [grasp("a", "steel", 1), grasp("real", "x", None), grasp("b", "steel", 1), grasp("c", "rubber", 1)]
    told = [picture.caption.partition(":")[0] for picture in drawing.draw_grasps(seen)]
    assert told == ["real", "b", "c"]


def test_a_model_is_drawn_by_the_first_method_over_samples_and_by_others_as_believed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn: list[tuple[str, Any]] = []
    monkeypatch.setattr(FrictionSamples, "concatenate", lambda parts: len(list(parts)))
    monkeypatch.setattr(drawing, "friction_sections", lambda model, samples, **_: drawn.append((model, samples)))
    monkeypatch.setattr(drawing, "marginals", lambda model, **given: drawn.append((model, given["truth"])))
    seen = [grasp("a", "steel", "law"), grasp("b", "steel", "law"), grasp("c", "rubber", None)]
    answers = [
        Answer("steel", METHODS[0], None, "first", None),  # type: ignore[arg-type]
        Answer("steel", METHODS[-1], None, "last", None),  # type: ignore[arg-type]
        Answer("rubber", METHODS[0], None, None, None),  # type: ignore[arg-type]
    ]
    told = [picture.caption for picture in drawing.draw_models(answers, seen)]
    assert drawn == [("first", 2), ("last", "law")]
    assert told == [
        f"steel: friction samples, and the plane and band fitted by {METHODS[0]}.",
        f"steel: posterior by {METHODS[-1]}; dotted: its 95 % interval.",
    ]
