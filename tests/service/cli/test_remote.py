"""What commands that ask a service say in words, without a service."""

import inspect
import json
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from typer import BadParameter

import stiction_client
from service.cli import jobs, logs, main, materials, owners, remote, sensors, simulation, streaming
from service.cli.exit_codes import FAILURE, INPUT_REFUSED, INTERRUPTED, SERVICE_REFUSED
from service.cli.local import fit
from slipcore import InvalidInput
from slipcore.contact import simulate
from stiction_client import (
    ConnectionFailed,
    FrictionClient,
    NoModel,
    ProblemError,
    RequiredForce,
    grasp,
    required_normal_force,
)
from stiction_client.records import FrictionAnswer, Material, NextGrasp, Withdrawal
from stiction_client.stream import SlipStream
from tests.service.report.test_material import JOB, LOG, MODEL, SEEN

TOLD = NextGrasp(
    "paper",
    "ols",
    *(3, 0.05, 5e-4, 4e-3, 0.9, 4.5, 0.06, 0.04, 0.31),
    "not identified",
    "record more grasps",
    "0.05 N is more",
    ("one sensor",),
)
Say = Callable[..., str]


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Mock:
    told = Mock()
    for module in (remote, jobs, logs, materials, owners, sensors):
        monkeypatch.setattr(module, "connected", lambda *_: nullcontext(told))
    return told


@pytest.fixture
def say(capsys: pytest.CaptureFixture[str]) -> Say:
    def command(*arguments: str, code: int = 0) -> str:
        with pytest.raises(SystemExit) as ending:
            main([*arguments])
        assert int(ending.value.code or 0) == code
        return capsys.readouterr().out

    return command


def test_the_grasp_to_record_next_is_told_in_words_with_its_units(client: Mock, say: Say) -> None:
    client.next_grasp.return_value = TOLD
    lines = " ".join(say("next", "paper", "--load", "1").split())
    for words in (
        "press with 0.0500 N an element",
        "slip by 0.500 mm at 4.00 mm/s, towards 0.900 rad",
        "takes 4.50 s",
        "known to ± 0.0600 now, ± 0.0400 after that",
        "support not identified: record more grasps",
        "mind 0.05 N is more",
        "note one sensor",
    ):
        assert words in lines
    assert json.loads(say("next", "paper", "--json")) == {**asdict(TOLD), "notes": ["one sensor"]}


def test_what_is_not_given_is_asked_for_as_a_planner_does(client: Mock, say: Say) -> None:
    client.next_grasp.return_value = TOLD
    say("next", "paper")
    client.next_grasp.assert_called_once_with(
        "paper", None, 0.0, 1e-2, 60, method="auto", load=0.0, drop_probability=1e-3, sensor=None
    )


PLANNED = {"velocity": "tangential_velocity", "slip_probability": "", "torque": "", "safety_factor": ""}
PROBED = {"velocity": "v", "quantile": "", "elements": "", "load": "", "drop_probability": ""}


@pytest.mark.parametrize(
    ("command", "call", "names"),
    [
        (remote.next_grasp, FrictionClient.next_grasp, PROBED),
        (remote.plan, required_normal_force, PLANNED),
        (remote.plan, grasp, {"fingers": "", "round_at": "", "object_radius": ""}),
        (streaming.stream, SlipStream, {"store": "keep"}),
        (fit, FrictionClient.fit, {"seed": ""}),
        (materials.fit, FrictionClient.fit, {"seed": ""}),
        (simulation.simulate, simulate, {"seed": ""}),
    ],
)
def test_a_command_takes_what_the_library_takes_where_nothing_is_said(
    command: Callable[..., Any], call: Callable[..., Any], names: dict[str, str]
) -> None:
    own, theirs = inspect.signature(command).parameters, inspect.signature(call).parameters
    for option, argument in names.items():
        assert own[option].default == theirs[argument or option].default, option


ANSWER = FrictionAnswer("paper", "ols", 3, 1e-3, 0.07, None, 0.449, 0.449, True, None)


def test_friction_is_looked_up_in_the_middle_of_the_data_for_as_large_an_element(client: Mock, say: Say) -> None:
    client.model.return_value, client.friction.return_value = MODEL, ANSWER
    say("lookup", "paper")
    assert client.friction.call_args.args == ("paper", 0.0, pytest.approx(0.07), None, "auto")
    say("lookup", "paper", "--element-area", str(2.0 * MODEL.element_area))
    assert client.friction.call_args.args[2] == pytest.approx(0.14)
    client.model.reset_mock()
    say("lookup", "paper", "--normal-force", "0.05", "--element-area", "1e-6", "--quantile", "0.05", "--elements", "9")
    assert client.friction.call_args.args == ("paper", 0.0, 0.05, 0.05, "auto")
    assert client.friction.call_args.kwargs == {"elements": 9, "sensor": None, "element_area": 1e-6}
    client.model.assert_not_called()


