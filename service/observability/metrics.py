"""What a running service says of itself at ``/metrics``, in the text format of Prometheus."""

import threading
import time
from datetime import datetime, timedelta
from typing import Protocol

from prometheus_client import CollectorRegistry, Gauge, Histogram, generate_latest
from sqlalchemy.orm import Session
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from db.database import Database
from db.records import Job
from db.repositories import audit, grasp_logs, jobs
from db.tables import now
from service.observability.access_log import AccessLog

REQUEST_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0)
STAGE_BUCKETS = (0.001, 0.005, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0, 60.0)

OVERLAP = timedelta(seconds=60)
"""How long before another one a job may have ended and be seen after it: transactions end in their own order."""


class ScrubProgress(Protocol):
    """What was compared of the stored files: bytes, and how often all of them."""

    bytes: int
    passes: int


class Metrics:
    """Requests of this process; jobs of the whole service, as the database gives them, since this process began."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry(auto_describe=True)
        self.requests = Histogram(
            "stiction_request_seconds",
            "Time until a request was answered.",
            ("method", "route", "status"),
            buckets=REQUEST_BUCKETS,
            registry=self.registry,
        )
        self._stages = Histogram(
            "stiction_job_stage_seconds",
            "Time that each stage of a job took: frames, slip_state, samples, friction_model, material.",
            ("kind", "stage"),
            buckets=STAGE_BUCKETS,
            registry=self.registry,
        )
        self._jobs = Histogram(
            "stiction_job_seconds",
            "Time from a job's being stored to its end.",
            ("kind", "status"),
            buckets=STAGE_BUCKETS,
            registry=self.registry,
        )
        self._unfinished = Gauge("stiction_jobs", "Jobs that have not ended.", ("status",), registry=self.registry)
        self._logs = Gauge("stiction_grasp_logs", "Grasp logs that are stored.", registry=self.registry)
        self._deleted = Gauge(
            "stiction_deleted_uploads", "Grasp logs whose uploads were old and are deleted.", registry=self.registry
        )
        self._bytes = Gauge("stiction_upload_bytes", "Bytes of the uploads of the others.", registry=self.registry)
        self._damaged = Gauge(
            "stiction_damaged_files", "Stored files that were found damaged, ever.", registry=self.registry
        )
        self._scrubbed = Gauge(
            "stiction_scrubbed_bytes", "Bytes of stored files that this process has compared.", registry=self.registry
        )
        self._scrub_passes = Gauge(
            "stiction_scrub_passes", "Times that this process has compared all of them.", registry=self.registry
        )
        self._lock = threading.Lock()
        self._horizon = now()
        self._counted: dict[str, datetime] = {}

    def expose(self, database: Database, scrub: ScrubProgress | None = None) -> bytes:
        """Everything, as of now."""
        with self._lock:
            with database.read() as session:
                self._follow_jobs(session)
                count, deleted, size = grasp_logs.count_and_bytes(session)
                self._damaged.set(audit.count_of_service(session, "blob.damaged"))
            self._logs.set(count)
            self._deleted.set(deleted)
            self._bytes.set(size)
            if scrub is not None:
                self._scrubbed.set(scrub.bytes)
                self._scrub_passes.set(scrub.passes)
            return generate_latest(self.registry)

    def _follow_jobs(self, session: Session) -> None:
        for status, count in jobs.count_unfinished(session).items():
            self._unfinished.labels(status).set(count)
        for job in jobs.ended_since(session, self._horizon):
            if job.id not in self._counted and job.finished_at is not None:
                self._count(job, job.finished_at)
        newest = min(max(self._counted.values(), default=self._horizon), now())  # a host's clock may be ahead
        self._horizon = max(self._horizon, newest - OVERLAP)
        self._counted = {key: moment for key, moment in self._counted.items() if moment >= self._horizon}

    def _count(self, job: Job, finished_at: datetime) -> None:
        self._counted[job.id] = finished_at
        self._jobs.labels(job.kind, job.status).observe(
            max((finished_at - job.created_at).total_seconds(), 0.0)  # a clock may have been set back meanwhile
        )
        for stage, seconds in job.seconds.items():
            self._stages.labels(job.kind, stage).observe(seconds)


class Metering:
    """Times every request for the figures and for the log."""

    def __init__(self, app: ASGIApp, access_log: AccessLog) -> None:
        self.app, self._access_log = app, access_log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        begin, status = time.perf_counter(), 0

        async def noting(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self.app(scope, receive, noting)
        finally:
            route = getattr(scope.get("route"), "path", "none")
            request_id = scope.get("state", {}).get("request_id")
            self._access_log.record(scope["method"], route, status, time.perf_counter() - begin, request_id)
