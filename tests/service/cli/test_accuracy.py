"""What accuracy costs, as a command tells it."""

import json
import math
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from service.cli import accuracy, main
from service.cli.exit_codes import INPUT_REFUSED, INTERRUPTED
from service.report import work_precision
from service.report.work_precision import Setting, WorkPrecision
from tests.service.report.test_material import MODEL

FOUND = WorkPrecision(
    "a scene",
    "of the ratio",
    (Setting("a", 1.0, 0.25, "quick"), Setting("b", 2.0, 0.5, "beaten"), Setting("c", 3.0, math.nan)),
)


def test_what_is_worth_asking_for_is_starred_and_no_error_is_no_number(capsys: pytest.CaptureFixture[str]) -> None:
    accuracy._tell([FOUND], None, json=False)
    title, head, _, *rows = capsys.readouterr().out.splitlines()
    assert (title, head.split()) == ("a scene; error: of the ratio", ["worth", "it", "ask", "for", "seconds", "error"])
    assert [row.split() for row in rows] == [
        ["*", "a", "1.00", "0.250", "quick"],
        ["b", "2.00", "0.500", "beaten"],
        ["*", "c", "3.00", "–"],
    ]


def test_a_program_is_told_all_settings_and_null_for_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    accuracy._tell([FOUND], None, json=True)
    (told,) = json.loads(capsys.readouterr().out)["subjects"]
    assert (told["subject"], told["error"]) == ("a scene", "of the ratio")
    assert told["settings"][1] == {"ask": "b", "seconds": 2.0, "error": 0.5, "told": "beaten", "worth_asking": False}
    assert (told["settings"][2]["error"], told["settings"][2]["worth_asking"]) == (None, True)


def test_the_models_of_a_material_are_asked_for_in_the_order_of_their_names(monkeypatch: pytest.MonkeyPatch) -> None:
    models = {"ols": MODEL, "hierarchical": MODEL}
    client = Mock(material=Mock(return_value=SimpleNamespace(models=models)), model=Mock(return_value=MODEL))
    monkeypatch.setattr(accuracy, "connected", lambda *_: nullcontext(client))
    found = accuracy._of_material("paper", "http://there", None)
    assert [call.args for call in client.model.call_args_list] == [("paper", "hierarchical"), ("paper", "ols")]
    assert found.subject == "paper"


@pytest.mark.parametrize("seconds", ["-1", "0", "nan", "inf"])
def test_a_time_that_means_nothing_is_refused_before_anything_is_run(
    seconds: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accuracy, "_of_scene", lambda *_: pytest.fail("ran"))
    with pytest.raises(SystemExit) as left:
        main(["accuracy", "table1_condition1", "--seconds", seconds])
    assert left.value.code == INPUT_REFUSED
    assert f"seconds is {seconds} s; allowed: above 0 s" in capsys.readouterr().err


def test_a_log_that_cannot_be_read_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (path := tmp_path / "half.npz").write_bytes(b"PK\x03\x04 and no more")
    with pytest.raises(SystemExit) as left:
        main(["accuracy", str(path)])
    assert left.value.code == INPUT_REFUSED
    assert capsys.readouterr().err.splitlines()[-1] == f"in {path}"


def test_what_was_found_until_ctrl_c_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(work_precision, "of_scene", Mock(side_effect=work_precision.Unfinished(FOUND)))
    with pytest.raises(SystemExit) as left:
        main(["accuracy", "table1_condition1"])
    assert left.value.code == INTERRUPTED
    assert "beaten" in capsys.readouterr().out


@pytest.mark.parametrize(("text", "is_scene"), [("a.toml", True), ("lifting_15N", True), ("a.npz", False)])
def test_a_scene_is_known_by_its_ending_or_its_name(text: str, is_scene: bool) -> None:
    assert accuracy._is_scene(text) is is_scene


def test_a_misspelt_scene_is_told_the_likely_ones_where_no_service_has_such_a_material(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["accuracy", "tabel1_condition1", "--url", "http://127.0.0.1:9"])
    assert "or was a scene meant: table1_condition1 or" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["accuracy", "felt", "--url", "http://127.0.0.1:9"])
    assert "scene meant" not in capsys.readouterr().err
