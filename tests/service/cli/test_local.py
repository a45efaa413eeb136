"""What commands on files take and tell, without detecting anything."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer

from service.cli import inputs, local, options
from slipcore import ContactFriction, GraspLog, InvalidInput
from slipcore.forces.reconstruction.comparison import Agreement, ForceComparison
from tests.service.domain.logs.test_doubtful_logs import MODEL

Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("name", ["slip.png", "slip.PNG"])
def test_a_picture_has_a_name_of_a_png(name: str) -> None:
    assert options.png_path(Path(name)) == Path(name)
    assert options.png_path(None) is None
    with pytest.raises(typer.BadParameter, match=r"slip\.svg; allowed: a name that ends in \.png"):
        options.png_path(Path("there/slip.svg"))


def test_nothing_that_is_read_is_written_over_by_whatever_name(tmp_path: Path) -> None:
    log, other, folder = tmp_path / "log.npz", tmp_path / "other.npz", tmp_path / "recording"
    log.touch()
    other.touch()
    folder.mkdir()
    (folder / "part.npy").touch()
    (tmp_path / "link.npz").symlink_to(log)
    inputs.refuse_inputs(other, log, None, folder, tmp_path / "absent")
    inputs.refuse_inputs(tmp_path / "new.npz", tmp_path / "new.npz")
    for output, read in ((log, log), (tmp_path / "link.npz", log), (folder / "part.npy", folder)):
        with pytest.raises(InvalidInput, match=f"output is {output}, which is read; allowed: another file"):
            inputs.refuse_inputs(output, other, read)


def test_a_mapping_is_a_file_or_else_a_preset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert inputs.mapping_text(None) is None
    assert inputs.mapping_text(Path("uskin")) == "uskin"
    Path("uskin").write_text('{"time": "µ"}', encoding="utf-8")
    assert inputs.mapping_text(Path("uskin")) == '{"time": "µ"}'
    with pytest.raises(
        InvalidInput, match="mapping is uskim, no file; allowed: a file of JSON, or papillarray or uskin"
    ):
        inputs.mapping_text(Path("uskim"))


def test_rest_is_a_file_where_there_is_one_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert (inputs.rest_of(None), inputs.rest_of("first")) == (None, "first")
    Path("first").touch()
    assert inputs.rest_of("first") == Path("first")
    assert inputs.rest_of(str(tmp_path)) == str(tmp_path)


CONTACT = ContactFriction(0.45, 0.4, 0.5, is_bound=False, reason="a plateau of 9 frames")


def told(bound: ContactFriction | None) -> Any:
    return None if bound is None else {name: getattr(bound, name) for name in ContactFriction.__slots__}


def test_friction_of_a_contact_is_an_interval_or_a_bound() -> None:
    assert local._contact_line(None) is None
    assert local._contact_line(told(CONTACT)) == "0.450, 0.400 … 0.500: a plateau of 9 frames"
    bound = replace(CONTACT, is_bound=True, high=math.inf, reason="it held")
    assert local._contact_line(told(bound)) == "at least 0.400: it held"


def seen(scaled: bool = True, ratio: tuple[float, ...] = (math.nan, 1.0, 0.25)) -> dict[str, Any]:
    """The summary of a log of three frames from 2 s to 4.5 s."""
    place = 1e-3 * np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0], indexing="ij"), axis=-1)[:, :, 0]
    metadata = {} if scaled else {"scale": "unknown"}
    log = GraspLog(np.array([2.0, 3.0, 4.5]), place, np.zeros((3, 2, 2, 3)), 1e-6, metadata=metadata)
    events = SimpleNamespace(onset=[1, 2, 3], end=[1, 2], touch=[1, 2, 3, 4], release=[1])
    history: Any = SimpleNamespace(
        method="filter", stick_ratio=np.array(ratio), macro_slip=np.array([False, True, False]), events=events,
        noise=2.5e-6, patches=(),
    )  # fmt: skip
    return local._detection_summary(log, history, 0.25)


def test_what_was_detected_is_counted() -> None:
    assert seen() == {
        "method": "filter", "frames": 3, "duration": 2.5, "frames_in_contact": 2, "frames_in_macro_slip": 1,
        "smallest_stick_ratio": 0.25, "slip_onsets": 3, "slip_ends": 2, "touches": 4, "releases": 1,
        "marker_noise": 2.5e-6, "seconds": 0.25, "contact_friction": None,
    }  # fmt: skip
    assert seen(ratio=(math.nan,) * 3)["smallest_stick_ratio"] is None


def test_what_was_detected_is_told_with_units() -> None:
    assert local._detection_lines(seen() | {"contact_friction": told(CONTACT)}) == [
        ("frames", "3 in 2.50 s"),
        ("in contact", "2 frames; 1 slip as a whole"),
        ("stick ratio", "0.250 at its smallest"),
        ("elements", "4 touch, 3 begin to slip, 2 stick again"),
        ("friction of the contact", "0.450, 0.400 … 0.500: a plateau of 9 frames"),
        ("marker noise", "2.50 µm"),
        ("computed in", "0.250 s"),
        ("unknown", None),
    ]
    assert dict(local._detection_lines(seen() | {"marker_noise": math.nan}))["marker noise"] is None  # of forces alone
    nothing = dict(local._detection_lines(seen(ratio=(math.nan,) * 3)))
    assert nothing["stick ratio"] is None
    whole = dict(local._detection_lines(seen(ratio=(0.0, 0.0, 0.0))))
    assert whole["stick ratio"] == "0 at its smallest"


def test_a_log_without_a_scale_has_no_noise_in_metres() -> None:
    summary = seen(scaled=False)
    assert summary["marker_noise"] is None
    assert summary["unknown"].startswith("the scale: no noise, velocity or friction")
    assert dict(local._detection_lines(summary))["marker noise"] is None


def test_a_model_is_printed_with_its_intervals_and_what_is_said_of_it(capsys: Capture) -> None:
    model = replace(
        MODEL, covariance=np.diag([1e-4, 0.0, 0.0]), identifiable=np.array([True, False, True]),
        diagnostics={"unknown_velocity": "the object's motion is unknown"},
    )  # fmt: skip
    local.print_model(model, "an ols fit")
    title, _, _, *rows = capsys.readouterr().out.splitlines()
    assert title == "an ols fit"
    assert [row.split() for row in rows[:4]] == [
        ["β₀", "[-]", "0.400", "0.378", "…", "0.422", "yes"],
        ["β₁", "[s/m]", "0", "0", "…", "0", "no"],
        ["β₂", "[1/N]", "0", "0", "…", "0", "yes"],
        ["σ", "[-]", "0.0200"],
    ]
    assert rows[4] == f"{model.support}: {model.advice}"
    assert rows[5] == "the object's motion is unknown"
    assert rows[6:] == list(model.notes)


def test_a_model_is_told_to_a_program_with_all_that_it_says() -> None:
    record = local.model_record(MODEL)
    assert np.array_equal(record["interval_95"], MODEL.interval(0.95))
    assert record["domain"] == {"tangential_velocity": (0.0, 0.01), "normal_force": (0.01, 0.1)}
    assert record["cost"] == {"seconds": 0.0, "monte_carlo_error": MODEL.cost.monte_carlo_error}
    assert (record["method"], record["n"], record["scale"], record["scales"]) == ("ols", 100, 0.02, None)
    assert (record["degrees_of_freedom"], record["scatter_degrees_of_freedom"]) == (10.0, 97.0)


def test_forces_are_compared_by_element_and_in_all(capsys: Capture) -> None:
    agree = [Agreement(ratio, 0.5) for ratio in (1.0, 2.0, 3.0, 4.0)]
    local.print_comparison(ForceComparison(*agree))
    assert [row.split() for row in capsys.readouterr().out.splitlines()[3:]] == [
        ["normal,", "of", "elements", "1.00", "0.500"],
        ["normal,", "of", "the", "contact", "3.00", "0.500"],
        ["tangential,", "of", "elements", "2.00", "0.500"],
        ["tangential,", "of", "the", "contact", "4.00", "0.500"],
    ]
