"""Spans on their way to a collector: named for the service, and without what somebody wrote into a query."""

from typing import Any

import pytest
from opentelemetry.sdk.resources import SERVICE_NAME
from opentelemetry.sdk.trace import TracerProvider

from service.observability import trace_export


@pytest.mark.parametrize(("attributes", "told"), [({"url.query": "key=secret", "a": 1}, "REDACTED"), ({"a": 1}, None)])
def test_a_query_is_struck_out(attributes: dict[str, Any], told: str | None) -> None:
    provider = TracerProvider()
    provider.add_span_processor(trace_export.Discreet())
    span: Any = provider.get_tracer("x").start_span("request", attributes=attributes)
    assert span.attributes.get("url.query") == told
    assert span.attributes["a"] == 1


@pytest.mark.parametrize(("named", "name"), [(None, "stiction"), ("grips", "grips")])
def test_spans_are_of_the_service_unless_it_is_named_otherwise(
    monkeypatch: pytest.MonkeyPatch, named: str | None, name: str
) -> None:
    monkeypatch.delenv("OTEL_SERVICE_NAME", raising=False)
    if named is not None:
        monkeypatch.setenv("OTEL_SERVICE_NAME", named)
    monkeypatch.setattr(trace_export, "OTLPSpanExporter", lambda: None)
    monkeypatch.setattr(trace_export, "BatchSpanProcessor", lambda _: trace_export.Discreet())
    assert trace_export.exporting().resource.attributes[SERVICE_NAME] == name
