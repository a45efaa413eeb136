from dataclasses import replace

import numpy as np
import pytest

from service.report.grasp import SeenGrasp, grasp_report, see
from service.report.page import render
from slipcore import GraspLog
from slipcore.contact import RampSchedule, tangential_ramp

SHORT = RampSchedule(rest=0.1, press=0.3, settle=0.1, shear=0.6, hold=0.1)


@pytest.fixture(scope="module")
def log() -> GraspLog:
    return tangential_ramp(points=10, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-6, force_noise=5e-4, seed=1)


@pytest.fixture(scope="module")
def seen(log: GraspLog) -> SeenGrasp:
    return see(log, "grasp.npz")


def test_a_grasp_that_slips_is_told_with_its_friction_and_what_to_record_next(seen: SeenGrasp) -> None:
    report = grasp_report(seen)
    facts = {fact.name: fact.value for fact in report.facts}
    assert facts["Friction samples"] == str(len(seen.samples)) != "0"
    (friction,) = (value for name, value in facts.items() if name.startswith("Friction coefficient"))
    assert float(friction) == pytest.approx(0.4, abs=0.05)  # the ramp's own
    assert any(step.startswith("Record next: press with") for step in report.steps)
    assert [section.heading for section in report.sections] == ["Slip over time", "Friction model", "What was detected"]
    assert len(list(report.pictures)) == 3


def test_terms_are_explained_on_the_page_that_uses_them(seen: SeenGrasp) -> None:
    page = render(grasp_report(seen))
    for term in ("The stick ratio is", "β₁ [s/m] its change with", "† marks a coefficient"):
        assert page.count(term) == 1


def test_a_grasp_without_forces_says_why_there_is_no_friction(log: GraspLog) -> None:
    report = grasp_report(see(replace(log, force=None), "no forces"))
    assert "the log has no forces" in report.lead
    assert not [fact for fact in report.facts if fact.name.startswith("Friction coefficient")]
    assert "Friction model" not in [section.heading for section in report.sections]


def test_what_makes_friction_doubtful_is_told_with_what_to_do(log: GraspLog) -> None:
    assert log.force is not None
    force = log.force.copy()
    force[..., 2] *= -1.0
    report = grasp_report(see(replace(log, force=force), "pulled"))
    assert "What makes its friction doubtful" in [section.heading for section in report.sections]
    assert any(step.startswith("force pulls: ") for step in report.steps[:-1])


def test_without_a_map_the_rest_is_told(seen: SeenGrasp) -> None:
    report = grasp_report(replace(seen, slip=None))
    assert "Slip over time" not in [section.heading for section in report.sections]
    assert np.isfinite(len(render(report)))
