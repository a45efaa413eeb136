import re
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from db.records import ContactFriction, Finding
from estimators import WorkingPoint, next_grasp
from service.domain.logs.doubtful_logs import with_doubts
from service.domain.logs.grasp_report import inspect_grasp, report_of_log, report_of_stored
from service.domain.models.stored_results import encode_history, encode_samples
from service.formatting import NOTHING
from service.report import wording
from service.report.grasp import InspectedGrasp, grasp_facts, grasp_report
from service.report.page import Report, render
from slipcore import GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.forces import Gel, reconstruct
from stiction_client.container import encode

SHORT = RampSchedule(rest=0.1, press=0.3, settle=0.1, shear=0.6, hold=0.1)


@pytest.fixture(scope="module")
def log() -> GraspLog:
    return tangential_ramp(points=10, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-6, force_noise=5e-4, seed=1)


@pytest.fixture(scope="module")
def seen(log: GraspLog) -> InspectedGrasp:
    return inspect_grasp(log, "grasp.npz")


def test_a_grasp_that_slips_is_told_with_its_friction_and_what_to_record_next(seen: InspectedGrasp) -> None:
    report = grasp_report(seen)
    facts = {fact.name: fact.value for fact in report.facts}
    assert facts["Friction samples"] == str(len(seen.samples)) != "0"
    (friction,) = (value for name, value in facts.items() if name.startswith("Friction coefficient"))
    assert float(friction) == pytest.approx(0.4, abs=0.05)  # the ramp's own
    assert any(step.startswith("Record next: press with") for step in report.steps)
    assert [section.heading for section in report.sections] == ["Slip over time", "Friction model", "What was detected"]
    assert len(list(report.pictures)) == 3


def test_a_log_is_reported_as_it_is_seen(log: GraspLog, seen: InspectedGrasp) -> None:
    """But for the seconds, which are those of each look."""

    def without_seconds(report: Report) -> str:
        return re.sub(r"[\d.]+ (ms|s)\b", "", f"{report.title} {report.lead} {report.facts} {report.steps}")

    assert without_seconds(report_of_log(log, "grasp.npz")) == without_seconds(grasp_report(seen))


def test_forces_that_no_sensor_measured_are_told(log: GraspLog) -> None:
    few = replace(log, force=None).take(np.linspace(0, len(log) - 1, 8, dtype=int))
    found = reconstruct(few, Gel(1e6, 0.5))
    steps = report_of_log(found.apply(few), "grasp.npz", reconstruction=found).steps
    assert steps[0] == "reconstructed forces: friction is as sure as the description of the sensor's gel."
    steps = report_of_log(found.apply(few), "grasp.npz").steps
    assert steps[0].startswith("forces not checked: ")


def told(inspected: InspectedGrasp) -> dict[str, str]:
    """What was detected, by its name."""
    (table,) = grasp_report(inspected).sections[-1].tables
    return dict(table.rows)


def test_what_was_detected_stands_in_a_table(seen: InspectedGrasp) -> None:
    found = told(seen)
    assert found["detector"] == seen.detection.method
    assert (int(found["onsets of slip"]), int(found["ends of slip"])) == (seen.detection.onsets, seen.detection.ends)
    noise, unit = found["noise of a marker"].split()
    assert float(noise) == pytest.approx(1.0, rel=0.3)  # what the log was made with
    assert unit == "µm"
    assert told(replace(seen, detection=replace(seen.detection, noise=None)))["noise of a marker"] == NOTHING


def test_terms_are_explained_on_the_page_that_uses_them(seen: InspectedGrasp) -> None:
    page = render(grasp_report(seen))
    for term in ("The stick ratio is", "β₁ [s/m] its change with", "† marks a coefficient"):
        assert page.count(term) == 1


def test_a_grasp_without_forces_says_why_there_is_no_friction(log: GraspLog) -> None:
    report = grasp_report(inspect_grasp(replace(log, force=None), "no forces"))
    assert "the log has no forces" in report.lead
    assert not [fact for fact in report.facts if fact.name.startswith("Friction coefficient")]
    assert "Friction model" not in [section.heading for section in report.sections]


def test_friction_of_the_whole_contact_is_a_bound_or_a_value_with_its_interval(seen: InspectedGrasp) -> None:
    name = "friction of the whole contact"
    bound = ContactFriction(0.45, 0.45, None, True, "nothing slips as a whole")
    known = ContactFriction(0.5, 0.45, 0.55, False, "gross slip")
    for found, text in (
        (None, NOTHING),
        (bound, "at least 0.450: nothing slips as a whole"),
        (known, "0.500 (0.450 … 0.550): gross slip"),
    ):
        assert told(replace(seen, detection=replace(seen.detection, contact_friction=found)))[name] == text


def test_what_a_log_holds_is_told_with_its_unit_and_a_sensor_without_a_name_as_none() -> None:
    assert [fact.value for fact in grasp_facts("left", 82, 2.75, (8, 6))] == ["left", "82 in 2.75 s, of 8 × 6 elements"]
    assert grasp_facts("", 82, 2.75, (8, 6))[0].value == NOTHING


