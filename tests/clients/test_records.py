"""Answers of the service as records: of an older service, and of a newer one."""

from typing import Any

import pytest

from stiction_client import JobCancelled, JobFailed, JobRefused
from stiction_client.records import (
    AuditEntry,
    Detection,
    FrictionAnswer,
    GraspLogReceipt,
    Job,
    Material,
    Recognition,
)

JOB: dict[str, Any] = {
    "id": "1", "kind": "ingest", "status": "done", "stage": None, "reason": None, "seconds": {"frames": 0.5},
    "grasp_log": "a", "material": "paper", "model_version": 3, "created_at": "now", "finished_at": "then",
}  # fmt: skip
SEEN: dict[str, Any] = {
    "method": "filter", "noise": 1e-6, "stick_ratio_min": 0.25, "contact_frames": 40, "macro_slip_frames": 2,
    "events": {"onset": 3}, "samples": 321, "seconds": 0.1,
}  # fmt: skip
FRICTION: dict[str, Any] = {
    "material": "paper", "method": "ols", "version": 3, "tangential_velocity": 1e-3, "normal_force": 0.05,
    "quantile": None, "friction_coefficient": 0.4, "mean": 0.4, "within_domain": True, "warning": None,
}  # fmt: skip


@pytest.mark.parametrize(
    ("status", "ended", "error"),
    [
        ("queued", False, None),
        ("running", False, None),
        ("done", True, None),
        ("refused", True, JobRefused),
        ("failed", True, JobFailed),
        ("cancelled", True, JobCancelled),
    ],
)
def test_a_job_has_ended_well_or_raises_how(status: str, ended: bool, error: type[Exception] | None) -> None:
    job = Job.from_json(JOB | {"status": status, "reason": "why", "of a newer service": 1})
    assert job.ended is ended
    if error is None:
        assert job.raise_for_status() is job
    else:
        with pytest.raises(error, match="job 1: why"):
            job.raise_for_status()
        with pytest.raises(error, match=f"job 1: {status}"):
            Job.from_json(JOB | {"status": status}).raise_for_status()


def test_a_detection_of_an_older_service_lacks_what_it_did_not_look_for() -> None:
    found = Detection.from_json(SEEN)
    assert (found.findings, found.contact_friction, found.velocity_is_relative) == (None, None, None)
    assert (found.calibration, found.corrections) == (None, None)
    whole = Detection.from_json(
        SEEN
        | {
            "findings": [{"name": "slow frames", "evidence": "seen", "remedy": "faster", "severity": "note", "x": 1}],
            "contact_friction": {"coefficient": 0.4, "low": 0.3, "high": None, "is_bound": True, "reason": "held"},
            "corrections": ["crosstalk"],
            "calibration": 2,
        }
    )
    assert whole.findings is not None
    assert [(each.name, each.severity) for each in whole.findings] == [("slow frames", "note")]
    assert whole.contact_friction is not None
    assert (whole.contact_friction.is_bound, whole.contact_friction.high) == (True, None)
    assert (whole.corrections, whole.calibration) == (("crosstalk",), 2)
    assert Detection.from_json(SEEN | {"findings": []}).findings == ()


def test_a_log_is_kept_with_its_job_and_what_became_of_it() -> None:
    log: dict[str, Any] = {
        "id": "a", "sha256": "0", "bytes": 9, "format": "npz", "material": None, "sensor": "left", "frames": 82,
        "duration": 2.75, "grid": [8, 9], "created_at": "now", "job": JOB, "detection": None,
    }  # fmt: skip
    receipt = GraspLogReceipt.from_json(log)
    assert (receipt.grid, receipt.job.id, receipt.detection, receipt.withdrawal) == ((8, 9), "1", None, None)
    withdrawn = {"at": "then", "reason": "wrong", "by": None}
    receipt = GraspLogReceipt.from_json(log | {"detection": SEEN, "withdrawal": withdrawn})
    assert receipt.detection is not None
    assert receipt.detection.samples == 321
    assert receipt.withdrawal is not None
    assert (receipt.withdrawal.reason, receipt.withdrawal.by) == ("wrong", None)


def test_a_material_of_an_older_service_recommends_least_squares() -> None:
    told: dict[str, Any] = {"name": "paper", "description": "", "created_at": "now", "grasp_logs": "4", "models": {}}
    material = Material.from_json(told)
    assert (material.recommended, material.grasp_logs, material.withdrawn_grasp_logs) == ("ols", 4, 0)
    newer = Material.from_json(told | {"recommended": {"method": "bayes"}, "withdrawn_grasp_logs": 2})
    assert (newer.recommended, newer.withdrawn_grasp_logs) == ("bayes", 2)
    assert Material.from_json(told | {"recommended": None}).recommended is None


def test_friction_is_no_number_that_cannot_be() -> None:
    answer = FrictionAnswer.from_json(FRICTION | {"notes": ["a", "b"]})
    assert (answer.friction_coefficient, answer.notes, answer.of, answer.elements) == (0.4, ("a", "b"), "element", 1)
    assert FrictionAnswer.from_json(FRICTION | {"friction_coefficient": 0, "mean": -0.1}).mean == -0.1
    for name, value in (
        ("friction_coefficient", -1e-9), ("tangential_velocity", -1.0), ("normal_force", None), ("mean", "0.4"),
        ("within_domain", 1),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=name):
            FrictionAnswer.from_json(FRICTION | {name: value})


def test_what_a_material_is_recognised_by_is_told_where_it_is_doubtful() -> None:
    paper = {"material": "paper", "probability": 0.75, "support": "supported", "advice": "fine", "method": "bayes"}
    felt = {"material": "felt", "probability": 0.2, "support": "stale", "advice": "fit it"}
    wood = {"material": "wood", "probability": 0}
    found = Recognition.from_json({"method": "ols", "unknown": 0.05, "candidates": [paper, felt, wood]})
    assert found.probability == {"paper": 0.75, "felt": 0.2, "wood": 0.0}
    assert found.advice == {"felt": "stale: fit it"}
    assert found.methods == {"paper": "bayes", "felt": "ols", "wood": "ols"}
    assert found.unknown == 0.05


def test_what_a_newer_service_adds_is_passed_over() -> None:
    entry = {
        "id": 7, "at": "now", "actor": "service", "address": None, "request_id": None, "action": "x", "subject": "y",
        "details": {}, "colour": "red",
    }  # fmt: skip
    assert AuditEntry.from_json(entry).action == "x"
    del entry["subject"]
    with pytest.raises(KeyError, match="subject"):
        AuditEntry.from_json(entry)
