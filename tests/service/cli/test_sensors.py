"""What commands on sensors send to a service, write and tell, without one."""

import json
import math
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest
from typer import BadParameter

from service.cli import main, sensors
from slipcore import forces
from slipcore.forces import Gel

Capture = pytest.CaptureFixture[str]
CROSSTALK = {
    "name": "crosstalk_x", "unit": "-", "value": 0.08, "low": 0.07, "high": 0.09, "not_identified": None
}  # fmt: skip
GAIN = CROSSTALK | {"name": "gain", "value": None, "not_identified": "no total force is known"}
TABLE = {"mapping": None, "scale": None, "frame_rate": None, "rest": None}
TOLD = {"estimates": [CROSSTALK, GAIN]}


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Mock:
    told = Mock()
    told.upload.side_effect = [SimpleNamespace(id=name, sensor="left") for name in "ab"]
    told.calibrate_sensor.return_value = TOLD | {"version": 3}
    monkeypatch.setattr(sensors, "connected", lambda *_: nullcontext(told))
    monkeypatch.setattr(sensors, "_learnt", lambda *_: TOLD)
    monkeypatch.setattr(sensors, "read_log", lambda *_: None)
    return told


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ending:
        main(["sensors", *arguments])
    return int(ending.value.code or 0)


def test_each_log_of_a_calibration_is_sent_with_its_own_force(client: Mock, capsys: Capture) -> None:
    assert run("calibrate", "1.npz", "2.npz", "--known-force", "2", "--known-force", "3", "--store") == 0
    assert [call.kwargs for call in client.upload.call_args_list] == [{"sensor": None, **TABLE}] * 2
    client.calibrate_sensor.assert_called_once_with("left", {"a": 2.0, "b": 3.0})
    title, _, _, *rows = capsys.readouterr().out.splitlines()
    assert title == "Calibration by 2 logs, version 3"
    assert [" ".join(row.split()) for row in rows] == [
        "crosstalk_x [-] 0.0800 0.0700 … 0.0900",
        "gain [-] not identified no total force is known",
    ]


def test_forces_that_nobody_measured_are_not_known_to_the_service(client: Mock) -> None:
    assert run("calibrate", "1.npz", "2.npz", "--store", "--sensor", "right") == 0
    assert [call.kwargs for call in client.upload.call_args_list] == [{"sensor": "right", **TABLE}] * 2
    client.calibrate_sensor.assert_called_once_with("left", {"a": None, "b": None})


def test_a_calibration_of_this_machine_is_written_whole(client: Mock, tmp_path: Path, capsys: Capture) -> None:
    assert run("calibrate", "1.npz", "--output", str(tmp_path / "model.json"), "--json") == 0
    assert json.loads((tmp_path / "model.json").read_text(encoding="utf-8")) == TOLD
    assert json.loads(capsys.readouterr().out) == TOLD
    client.upload.assert_not_called()
    assert run("calibrate", "1.npz", "--store", "--output", "x.json") == 2


def test_a_table_is_sent_to_a_calibration_with_what_it_leaves_out(client: Mock, tmp_path: Path) -> None:
    (tmp_path / "1.csv").touch()
    about = ("--scale", "2e-5", "--frame-rate", "30", "--rest", "first", "--mapping", "uskin")
    assert run("calibrate", str(tmp_path), "--store", "--known-force", "2", *about) == 0
    (sent,) = client.upload.call_args_list
    assert sent.args == (tmp_path / "1.csv",)
    given = {name: sent.kwargs[name] for name in ("scale", "frame_rate", "rest")}
    assert given == {"scale": 2e-5, "frame_rate": 30.0, "rest": "first"}
    assert sent.kwargs["mapping"]


