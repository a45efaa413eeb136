import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any

import pytest
from sqlalchemy import event, func, select, update
from sqlalchemy.orm import Session

from db.database import Database
from db.errors import AlreadyExists, NotFound
from db.paging import Window
from db.records import Detection, LogFilter, NewGraspLog, SampleSummary, Signature
from db.repositories import blobs, detections, grasp_logs, jobs, materials
from db.tables import GraspLogRow, SampleSummaryRow, SensorRow

NEWEST_FIRST = Window("created_at", descending=True)


def add(database: Database, log: NewGraspLog) -> str:
    with database.write() as session:
        log_id = grasp_logs.add(session, log)
        jobs.add(session, "ingest", "ols", material_id=log.material_id, grasp_log_id=log_id)
    return log_id


def test_a_log_comes_back_with_its_job(database: Database, new_log: Callable[..., NewGraspLog]) -> None:
    log = new_log()
    log_id = add(database, log)
    with database.read() as session:
        found = grasp_logs.get(session, log_id)
    assert (found.sha256, found.bytes, found.format, found.detector) == (log.sha256, 10, "npz", "strain_rate")
    assert (found.sensor, found.frames, found.duration, found.grid) == ("sensor", 250, 8.3, (20, 20))
    assert (found.material, found.detection, found.samples) == (None, None, None)
    assert (found.job.kind, found.job.status, found.job.grasp_log_id) == ("ingest", "queued", log_id)


def test_a_log_comes_back_with_what_was_found_in_one_query(
    database: Database,
    new_log: Callable[..., NewGraspLog],
    detection: Detection,
    samples: SampleSummary,
    statements: list[str],
) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
    log_id = add(database, new_log(material))
    with database.write() as session:
        detections.add(session, log_id, detection, samples)
    statements.clear()
    with database.read() as session:
        found = grasp_logs.get(session, log_id)
        (listed,) = grasp_logs.list_all(session, NEWEST_FIRST, LogFilter())
    assert (found.material, found.detection, found.samples) == ("paper", detection, samples)
    assert found.job.material == "paper"
    assert listed == replace(found, samples=replace(samples, moments=None))
    assert ["moments" in statement for statement in statements] == [True, False]
    assert not any("alike" in statement or "signature" in statement for statement in statements)


def test_whether_the_same_logs_count_is_told_without_what_is_long(
    database: Database,
    new_log: Callable[..., NewGraspLog],
    detection: Detection,
    samples: SampleSummary,
    statements: list[str],
) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
    ids = [add(database, new_log(material)) for _ in range(2)]
    seen, states = list[Any](), list[str]()
    changes: list[Callable[[Session], object]] = [
        lambda session: detections.add(session, ids[0], detection, samples),
        lambda session: detections.add(session, ids[1], detection, samples),
        lambda session: detections.remove(session, ids[0]),
        lambda session: detections.add(session, ids[0], detection, samples),
        lambda session: grasp_logs.withdraw(session, ids[1], "wet", None),
        lambda session: grasp_logs.change_sensor(session, ids[0], "another"),
    ]
    for change in changes:
        with database.write() as session:
            change(session)
        statements.clear()
        with database.read() as session:
            found = detections.logs_that_count(session, material)
            assert detections.logs_that_count(session, material) == found
            states.append(detections.state_of_logs(session, material))
            assert detections.state_of_logs(session, material) == states[-1]
        assert not any(name in statement for statement in statements for name in ("alike", "moments", "findings"))
        assert found not in seen
        seen.append(found)
    assert len(set(states)) == len(changes)
    assert [[log.id for log in found] for found in seen] == [ids[:1], ids, ids[1:], ids, ids[:1], ids[:1]]


def test_no_samples_have_no_range(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection
) -> None:
    log_id = add(database, new_log())
    none = SampleSummary(0, "no slip", 1e-6, None, None, None, "f" * 64)
    with database.write() as session:
        detections.add(session, log_id, detection, none)
        assert grasp_logs.get(session, log_id).samples == none


