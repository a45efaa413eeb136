"""The command line, as an outsider uses it: real files, a real server, documented exit codes."""

import io
import itertools
import json
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import httpx
import numpy as np
import pytest
from typer.core import TyperGroup
from typer.main import get_command

import slipcore
from benchmarks.calibration.presses import Faults, pressed
from db.blobs import BlobStore
from db.database import Database
from db.records import NewGraspLog
from db.repositories import grasp_logs, jobs
from service import exports, formats
from service.cli import app, main, progress, streaming
from service.cli.exit_codes import INPUT_REFUSED, INTERRUPTED, NOT_FEASIBLE, SERVICE_REFUSED
from service.cli.output import plain
from service.settings import Settings
from slipcore import GraspLog, contact, detect_slip, forces
from slipcore.contact import tangential_ramp
from slipcore.contact.errors import Interrupted
from slipcore.contact.tiers.ramp import RampSchedule
from stiction_client import FrictionClient, container
from tests.service.remembered import remembering

WRONG_USAGE = 2
Run = Callable[..., tuple[int, str, str]]
Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
ROOT = Path(__file__).parents[3]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command: (exit code, standard output, standard error)."""

    def command(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ending:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return int(ending.value.code or 0), out, err

    return command


@pytest.fixture(scope="module", autouse=True)
def worked_out_once() -> Iterator[None]:
    """Slip in the same few logs, findings, and forces by a gel."""
    with remembering((slipcore, "detect_slip"), (slipcore, "check_log"), (forces, "reconstruct")):
        yield


@pytest.fixture(scope="module")
def ramps(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Grasp logs of a material of friction 0.5."""
    folder = tmp_path_factory.mktemp("ramps")
    paths = []
    for seed, force in enumerate((4.0, 6.0, 9.0, 13.0)):
        log = tangential_ramp(friction=0.5, normal_force=force, marker_noise=1e-6, force_noise=2e-3, seed=seed)
        paths.append(folder / f"{force:g}.npz")
        container.write(log, paths[-1])
    return paths


