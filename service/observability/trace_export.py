"""What is imported only where traces are wanted: spans on their way to a collector."""

import multiprocessing
import os
from multiprocessing.util import Finalize

from opentelemetry.context import Context
from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import SERVICE_NAME, Resource
from opentelemetry.sdk.trace import Span, SpanProcessor, TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor

QUERY = "url.query"


class Discreet(SpanProcessor):
    """Strikes queries out: somebody may have written a key into one."""

    def on_start(self, span: Span, parent_context: Context | None = None) -> None:  # noqa: ARG002
        """Look at a new span."""
        if span.attributes is not None and QUERY in span.attributes:
            span.set_attribute(QUERY, "REDACTED")


def exporting() -> TracerProvider:
    """Spans of this process, sent off in the background as the environment says (``OTEL_…``), the last at its end."""
    name = {} if "OTEL_SERVICE_NAME" in os.environ else {SERVICE_NAME: "stiction"}
    provider = TracerProvider(resource=Resource.create(name))
    provider.add_span_processor(Discreet())
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    if multiprocessing.parent_process() is not None:  # such a process runs no ``atexit``
        Finalize(None, provider.shutdown, exitpriority=0)
    return provider
