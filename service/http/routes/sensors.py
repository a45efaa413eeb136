"""Sensors, and what is known of their gels and faults."""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from db.repositories import calibrations
from db.repositories import sensors as stored_sensors
from service.domain.sensors import gels
from service.domain.sensors.calibrate import calibrate
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.bodies import JsonRoute
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.paging import LARGEST_ID, Page, link_next
from service.http.problems import (
    FILE_DELETED,
    INVALID_REQUEST,
    QUOTA_EXCEEDED,
    STORAGE_UNAVAILABLE,
    TOO_MANY_UPLOADS,
    UNKNOWN_CALIBRATION,
    UNKNOWN_GRASP_LOG,
    UNKNOWN_SENSOR,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.http.schemas.common import MOST, USUAL, CursorText, Limit, Reference
from service.http.schemas.sensors import (
    CalibrationOut,
    CalibrationsOut,
    GelIn,
    NewCalibrationIn,
    SensorOut,
    SensorsOut,
)

router = APIRouter(prefix="/v1/sensors", tags=["sensors"], route_class=JsonRoute)

SensorName = Annotated[
    Reference,
    Path(min_length=1, max_length=200, description="As its logs name it.", examples=["GelSight Mini"]),
]


@router.get("", dependencies=[READ], summary="List sensors", responses=problems(INVALID_REQUEST, STORAGE_UNAVAILABLE))
def list_sensors(
    context: CurrentContext, request: Request, response: Response, limit: Limit = MOST, cursor: CursorText = None
) -> SensorsOut:
    """Those that logs come from or that were described, by name."""
    page = Page("name", limit, cursor)
    with context.database.read() as session:
        found, after = page.cut(stored_sensors.list_all(session, page.window()))
    return SensorsOut(items=[SensorOut.of(each) for each in found], next=link_next(request, response, after))


@router.post(
    "/{name:path}/calibrations",
    dependencies=[UPLOAD],
    summary="Calibrate a sensor",
    status_code=201,
    responses=problems(
        UNKNOWN_SENSOR, UNKNOWN_GRASP_LOG, FILE_DELETED, TOO_MANY_UPLOADS, UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT,
        INVALID_REQUEST, STORAGE_UNAVAILABLE,
    ),
)  # fmt: skip
async def create_calibration(
    context: CurrentContext, name: SensorName, new: NewCalibrationIn, principal: CurrentPrincipal
) -> CalibrationOut:
    """By logs of a body pressed straight down and lifted. Its logs that come in from then on are corrected by it."""
    return CalibrationOut.of(await calibrate(context, name, [press.record() for press in new.presses], principal))


@router.get(
    "/{name:path}/calibrations",
    dependencies=[READ],
    summary="List versions of a sensor's calibration",
    responses=problems(UNKNOWN_SENSOR, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def list_calibrations(
    context: CurrentContext,
    request: Request,
    response: Response,
    name: SensorName,
    limit: Limit = USUAL,
    cursor: CursorText = None,
) -> CalibrationsOut:
    """Newest first."""
    page = Page("-id", limit, cursor)
    with context.database.read() as session:
        stored_sensors.get(session, name)
        found, after = page.cut(calibrations.list_all(session, name, page.window()))
    return CalibrationsOut(items=[CalibrationOut.of(each) for each in found], next=link_next(request, response, after))


@router.get(
    "/{name:path}/calibrations/{version}",
    dependencies=[READ],
    summary="Look at a version of a sensor's calibration",
    responses=problems(UNKNOWN_CALIBRATION, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_calibration(
    context: CurrentContext, name: SensorName, version: Annotated[int, Path(ge=1, le=LARGEST_ID)]
) -> CalibrationOut:
    """What was found, each quantity with its interval or the reason why it is not known, and from which logs."""
    with context.database.read() as session:
        return CalibrationOut.of(calibrations.get(session, name, version))


@router.get(
    "/{name:path}",
    dependencies=[READ],
    summary="Look at a sensor",
    responses=problems(UNKNOWN_SENSOR, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_sensor(context: CurrentContext, name: SensorName) -> SensorOut:
    """With the mechanics of its gel, where they are known."""
    return SensorOut.of(gels.find(context, name))


@router.put(
    "/{name:path}",
    dependencies=[UPLOAD],
    summary="Describe a sensor's gel",
    responses=problems(QUOTA_EXCEEDED, UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def describe_sensor(context: CurrentContext, name: SensorName, gel: GelIn, principal: CurrentPrincipal) -> SensorOut:
    """From then on, forces of its logs that have none are reconstructed from the displacement of their markers."""
    return SensorOut.of(gels.describe(context, name, gel.record(), principal))