@pytest.mark.parametrize("with_material", [True, False])
def test_the_same_content_material_and_detector_is_one_log(
    database: Database, new_log: Callable[..., NewGraspLog], with_material: bool
) -> None:
    with database.write() as session:
        material, other = (materials.create(session, name, "").id for name in ("paper", "steel"))
    key = material if with_material else None
    log = new_log(key, sha256="a" * 64)
    log_id = add(database, log)
    with pytest.raises(AlreadyExists, match="grasp log"):
        add(database, log)
    different = [
        add(database, new_log(other, sha256="a" * 64)),
        add(database, new_log(key, sha256="b" * 64)),
        add(database, new_log(key, sha256="a" * 64, detector="other")),
    ]
    with database.read() as session:
        assert grasp_logs.find_id(session, "a" * 64, key, "strain_rate") == log_id
        with pytest.raises(NotFound, match="no grasp log 'cc"):
            grasp_logs.find_id(session, "c" * 64, key, "strain_rate")
        assert session.scalar(select(func.count()).select_from(SensorRow)) == 1
    assert len({log_id, *different}) == 4


def test_an_unknown_log_is_named(database: Database) -> None:
    with database.read() as session, pytest.raises(NotFound, match="no grasp log 'x' is stored"):
        grasp_logs.get(session, "x")


def test_samples_of_a_material_are_one_part_a_grasp(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection
) -> None:
    with database.write() as session:
        paper, steel = (materials.create(session, name, "").id for name in ("paper", "steel"))
    stored = [
        (new_log(paper, sha256="a" * 64), 5, "1" * 64),
        (new_log(paper, sha256="b" * 64), 5, "2" * 64),
        (new_log(paper, sha256="a" * 64, detector="other"), 5, "3" * 64),
        (new_log(paper, sha256="c" * 64), 0, "4" * 64),
        (new_log(steel, sha256="d" * 64), 5, "5" * 64),
        (new_log(None, sha256="e" * 64), 5, "6" * 64),
    ]
    for log, count, blob in stored:
        log_id = add(database, log)
        none_because = None if count else "no slip"
        with database.write() as session:
            detections.add(session, log_id, detection, SampleSummary(count, none_because, 1e-6, None, None, None, blob))
    with database.read() as session:
        assert [found.samples_blob for found in detections.samples_of_material(session, paper)] == ["3" * 64, "2" * 64]


def copies_of_counted(database: Database, material_id: str) -> dict[str, tuple[str, ...]]:
    """The logs of a material that count, with the copies of each, which both queries agree on."""
    with database.read() as session:
        found = detections.samples_of_material(session, material_id)
        newest = [log.samples.grasp_log_id for log in detections.newest_sampled_logs(session, material_id, 9)]
    assert sorted(newest) == sorted(part.grasp_log_id for part in found)
    return {part.grasp_log_id: part.copies for part in found}


