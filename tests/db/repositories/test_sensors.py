from collections.abc import Callable
from dataclasses import replace

import pytest

from db.database import Database
from db.errors import NotFound
from db.paging import Window
from db.records import Gel, NewCalibration, NewGraspLog, Sensor
from db.repositories import calibrations, grasp_logs, sensors
from db.tables import SampleSummaryRow

GEL = Gel(2.5e5, 0.48, None, 0.0)


def test_a_gel_is_kept_with_its_sensor_and_replaced(database: Database) -> None:
    with database.write() as session:
        key = sensors.find_or_add(session, "seen")
        assert sensors.find_or_add(session, "seen") == key
        assert sensors.get(session, "seen") == Sensor(key, "seen", None)
        assert sensors.describe(session, "seen", Gel(1e6, 0.49, 4e-3, 1e-3)).gel == Gel(1e6, 0.49, 4e-3, 1e-3)
        sensors.describe(session, "seen", GEL)
        before = sensors.describe(session, "before", GEL)
    with database.read() as session:
        assert sensors.list_all(session) == [before, Sensor(key, "seen", GEL)]
        assert sensors.list_all(session, Window("name", limit=1)) == [before]
        assert sensors.list_all(session, Window("name", after=("before", before.id))) == [Sensor(key, "seen", GEL)]


def test_logs_are_counted_by_sensor(database: Database, new_log: Callable[..., NewGraspLog]) -> None:
    with database.write() as session:
        for sensor in ("left", "left", "right"):
            grasp_logs.add(session, replace(new_log(), sensor=sensor))
        left, right, unused = (sensors.find_or_add(session, name) for name in ("left", "right", "unused"))
        assert sensors.count_logs(session, [left, unused]) == {left: 2}
        assert sensors.count_logs(session, [left, right]) == {left: 2, right: 1}


def test_how_large_elements_are_is_known_by_logs_and_else_by_the_newest_calibration(
    database: Database, new_log: Callable[..., NewGraspLog]
) -> None:
    with database.write() as session:
        left, right = (sensors.find_or_add(session, name) for name in ("left", "right"))
        assert sensors.element_area(session, left) is None
        for area in (4e-6, 1e-6):
            calibrations.add(session, "left", NewCalibration((), {"element_area": area}, None, None))
        assert sensors.element_area(session, left) == 1e-6
        for area in (2e-6, 9e-6):
            log_id = grasp_logs.add(session, replace(new_log(), sensor="left"))
            session.add(
                SampleSummaryRow(
                    grasp_log_id=log_id, count=0, none_because="stuck", element_area=area, samples_blob="1" * 64
                )
            )
        assert sensors.element_area(session, left) == 2e-6
        assert sensors.element_area(session, right) is None


@pytest.mark.parametrize("name", ["other", "nul\0"])
def test_a_sensor_that_is_not_there_is_named(database: Database, name: str) -> None:
    with database.read() as session, pytest.raises(NotFound, match="sensor"):
        sensors.get(session, name)