@pytest.mark.parametrize(("thickness", "told"), [(1.0, 1.0), (1.001, None), (4e-3, 4e-3)])
def test_a_gel_that_is_thicker_than_a_metre_is_a_half_space_to_the_service(
    client: Mock,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capture,
    tmp_path: Path,
    thickness: float,
    told: float | None,
) -> None:
    gel = Gel(2e5, 0.48, thickness)
    estimates = [
        {"name": "thickness", "unit": "m", "value": 4e-3, "low": 3e-3, "high": 5e-3, "information": 0.5, "note": ""}
    ]
    found: Any = SimpleNamespace(gel=gel, to_json=lambda: {"gel": {"young_modulus": 2e5}, "estimates": estimates})
    asked = Mock(return_value=found)
    monkeypatch.setattr(forces, "calibrate_gel", asked)
    monkeypatch.setattr(sensors, "read_log", lambda *_: SimpleNamespace(sensor="left"))
    given = ("--known-force", "2", "--young-modulus", "3", "--poisson-ratio", "0.4", "--thickness", "5")
    assert run("calibrate-gel", "1.npz", *given, "--marker-depth", "0.001", "--noise", "6", "--store") == 0
    assert asked.call_args.args[1:] == ([2.0], 3.0, 0.4, 5.0, 1e-3, 6.0, None)
    client.describe_sensor.assert_called_once_with("left", 2e5, 0.48, told, 1e-3, None)
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "Gel by 1 logs, by which left is described"
    assert " ".join(out[3].split()) == "thickness [m] 0.004000 0.003000 … 0.005000 50.0%"
    (tmp_path / "map.json").write_text("[[1.0, 0.9], [1.0, 1.1]]", encoding="utf-8")
    assert run("calibrate-gel", "1.npz", "--relative-thickness", str(tmp_path / "map.json"), "--store") == 0
    uneven = [[1.0, 0.9], [1.0, 1.1]]
    assert asked.call_args.args[-1] == client.describe_sensor.call_args.args[-1] == uneven


def test_a_log_without_a_sensor_s_name_needs_one_to_be_stored_by() -> None:
    assert sensors._sensor_name("mine", "unknown") == "mine"
    assert sensors._sensor_name(None, "left") == "left"
    with pytest.raises(BadParameter, match="--store for logs that name no sensor; needed: --sensor"):
        sensors._sensor_name(None, "unknown")


def test_sensors_are_told_to_a_program_as_the_service_has_them(client: Mock, capsys: Capture) -> None:
    client.sensors.return_value = [{"name": "left", "gel": None}]
    assert run("list", "--json") == 0
    assert json.loads(capsys.readouterr().out) == {"sensors": [{"name": "left", "gel": None}]}


def test_an_infinitely_thick_gel_is_a_half_space(client: Mock) -> None:
    assert run("describe", "pad", "--young-modulus", "2e5", "--poisson-ratio", "0.48", "--thickness", "inf") == 0
    assert client.describe_sensor.call_args.args == ("pad", 2e5, 0.48, math.inf, 0.0, None)


def test_a_map_of_the_thickness_is_read_from_a_file_and_told(client: Mock, capsys: Capture, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    path.write_text("[[1, 0.5], [0.75, 1]]")
    given = ("--young-modulus", "2e5", "--poisson-ratio", "0.48", "--thickness", "0.004")
    assert run("describe", "dome", *given, "--relative-thickness", str(path)) == 0
    client.describe_sensor.assert_called_once_with("dome", 2e5, 0.48, 4e-3, 0.0, [[1.0, 0.5], [0.75, 1.0]])
    gel = {"young_modulus": 2e5, "poisson_ratio": 0.48, "thickness": 4e-3, "marker_depth": 0.0}
    client.sensors.return_value = [{"name": "dome", "gel": gel | {"relative_thickness": [[1.0, 0.5], [0.75, 1.0]]}}]
    assert run("list") == 0
    assert "0.00200 … 0.00400" in capsys.readouterr().out


@pytest.mark.parametrize("content", ["", "1", "[1, 2]", '[["a"]]'])
def test_a_map_that_is_none_is_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    path.write_text(content)
    with pytest.raises(BadParameter, match=r"--relative-thickness of .*; allowed: \[\[1"):
        sensors._rows_of(path)