@pytest.mark.parametrize("command", [["lookup", "paper"], ["plan", "paper", "--load", "1", "--contact-area", "6e-5"]])
def test_without_a_model_the_service_says_what_it_knows_instead(
    client: Mock, command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    client.model.side_effect = NoModel("material 'paper' has no fitted model of method 'auto'; fitted: none")
    client.friction.side_effect = ProblemError("/problems/no-model", 409, "friction was at least 0.3")
    with pytest.raises(SystemExit):
        main(command)
    assert "friction was at least 0.3" in capsys.readouterr().err
    client.friction.side_effect = None
    with pytest.raises(SystemExit):
        main(command)
    assert "fitted: none" in capsys.readouterr().err


def test_what_is_looked_up_is_told_with_all_that_was_said_of_it(client: Mock, say: Say) -> None:
    client.friction.return_value = replace(
        ANSWER, quantile=0.05, friction_coefficient=0.3, of="contact", elements=9, element_area=1e-6,
        warning="careful", support="supported", advice="record more", chosen_because="it is the best",
        notes=("a note", "another"),
    )  # fmt: skip
    lines = [" ".join(line.split()) for line in say("lookup", "paper", "--normal-force", "0.07").splitlines()]
    assert lines == [
        "Friction of paper",
        "μ 0.300, the 0.05 quantile of a contact of 9 elements; the mean is 0.449",
        "at 0.00100 m/s and 0.0700 N an element of 1.00 mm²",
        "model ols, version 3",
        "because it is the best",
        "support supported: record more",
        "warning careful",
        "note a note",
        "note another",
    ]


def test_what_is_said_of_support_is_not_said_again_as_a_warning_nor_a_friction_below_0(client: Mock, say: Say) -> None:
    outside = "normal force extrapolated to 9 N an element"
    client.friction.return_value = replace(
        ANSWER, quantile=0.05, friction_coefficient=0.0, mean=-0.2, warning=f"{outside}; look at the samples",
        support="extrapolated", advice=f"{outside}: record a grasp there",
    )  # fmt: skip
    told = say("lookup", "paper", "--normal-force", "9")
    assert told.count(outside) == 1
    assert "one element\n" in told
    lines = [" ".join(line.split()) for line in told.splitlines()]
    assert lines[-2:] == [f"support extrapolated: {outside}: record a grasp there", "warning look at the samples"]


GRIP = RequiredForce(3.7501, (3.7501, 20.0), 16.25, 5.0, 0.04, 0.31, 1e-3, True, None, "contact", 90.4, advice="go on")


def test_a_grip_is_told_with_its_bounds_and_rounded_up(client: Mock, say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    client.model.return_value, asked = MODEL, Mock(return_value=GRIP)
    monkeypatch.setattr(stiction_client, "required_normal_force", asked)
    lines = [
        " ".join(line.split()) for line in say("plan", "paper", "--load", "2", "--contact-area", "1e-4").splitlines()
    ]
    assert lines == [
        "Grip for 2 N on paper",
        "press with 3.76 N, each finger",
        "at most 20.0 N",
        "slips with a probability of 0.001 at most",
        "largest load 5.00 N",
        "μ 0.310, so low in a contact of 90 elements at 0.0400 N an element",
        "model hierarchical, version 3",
        "support supported: go on",
    ]
    client.model.return_value = replace(MODEL, diagnostics={"chosen_because": "hierarchical: grasps differ"})
    question = ("plan", "paper", "--load", "2", "--contact-area", "1e-4")
    told = json.loads(say(*question, "--json"))
    assert (told["material"], told["chosen_because"]) == (MODEL.material, "hierarchical: grasps differ")
    assert "hierarchical: grasps differ" in say(*question)
    assert "grasps differ" not in say(*question, "--method", "hierarchical")
    asked.return_value = replace(GRIP, feasible_interval=(3.0, math.inf), largest_load=math.inf, of="element")
    told = say("plan", "paper", "--load", "2", "--contact-area", "1e-4")
    assert "so low in one element at" in told
    assert "at most  " not in told
    assert "largest load" not in told


@pytest.mark.parametrize(
    ("statuses", "code"),
    [
        (["done", "done"], 0),
        (["done", "refused"], INPUT_REFUSED),
        (["failed", "done"], FAILURE),
        (["cancelled", "refused"], SERVICE_REFUSED),
    ],
)
def test_the_worst_end_of_an_upload_is_the_exit_code(
    client: Mock, say: Say, tmp_path: Path, statuses: list[str], code: int
) -> None:
    for number in range(len(statuses)):
        (tmp_path / f"{number}.npz").touch()
    client.wait.side_effect = [replace(JOB, status=status) for status in statuses]
    client.upload.return_value = client.grasp_log.return_value = LOG
    told = json.loads(say("upload", str(tmp_path), "--json", code=code))["uploads"]
    assert [(each["file"], each["status"]) for each in told] == [(f"{k}.npz", each) for k, each in enumerate(statuses)]
    assert [each["findings"][0]["name"] for each in told] == ["slow frames"] * 2
    client.ensure_material.assert_not_called()


def test_an_upload_that_is_not_waited_for_tells_what_is_known_by_then(client: Mock, say: Say, tmp_path: Path) -> None:
    (tmp_path / "0.npz").touch()
    client.upload.return_value = replace(LOG, job=replace(JOB, status="queued"), detection=None)
    told = json.loads(say("upload", str(tmp_path), "--no-wait", "--material", "paper", "--create", "--json"))["uploads"]
    assert (told[0]["status"], told[0]["findings"], told[0]["grasp_log"]) == ("queued", [], "a")
    client.wait.assert_not_called()
    client.grasp_log.assert_not_called()
    client.ensure_material.assert_called_once_with("paper")


def test_a_log_that_cannot_be_read_is_rejected_and_the_others_go_on(client: Mock, say: Say, tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        (tmp_path / name).touch()
    client.upload.side_effect = [InvalidInput("time", "none", "some"), LOG]
    client.wait.return_value, client.grasp_log.return_value = JOB, LOG
    first, second = json.loads(say("upload", str(tmp_path), "--json", code=SERVICE_REFUSED))["uploads"]
    assert first == {"file": "a.npz", "status": "rejected", "reason": "time is none; allowed: some"}
    assert second["status"] == "done"


def test_a_log_is_shown_with_its_job_its_withdrawal_and_what_was_seen(client: Mock, say: Say) -> None:
    client.grasp_log.return_value = replace(
        LOG, job=replace(JOB, status="refused", reason="too few samples"), withdrawal=Withdrawal(
            "2026-01-03T00:00:00+00:00", "wrong", "7f"
        ),
    )  # fmt: skip
    assert [" ".join(line.split()) for line in say("logs", "show", "a").splitlines()] == [
        "a",
        "material paper",
        "sensor left",
        "holds 82 frames of 8 × 8 in 2.75 s, 9 bytes of npz",
        "uploaded 2026-01-02 03:04:05 UTC",
        "job refused: too few samples",
        "withdrawn 2026-01-03 00:00:00 UTC by key 7f: wrong",
        "detected by filter",
        "macro slip 2 of 40 frames in contact slip as a whole",
        "stick ratio 0.250 at its smallest",
        "samples 321",
        "slow frames seen; faster",
    ]
    client.grasp_log.return_value = replace(
        LOG, material=None, sensor="", detection=replace(SEEN, stick_ratio_min=None)
    )
    lines = [" ".join(line.split()) for line in say("logs", "show", "a").splitlines()]
    assert lines[1] == "material none"
    assert "job done" in lines
    assert not [line for line in lines if line.startswith(("sensor", "withdrawn", "stick ratio"))]


def test_lists_are_of_the_newest_twenty_unless_more_are_asked_for(client: Mock, say: Say) -> None:
    client.grasp_logs.return_value, client.jobs.return_value = [LOG], [JOB]
    assert "2026-01-02 03:04:05 UTC" in say("logs", "list")
    client.grasp_logs.assert_called_once_with(None, 20)
    assert say("jobs", "list").split()[-7:-2] == ["1", "ingest", "done", "paper", "2026-01-01"]
    client.jobs.assert_called_once_with(None, 20)
    say("jobs", "list", "--limit", "1", "--status", "failed")
    assert client.jobs.call_args.args == ("failed", 1)


def test_a_material_is_listed_with_its_friction_in_the_middle_of_the_data(client: Mock, say: Say) -> None:
    paper = Material("paper", "", "2026-01-01T00:00:00+00:00", 3, {"hierarchical": MODEL}, "hierarchical")
    client.materials.return_value = [paper, replace(paper, name="felt", models={}, recommended=None)]
    rows = [line.split() for line in say("materials", "list").splitlines()[3:]]
    assert rows[0][:5] == ["paper", "3", "0.449", "hierarchical", "not"]  # identified
    assert rows[1][:3] == ["felt", "3", "2026-01-01"]
    client.material.return_value = paper
    shown = say("materials", "show", "paper")
    assert "about" not in shown
    assert "  support      not identified: " in shown
    assert shown.splitlines()[-1].split()[:3] == ["hierarchical", "3", "0.450"]


@pytest.mark.parametrize(
    ("status", "reason", "told", "code"),
    [("done", None, "paper: done, version 3 by auto", 0), ("failed", "no room", "paper: failed, no room", FAILURE)],
)
def test_a_fit_ends_as_its_job_does(
    client: Mock, say: Say, status: str, reason: str | None, told: str, code: int
) -> None:
    client.wait.return_value = replace(JOB, status=status, reason=reason)
    assert say("materials", "fit", "paper", code=code) == f"{told}\n"
    client.fit.assert_called_once_with("paper", "auto", 0)


def test_sensors_are_listed_thick_where_no_contact_feels_their_base(client: Mock, say: Say) -> None:
    gel = {"young_modulus": 2.5e5, "poisson_ratio": 0.48, "thickness": None, "marker_depth": 5e-4}
    client.sensors.return_value = [{"name": "left", "gel": gel}, {"name": "right", "gel": None}]
    left, right = (line.split() for line in say("sensors", "list").splitlines()[3:])
    assert left == ["left", "250000", "0.480", "thick", "0.000500"]
    assert right == ["right"]
    told = say("sensors", "describe", "left", "--young-modulus", "1e5", "--poisson-ratio", "0.4")
    client.describe_sensor.assert_called_once_with("left", 1e5, 0.4, None, 0.0, None)
    assert told.startswith("left is described: ")


def test_known_forces_are_one_for_all_logs_or_one_for_each() -> None:
    assert sensors._known_forces(None, 2) is None
    assert sensors._known_forces([2.0], 2) == [2.0, 2.0]
    assert sensors._known_forces([2.0, 3.0], 2) == [2.0, 3.0]
    for given in ([1.0, 2.0, 3.0], []):
        with pytest.raises(BadParameter, match=f"{len(given)} known forces for 2 logs; allowed: one, or one"):
            sensors._known_forces(given, 2)


def test_a_quantity_of_a_gel_is_told_as_found_as_given_or_as_a_bound() -> None:
    found = {
        "name": "thickness",
        "unit": "m",
        "value": 4e-3,
        "low": 3e-3,
        "high": 5e-3,
        "information": 0.75,
        "note": "",
    }
    assert sensors._gel_cells(found) == ("thickness [m]", "0.004000", "0.003000 … 0.005000", "75.0%", "")
    assert sensors._gel_cells(found | {"low": 4e-3, "high": 4e-3, "note": "given"})[2:] == ("", "", "given")
    assert sensors._gel_cells(found | {"value": None, "high": None})[1:3] == ("thick", "at least 0.003000")


def test_owners_are_printed_one_a_line(client: Mock, say: Say) -> None:
    client.owners.return_value, client.add_owner.return_value = ["key:a", "group:lab"], ["key:a", "group:lab"]
    assert say("owners", "list", "paper") == "key:a\ngroup:lab\n"
    assert say("owners", "add", "paper", "group:lab") == "paper belongs to key:a, group:lab\n"
    assert say("owners", "remove", "paper", "key:a") == "paper does not belong to key:a any more\n"
    client.remove_owner.assert_called_once_with("paper", "key:a")


STATE = {"type": "state", "stick_ratio": 0.5, "macro_slip": False, "friction": None, "findings": []}
FRICTION = {"coefficients": [0.4, 0.0, 0.0], "standard_errors": [0.02, None, None], "samples": 12}


def test_what_a_replayed_stream_answered_is_counted() -> None:
    answers = [
        STATE | {"stick_ratio": None},
        STATE | {"stick_ratio": 0.25, "macro_slip": True},
        {"type": "error"},
        STATE | {"friction": FRICTION},
    ]
    summary = streaming._summary(answers)
    assert summary == {
        "frames": 3, "refused_frames": 1, "stick_ratio_min": 0.25, "macro_slip_frames": 1, "friction": FRICTION,
        "findings": [], "forces": None,
    }  # fmt: skip
    told = dict(streaming._lines(summary | {"grasp_log": None}))
    assert (told["frames"], told["least stick ratio"], told["gross slip"]) == (
        "3, and 1 refused",
        "0.250",
        "in 1 frames",
    )
    assert told["friction"] == "β₀ = 0.400 ± 0.0200 (standard error), from 12 samples"
    nothing = streaming._summary([])
    assert (nothing["stick_ratio_min"], nothing["friction"]) == (None, None)
    assert dict(streaming._lines(nothing | {"grasp_log": None}))["frames"] == "0"


def test_why_a_replayed_stream_has_no_samples_is_told_with_what_to_do() -> None:
    finding = {"name": "no rest", "evidence": "3 elements touch in the first frame", "remedy": "begin before the touch"}
    for findings, why in (
        ([], "nothing slipped, or there are no forces"),
        ([finding], "3 elements touch in the first frame; begin before the touch"),
    ):
        summary = streaming._summary([STATE | {"findings": findings}])
        assert dict(streaming._lines(summary | {"grasp_log": None}))["friction"] == f"no samples: {why}"
    of_before = {name: value for name, value in STATE.items() if name != "findings"}
    assert streaming._summary([of_before])["findings"] == []


def test_where_a_replayed_streams_forces_are_from_is_told() -> None:
    found = {"source": "reconstructed", "wait_for": None}
    for told, forces, friction in (
        ([found | {"wait_for": "noise"}, found], "reconstructed from displacement, not yet known in 1 frames", "elem"),
        ([found], "reconstructed from displacement", "elements' forces are too unsure"),
        ([{"source": "none", "reason": "too many markers"}], "none: too many markers", "there are no forces"),
        ([None], None, "there are no forces"),
    ):
        lines = dict(
            streaming._lines(streaming._summary([STATE | {"force": each} for each in told]) | {"grasp_log": None})
        )
        assert lines["forces"] == forces
        assert lines["friction"] is not None
        assert lines["friction"].startswith(f"no samples: nothing slipped, or {friction}")


@pytest.mark.parametrize("error", [None, math.inf])
def test_an_error_that_nobody_knows_is_left_out(error: float | None) -> None:
    told = streaming._friction(FRICTION | {"standard_errors": [error, None, None]})
    assert told == "β₀ = 0.400 (standard error), from 12 samples"


def test_an_area_as_large_as_a_hand_is_taken_without_asking(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("typer.confirm", lambda *_, **__: False)
    remote._check_area(0.02)
    with pytest.raises(BadParameter, match=r"--contact-area is 0\.0201 m²; allowed: that of one finger, such as 1e-4"):
        remote._check_area(0.0201)


@pytest.mark.parametrize(
    ("end", "code"), [(ConnectionFailed("refused"), SERVICE_REFUSED), (KeyboardInterrupt(), INTERRUPTED)]
)
def test_uploads_that_break_off_say_what_is_done_and_how_to_go_on(
    client: Mock, tmp_path: Path, capsys: pytest.CaptureFixture[str], end: BaseException, code: int
) -> None:
    paths = [tmp_path / f"{name}.npz" for name in "abcd"]
    for path in paths:
        path.touch()
    receipt = Mock(id="1f", job=JOB)
    for shown in ([], ["--json"]):
        client.upload.side_effect, client.wait.return_value = [receipt, receipt, end], JOB
        client.grasp_log.return_value = Mock(detection=None)
        with pytest.raises(SystemExit) as left:
            main(["upload", *map(str, paths), *shown])
        assert left.value.code == code
        out, err = capsys.readouterr()
        assert "2 of 4 logs are done; the same command sends the rest, and stores none twice" in err
    told = json.loads(out)["uploads"]
    assert [each["status"] for each in told] == [JOB.status, JOB.status, "not known", "not sent"]
    assert [each["file"] for each in told] == [path.name for path in paths]


def test_an_interrupt_when_all_uploads_are_done_loses_none_of_them(
    client: Mock, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As progress raises it at its end, where one was lost before."""

    def interrupted(things: Iterable[Any], *_: Any) -> Iterator[Any]:
        yield from things
        raise KeyboardInterrupt

    monkeypatch.setattr(remote, "counted", interrupted)
    (tmp_path / "a.npz").touch()
    client.upload.return_value, client.wait.return_value = Mock(id="1f", job=JOB), JOB
    client.grasp_log.return_value = Mock(detection=None)
    with pytest.raises(SystemExit) as left:
        main(["upload", str(tmp_path / "a.npz"), "--json"])
    out, err = capsys.readouterr()
    assert (left.value.code, "1 of 1 logs are done" in err) == (INTERRUPTED, True)
    assert [each["status"] for each in json.loads(out)["uploads"]] == [JOB.status]


def test_a_first_upload_that_fails_says_no_more_than_why(
    client: Mock, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.npz").touch()
    client.upload.side_effect = ConnectionFailed("refused")
    with pytest.raises(SystemExit):
        main(["upload", str(tmp_path / "a.npz")])
    out, err = capsys.readouterr()
    assert (out, "refused" in err, "logs are done" in err) == ("", True, False)
