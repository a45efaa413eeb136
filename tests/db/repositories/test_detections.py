from collections.abc import Callable
from dataclasses import replace
from time import process_time
from types import SimpleNamespace
from typing import Any

import pytest

from db.database import Database
from db.records import ContactFriction, Detection, Finding, NewGraspLog, SampleSummary
from db.repositories import detections, grasp_logs, jobs, materials
from db.repositories.detections import _copies


@pytest.mark.parametrize("step", [1, -1, 7])
def test_a_thousand_copies_of_one_grasp_are_told_in_a_moment(step: int) -> None:
    """Each is alike all before it, in whichever order that is read. They made a chain, along which each was gone for
    each: 4 s, in a transaction.
    """
    marks = [f"{number:064x}" for number in range(1000)]
    rows: Any = [
        SimpleNamespace(number=k, id=mark, sha256=mark, samples=100, fingerprint=mark) for k, mark in enumerate(marks)
    ]
    alike = [(marks[k * step % 1000], marks[: k * step % 1000]) for k in range(1000)]
    begin = process_time()
    assert _copies(rows, alike) == {marks[0]: marks[1:]}
    assert process_time() - begin < 1.0


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_what_friction_is_at_least_is_told_by_the_newest_logs_that_were_looked_at(
    database: Database, detection: Detection, samples: SampleSummary, new_log: Callable[..., NewGraspLog]
) -> None:
    def store(material: int, low: float | None, findings: tuple[Finding, ...] | None = ()) -> str:
        log = grasp_logs.add(session, new_log(material))
        jobs.add(session, "ingest", "ols", material_id=material, grasp_log_id=log)
        contact = None if low is None else ContactFriction(low, low, None, is_bound=True, reason="held")
        detections.add(session, log, replace(detection, findings=findings, contact_friction=contact), samples)
        return log

    with database.write() as session:
        paper, felt = (materials.create(session, name, "").id for name in ("paper", "felt"))
        store(paper, 0.1)
        store(paper, 0.2, (Finding("slow frames", "x", "y"), Finding("rounded", "x", "y")))
        store(paper, 0.3, None)
        store(paper, None)
        withdrawn = store(paper, 0.5)
        store(felt, 0.9)
        grasp_logs.withdraw(session, withdrawn, "wrong")
        assert detections.least_frictions(session, paper, 9) == [(0.2, ("slow frames", "rounded")), (0.1, ())]
        assert detections.least_frictions(session, paper, 4) == [(0.2, ("slow frames", "rounded"))]
        assert detections.least_frictions(session, paper, 3) == []  # the withdrawn one is among the three


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_a_log_has_samples_once_it_has_one_and_a_material_while_one_counts(
    database: Database, detection: Detection, samples: SampleSummary, new_log: Callable[..., NewGraspLog]
) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        logs = []
        for count in (0, 1):
            logs.append(grasp_logs.add(session, new_log(paper)))
            jobs.add(session, "ingest", "ols", material_id=paper, grasp_log_id=logs[-1])
            assert not detections.has_samples(session, logs[-1])
            detections.add(
                session, logs[-1], detection, replace(samples, count=count, none_because=None if count else "none")
            )
            assert detections.has_samples(session, logs[-1]) is (count == 1)
            assert detections.any_samples(session, paper) is (count == 1)
        grasp_logs.withdraw(session, logs[1], "wrong")
        assert detections.has_samples(session, logs[1])
        assert not detections.any_samples(session, paper)
        detections.set_moments(session, logs[1], b"new")
        told = [grasp_logs.get(session, each).samples for each in logs]
        assert [each and each.moments for each in told] == [b"moments", b"new"]
        detections.remove(session, logs[1])
        assert grasp_logs.get(session, logs[1]).samples is None
        assert grasp_logs.get(session, logs[1]).detection is None
        assert grasp_logs.get(session, logs[0]).samples is not None
