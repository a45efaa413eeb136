import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from db.errors import DriverMissing
from service.demo.server import running_server
from service.observability import traces
from tests import forking
from tests.waiting import wait_until

STAGES = ["frames", "slip_state", "samples", "friction_model"]
CALLER = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


class Collector(BaseHTTPRequestHandler):
    """Takes spans in as a collector does, by OTLP over HTTP, and keeps them."""

    spans: list[Any]

    def do_POST(self) -> None:
        assert self.path == "/v1/traces"
        sent = ExportTraceServiceRequest.FromString(self.rfile.read(int(self.headers["content-length"])))
        for resource in sent.resource_spans:
            assert "stiction" in [each.value.string_value for each in resource.resource.attributes]
            self.spans.extend(span for scope in resource.scope_spans for span in scope.spans)
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def spans(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """What a collector on loopback was sent; the environment names it."""
    kept: list[Any] = []
    server = HTTPServer(("127.0.0.1", 0), type("Keeping", (Collector,), {"spans": kept}))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", f"http://127.0.0.1:{server.server_port}")
    monkeypatch.setenv("OTEL_BSP_SCHEDULE_DELAY", "50")
    yield kept
    server.shutdown()
    thread.join()
    server.server_close()


def attributes(span: Any) -> dict[str, str]:
    return {each.key: each.value.string_value for each in span.attributes}


@pytest.mark.parametrize("engine_name", ["postgresql", pytest.param("sqlite", marks=pytest.mark.long)], indirect=True)
def test_an_upload_is_one_trace_from_its_request_to_its_model(
    tmp_path: Path,
    new_url: Callable[..., str],
    spans: list[Any],
    monkeypatch: pytest.MonkeyPatch,
    content: bytes,
    upload: Any,
    wait: Any,
) -> None:
    monkeypatch.setenv("STICTION_DATABASE_URL", new_url(tmp_path))
    headers = {"traceparent": CALLER}
    monkeypatch.setattr(subprocess, "Popen", forking.Command)
    with running_server(tmp_path) as url, httpx.Client(base_url=url, headers=headers, timeout=60.0) as client:
        client.post("/v1/materials", json={"name": "paper"}).raise_for_status()
        job = upload(client, content, material="paper").json()["job"]["id"]
        assert wait(client, job)["status"] == "done"
        for _ in range(2):  # from the database, and from memory
            client.get("/v1/materials/paper/friction", params={"fn": 0.05}).raise_for_status()
    wait_until(lambda: "ingest" in [span.name for span in spans], "the trace")

    assert {span.trace_id.hex() for span in spans} == {CALLER[3:35]}
    by_name = {span.name: span for span in spans}
    request, ingest = by_name["POST /v1/grasp-logs"], by_name["ingest"]
    assert request.parent_span_id.hex() == CALLER[36:52]
    assert (attributes(request)["http.route"], attributes(request)["url.query"]) == ("/v1/grasp-logs", "REDACTED")
    assert (ingest.parent_span_id, attributes(ingest)["stiction.job"]) == (request.span_id, job)
    stages = [span for span in spans if span.parent_span_id == ingest.span_id]
    assert [span.name for span in sorted(stages, key=lambda span: span.start_time_unix_nano)] == STAGES
    assert [span.name for span in spans].count("GET /v1/materials/{name}/friction") == 2
    assert not [span for span in spans if "ready" in span.name]


def test_without_a_collector_nothing_is_imported_for_one() -> None:
    """Neither by the server nor by its workers."""
    code = "import sys; from service import app; from service.jobs import pipeline; "
    code += "from service.observability import traces; app.create_app(); traces.start()"
    code += "; print([name for name in sys.modules if name.startswith(('opentelemetry.sdk', 'opentelemetry.exp'))])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "[]\n"


def test_what_is_not_traced_has_no_place_and_no_span() -> None:
    assert traces.start() is None
    assert traces.place() is None
    with traces.span("ingest", CALLER, job="1"):
        assert traces.place() is None


def test_a_collector_without_the_library_stops_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", "http://127.0.0.1:1")
    monkeypatch.setitem(sys.modules, "service.observability.trace_export", None)
    with pytest.raises(DriverMissing, match=r"trace collector is http://127.0.0.1:1.*stiction\[otel\]"):
        traces.start()
    monkeypatch.setenv("OTEL_SDK_DISABLED", "true")
    assert traces.start() is None
