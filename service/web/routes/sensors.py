"""Sensors: the mechanics of their gels, their calibrations, their logs, and what was found against these."""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, Request, Response
from fastapi.params import Form
from fastapi.responses import RedirectResponse

from db.paging import Window
from db.records import Gel, LogFilter, Sensor, StoredGraspLog
from db.repositories import calibrations, grasp_logs
from db.repositories import sensors as stored_sensors
from service.domain.resources.context import Context
from service.domain.sensors import gels
from service.http.access import READ, UPLOAD, Access, CurrentPrincipal
from service.http.dependencies import CurrentContext
from service.http.paging import Page
from service.http.routes.sensors import SensorName
from service.http.schemas.common import CursorText
from service.http.schemas.sensors import GelIn
from service.web.forms import FormRoute, checked, revised, typed
from service.web.rendering import on_problem, render
from service.web.routes.materials import LOGS_ON_A_PAGE, ON_A_PAGE

router = APIRouter(include_in_schema=False, route_class=FormRoute)

SHOWN_CALIBRATIONS = 5
"""The newest of a sensor; the API has all."""

FIELDS = tuple(name for name in GelIn.model_fields if name != "relative_thickness")
"""In the form; a map of the thickness is kept, as the API or the command line gave it."""
FieldText = Annotated[str, Form(max_length=40)]


@router.get("/sensors", dependencies=[READ])
def list_sensors(context: CurrentContext, request: Request, cursor: CursorText = None) -> Response:
    """Those that logs come from or that were described, by name."""
    page = Page("name", ON_A_PAGE, cursor)
    with context.database.read() as session:
        found, after = page.cut(stored_sensors.list_all(session, page.window()))
        logs = stored_sensors.count_logs(session, [each.id for each in found])
    return render(request, "sensors.html", sensors=found, logs=logs, after=after)


@router.get("/sensors/{name:path}", dependencies=[READ])
def show_sensor(context: CurrentContext, request: Request, name: SensorName, cursor: CursorText = None) -> Response:
    """One sensor with its logs; raises ``NotFound``."""
    sensor = gels.find(context, name)
    return render(request, "sensor.html", **_shown(context, request, sensor, cursor), fields=_typed(sensor.gel))


@router.post("/sensors/{name:path}", dependencies=[UPLOAD])
def describe_sensor(
    context: CurrentContext,
    request: Request,
    principal: CurrentPrincipal,
    name: SensorName,
    young_modulus: FieldText = "",
    poisson_ratio: FieldText = "",
    thickness: FieldText = "",
    marker_depth: FieldText = "",
) -> Response:
    """Describe the gel of a known sensor, and show it; raises ``NotFound``, and as the API's route does."""
    fields = dict(zip(FIELDS, (young_modulus, poisson_ratio, thickness, marker_depth), strict=True))
    sensor = gels.find(context, name)
    on_problem(request, "sensor.html", **_shown(context, request, sensor, None), fields=fields)
    described = checked(GelIn, {each: text.strip() for each, text in fields.items()})
    if sensor.gel is not None and sensor.gel.relative_thickness is not None:
        rows = [list(row) for row in sensor.gel.relative_thickness]
        described = revised(GelIn, described.model_dump() | {"relative_thickness": rows})
    gels.describe(context, name, described.record(), principal)
    return RedirectResponse(f"/sensors/{quote(name, safe='')}", 303)


def _shown(context: Context, request: Request, sensor: Sensor, cursor: str | None) -> dict[str, Any]:
    """What the template needs beside the fields of its form."""
    page = Page("-created_at", LOGS_ON_A_PAGE, cursor, identity="hex")
    with context.database.read() as session:
        logs, after = page.cut(grasp_logs.list_all(session, page.window(), LogFilter(sensor=sensor.name)))
        newest = calibrations.list_all(session, sensor.name, Window("id", descending=True, limit=SHOWN_CALIBRATIONS))
    access: Access = request.state.access
    may_describe = access.allows("admin" if sensor.gel is not None else "upload")
    return {
        "sensor": sensor,
        "calibrations": newest,
        "logs": logs,
        "after": after,
        "findings": count_findings(logs),
        "may_describe": may_describe,
    }


def count_findings(logs: Sequence[StoredGraspLog]) -> list[tuple[str, int]]:
    """Names of what was found against logs, the most frequent first, each with the number of its logs."""
    found = (each.name for log in logs if log.detection is not None for each in log.detection.findings or ())
    return Counter(found).most_common()


def _typed(gel: Gel | None) -> dict[str, str]:
    """The form of what is known of a gel."""
    return {} if gel is None else {name: typed(getattr(gel, name)) for name in FIELDS}
