"""Traces for OpenTelemetry, where the environment names a collector; elsewhere nothing is imported for them.

The framework makes the spans of requests. Those of jobs and their stages are made here, in the trace of the request
that asked for the job: its place in there is stored with the job.
"""

import os
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

from db.errors import DriverMissing

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import TracerProvider

ENDPOINTS = ("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT")
"""Variables of OpenTelemetry, either of which leads to a collector."""

_provider: "TracerProvider | None" = None


def start() -> "TracerProvider | None":
    """Trace what this process does from now on, where a collector is named; raises ``DriverMissing``."""
    global _provider
    endpoint = next((os.environ[name] for name in ENDPOINTS if os.environ.get(name)), None)
    is_off = os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true"
    if _provider is None and endpoint is not None and not is_off:
        try:
            from service.observability.trace_export import exporting
        except ModuleNotFoundError as error:
            raise DriverMissing(endpoint, error.name or str(error), "trace collector", "otel") from error
        _provider = exporting()
    return _provider


def span(name: str, parent: str | None = None, **attributes: str) -> AbstractContextManager[object]:
    """A part of a trace: of the one that ``parent`` is in (W3C traceparent), else of the present one."""
    if _provider is None:
        return nullcontext()
    from opentelemetry.propagate import extract

    context = None if parent is None else extract({"traceparent": parent})
    named = {f"stiction.{key}": value for key, value in attributes.items()}
    tracer = _provider.get_tracer("stiction")
    return tracer.start_as_current_span(name, context, attributes=named, record_exception=False)


def place() -> str | None:
    """Where in a trace we are, as W3C traceparent; None where nothing is traced."""
    if _provider is None:
        return None
    from opentelemetry.propagate import inject

    carrier: dict[str, Any] = {}
    inject(carrier)
    return carrier.get("traceparent")


def name_request(method: str, route: str) -> None:
    """Record a request that the framework did not route, under what it is known."""
    if _provider is not None:
        from opentelemetry.trace import get_current_span

        present = get_current_span()
        present.update_name(f"{method} {route}")
        present.set_attribute("http.route", route)