@pytest.fixture(scope="module")
def presses(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Logs of a ball pressed with 2 N on a sensor with crosstalk of 8 %, whose forces are 10 % too large."""
    folder = tmp_path_factory.mktemp("presses")
    faults = Faults(crosstalk=(0.08, 0.0), gain=1.1, marker_noise=1e-6, force_noise=2e-3)
    paths = [folder / f"{seed}.npz" for seed in range(2)]
    for seed, path in enumerate(paths):
        container.write(faults.put_into(pressed(), seed), path)
    return paths


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory, serving: Serving) -> Iterator[str]:
    with serving(Settings(data_folder=tmp_path_factory.mktemp("service"), poll_seconds=5.0)) as client:
        yield str(client.base_url)


DO_AND_TELL_NO_MORE = {
    *("demo", "serve", "worker", "open", "report", "logs withdraw", "jobs cancel", "keys revoke"),
    *("materials rename", "materials merge", "materials begin-epoch", "owners add", "owners remove"),
    *("sensors describe", "sensor describe"),
    *("db upgrade", "db downgrade", "db backup", "db restore", "db adopt"),
}
"""Commands without ``--json``: what they did follows from their exit code."""


def command_names() -> list[str]:
    names = [c.name or c.callback.__name__.replace("_", "-") for c in app.registered_commands if c.callback is not None]
    return [*names, *(str(g.name) for g in app.registered_groups)]


@pytest.mark.parametrize("name", command_names())
def test_every_command_explains_itself_and_is_documented(name: str, run: Run) -> None:
    code, out, _ = run(name, "--help")
    assert code == 0
    assert "Usage" in out
    assert f"`stiction {name}" in (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")


def options_of(command: Any, name: str = "") -> Iterator[tuple[str, set[str]]]:
    """Each command of a group by its words, with its options."""
    if isinstance(command, TyperGroup):
        for own, inner in command.commands.items():
            yield from options_of(inner, f"{name} {own}".strip())
    else:
        yield name, {option for parameter in command.params for option in parameter.opts}


def test_commands_are_read_by_programs_and_read_logs_alike() -> None:
    commands = dict(options_of(get_command(app)))
    assert {name for name, options in commands.items() if "--json" not in options} == DO_AND_TELL_NO_MORE
    for name, options in commands.items():
        if "--mapping" in options:
            assert options >= {"--scale", "--frame-rate", "--rest"}, name


def test_the_key_of_the_environment_is_sent_and_not_shown(run: Run, url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICTION_KEY", "hush")
    code, out, err = run("lookup", "paper", "--url", url)
    assert code == SERVICE_REFUSED
    assert "invalid-key" in err
    assert "hush" not in out + err


def test_detect_tells_a_program_what_was_seen(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    picture = tmp_path / "slip.png"
    code, out, _ = run("detect", ramps[0], "--json", "--picture", picture)
    seen = json.loads(out)
    assert code == 0
    assert seen["slip_onsets"] > 0
    assert len(seen["time"]) == len(seen["stick_ratio"]) == seen["frames"]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_report_of_a_log_is_one_file_and_its_pictures_are_written_beside_on_request(
    run: Run, ramps: list[Path], tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    code, out, _ = run("report", ramps[0], "-o", page, "--pictures", "svg")
    assert code == 0
    assert page.read_text(encoding="utf-8").count("<svg") == 3
    assert {each.name for each in tmp_path.iterdir()} == {
        "report.html", "report-1.svg", "report-2.svg", "report-3.svg"
    }  # fmt: skip
    assert [Path(line).name for line in out.splitlines()][-1] == "report.html"
    assert run("report", tmp_path / "absent.npz", "-o", page)[0] == 2


def test_check_says_what_is_doubtful_and_fit_says_it_beside_its_model(
    run: Run, ramps: list[Path], tmp_path: Path
) -> None:
    assert "nothing found against it" in run("check", ramps[0])[1]
    bound = re.search(r"friction of the contact: at least (0\.\d+)", run("check", ramps[0])[1])
    assert bound is not None
    assert 0.35 < float(bound[1]) < 0.5  # the friction of the material
    log, doubtful = formats.read(ramps[0]), tmp_path / "doubtful.npz"
    container.write(replace(log, time=1e3 * log.time), doubtful)
    found = json.loads(run("check", doubtful, "--json")[1])["findings"]
    assert [each["name"] for each in found] == ["slow frames"]
    assert [each["severity"] for each in found] == ["note"]
    assert "doubtful:" not in run("check", doubtful)[1]
    container.write(replace(log, force=-np.asarray(log.force)), pulling := tmp_path / "pulling.npz")
    assert "friction from this log is doubtful: force pulls" in run("check", pulling)[1]
    assert "times are in s, not ms" in run("check", doubtful)[1]
    code, _, told = run("fit", *ramps[1:], doubtful)
    assert (code, told.count("slow frames")) == (0, 1)


def test_detect_reads_tracked_markers_and_says_what_it_cannot_know(run: Run, tmp_path: Path) -> None:
    dots = Path(__file__).parents[1] / "formats" / "tracked_dots.csv"
    code, out, _ = run("detect", dots, "--method", "filter", "--json", "--picture", tmp_path / "slip.png")
    seen = json.loads(out)
    assert (code, seen["frames"], "unknown" in seen) == (0, 31, False)
    assert seen["marker_noise"] == pytest.approx(2e-6, rel=0.5)
    text = dots.read_text(encoding="utf-8").replace("# scale", "# was").replace("# frame_rate", "# was")
    (tmp_path / "dots.csv").write_text(text, encoding="utf-8")
    code, out, _ = run("detect", tmp_path / "dots.csv", "--method", "filter", "--frame-rate", 30, "--json")
    seen = json.loads(out)
    assert (code, seen["marker_noise"]) == (0, None)
    assert "scale" in seen["unknown"]
    assert (
        "no friction from this log: its scale is unknown" in run("check", tmp_path / "dots.csv", "--frame-rate", 30)[1]
    )
    assert run("detect", tmp_path / "dots.csv")[0] == INPUT_REFUSED
    assert run("convert", dots, tmp_path / "log.npz", "--rest", dots)[0] == 0
    assert formats.read(tmp_path / "log.npz").metadata["rest"] == "file of rest"


@pytest.mark.parametrize(
    "command",
    [
        ["fit"],
        ["export", "--output", "out.mcap"],
        ["accuracy"],
        ["sensors", "calibrate"],
        ["sensors", "calibrate-gel", "--known-force", "1.0"],
    ],
    ids=" ".join,
)
def test_every_command_that_reads_logs_takes_what_a_table_leaves_out(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    dots = tmp_path / "dots.csv"
    dots.write_text("frame,marker,x,y\n" + "".join(f"{k},0,1,2\n" for k in range(3)), encoding="utf-8")
    assert "frame_rate is missing" in run(*command, dots)[2]
    assert "frame_rate" not in run(*command, dots, "--frame-rate", 30, "--scale", 2.5e-5)[2]
    assert "rest is 'nonsense'" in run(*command, dots, "--frame-rate", 30, "--rest", "nonsense")[2]


def test_of_few_elements_the_detector_for_few_is_taken_where_none_was_named(run: Run, tmp_path: Path) -> None:
    few = tmp_path / "few.npz"
    container.write(tangential_ramp(points=4, pitch=3.8e-3, normal_force=6.0, marker_noise=1e-6, seed=1), few)
    assert json.loads(run("detect", few, "--json")[1])["method"] == "coarse"
    assert json.loads(run("detect", few, "--method", "filter", "--json")[1])["method"] == "filter"


def test_simulate_takes_a_scene_by_name_or_by_file_and_writes_a_log_that_detect_reads(run: Run, tmp_path: Path) -> None:
    log, picture = tmp_path / "grasp.npz", tmp_path / "truth.png"
    code, out, _ = run("simulate", "lifting_15N", "--accuracy", 0.1, "--output", log, "--picture", picture, "--json")
    made = json.loads(out)
    assert code == 0
    assert float(made["estimated accuracy"]) <= 0.1
    assert made["largest normal force_N"] == pytest.approx(15.0, rel=1e-4)  # sums over elements
    assert len(made["time"]) == len(made["stick_ratio"]) == made["frames"]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert json.loads(run("detect", log, "--json")[1])["frames"] == made["frames"]

    path = tmp_path / "press.toml"
    path.write_text('name = "my press"\n[[effect]]\nkind = "SensorSampling"\nframe_rate = 3.0\n', encoding="utf-8")
    code, out, _ = run("simulate", path)
    assert code == 0
    assert "my press" in out


def test_simulate_that_is_interrupted_writes_the_best_log_until_then(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    best = tangential_ramp(schedule=RampSchedule(0.0, 0.1, 0.0, 0.1, 0.0))

    def interrupted(*_: object, **__: object) -> GraspLog:
        raise Interrupted(best)

    monkeypatch.setattr(contact, "simulate", interrupted)
    log = tmp_path / "best.npz"
    code, out, err = run("simulate", "lifting_15N", "--accuracy", 0.001, "--output", log)
    assert code == INTERRUPTED
    assert len(formats.read(log)) == len(best)
    assert "stick ratio" in out
    assert "interrupted" in err


def test_simulate_takes_the_tier_that_is_named_and_refuses_one_that_is_not(run: Run) -> None:
    code, out, _ = run("simulate", "lifting_15N", "--tier", "beams", "--json")
    assert code == 0
    assert json.loads(out)["tier"] == "beams"
    code, _, err = run("simulate", "lifting_15N", "--tier", "finite elements")
    assert code != 0
    assert "boundary elements" in err


def test_a_campaign_fills_a_folder_and_says_what_was_refused(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "MOMENT", 0.01)
    press, pull = tmp_path / "press.toml", tmp_path / "pull.toml"
    press.write_text('name = "my press"\n[[effect]]\nkind = "SensorSampling"\nframe_rate = 3.0\n', encoding="utf-8")
    pull.write_text('name = "pull"\n[[effect]]\nkind = "TangentialLoad"\nforce = [100.0, 0.0]\n', encoding="utf-8")
    folder = tmp_path / "logs"
    code, out, err = run("campaign", press, "--seeds", 2, "--processes", 1, "--output", folder, "--json")
    assert code == 0
    assert "2 of 2 logs" in err
    assert [Path(log["path"]).name for log in json.loads(out)["logs"]] == ["my_press-0.npz", "my_press-1.npz"]
    assert run("detect", folder / "my_press-1.npz")[0] == 0
    code, out, _ = run("campaign", press, pull, "--processes", 1, "--output", folder)
    assert code == INPUT_REFUSED
    assert "tangential load" in out
    assert "my_press-0.npz" in out


def test_simulate_explains_a_scene(run: Run) -> None:
    code, out, _ = run("simulate", "lifting_15N", "--explain")
    assert code == 0
    assert "TangentialLoad" in out
    assert "applications" in out
    explained = json.loads(run("simulate", "lifting_15N", "--explain", "--json")[1])
    assert {effect["name"] for effect in explained["effects"]} == {"TangentialLoad", "SensorSampling"}
    assert "FiniteLayer" in {proposal["effect"] for proposal in explained["proposals"]}


def test_an_unknown_scene_is_refused_with_those_that_exist(run: Run) -> None:
    code, _, err = run("simulate", "crystal_ball")
    assert code == INPUT_REFUSED
    assert "scene is crystal_ball; allowed: a TOML file, or one of" in err
    assert "lifting_15N" in err


def test_fit_finds_the_friction_that_the_ramps_were_made_with(run: Run, ramps: list[Path]) -> None:
    code, out, _ = run("fit", *ramps, "--json")
    model = json.loads(out)
    assert code == 0
    zeroth, _, per_force = model["coefficients"]
    observed = sum(model["domain"]["normal_force"]) / 2.0
    assert zeroth + per_force * observed == pytest.approx(0.5, rel=0.02)  # the 2 % that the project promises
    low, high = model["interval_95"][0]
    assert low < 0.5 < high
    code, out, _ = run("fit", *ramps)
    assert code == 0
    assert "β₁ [s/m]" in out


def test_a_fit_by_no_method_is_refused_before_a_log_is_looked_at(run: Run) -> None:
    code, _, err = run("fit", "not there.npz", "--method", "best")
    assert (code, err.splitlines()[-1].startswith("stiction: method is best; allowed: ols, ")) == (INPUT_REFUSED, True)


def test_a_gel_that_cannot_be_read_is_refused_also_of_a_log_with_forces(
    run: Run, ramps: list[Path], tmp_path: Path
) -> None:
    code, _, err = run("detect", ramps[0], "--gel", tmp_path / "gel.json")
    assert code == INPUT_REFUSED
    assert "gel.json': No such file" in err


def test_fit_counts_a_grasp_once_that_comes_in_two_files(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    log, copy = formats.read(ramps[0]), tmp_path / "copy.npz"
    container.write(replace(log, time=log.time + 10.0, sensor="other", truth=None), copy)
    _, alone, _ = run("fit", *ramps[:2], "--method", "ols", "--json")
    code, out, told = run("fit", *ramps[:2], copy, "--method", "ols", "--json")
    assert (code, json.loads(out)["n"]) == (0, json.loads(alone)["n"])
    assert f"copy.npz: same grasp: the measurements are those of log {ramps[0].name}" in told


def test_fit_counts_the_whole_log_where_a_cut_of_it_came_first(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    cut = tmp_path / "cut.npz"
    container.write(formats.read(ramps[0]).take(slice(60)), cut)
    _, alone, _ = run("fit", ramps[0], "--method", "ols", "--json")
    _, out, told = run("fit", cut, ramps[0], "--method", "ols", "--json")
    assert json.loads(out)["n"] == json.loads(alone)["n"]
    assert f"{ramps[0].name}: same grasp: the measurements are those of log cut.npz" in told


def test_fit_counts_a_grasp_once_where_the_whole_comes_after_parts(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    log = formats.read(ramps[0])
    assert log.force is not None
    log = replace(log, force=log.force + np.random.default_rng(1).normal(0.0, 1e-4, log.force.shape))
    paths = [tmp_path / f"{name}.npz" for name in ("even", "odd", "whole")]
    for path, frames in zip(paths, (slice(0, None, 2), slice(1, None, 2), slice(None)), strict=True):
        container.write(log.take(frames), path)
    _, alone, _ = run("fit", paths[2], "--method", "ols", "--json")
    _, parts, _ = run("fit", *paths[:2], "--method", "ols", "--json")
    _, out, told = run("fit", *paths, "--method", "ols", "--json")
    assert json.loads(out)["n"] == json.loads(alone)["n"] != json.loads(parts)["n"]
    assert told.count("same grasp: the measurements are those of log even.npz") == 2


def test_fit_says_that_velocities_are_unknown(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    path = tmp_path / "unposed.npz"
    container.write(replace(formats.read(ramps[-1]), object_pose=None), path)
    code, out, _ = run("fit", path)
    assert code == 0
    assert "the object's motion is unknown" in out


def test_a_file_that_is_no_log_is_refused_by_name(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "noise.npz"
    path.write_bytes(b"not a log at all")
    code, out, err = run("detect", path)
    assert code == INPUT_REFUSED
    assert not out
    assert "noise.npz" in err or "allowed" in err
    assert run("detect", tmp_path / "absent.npz")[0] == INPUT_REFUSED


def test_an_unknown_detector_is_refused_with_those_that_exist(run: Run, ramps: list[Path]) -> None:
    code, _, err = run("detect", ramps[0], "--method", "crystal ball")
    assert code == INPUT_REFUSED
    assert "strain_rate" in err


def test_a_service_that_is_not_there_has_its_own_exit_code(run: Run, ramps: list[Path]) -> None:
    code, _, err = run("lookup", "paper", "--url", "http://127.0.0.1:9")
    assert code == SERVICE_REFUSED
    assert "ConnectError" in err
    assert "is a service running at http://127.0.0.1:9?" in err
    code, _, err = run("stream", ramps[0], "--url", "http://127.0.0.1:9")
    assert code == SERVICE_REFUSED
    assert "is a service running at http://127.0.0.1:9?" in err


def test_a_service_that_refuses_a_stream_is_not_looked_for(run: Run, url: str, ramps: list[Path]) -> None:
    code, _, err = run("stream", ramps[0], "--material", "unobtainium", "--url", url)
    assert code == SERVICE_REFUSED
    assert "unobtainium" in err
    assert "is a service running" not in err


def test_upload_lookup_and_plan_go_through_a_real_service(run: Run, ramps: list[Path], url: str) -> None:
    code, out, _ = run("upload", *ramps, "--material", "paper", "--create", "--url", url, "--json")
    assert code == 0
    assert [item["status"] for item in json.loads(out)["uploads"]] == ["done"] * len(ramps)

    code, out, _ = run("accuracy", "paper", "--url", url, "--json")
    (models,) = json.loads(out)["subjects"]
    assert (code, "--method hierarchical" in {each["ask"] for each in models["settings"]}) == (0, True)
    code, out, _ = run("lookup", "paper", "--quantile", 0.05, "--url", url, "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["friction_coefficient"] < answer["mean"] == pytest.approx(0.5, abs=0.05)

    code, out, _ = run("next", "paper", "--normal-force", 0.2, "--url", url)
    assert code == 0
    assert out.startswith("Record next of paper\n  press with")
    assert " mm/s, towards " in out

    grip = ("plan", "paper", "--contact-area", 6e-5, "--url", url, "--json")
    code, out, _ = run(*grip, "--load", 1.0)
    assert code == 0
    assert json.loads(out)["normal_force"] > 2.0  # more than load/μ: the planner gets a quantile, not a mean
    assert run(*grip, "--load", 1e6, "--limit", 50.0)[0] == NOT_FEASIBLE


def test_slip_of_uploaded_logs_is_found_by_the_detector_that_is_asked_for(
    run: Run, ramps: list[Path], url: str
) -> None:
    code, out, _ = run("upload", ramps[0], "--detector", "strain_rate", "--url", url, "--json")
    (sent,) = json.loads(out)["uploads"]
    with FrictionClient(url) as client:
        detection = client.grasp_log(sent["grasp_log"]).detection
    assert detection is not None
    assert (code, detection.method) == (0, "strain_rate")
    code, out, _ = run("upload", ramps[0], "--detector", "best", "--url", url, "--json")
    (refused,) = json.loads(out)["uploads"]
    assert code != 0
    assert "best" in refused["reason"]
    assert "strain_rate" in refused["reason"]


def test_logs_are_given_their_sensor_and_asked_for_as_it_shows_friction(
    run: Run, ramps: list[Path], url: str, tmp_path: Path
) -> None:
    with np.load(ramps[1]) as archive:
        members = dict(archive)
    np.savez(tmp_path / "more.npz", **members | {"force": members["force"] * [1.3, 1.3, 1.0]})
    for log, sensor in ((ramps[0], "left"), (tmp_path / "more.npz", "right")):
        sent = run("upload", log, "--material", "felt by two", "--create", "--sensor", sensor, "--url", url, "--json")
        assert [each["status"] for each in json.loads(sent[1])["uploads"]] == ["done"]
    asked = ("--url", url, "--json")
    means, forces = {}, {}
    for sensor in ("left", "right"):
        answer = json.loads(run("lookup", "felt by two", "--sensor", sensor, *asked)[1])
        grip = json.loads(
            run("plan", "felt by two", "--load", 1.0, "--contact-area", 6e-5, "--sensor", sensor,
                "--slip-probability", 0.05, *asked)[1]
        )  # fmt: skip
        means[sensor], forces[sensor] = answer["mean"], grip["normal_force"]
    assert means["right"] > 1.02 * means["left"]
    middle = json.loads(run("lookup", "felt by two", *asked)[1])
    larger = json.loads(run("lookup", "felt by two", "--element-area", 2.0 * middle["element_area"], *asked)[1])
    assert larger["normal_force"] == pytest.approx(2.0 * middle["normal_force"])
    assert larger["mean"] == pytest.approx(middle["mean"])
    assert "sensor 'lefft'" in str(json.loads(run("lookup", "felt by two", "--sensor", "lefft", *asked)[1])["notes"])
    assert forces["right"] < forces["left"]


def test_a_log_is_replayed_as_a_live_stream_and_stored(
    run: Run, ramps: list[Path], url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ("--url", url, "--speed", 1e6, "--json")
    code, out, err = run("stream", ramps[0], "--store", *arguments)
    told = json.loads(out)
    assert code == 0
    assert f"{url}/live/" in err
    log = formats.read(ramps[0])
    assert (told["frames"], told["refused_frames"]) == (len(log), 0)
    assert told["stick_ratio_min"] < 0.5
    with FrictionClient(url) as client:
        assert client.grasp_log(told["grasp_log"]).frames == len(log)
    with ramps[0].open("rb") as file:
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=file))
        assert json.loads(run("stream", "-", *arguments)[1])["frames"] == len(log)
    code, out, _ = run("stream", ramps[0], "--url", url, "--speed", 1e6)
    assert code == 0
    assert f"frames             {len(log)}\n" in out


@pytest.mark.parametrize("content", [b"", b"few", bytes(100_000)], ids=["nothing", "few bytes", "many"])
def test_what_comes_on_standard_input_is_a_file_for_a_while(content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(content)))
    with streaming._file(streaming.STANDARD_INPUT) as path:
        assert path.read_bytes() == content
    assert not path.exists()


def test_a_frame_is_sent_when_it_is_due(ramps: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    log, now, due = formats.read(ramps[0]), [100.0], []

    def pass_time(seconds: float) -> None:
        now[0] += seconds

    monkeypatch.setattr(streaming, "perf_counter", lambda: now[0])
    monkeypatch.setattr(streaming, "sleep", pass_time)
    told = []
    live: Any = SimpleNamespace(step=lambda *_, **more: (due.append(now[0]), told.append(more)))
    gripped = replace(log, gripper_force=np.arange(float(len(log))), gripper_force_deviation=0.3)
    assert len(list(streaming._replay(live, gripped, speed=2.0))) == len(log)
    assert told[2] == {"gripper_force": 2.0, "gripper_force_deviation": 0.3}
    assert due == pytest.approx((100.0 + (log.time - log.time[0]) / 2.0).tolist(), rel=1e-12)


def test_what_becomes_of_an_upload_shows_in_the_exit_code(
    run: Run, ramps: list[Path], url: str, tmp_path: Path
) -> None:
    still = tmp_path / "still.npz"
    container.write(tangential_ramp(tangential_force=0.0, schedule=RampSchedule(shear=0.5)), still)
    code, out, _ = run("upload", still, ramps[0], "--material", "still", "--create", "--url", url, "--json")
    first, second = json.loads(out)["uploads"]
    assert (code, first["status"], second["status"]) == (INPUT_REFUSED, "refused", "done")
    assert "slip" in first["reason"]

    noise = tmp_path / "noise.npz"
    noise.write_bytes(b"not a log at all")
    code, out, _ = run("upload", noise, ramps[1], "--url", url, "--json")
    first, second = json.loads(out)["uploads"]
    assert (code, first["status"], second["status"]) == (SERVICE_REFUSED, "rejected", "done")


def test_what_speaks_against_a_log_is_said_when_it_is_uploaded(
    run: Run, ramps: list[Path], url: str, tmp_path: Path
) -> None:
    log, pulling = formats.read(ramps[0]), tmp_path / "pulling.npz"
    container.write(replace(log, force=-np.asarray(log.force)), pulling)
    _, out, err = run("upload", pulling, ramps[0], "--url", url, "--json")
    against, fine = json.loads(out)["uploads"]
    assert "force pulls" in {each["name"] for each in against["findings"]}
    assert "pulling.npz: force pulls: " in err
    assert (fine["findings"], f"{ramps[0].name}: " in err) == ([], False)


@pytest.mark.parametrize(
    "arguments",
    [
        ("upload", "x.npz", "--create"),
        ("fit", "x.npz", "--seed", -1),
        ("detect", "x.npz", "--picture", "x.foo"),
        ("stream", "x.npz", "--speed", "nan"),
        ("keys", "create", "e", "--scope", "read", "--expires", "9999-12-31T23:59:59-14:00"),
    ],
)
def test_wrong_usage_is_told_from_refused_input(run: Run, arguments: tuple[object, ...]) -> None:
    assert run(*arguments)[0] == WRONG_USAGE


def test_a_setting_out_of_range_is_refused_by_name(run: Run) -> None:
    code, _, err = run("serve", "--port", 99999)
    assert code == INPUT_REFUSED
    assert "STICTION_PORT is '99999'; allowed: a whole number, 0 to 65535" in err


def test_a_worker_without_workers_is_wrong_usage(run: Run) -> None:
    assert run("worker", "--workers", 0)[0] == WRONG_USAGE


def test_jobs_are_listed_and_one_that_has_ended_is_not_cancelled(run: Run, url: str, ramps: list[Path]) -> None:
    run("upload", ramps[0], "--material", "of the jobs", "--create", "--url", url)
    listed = json.loads(run("jobs", "list", "--status", "done", "--limit", 1, "--url", url, "--json")[1])["jobs"]
    assert [(job["status"], job["material"]) for job in listed] == [("done", "of the jobs")]
    assert "of the jobs" in run("jobs", "list", "--url", url)[1]
    code, _, err = run("jobs", "cancel", listed[0]["id"], "--url", url)
    assert (code, "cannot be cancelled" in err) == (SERVICE_REFUSED, True)


def test_an_argument_that_cannot_be_is_refused_before_anything_is_asked(run: Run, url: str) -> None:
    run("upload", "--help")
    code, _, err = run("lookup", "..", "--url", url)
    assert code == INPUT_REFUSED
    assert "allowed" in err


def test_an_unknown_material_is_named_with_the_nearest_that_is_known(run: Run, url: str) -> None:
    code, _, err = run("lookup", "unobtainium", "--url", url)
    assert code == SERVICE_REFUSED
    assert "unobtainium" in err
    assert "did you mean" not in err
    with FrictionClient(url) as client:
        client.ensure_material("cardboard")
    assert "did you mean cardboard?" in run("lookup", "cardbord", "--url", url)[2]


def test_an_upload_for_an_unknown_material_says_how_to_make_it(run: Run, url: str, ramps: list[Path]) -> None:
    code, _, err = run("upload", *ramps, "--material", "new stuff", "--url", url)
    assert code == SERVICE_REFUSED
    assert "material is new stuff" in err
    assert "`stiction upload --create` makes a new one" in err


def test_an_area_that_is_larger_than_a_hand_is_asked_back(
    run: Run, url: str, ramps: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    run("upload", *ramps[:2], "--material", "plate", "--create", "--url", url)
    plan = ("plan", "plate", "--load", 1.0, "--url", url, "--contact-area")
    monkeypatch.setattr("sys.stdin", io.StringIO("n\ny\n"))
    code, out, err = run(*plan, 1)
    assert (code, out.strip()) == (WRONG_USAGE, "")
    assert "1 m² are 10000 cm², more than a hand; 1 cm² is 1e-4. Is it m²?" in err
    assert "press with" in run(*plan, 1)[1]
    assert "Is it m²?" not in run(*plan, 0.01)[2]
    assert run(*plan, 1)[0] == WRONG_USAGE  # nobody answers


def test_advice_that_the_warning_gave_is_not_said_again(run: Run, url: str, ramps: list[Path]) -> None:
    run("upload", ramps[0], "--material", "one grasp", "--create", "--url", url)
    out = run("plan", "one grasp", "--load", 1.0, "--contact-area", 6e-5, "--url", url)[1]
    assert out.count("record more grasps") == 1, out
    assert re.search(r"support +not identified: ", out)


def test_what_is_printed_for_people_has_units_and_no_empty_values(run: Run, ramps: list[Path], url: str) -> None:
    run("upload", *ramps, "--material", "wood", "--create", "--url", url)
    printed = [
        run("detect", ramps[0])[1],
        run("fit", *ramps)[1],
        run("simulate", "lifting_15N")[1],
        run("lookup", "wood", "--url", url)[1],
        run("lookup", "wood", "--quantile", 0.05, "--elements", 30, "--url", url)[1],
        run("plan", "wood", "--load", 1.0, "--contact-area", 6e-5, "--url", url)[1],
        run("materials", "list", "--url", url)[1],
        run("materials", "show", "wood", "--url", url)[1],
        run("logs", "list", "--url", url)[1],
        run("audit", "--url", url)[1],
    ]
    for text in printed:
        assert not re.search(r"\bNone\b|\bnan\b|\binf\b|\d{4}-\d\d-\d\dT", text), text
    detected, fitted, simulated, expected, quantile, grip = printed[:6]
    assert re.search(r"frames +\d+ in [\d.]+ s\n", detected)
    assert "β₁ [s/m]" in fitted
    assert re.search(r"normal force +15\.0 N", simulated)
    assert re.search(r"at +0 m/s and [\d.]+ N an element", expected)
    assert "the 0.05 quantile of a contact of 30 elements; the mean is" in quantile
    assert re.search(r"press with +[\d.]+ N, each finger", grip)


def test_materials_and_logs_are_looked_at_and_looked_after(run: Run, ramps: list[Path], url: str) -> None:
    told = ("--url", url)
    sent = json.loads(run("upload", *ramps[:2], "--material", "felt", "--create", *told, "--json")[1])["uploads"]
    kept = json.loads(run("logs", "list", "--material", "felt", *told, "--json")[1])["grasp_logs"]
    assert {log["id"] for log in kept} == {log["grasp_log"] for log in sent}
    assert len(json.loads(run("logs", "list", "--limit", 1, *told, "--json")[1])["grasp_logs"]) == 1
    assert re.search(r"material +felt\n", run("logs", "show", sent[0]["grasp_log"], *told)[1])
    code, out, _ = run("materials", "fit", "felt", "--method", "robust", *told)
    assert (code, "by robust" in out) == (0, True)
    assert "robust" in run("materials", "show", "felt", *told)[1]
    assert run("materials", "rename", "felt", "grey felt", *told)[1] == "felt is grey felt now\n"
    listed = json.loads(run("materials", "list", *told, "--json")[1])["materials"]
    assert "grey felt" in {material["name"] for material in listed}
    run("upload", ramps[2], "--material", "velour", "--create", *told)
    assert run("materials", "merge", "grey felt", "velour", *told)[1] == "velour is part of grey felt now\n"
    assert json.loads(run("materials", "show", "velour", *told, "--json")[1])["name"] == "grey felt"
    assert run("logs", "withdraw", sent[0]["grasp_log"], "--reason", "mislabelled", *told)[0] == 0
    assert re.search(r"withdrawn +\d{4}-.* UTC: mislabelled\n", run("logs", "show", sent[0]["grasp_log"], *told)[1])
    withdrawn = json.loads(run("logs", "list", "--material", "felt", *told, "--json")[1])["grasp_logs"]
    assert len(withdrawn) == 3
    newest = ("--reason", "coated", "--first", withdrawn[0]["id"])
    assert run("materials", "begin-epoch", "felt", *newest, *told)[1] == "1 of the 3 logs of grey felt count\n"
    code, _, err = run("materials", "begin-epoch", "felt", "--reason", "coated", "--first", "0", *told)
    assert (code, "first_grasp_log is 0; allowed: a log of felt" in err) == (SERVICE_REFUSED, True)


def test_a_report_of_a_material_is_made_of_what_the_service_tells(
    run: Run, ramps: list[Path], url: str, tmp_path: Path
) -> None:
    run("upload", ramps[0], "--material", "reported", "--create", "--url", url)
    code, out, _ = run("report", "reported", "-o", tmp_path / "reported.html", "--url", url)
    page = (tmp_path / "reported.html").read_text(encoding="utf-8")
    assert (code, out.strip()) == (0, str(tmp_path / "reported.html"))
    assert "Record next: press with" in page
    code, _, err = run("report", "reportd", "-o", tmp_path / "none.html", "--url", url)
    assert (code, "did you mean reported?" in err) == (SERVICE_REFUSED, True)
    assert not (tmp_path / "none.html").exists()


def test_what_others_typed_moves_no_terminal(run: Run, url: str) -> None:
    with FrictionClient(url) as client:
        client.create_material("loud", "a\x1b[2J\x1b]0;title\x07b\u202ec")
    out = run("materials", "show", "loud", "--url", url)[1]
    assert re.search("about +a\ufffd\\[2J\ufffd\\]0;title\ufffdb\ufffdc\n", out)


def test_the_version_is_told(run: Run) -> None:
    code, out, _ = run("--version")
    assert (code, out) == (0, f"stiction {version('stiction')}\n")


def test_db_upgrade_makes_a_database_that_check_approves_of(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    database = f"sqlite:///{tmp_path / 'stiction.sqlite'}"
    assert run("db", "check", "--database-url", database)[0] != 0
    assert run("db", "upgrade", "--database-url", database)[0] == 0
    assert run("db", "check", "--database-url", database)[0] == 0
    revision = run("db", "current", "--database-url", database)[1].strip()
    told = json.loads(run("db", "current", "--database-url", database, "--json")[1])
    assert told == {"revision": revision, "newest": revision}


@pytest.mark.parametrize(
    "command",
    [("db", "backup", "copy"), ("db", "check"), ("db", "current"), ("db", "downgrade", "0001"), ("blobs", "prune")],
    ids=lambda command: command[1],
)
def test_a_command_in_the_wrong_folder_leaves_nothing_there(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "wrong"))
    monkeypatch.setenv("STICTION_KEEP_UPLOADS_DAYS", "1")
    code, _, err = run(*command)
    assert code == INPUT_REFUSED
    assert f"no database '{tmp_path / 'wrong' / 'stiction.sqlite3'}' is stored" in err
    assert "`stiction serve` makes one; STICTION_DATA_FOLDER or" in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["backup", "restore"])
def test_an_empty_name_is_no_folder_of_a_backup(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    """It had been the folder where one is, as in a script whose variable is not set."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "data"))
    assert run("db", "upgrade")[0] == 0
    code, _, err = run("db", command, "")
    assert code == 2
    assert "the name of the folder is empty" in " ".join(err.replace("│", " ").split())
    assert [path.name for path in tmp_path.iterdir()] == ["data"]


def test_a_backup_names_what_it_lacks_and_so_does_what_is_restored(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "data"))
    assert run("db", "upgrade")[0] == 0
    lost = BlobStore(tmp_path / "data").put(b"lost")
    with closing(Database(Settings().resolved_database_url)) as database, database.write() as session:
        log_id = grasp_logs.add(session, NewGraspLog(lost, 4, "npz", "filter", None, "s", 9, 1.0, (3, 3)))
        jobs.add(session, "ingest", "auto", material_id=None, grasp_log_id=log_id)
    BlobStore(tmp_path / "data").remove([lost])
    code, out, err = run("db", "backup", str(tmp_path / "copy"))
    assert (code, lost in err, "without 1 file(s)" in out) == (INPUT_REFUSED, True, True)
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "again"))
    code, out, err = run("db", "restore", str(tmp_path / "copy"))
    assert (code, lost in err, "without 1 file(s)" in out) == (0, True, True)
    assert run("db", "check")[0] == INPUT_REFUSED


