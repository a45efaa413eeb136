import pytest

from db.database import Database
from db.errors import NotFound
from db.records import Gel, Sensor
from db.repositories import sensors

GEL = Gel(2.5e5, 0.48, None, 0.0)


def test_a_gel_is_kept_with_its_sensor_and_replaced(database: Database) -> None:
    with database.write() as session:
        key = sensors.find_or_add(session, "seen")
        assert sensors.find_or_add(session, "seen") == key
        assert sensors.get(session, "seen") == Sensor("seen", None)
        assert sensors.describe(session, "seen", Gel(1e6, 0.49, 4e-3, 1e-3)).gel == Gel(1e6, 0.49, 4e-3, 1e-3)
        sensors.describe(session, "seen", GEL)
        sensors.describe(session, "before", GEL)
    with database.read() as session:
        assert sensors.list_all(session) == [Sensor("before", GEL), Sensor("seen", GEL)]


@pytest.mark.parametrize("name", ["other", "nul\0"])
def test_a_sensor_that_is_not_there_is_named(database: Database, name: str) -> None:
    with database.read() as session, pytest.raises(NotFound, match="sensor"):
        sensors.get(session, name)
