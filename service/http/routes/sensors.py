"""Sensors, and what is known of their gels."""

from typing import Annotated

from fastapi import APIRouter, Path

from service.domain import sensors
from service.http.access import READ, UPLOAD, CurrentPrincipal
from service.http.bodies import JsonRoute
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.problems import (
    INVALID_REQUEST,
    STORAGE_UNAVAILABLE,
    UNKNOWN_SENSOR,
    UNSUPPORTED_FORMAT,
    UPLOAD_TOO_LARGE,
)
from service.http.schemas.common import Reference
from service.http.schemas.sensors import GelIn, SensorOut, SensorsOut

router = APIRouter(prefix="/v1/sensors", tags=["sensors"], route_class=JsonRoute)

SensorName = Annotated[
    Reference,
    Path(min_length=1, max_length=200, description="As its logs name it.", examples=["GelSight Mini"]),
]


@router.get("", dependencies=[READ], summary="List sensors", responses=problems(STORAGE_UNAVAILABLE))
def list_sensors(context: CurrentContext) -> SensorsOut:
    """All that logs come from or that were described, by name."""
    return SensorsOut(items=[SensorOut.of(each) for each in sensors.list_all(context)])


@router.get(
    "/{name:path}",
    dependencies=[READ],
    summary="Look at a sensor",
    responses=problems(UNKNOWN_SENSOR, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def read_sensor(context: CurrentContext, name: SensorName) -> SensorOut:
    """With the mechanics of its gel, where they are known."""
    return SensorOut.of(sensors.find(context, name))


@router.put(
    "/{name:path}",
    dependencies=[UPLOAD],
    summary="Describe a sensor's gel",
    responses=problems(UPLOAD_TOO_LARGE, UNSUPPORTED_FORMAT, INVALID_REQUEST, STORAGE_UNAVAILABLE),
)
def describe_sensor(context: CurrentContext, name: SensorName, gel: GelIn, principal: CurrentPrincipal) -> SensorOut:
    """From then on, forces of its logs that have none are reconstructed from the displacement of their markers."""
    return SensorOut.of(sensors.describe(context, name, gel.record(), principal))