def test_a_restore_tells_that_keys_are_as_they_were(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that was revoked since the backup is good again, and nothing said so."""
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "data"))
    assert run("db", "upgrade")[0] == 0
    made = [json.loads(run("keys", "create", name, "--json")[1])["id"] for name in ("a", "b", "c")]
    run("keys", "revoke", made[0])
    assert run("db", "backup", str(tmp_path / "copy"))[0] == 0
    run("keys", "revoke", made[1])
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path / "again"))
    code, _, err = run("db", "restore", str(tmp_path / "copy"))
    assert (code, "2 access key(s) are valid as in the backup: revoke those that were revoked since" in err) == (
        0,
        True,
    )


def test_check_tells_files_that_are_missing_or_changed(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    assert run("db", "upgrade")[0] == 0
    blobs = BlobStore(tmp_path)
    kept, changed, lost = (blobs.put(name) for name in (b"kept", b"changed", b"lost"))
    with closing(Database(Settings().resolved_database_url)) as database, database.write() as session:
        for sha256 in (kept, changed, lost):
            grasp_logs.add(session, NewGraspLog(sha256, 4, "npz", "filter", None, "s", 2, 1.0, (1, 1)))
    schema = "the schema is this version's\n"
    assert run("db", "check")[:2] == (0, f"{schema}every file is there\n")
    assert run("db", "check", "--deep")[:2] == (0, f"{schema}every file is there, and as it was\n")
    blobs.path(changed).write_bytes(b"Changed")
    blobs.remove([lost])
    code, _, err = run("db", "check")
    assert (code, err) == (INPUT_REFUSED, f"blob {lost} is missing\n")
    code, out, err = run("db", "check", "--json")
    assert (code, json.loads(out)["damaged"], json.loads(out)["deep"]) == (INPUT_REFUSED, err.splitlines(), False)
    assert f"blob {changed} has other bytes than it had: their hash is " in run("db", "check", "--deep")[2]


def test_a_restore_that_is_refused_leaves_no_folder(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def run_in(folder: Path, *command: str) -> int:
        monkeypatch.setenv("STICTION_DATA_FOLDER", str(folder))
        return run("db", *command)[0]

    backup, target = tmp_path / "backup", tmp_path / "new" / "data"
    assert run_in(tmp_path / "old", "upgrade") == 0
    sha256 = BlobStore(tmp_path / "old").put(b"tactile")
    with closing(Database(Settings().resolved_database_url)) as database, database.write() as session:
        grasp_logs.add(session, NewGraspLog(sha256, 7, "npz", "filter", None, "s", 2, 1.0, (1, 1)))
    assert run_in(tmp_path / "old", "backup", str(backup)) == 0
    blob = BlobStore(backup).path(sha256)
    blob.unlink()
    for wrong in (backup, tmp_path / "nowhere"):
        assert run_in(target, "restore", str(wrong)) == INPUT_REFUSED
        assert not target.parent.exists()
    target.mkdir(parents=True)
    assert run_in(target, "restore", str(backup)) == INPUT_REFUSED
    assert list(target.iterdir()) == []  # the folder itself was there
    blob.write_bytes(b"tactile")
    assert run_in(target, "restore", str(backup)) == 0


@pytest.mark.parametrize(
    ("command", "pages"), [("check", slice(2, None)), ("check", slice(-1, None)), ("upgrade", slice(2, None))]
)
def test_a_damaged_database_is_told_without_a_traceback(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, pages: slice
) -> None:
    """From the third page on, behind the schema's, or in the last alone, which only who reads all of them sees."""
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(tmp_path))
    assert run("db", "upgrade")[0] == 0
    with (tmp_path / "stiction.sqlite3").open("r+b") as file:
        for page in range(0, file.seek(0, 2), 4096)[pages]:
            file.seek(page)
            file.write(b"\xff" * 100)
    code, _, err = run("db", command)
    assert code == INPUT_REFUSED
    assert "malformed" in err or "damaged" in err
    assert "Traceback" not in err


