"""The demo's tables, of answers that are made up."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.demo import tables
from service.demo.tables import Answer, Upload
from slipcore import FrictionLaw
from tests.service.report.test_material import JOB, LOG, MODEL, SEEN

TRUTHS = {"paper": FrictionLaw((0.45, 0.0, 0.0), 0.02), "glass": None}
DETECTED = replace(SEEN, stick_ratio_min=0.125, macro_slip_frames=3, events={"onset": 7, "end": 2}, noise=1.234e-6)


def answer(model: Any = MODEL, material: str = "paper", **job: Any) -> Answer:
    return Answer(material, "ols", replace(JOB, **job), model, None)


def upload(detection: Any = DETECTED, **seconds: float) -> Upload:
    log: Any = SimpleNamespace(name="grasp 1")
    return Upload(log, replace(LOG, detection=detection, job=replace(JOB, seconds=seconds)))


def test_friction_has_half_of_its_interval_and_a_mark_where_data_do_not_determine_it() -> None:
    table = tables.friction([answer(), answer(material="glass")], TRUTHS)
    halves = 0.5 * np.diff(MODEL.interval(0.95), axis=1).ravel()
    assert table.columns == ("material", "method", "β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]", "true β₀")
    first, second = table.rows
    assert first[:3] == ["paper", "ols", f"0.450 ± {halves[0]:.2g}"]
    assert first[3:] == [f"0.100 ± {halves[1]:.2g} †", f"−0.0200 ± {halves[2]:.2g} †", "0.0200", "0.45"]
    assert second == ["glass", *first[1:-1], "unknown"]


def test_without_a_model_the_end_of_the_job_stands_in_its_place() -> None:
    (row,) = tables.friction([answer(None, status="refused")], TRUTHS).rows
    assert row == ["paper", "ols", "refused", "", "", "", ""]
    assert tables.grips([answer(None)]).rows == [["paper", "ols", "no model", ""]]


def test_a_grasp_is_told_by_what_was_seen_in_it() -> None:
    (row,) = tables.grasps([upload(frames=0.01, samples=0.0025)]).rows
    contact = f"{DETECTED.contact_frames} of 82"
    assert row == ["grasp 1", contact, "0.12", "3", "7", "1.23 µm", str(DETECTED.samples), "done", "12.5 ms"]
    assert len(row) == len(tables.grasps([]).columns)


def test_what_was_not_seen_is_left_empty() -> None:
    (row,) = tables.grasps([upload(replace(DETECTED, stick_ratio_min=None, noise=None))]).rows
    assert (row[2], row[5]) == ("", "")
    assert tables.grasps([upload(None)]).rows == [["grasp 1", *[""] * 6, "done", "0.0 ms"]]


def test_the_time_of_a_stage_is_the_median_of_the_uploads_that_had_it() -> None:
    table = tables.stages([upload(frames=0.001, samples=0.2), upload(frames=0.009), upload(frames=0.002, samples=0.4)])
    assert table.rows == [["frames", "2.0 ms"], ["samples", "300.0 ms"]]


@pytest.mark.parametrize("reason", ["", "no slip"])
def test_each_reason_stands_with_what_it_is_of(reason: str) -> None:
    said = [("a", replace(JOB, status="refused", reason=reason)), ("b", JOB)]
    (table,) = tables.reasons(said)
    assert table.rows == [("a", "refused", reason)]
    assert tables.reasons([("b", JOB)]) == []
