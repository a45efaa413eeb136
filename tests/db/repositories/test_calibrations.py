from collections.abc import Callable

import pytest

from db.database import Database
from db.errors import NotFound
from db.paging import Window
from db.records import CalibrationPress, NewCalibration, NewGraspLog
from db.repositories import calibrations, grasp_logs, jobs, sensors

NEW = NewCalibration(
    (CalibrationPress("a" * 32, 2.0), CalibrationPress("b" * 32, None)), {"grid": [1, 1]}, b"123", None
)


def test_versions_count_up_for_each_sensor_and_stay(database: Database) -> None:
    with database.write() as session:
        for name in ("left", "right"):
            sensors.find_or_add(session, name)
        first = calibrations.add(session, "left", NEW)
        assert (first.version, first.new) == (1, NEW)
        assert calibrations.add(session, "left", NEW).version == 2
        assert calibrations.add(session, "right", NEW).version == 1
    with database.read() as session:
        listed = calibrations.list_all(session, "left", Window("id", descending=True, limit=10))
        assert [each.version for each in listed] == [2, 1]
        assert calibrations.get(session, "left", 1) == first
        assert [(each.name, each.calibration) for each in sensors.list_all(session)] == [("left", 2), ("right", 1)]


@pytest.mark.parametrize("name", ["other", "nul\0"])
def test_what_is_not_there_is_named(database: Database, name: str) -> None:
    with database.write() as session, pytest.raises(NotFound, match="sensor"):
        calibrations.add(session, name, NEW)
    with database.read() as session, pytest.raises(NotFound, match="calibration"):
        calibrations.get(session, name, 1)


def test_a_log_is_corrected_by_the_version_that_was_the_newest_when_it_was_sent(
    database: Database, new_log: Callable[..., NewGraspLog]
) -> None:
    found = []
    with database.write() as session:
        for number in range(3):
            log = new_log(sha256=f"{number:064}")
            log_id = grasp_logs.add(session, log)
            jobs.add(session, "ingest", "ols", material_id=None, grasp_log_id=log_id)
            found.append(grasp_logs.get(session, log_id).calibration)
            calibrations.add(session, log.sensor, NEW)
    assert found == [None, 1, 2]