def test_gross_slip_is_counted_of_the_frames_in_contact(seen: InspectedGrasp) -> None:
    facts = {fact.name: fact.value for fact in grasp_report(seen).facts}
    assert facts["Frames of gross slip"] == (
        f"{seen.detection.macro_slip_frames} of {seen.detection.contact_frames} in contact"
    )
    assert facts["Findings against it"] == "0"


def test_what_makes_friction_doubtful_is_told_with_what_to_do(log: GraspLog) -> None:
    assert log.force is not None
    force = log.force.copy()
    force[..., 2] *= -1.0
    report = grasp_report(inspect_grasp(replace(log, force=force), "pulled"))
    assert "What makes its friction doubtful" in [section.heading for section in report.sections]
    assert any(step.startswith("force pulls: ") for step in report.steps[:-1])
    assert "Upload" not in report.steps[-1]
    still = grasp_report(inspect_grasp(replace(log, time=1e3 * log.time), "slow"))  # a note
    assert "What limits its friction" in [section.heading for section in still.sections]


def test_what_speaks_against_friction_is_mended_before_more_is_recorded(seen: InspectedGrasp) -> None:
    doubt = Finding("friction follows force", "seen", "believe the whole contact")
    assert seen.model is not None
    doubted = with_doubts(seen.model, [[doubt.name]])
    report = grasp_report(replace(seen, model=doubted, detection=replace(seen.detection, findings=(doubt,))))
    assert report.steps == [
        "friction follows force: believe the whole contact.",
        "Record the grasp again once that is mended.",
    ]
    assert "implausible" in report.lead


def test_of_a_deleted_upload_the_maps_are_drawn_on_the_lattice(
    seen: InspectedGrasp, log: GraspLog, tmp_path: Path
) -> None:
    history = detect_slip(log)
    (tmp_path / "history").write_bytes(encode_history(history))
    (tmp_path / "samples").write_bytes(encode_samples(seen.samples))
    (tmp_path / "log.npz").write_bytes(encode(log))
    for upload in (None, tmp_path / "log.npz"):
        stored = SimpleNamespace(
            material="<i>", sensor="s", frames=len(log), duration=1.2, grid=log.grid, created_at=datetime(2026, 1, 2),
            detection=seen.detection, samples=SimpleNamespace(none_because=None),
        )  # fmt: skip
        page = render(report_of_stored(cast(Any, stored), tmp_path / "history", tmp_path / "samples", upload))
        assert "Grasp log of 2026-01-02 00:00:00 UTC" in page
        assert page.count("<svg") == 3
        assert "&lt;i&gt;" in page


def test_without_a_map_the_rest_is_told(seen: InspectedGrasp) -> None:
    report = grasp_report(replace(seen, slip=None))
    assert "Slip over time" not in [section.heading for section in report.sections]
    assert np.isfinite(len(render(report)))


def test_the_summary_tells_what_a_grasp_alone_says_and_what_would_say_most(seen: InspectedGrasp) -> None:
    assert seen.model is not None
    report = grasp_report(seen)
    middle = 0.5 * sum(seen.model.domain.normal_force)
    support = seen.model.support_at(0.0, middle)
    assert report.lead == f"Friction, from this grasp alone, is {support.kind}: {support.advice}."
    assert report.steps == [
        wording.record_next(next_grasp(seen.model, WorkingPoint(middle), grasps=1)),
        "Upload it with others of its material, and ask how hard to grip that.",
    ]
    facts = {fact.name: fact.value for fact in report.facts}
    assert list(facts)[2:6] == [
        "Friction samples", "Least stick ratio", "Frames of gross slip", "Findings against it"
    ]  # fmt: skip
    assert float(facts["Least stick ratio"]) == pytest.approx(seen.detection.stick_ratio_min, abs=5e-3)
    assert list(report.facts[6:]) == list(seen.grasp_facts)
    assert [section.folded for section in report.sections] == [False, True, True]


def test_what_cannot_be_fitted_is_recorded_again_after_what_was_found_is_mended(seen: InspectedGrasp) -> None:
    doubt = Finding("slow frames", "seen", "ask for more frames")
    found = replace(seen.detection, findings=(doubt,))
    report = grasp_report(replace(seen, model=None, refusal="nothing slips", detection=found))
    assert report.lead == "This grasp alone gives no friction: nothing slips."
    assert report.steps == [
        "slow frames: ask for more frames.",
        "Record another grasp of the same material, or load this one further, until parts of it slip.",
    ]
    (table,) = report.sections[-2].tables
    assert [list(row) for row in table.rows] == [["slow frames", "seen", "ask for more frames"]]
    noted = grasp_report(replace(seen, detection=found))
    assert "Record the grasp again once that is mended." not in noted.steps  # a note alone spoils nothing
