import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service import formats
from slipcore import GraspLog
from stiction_client import container

ROOT = Path(__file__).parents[2]


def code_blocks(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)


def run(blocks: list[str], url: str = "") -> dict[str, Any]:
    names: dict[str, Any] = {}
    for block in blocks:
        exec(block.replace("http://127.0.0.1:8000", url), names)
    return names


def test_the_code_of_the_client_page_runs(
    service_url: str,
    grasp: GraspLog,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    container.write(grasp, "grasp.npz")
    names = run(code_blocks("docs/client.md"), service_url)
    assert names["job"].status == "done"
    # simulated with μ = 0.4; one grasp does not tell how others differ, so that a hundredth's quantile is far below
    assert 1.5 / 0.4 < names["grip"].normal_force < 1.5 / 0.1
    printed = capsys.readouterr().out
    for expected in ("press with ", '<pair geom1="fingertip"', "physics:staticFriction", "<drake:mu_static>", "[["):
        assert expected in printed


def test_the_code_of_the_client_s_readme_runs(
    service_url: str, grasp: GraspLog, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    container.write(grasp, tmp_path / "grasp.npz")
    upload = f"""
from stiction_client import FrictionClient
with FrictionClient("{service_url}") as client:
    client.ensure_material("cardboard")
    client.wait(client.upload("{tmp_path}/grasp.npz", material="cardboard"))
"""
    names = run([upload, *code_blocks("clients/README.md")], service_url)
    assert f"{names['grip'].normal_force}" in capsys.readouterr().out


def test_the_worked_example_of_a_planner_runs(service_url: str, capsys: pytest.CaptureFixture[str]) -> None:
    names = run(code_blocks("docs/planner.md"), service_url)
    weight = 0.2 * 9.81
    assert 1.2 * weight / 2.0 / 0.47 < names["grip"].normal_force < 1.2 * weight / 2.0 / 0.3
    assert names["offset"][names["best"]] == pytest.approx(0.0, abs=1e-12)
    assert names["command"].mode == "hold"
    assert names["state"].slipped[0] < 1e-4
    assert 0.1 * 9.81 / 0.45 < names["state"].normal_force[0] < 1.4 * 0.1 * 9.81 / 0.45
    printed = capsys.readouterr().out
    page = (ROOT / "docs/planner.md").read_text(encoding="utf-8")
    by_text = {without_numbers(line): numbers(line) for line in printed.splitlines()}
    for shown in re.findall(r"```text\n(.*?)```", page, re.DOTALL):
        for line in shown.splitlines():
            assert numbers(line) == pytest.approx(by_text[without_numbers(line)], rel=0.05, abs=0.05), line


NUMBER = re.compile(r"\d+(?:\.\d+)?")


def without_numbers(text: str) -> str:
    """The text with each number as #: last digits may differ from machine to machine."""
    return NUMBER.sub("#", text)


def numbers(text: str) -> list[float]:
    return [float(number) for number in NUMBER.findall(text)]


def test_the_code_of_the_control_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(code_blocks("docs/control.md"))["command"].mode == "feel"
    assert capsys.readouterr().out.count("press with") == 3


def test_the_code_of_the_formats_page_writes_a_valid_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(code_blocks("docs/formats.md"))
    log = formats.read(Path("grasp.npz"))
    assert log.grid == (2, 2)
    np.testing.assert_array_equal(log.position[1, 0], [1e-3, 0.0, 0.0])


def test_every_member_of_the_container_is_documented() -> None:
    from service.formats import npz

    page = (ROOT / "docs/formats.md").read_text(encoding="utf-8")
    for member in npz._DTYPES:
        assert f"`{member}`" in page


def test_every_error_and_call_is_documented() -> None:
    import stiction_client

    page = (ROOT / "docs/client.md").read_text(encoding="utf-8")
    calls = [name for name in vars(stiction_client.FrictionClient) if not name.startswith("_") and name != "close"]
    errors = [
        name
        for name in stiction_client.__all__
        if isinstance(value := getattr(stiction_client, name), type)
        and issubclass(value, Exception)
        and name != "JobError"
    ]
    assert len(calls) > 8
    assert len(errors) > 8
    for name in (*calls, *errors):
        assert f"`{name}" in page or f".{name}`" in page, name