def test_of_logs_of_one_grasp_the_first_that_is_not_withdrawn_counts(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    with database.write() as session:
        paper, steel = (materials.create(session, name, "").id for name in ("paper", "steel"))
    prints = {"a": "1" * 64, "b": "1" * 64, "c": None, "d": "2" * 64, "e": "1" * 64, "f": None}
    ids = {name: add(database, new_log(steel if name == "e" else paper)) for name in prints}
    with database.write() as session:
        for name in reversed(prints):  # the first was found last
            detections.add(session, ids[name], replace(detection, fingerprint=prints[name]), samples)

    counted = partial(copies_of_counted, database, paper)
    alone: dict[str, tuple[str, ...]] = {ids[name]: () for name in "cdf"}
    assert counted() == alone | {ids["a"]: (ids["b"],)}
    with database.write() as session:
        assert detections.others_of_grasp(session, ids["b"], ["1" * 64]) == [ids["a"]]
        assert detections.others_of_grasp(session, ids["e"], ["1" * 64]) == []
        grasp_logs.withdraw(session, ids["a"], "the sensor was wet")
    assert counted() == alone | {ids["b"]: ()}


def test_of_logs_of_one_grasp_the_one_with_the_most_samples_counts(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    """A short cut that came first let the whole log be left out."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
    short, whole, again = (add(database, new_log(paper)) for _ in range(3))
    with database.write() as session:
        for log_id, count in ((short, 5), (whole, 500), (again, 500)):
            found = replace(samples, count=count)
            detections.add(session, log_id, replace(detection, fingerprint="1" * 64), found)
    with database.read() as session:
        (counted,) = detections.samples_of_material(session, paper)
        (newest,) = detections.newest_sampled_logs(session, paper, 9)
    assert (counted.grasp_log_id, counted.copies) == (whole, (short, again))
    assert newest.samples.grasp_log_id == whole


def test_grasps_that_share_a_content_are_one(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    """A content in two of them, by two detectors, was the copy of a log that did not count itself."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
    stored = [("a", "1", 50), ("x", "1", 100), ("b", "2", 60), ("y", "3", 10), ("x", "2", 55), ("y", "2", 10)]
    ids = []
    for content, mark, count in stored:
        detector = f"detector {len(ids)}"
        ids.append(add(database, new_log(paper, sha256=content * 64, detector=detector)))
        found = replace(samples, count=count)
        with database.write() as session:
            detections.add(session, ids[-1], replace(detection, fingerprint=mark * 64), found)
    with database.read() as session:
        (counted,) = detections.samples_of_material(session, paper)
        (newest,) = detections.newest_sampled_logs(session, paper, 9)
    assert (counted.grasp_log_id, counted.copies) == (ids[2], (ids[0], ids[4], ids[5]))  # of x 55 count
    assert newest.samples.grasp_log_id == ids[2]


@pytest.mark.parametrize("whole_comes", ["first", "last"])
def test_grasps_that_one_recording_holds_are_one_beside_it_alone(
    database: Database,
    new_log: Callable[..., NewGraspLog],
    detection: Detection,
    samples: SampleSummary,
    whole_comes: str,
) -> None:
    """They had been one grasp for good, also once the recording, which had been sent by mistake, was withdrawn."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
    ids = [add(database, new_log(paper)) for _ in range(4)]
    marks = [str(number) * 64 for number in range(4)]
    whole = 0 if whole_comes == "first" else 3
    for number, (log_id, mark) in enumerate(zip(ids, marks, strict=True)):
        others = marks[:3] if number == whole == 3 else marks[:1] if number > whole else []
        found, summary = replace(detection, fingerprint=mark), replace(samples, count=500 if number == whole else 100)
        with database.write() as session:
            detections.add(session, log_id, found, summary, alike=others)

    counted = partial(copies_of_counted, database, paper)
    cuts = tuple(each for each in ids if each != ids[whole])
    assert counted() == {ids[whole]: cuts}
    with database.write() as session:
        grasp_logs.withdraw(session, ids[whole], "sent by mistake")
    assert counted() == dict.fromkeys(cuts, ())
    with database.write() as session:
        assert grasp_logs.restore(session, ids[whole])
    assert counted() == {ids[whole]: cuts}


def test_logs_without_a_material_are_no_copies_of_each_other(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    first, second = (add(database, new_log()) for _ in range(2))
    with database.write() as session:
        detections.add(session, first, replace(detection, fingerprint="1" * 64), samples)
        assert detections.others_of_grasp(session, second, ["1" * 64]) == []


def test_signatures_of_the_other_logs_of_a_material_come_newest_first(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    with database.write() as session:
        paper, steel = (materials.create(session, name, "").id for name in ("paper", "steel"))
    ids = [add(database, new_log(material)) for material in (paper, paper, steel, paper, paper, paper)]
    unassigned = add(database, new_log())
    kept = {0: b"0", 1: None, 2: b"2", 3: b"", 4: b"4"}  # of the fourth nothing, as nothing touched it
    with database.write() as session:
        for number, content in kept.items():
            detections.add(session, ids[number], replace(detection, fingerprint=str(number) * 64), samples, content)
        assert detections.known_again(session, ids[5], 9) == [ids[4], ids[0]]
        assert detections.known_again(session, ids[5], 1) == [ids[4]]
        assert detections.known_again(session, ids[0], 9) == [ids[4]]
        assert detections.known_again(session, unassigned, 9) == []
        found = list(detections.signatures(session, [ids[0], ids[4]]))
        assert found == [Signature(ids[4], b"4"), Signature(ids[0], b"0")]
        looked_for = [detections.has_signature(session, log_id) for log_id in ids]
    assert looked_for == [True, False, True, True, True, False]


def test_no_clock_that_is_set_moves_the_order_of_logs(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    """An epoch left in what had come while the clock was ahead, and the alarm took it for the newest."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        ahead, early, late = logs = [grasp_logs.add(session, new_log(paper)) for _ in range(3)]
        for log_id in reversed(logs):  # as they were worked on does not count either
            detections.add(session, log_id, detection, samples)
        of_first = update(GraspLogRow).where(GraspLogRow.id == ahead)
        session.execute(of_first.values(created_at=datetime.now(UTC) + timedelta(hours=1)))
    with database.write() as session:
        assert [part.grasp_log_id for part in detections.samples_of_material(session, paper)] == logs
        newest = detections.newest_sampled_logs(session, paper, 2)
        assert [log.samples.grasp_log_id for log in newest] == [late, early]
        assert set(grasp_logs.withdraw_before(session, paper, late, "new lot")) == {ahead, early}


def test_an_epoch_takes_all_logs_out_in_one_statement(
    database: Database, new_log: Callable[..., NewGraspLog], statements: list[str]
) -> None:
    """20,000 logs, one by one, had taken 0.9 s of CPU, for which all others who write wait."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        logs = [grasp_logs.add(session, new_log(paper)) for _ in range(5)]
        grasp_logs.withdraw(session, logs[0], "torn")
    statements.clear()
    with database.write() as session:
        assert set(grasp_logs.withdraw_before(session, paper, None, "new lot")) == set(logs[1:])
    assert not statements  # none is read before
    with database.read() as session:
        query = select(GraspLogRow.withdrawn_because).order_by(GraspLogRow.number)
        assert list(session.scalars(query)) == ["torn"] + 4 * ["new lot"]


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_the_newest_logs_with_samples_are_found_without_sorting_all(
    database: Database, new_log: Callable[..., NewGraspLog]
) -> None:
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
        logs = [grasp_logs.add(session, new_log(paper)) for _ in range(3)]
        for log_id in logs[1:]:
            session.add(SampleSummaryRow(grasp_log_id=log_id, count=5, element_area=1e-6, samples_blob="1" * 64))
    asked: list[tuple[str, tuple[object, ...]]] = []

    def note(_connection: object, _cursor: object, statement: str, values: tuple[object, ...], *_rest: object) -> None:
        asked.append((statement, values))

    event.listen(database.engine, "before_cursor_execute", note)
    with database.read() as session:
        found = detections.newest_sampled_logs(session, paper, 5)
        statement, values = next(each for each in asked if "ORDER BY" in each[0])
        plan = session.connection().exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", values).all()
    assert [log.samples.grasp_log_id for log in found] == logs[:0:-1]
    assert "TEMP B-TREE" not in str(plan)
    assert "ix_grasp_logs_material_id_number_id" in str(plan)


def test_the_blobs_that_rows_refer_to_are_known(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    log = new_log()
    log_id = add(database, log)
    with database.write() as session:
        detections.add(session, log_id, detection, samples)
    used = {log.sha256, detection.history_blob, samples.samples_blob}
    with database.read() as session:
        assert blobs.referenced(session, [*used, "0" * 64]) == used
        assert blobs.referenced(session, []) == set()


def test_what_copies_of_a_grasp_are_alike_is_not_held_together(
    database: Database, new_log: Callable[..., NewGraspLog], detection: Detection, samples: SampleSummary
) -> None:
    """4,000 copies, each with a thousand fingerprints of others, took 700 MB of whoever fitted their material."""
    with database.write() as session:
        paper = materials.create(session, "paper", "").id
    marks = [f"{number:064x}" for number in range(60)]
    with database.write() as session:
        for number, mark in enumerate(marks):
            log_id = grasp_logs.add(session, new_log(paper))
            jobs.add(session, "ingest", "ols", material_id=paper, grasp_log_id=log_id)
            alike = [*marks[:number], *(f"{number}{gone:059x}" for gone in range(1000 - number))]
            detections.add(session, log_id, replace(detection, fingerprint=mark), samples, alike=alike)
    with database.read() as session:
        tracemalloc.start()
        try:
            counted = (
                detections.samples_of_material(session, paper),
                detections.newest_sampled_logs(session, paper, 60),
            )
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert [len(found) for found in counted] == [1, 1]
    assert len(counted[0][0].copies) == len(marks) - 1
    assert most < 4e6  # it was 7 MB