def test_json_holds_no_number_that_json_does_not_know() -> None:
    record: dict[str, Any] = {"a": float("nan"), "b": [float("inf"), 1.5], "c": {"d": (1, None)}}
    assert plain(record) == {"a": None, "b": [None, 1.5], "c": {"d": [1, None]}}


def test_a_log_is_converted_and_read_by_its_mapping(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    steps = [ramps[0], tmp_path / "log.mcap", tmp_path / "log.parquet", tmp_path / "back.npz"]
    for source, target in itertools.pairwise(steps):
        assert run("convert", source, target)[0] == 0
    assert steps[-1].read_bytes() == ramps[0].read_bytes()
    made = json.loads(run("convert", ramps[0], steps[-1], "--json")[1])
    log = formats.read(ramps[0])
    assert made == {"output": str(steps[-1]), "format": "npz", "frames": len(log), "grid": list(log.grid)}
    (tmp_path / "mapping.json").write_text('{"time": "clock"}')
    code, _, err = run("detect", tmp_path / "log.parquet", "--mapping", tmp_path / "mapping.json")
    assert code == INPUT_REFUSED
    assert "time is not there (clock)" in err
    assert run("convert", ramps[0], tmp_path / "log.txt")[0] == INPUT_REFUSED


def test_a_recording_is_uploaded_with_its_mapping(run: Run, url: str, ramps: list[Path], tmp_path: Path) -> None:
    log = formats.read(ramps[0])
    path, mapping = tmp_path / "log.json", tmp_path / "mapping.json"
    path.write_text(json.dumps({"t": log.time.tolist(), "u": (1e3 * log.displacement).tolist()}))
    mapping.write_text(json.dumps({"time": "t", "displacement": {"field": "u", "unit": "mm"}, "pitch": 1e-3}))
    code, out, _ = run("upload", path, "--mapping", mapping, "--url", url, "--json")
    assert (code, json.loads(out)["uploads"][0]["status"]) == (0, "done")
    mapping.write_text('{"tim": "t"}')
    code, _, err = run("upload", path, "--mapping", mapping, "--url", url)
    assert code == INPUT_REFUSED
    assert "mapping is of the unknown 'tim'" in err


def test_maps_of_height_are_uploaded_with_their_mapping(run: Run, url: str, ramps: list[Path], tmp_path: Path) -> None:
    log = formats.read(ramps[0])
    path, mapping = tmp_path / "log.h5", tmp_path / "mapping.json"
    with h5py.File(path, "w") as file:
        file.update({"t": log.time, "u": log.displacement * [1.0, 1.0, 0.0], "x": log.position})
        file["depth"] = np.zeros((len(log), 40, 40))
    told = {"time": "t", "displacement": "u", "position": "x", "height": "depth", "pixel": 1e-3}
    mapping.write_text(json.dumps(told))
    code, out, _ = run("upload", path, "--mapping", mapping, "--url", url, "--json")
    assert (code, json.loads(out)["uploads"][0]["status"]) == (0, "done")
    mapping.write_text(json.dumps(told | {"pixels": [3, 3]}))
    code, out, _ = run("upload", path, "--mapping", mapping, "--url", url)
    assert code == SERVICE_REFUSED
    assert f"height is of shape [{len(log)}, 40, 40]" in out


def test_a_lerobot_data_set_is_uploaded_one_log_an_episode(
    run: Run, url: str, ramps: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "MOMENT", 0.01)
    logs = [formats.read(path) for path in ramps[:2]]
    recordings = [exports.DetectedLog(log, detect_slip(log), "ramp") for log in logs]
    exports.write(recordings, tmp_path / "grasps", "lerobot")
    code, out, err = run(
        "upload", tmp_path / "grasps", "--material", "from lerobot", "--create", "--url", url, "--json"
    )
    told = json.loads(out)["uploads"]
    assert (code, [each["file"] for each in told]) == (0, ["grasps episode 0", "grasps episode 1"])
    assert [each["status"] for each in told] == ["done", "done"]
    assert "2 of 2 logs" in err
    with FrictionClient(url) as client:
        model = client.model("from lerobot", "ols")
        assert (client.material("from lerobot").grasp_logs, model.interval(0.95)[0][0] < 0.5) == (2, True)
    (tmp_path / "mapping.json").write_text('{"displacement": "observation.tactile"}')
    code, _, err = run("upload", tmp_path / "grasps", "--mapping", tmp_path / "mapping.json", "--url", url)
    assert code == INPUT_REFUSED
    assert "displacement is not among the features (observation.tactile)" in err
    assert "observation.displacement [20, 20, 3]" in err


def test_each_file_of_a_folder_is_uploaded(run: Run, url: str, ramps: list[Path], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert run("upload", tmp_path / "empty", "--url", url)[0] == WRONG_USAGE
    (tmp_path / "1.npz").write_bytes(ramps[0].read_bytes())
    (tmp_path / "2.txt").write_text("no log")
    (tmp_path / ".hidden").write_text("")
    code, out, _ = run("upload", tmp_path, "--url", url, "--json")
    told = [(each["file"], each["status"]) for each in json.loads(out)["uploads"]]
    assert (code, told) == (SERVICE_REFUSED, [("1.npz", "done"), ("2.txt", "rejected")])


def test_owners_and_the_audit_trail_from_the_command_line(run: Run, url: str) -> None:
    with FrictionClient(url) as client:
        client.create_material("owned")
    assert run("owners", "add", "owned", "group:lab 1", "--url", url)[:2] == (0, "owned belongs to group:lab 1\n")
    assert run("owners", "list", "owned", "--url", url)[:2] == (0, "group:lab 1\n")
    assert json.loads(run("owners", "list", "owned", "--json", "--url", url)[1]) == {"owners": ["group:lab 1"]}
    assert run("owners", "remove", "owned", "group:lab 1", "--url", url)[0] == 0
    assert run("owners", "add", "owned", "robot", "--url", url)[0] == SERVICE_REFUSED
    entries = json.loads(run("audit", "--subject", "owned", "--json", "--url", url)[1])["entries"]
    assert [entry["action"] for entry in entries] == ["owner.removed", "owner.added", "material.created"]
    assert "owner.added" in run("audit", "--action", "owner.added", "--url", url)[1]


def test_a_sensor_is_calibrated_and_its_logs_are_corrected(run: Run, presses: list[Path], tmp_path: Path) -> None:
    model = tmp_path / "model.json"
    code, out, _ = run("sensors", "calibrate", *presses, "--known-force", 2.0, "--output", model)
    assert code == 0
    assert re.search(r"crosstalk_x \[-\] +0\.[01]", out)
    code, out, _ = run("sensor", "calibrate", presses[0], "--json")
    told = {each["name"]: each for each in json.loads(out)["estimates"]}
    assert told["crosstalk_x"]["low"] < 0.08 < told["crosstalk_x"]["high"]
    assert "no total force" in told["gain"]["not_identified"]
    code, _, err = run("check", presses[1], "--sensor-model", model)
    assert code == 0
    assert "crosstalk of 0.0" in err
    assert "forces multiplied with" in err


def test_a_service_keeps_the_calibration_of_a_sensor(run: Run, presses: list[Path], url: str) -> None:
    about = ("--known-force", 2.0, "--store", "--sensor", "pressed", "--url", url)
    code, out, _ = run("sensors", "calibrate", *presses, *about)
    assert code == 0
    assert "version 1" in out
    with FrictionClient(url) as client:
        (stored,) = client.calibrations("pressed")
        assert stored["version"] == 1
        assert [each["known_force"] for each in stored["presses"]] == [2.0, 2.0]
        receipt = client.wait(client.upload(presses[0], sensor="pressed"))
    assert receipt is not None
    code, out, _ = run("sensors", "calibrate", presses[0], *about, "--json")
    assert json.loads(out)["version"] == 2
    assert run("sensors", "calibrate", presses[0], *about, "--output", "model.json")[0] == WRONG_USAGE


def test_what_no_sensor_can_be_calibrated_by_is_refused(run: Run, presses: list[Path], ramps: list[Path]) -> None:
    code, _, err = run("sensors", "calibrate", ramps[0])
    assert code == INPUT_REFUSED
    assert "log 1: the load sideways" in err
    assert run("sensors", "calibrate", presses[0], *["--known-force", 1.0] * 2)[0] == WRONG_USAGE
    assert run("detect", presses[0], "--sensor-model", presses[0])[0] == INPUT_REFUSED


@pytest.fixture(scope="module")
def gel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """That of the simulator."""
    path = tmp_path_factory.mktemp("gel") / "gel.json"
    path.write_text(json.dumps({"young_modulus": 1e6, "poisson_ratio": 0.5, "thickness": None}), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def felt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of few elements that has forces."""
    path = tmp_path_factory.mktemp("felt") / "felt.npz"
    container.write(tangential_ramp(points=10, pitch=1.5e-3, normal_force=6.0, marker_noise=1e-6, seed=1), path)
    return path


def without_forces(log: GraspLog, path: Path) -> Path:
    container.write(replace(log, force=None), path)
    return path


def test_a_log_without_forces_is_fitted_by_its_gel(run: Run, gel: Path, tmp_path: Path) -> None:
    own = tangential_ramp(points=16, pitch=0.96e-3, friction=0.5, normal_force=20.0, marker_noise=1e-6, seed=1)
    log = without_forces(own, tmp_path / "unfelt.npz")
    code, _, err = run("fit", log)
    assert code == INPUT_REFUSED
    assert f"{log.name}: no friction from this log: it has no forces: describe the sensor's gel" in err
    assert "logs is without friction samples, for what is said of each above; allowed: one that gives some" in err
    code, out, err = run("fit", log, "--gel", gel, "--method", "ols", "--json")
    assert code == 0
    assert json.loads(out)["coefficients"][0] == pytest.approx(0.5, abs=0.05)
    assert f"{log.name}: reconstructed forces: " in err


def test_a_log_without_forces_is_looked_at_by_its_gel(run: Run, felt: Path, gel: Path, tmp_path: Path) -> None:
    log = without_forces(formats.read(felt), tmp_path / "unfelt.npz")
    assert "no friction from this log: it has no forces" in run("check", log)[1]
    assert "it has no forces" in json.loads(run("check", log, "--json")[1])["without_friction"]
    assert "no slip gave a friction sample" in json.loads(run("check", felt, "--json")[1])["without_friction"]
    assert "share of the resultant by the data: x 100%, y 100%, z 100%" in run("check", log, "--gel", gel)[1]
    with_forces, without = (json.loads(run("detect", log, "--json", *more)[1]) for more in (("--gel", gel), ()))
    assert with_forces["frames_in_contact"] == without["frames_in_contact"] > 0
    assert with_forces["contact_friction"] is not None
    assert without["contact_friction"] is None


def test_a_report_of_a_log_without_forces_is_by_its_gel(run: Run, felt: Path, gel: Path, tmp_path: Path) -> None:
    log, page = formats.read(felt), tmp_path / "report.html"
    few = without_forces(log.take(np.linspace(0, len(log) - 1, 8, dtype=int)), tmp_path / "few.npz")
    assert run("report", few, "-o", page)[0] == 0
    assert "the log has no forces" in page.read_text(encoding="utf-8")
    assert run("report", few, "--gel", gel, "-o", page)[0] == 0
    assert "reconstructed forces: friction is as sure" in page.read_text(encoding="utf-8")


def test_check_tells_how_a_sensors_own_forces_agree_with_those_by_its_gel(
    run: Run, felt: Path, gel: Path, tmp_path: Path
) -> None:
    found = json.loads(run("check", felt, "--gel", gel, "--json")[1])["forces_by_gel"]
    assert found["total_normal"] == {"ratio": pytest.approx(1.0, abs=0.1), "correlation": pytest.approx(1.0, abs=0.01)}
    assert set(found) == {"normal", "tangential", "total_normal", "total_tangential"}
    log = formats.read(felt)
    gripped = container.write(replace(log, gripper_force=[1.0] * len(log)), tmp_path / "gripped.npz")
    assert re.search(r"normal, of the contact +0\.9\d+ +1\.00", run("check", gripped, "--gel", gel)[1])
    assert "forces_by_gel" not in json.loads(run("check", felt, "--json")[1])
    assert "gel.json: slip and friction are by the log's own forces" in run("detect", felt, "--gel", gel)[2]
    code, _, err = run("check", felt, "--gel", felt)
    assert code == INPUT_REFUSED
    assert "gel is not JSON" in err


def test_forces_do_not_follow_from_what_tells_no_displacement_in_metres(
    run: Run, felt: Path, gel: Path, tmp_path: Path
) -> None:
    told = (Path(__file__).parents[1] / "formats" / "tracked_dots.csv").read_text(encoding="utf-8")
    (tmp_path / "dots.csv").write_text(told.replace("# scale", "# was"), encoding="utf-8")
    code, _, err = run("detect", tmp_path / "dots.csv", "--gel", gel)
    assert (code, "the log's scale is unknown" in err) == (INPUT_REFUSED, True), err
    container.write(replace(formats.read(felt), displacement=None), tmp_path / "taxels.npz")
    code, _, err = run("check", tmp_path / "taxels.npz", "--gel", gel)
    assert (code, "gel is given for a log of forces alone" in err) == (INPUT_REFUSED, True), err


def test_a_gel_is_learnt_from_presses_and_describes_the_sensor(run: Run, felt: Path, url: str, tmp_path: Path) -> None:
    about = ("--known-force", 6.0, "--poisson-ratio", 0.5, "--thickness", "inf", "--noise", 1e-6)
    code, out, err = run("sensors", "calibrate-gel", felt, *about, "--output", tmp_path / "gel.json")
    assert code == 0, err
    assert re.search(r"poisson_ratio \[-\] +0\.5000 +given", out)
    gel = json.loads((tmp_path / "gel.json").read_text(encoding="utf-8"))
    assert gel["young_modulus"] == pytest.approx(1e6, rel=0.1)
    assert gel["thickness"] is None
    container.write(replace(formats.read(felt), sensor="unknown"), tmp_path / "whose.npz")
    assert run("sensors", "calibrate-gel", tmp_path / "whose.npz", *about, "--store", "--url", url)[0] == WRONG_USAGE
    told = run("sensors", "calibrate-gel", felt, *about, "--store", "--sensor", "soft", "--url", url, "--json")[1]
    with FrictionClient(url) as client:
        (described,) = (each["gel"] for each in client.sensors() if each["name"] == "soft")
    assert described == pytest.approx(json.loads(told)["gel"])
    assert run("sensors", "calibrate-gel", felt)[0] == INPUT_REFUSED


def test_a_sensor_is_described_and_listed_from_the_command_line(run: Run, url: str) -> None:
    gel = ("--young-modulus", "2.5e5", "--poisson-ratio", "0.48", "--thickness", "0.004")
    assert run("sensors", "describe", "GelSight Mini", *gel, "--url", url)[0] == 0
    listed = run("sensors", "list", "--url", url)[1]
    assert re.search(r"Young's modulus \[Pa\].*marker depth \[m\]", listed)
    assert re.search(r"GelSight Mini +250000 +0\.480 +0\.00400 +0", listed)
    every = json.loads(run("sensors", "list", "--json", "--url", url)[1])["sensors"]
    (told,) = (each for each in every if each["name"] == "GelSight Mini")
    even = {"young_modulus": 2.5e5, "poisson_ratio": 0.48, "thickness": 0.004, "marker_depth": 0.0}
    assert told["gel"] == even | {"relative_thickness": None}
    assert run("sensors", "describe", "GelSight Mini", *gel[:-1], "-1", "--url", url)[0] == SERVICE_REFUSED


def test_accuracy_says_what_to_ask_for_of_logs(run: Run, ramps: list[Path], tmp_path: Path) -> None:
    code, out, _ = run("accuracy", *ramps[:2], "--json", "--picture", tmp_path / "accuracy.png")
    detection, fits = json.loads(out)["subjects"]
    assert (code, detection["subject"], fits["subject"]) == (0, ramps[0].name, "friction of 2 grasp(s)")
    assert any(each["worth_asking"] for each in detection["settings"])
    assert (tmp_path / "accuracy.png").stat().st_size > 10_000
    code, out, _ = run("accuracy", ramps[0])
    assert (code, "ask for" in out, "--method hierarchical" in out) == (0, True, True)


def test_accuracy_says_what_to_ask_for_of_a_scene(run: Run) -> None:
    code, out, _ = run("accuracy", "table1_condition1", "--seconds", 0.05, "--json")
    (scene,) = json.loads(out)["subjects"]
    assert (code, scene["subject"]) == (0, "Table I, condition 1")
    assert {'--tier "closed form"', '--tier "beams"'} < {each["ask"] for each in scene["settings"]}


@pytest.mark.parametrize(
    ("what", "code", "told"),
    [("no/file.npz", WRONG_USAGE, "there is no file"), ("no_scene.toml", INPUT_REFUSED, "a TOML file, or one of")],
)
def test_accuracy_of_nothing_says_what_is_allowed(run: Run, what: str, code: int, told: str) -> None:
    ended, _, error = run("accuracy", what)
    assert (ended, told in " ".join(error.split())) == (code, True)
