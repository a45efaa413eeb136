"""Figures for a monitor."""

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response
from prometheus_client import CONTENT_TYPE_LATEST

from service.http.access import READ
from service.http.dependencies import CurrentContext
from service.http.descriptions import problems
from service.http.fair_route import FairRoute
from service.http.problems import STORAGE_UNAVAILABLE
from service.observability.metrics import Metrics

router = APIRouter(tags=["health"], route_class=FairRoute)

_TEXT: dict[int | str, dict[str, Any]] = {
    200: {"content": {"text/plain": {}}, "description": "In the text format of Prometheus."}
}


async def _metrics(request: Request) -> Metrics:
    metrics: Metrics = request.app.state.metrics
    return metrics


@router.get(
    "/metrics",
    dependencies=[READ],
    summary="Figures for a monitor",
    response_class=Response,
    responses=problems(STORAGE_UNAVAILABLE) | _TEXT,
)
def read_metrics(context: CurrentContext, metrics: Annotated[Metrics, Depends(_metrics)]) -> Response:
    """Requests, jobs and their stages, and what is stored (docs/operations.md)."""
    return Response(metrics.expose(context.database, context.scrub), media_type=CONTENT_TYPE_LATEST)
