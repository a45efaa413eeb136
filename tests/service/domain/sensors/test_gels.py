"""Names of sensors, and whose description of one counts."""

from dataclasses import replace
from typing import Any, cast

import pytest

from db.database import Database
from db.paging import Window
from db.records import AuditFilter, Gel, NewCalibration
from db.repositories import access_keys, audit, calibrations
from db.repositories import sensors as stored
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import InsufficientScope, InvalidValue, QuotaExceeded
from service.domain.resources.context import Context
from service.domain.sensors import gels, names
from service.settings import Settings

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
GEL = Gel(2e5, 0.48, 4e-3, 5e-4)
KEY = Principal("a" * 12, None, False)


@pytest.fixture
def context(database: Database) -> Context:
    nothing = cast(Any, None)
    with database.write() as session:
        access_keys.add(session, "a" * 12, "robot", "upload", "0" * 64)
    return Context(Settings(key_changes_a_day=2), database, nothing, nothing)


def test_a_gel_is_described_by_whoever_uploads_and_again_by_an_admin(context: Context, database: Database) -> None:
    assert gels.describe(context, "left", GEL, KEY).gel == GEL
    assert gels.describe(context, "left", GEL, KEY).gel == GEL  # nothing changes
    stiffer = replace(GEL, young_modulus=3e5)
    with pytest.raises(InsufficientScope, match="the key has scope upload; this needs admin"):
        gels.describe(context, "left", stiffer, KEY)
    found = gels.find(context, "left")
    assert (found.gel, found.described_by) == (GEL, "a" * 12)
    assert gels.describe(context, "left", stiffer, ANONYMOUS).gel == stiffer
    assert gels.find(context, "left").gel == stiffer
    assert gels.describe(context, "right", GEL, replace(KEY, is_admin=True)).described_by is None
    assert gels.find(context, "left").described_by is None
    with database.read() as session:
        told = audit.list_all(session, Window("id"), AuditFilter())
    assert [(each.action, each.subject, each.details["young_modulus"]) for each in told] == [
        ("sensor.described", "left", 2e5),
        ("sensor.described", "left", 3e5),
        ("sensor.described", "right", 2e5),
    ]


def test_a_gel_too_thin_for_its_markers_is_refused_where_their_distance_is_known(
    context: Context, database: Database
) -> None:
    thin = Gel(2e5, 0.48, 1e-6, 0.0)
    assert gels.describe(context, "new", thin, ANONYMOUS).gel == thin
    with database.write() as session:
        stored.find_or_add(session, "left")
        calibrations.add(session, "left", NewCalibration((), {"element_area": 1e-6}, None, None))
    with pytest.raises(InvalidValue, match=r"^thickness is 1e-06; allowed: 0\.0001 m or more, 0\.1 of the distance"):
        gels.describe(context, "left", thin, ANONYMOUS)
    assert gels.find(context, "left").gel is None
    half_space = replace(thin, thickness=None)
    assert gels.describe(context, "left", half_space, ANONYMOUS).gel == half_space


def test_an_admin_who_says_the_same_vouches_for_a_description(context: Context, database: Database) -> None:
    """Logs told for good whose gel it is, also where it is right, and that an admin was to describe it."""
    gels.describe(context, "left", GEL, KEY)
    for _ in range(2):
        assert gels.describe(context, "left", GEL, ANONYMOUS) == gels.find(context, "left")
        assert gels.find(context, "left").described_by is None
    assert gels.describe(context, "left", GEL, KEY).described_by is None
    with database.read() as session:
        told = audit.list_all(session, Window("id"), AuditFilter())
    assert [(each.actor.name, each.action) for each in told] == [
        ("key:aaaaaaaaaaaa", "sensor.described"),
        ("anybody", "sensor.described"),
    ]


def test_a_key_describes_as_many_sensors_a_day_as_it_may(context: Context) -> None:
    for name in ("left", "right"):
        gels.describe(context, name, GEL, KEY)
    with pytest.raises(QuotaExceeded):
        gels.describe(context, "thumb", GEL, KEY)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("unknown", "allowed: a name of one sensor, which its uploads and streams give by `sensor`"),
        ("stream", "allowed: a name of one sensor"),
        ("left/calibrations", "allowed: a name without /calibrations, where calibrations are found"),
        ("left/calibrations/1", "allowed: a name without /calibrations"),
        (" left", "sensor is ' left'; allowed: a name without spaces at its ends"),
        ("left\t", "allowed: a name without spaces at its ends"),
        ("le\u200bft", "allowed: printable characters, as uploads have them"),
        ("\u202etfel", "allowed: printable characters"),
    ],
)
def test_a_name_is_that_of_one_sensor(context: Context, name: str, told: str) -> None:
    with pytest.raises(InvalidValue, match=told):
        gels.describe(context, name, GEL, ANONYMOUS)


@pytest.mark.parametrize("name", ["left hand", "calibrations", "left/calibrationsX", "Stream"])
def test_a_name_may_resemble_one_that_is_taken(context: Context, name: str) -> None:
    assert gels.describe(context, name, GEL, ANONYMOUS).name == name


def test_spaces_at_the_ends_are_kept_where_a_sensor_is_stored_so(database: Database) -> None:
    with database.write() as session:
        assert names.as_found(session, " left ") == "left"
        assert names.as_found(session, "  ") == "unknown"
        stored.hold(session, " left ")
        stored.describe(session, " left ", GEL)
        assert names.as_found(session, " left ") == " left "
        names.check_spelling(session, " left ")


def test_a_name_that_an_earlier_version_took_may_be_described_anew(database: Database) -> None:
    with database.write() as session:
        stored.hold(session, "le\x7fft")
        names.check_spelling(session, "le\x7fft")


@pytest.mark.usefixtures("context")
def test_logs_without_a_name_count_as_of_one_sensor() -> None:
    assert [names.grasping(name) for name in ("unknown", "stream", "left", "Stream")] == [
        "unknown",
        "unknown",
        "left",
        "Stream",
    ]
