"""The application: stores opened, jobs taken up, routes and problems put together."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, closing
from functools import partial
from typing import NamedTuple

from fastapi import FastAPI

from db import identity, migrate
from db.blobs import BlobStore, open_blobs
from db.database import Database
from db.repositories import runners
from service.domain.access import keys
from service.domain.models.model_cache import ModelCache
from service.formats.reading import Readers
from service.http import access, errors, openapi
from service.http.context import ServerContext
from service.http.middleware.authentication import Authentication, Authenticator
from service.http.middleware.fair_starts import FairStarts
from service.http.middleware.head_requests import HeadRequests
from service.http.middleware.lookups import Lookups
from service.http.middleware.own_cookie import OwnCookie
from service.http.middleware.request_middleware import RequestMiddleware
from service.http.middleware.start_refusal import StartRefusal
from service.http.routes import (
    audit,
    curation,
    grasp_logs,
    health,
    jobs,
    materials,
    metrics,
    owners,
    planning,
    sensors,
    stream,
)
from service.jobs.executors import executor_for_short_jobs, executors
from service.jobs.retention import Retention
from service.jobs.runner import JobRunner
from service.jobs.scrub import Scrub
from service.jobs.spool_sweep import SpoolSweep
from service.jobs.webhook import Webhook
from service.jobs.worker import StoreConfig
from service.observability import traces
from service.observability.access_log import AccessLog
from service.observability.metrics import Metering, Metrics
from service.observability.store_watch import StoreWatch
from service.processes import data_folder, private_files
from service.processes.fair_threads import FairThreads
from service.processes.folder_lock import shared
from service.settings import Settings
from service.stream.sessions import Streams
from service.web.problem_pages import ProblemPages
from service.web.routes import pages

UNTRACED = access.PUBLIC_PATHS | {"/metrics"}
"""Paths of which a monitor asks all the time."""

DESCRIPTION = """Friction of what a robot holds, identified from the micro-slips of a grasp that still holds.

Upload grasp logs of a material, wait for their jobs, and look up the friction coefficient. SI units throughout.
Errors are problem details (RFC 9457) with stable types."""


def create_app(settings: Settings | None = None) -> FastAPI:
    """The web service as an ASGI application; without ``settings``, those of the environment."""
    chosen, provider = settings or Settings(), traces.start()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        try:
            async with running(chosen, check=keys.check_start) as context:
                app.state.context = context
                yield
        except Exception as error:
            app.state.start_error = error
            raise
        finally:
            access_log.flush()

    app = openapi.DescribedApp(
        title="Stiction",
        description=DESCRIPTION,
        version="1",
        lifespan=lifespan,
        redirect_slashes=False,
        docs_url=None,  # the framework's own pages load their scripts from elsewhere
        redoc_url=None,
        telemetry={
            "tracing": provider is not None,
            "tracer_provider": provider,
            "metrics": False,
            "logs": False,
            "operation_spans": False,
            "auto_configure": False,
            "exclude": lambda scope: scope["path"] in UNTRACED,
        },
    )
    for module in (health, metrics, materials, owners, grasp_logs, curation, sensors, planning, jobs, stream, audit):
        app.take(module.router)
    app.take(pages.router)
    access.check_routes(app)
    app.state.metrics = Metrics()
    access_log = AccessLog(app.state.metrics.requests)
    authenticator = app.state.authenticator = Authenticator(chosen)
    app.add_middleware(Authentication, authenticator=authenticator)
    app.add_middleware(HeadRequests)
    app.add_middleware(RequestMiddleware)
    app.add_middleware(ProblemPages)
    app.add_middleware(FairStarts, authenticator=authenticator)
    app.add_middleware(Metering, access_log=access_log)
    app.add_middleware(Lookups, authenticator=authenticator, access_log=access_log)
    app.add_middleware(OwnCookie)
    app.add_middleware(StartRefusal)
    errors.install(app)
    return app


@asynccontextmanager
async def running(
    settings: Settings, check: Callable[[Settings, Database], None] | None = None
) -> AsyncIterator[ServerContext]:
    """Open the stores, which must belong together, and take up unfinished jobs; at the end, stop in opposite order.

    ``check`` may raise what stops the start.
    """
    private_files.withhold()
    data_folder.prepare(settings.data_folder)
    with closing(Database(settings.resolved_database_url)) as database:
        blobs = open_blobs(settings.data_folder, settings.blob_url, settings.blob_cache_bytes)
        with shared(settings.data_folder, partial(_enter, settings, database, blobs, check)):
            runner = _job_runner(settings, database)
            for_clients, for_the_store = FairThreads(), FairThreads()
            readers = Readers(
                settings.read_seconds, settings.readers, settings.reading_bytes, for_clients, blobs.folder
            )
            streams = Streams(settings.stream_sessions_per_key, settings.stream_bytes)
            await runner.start()
            threads = _background(settings, database, blobs, runner)
            for thread in threads:
                thread.start()
            try:
                models = ModelCache(settings.lookup_seconds)
                yield ServerContext(
                    settings,
                    database,
                    blobs,
                    runner,
                    readers,
                    models,
                    threads=for_clients,
                    store_threads=for_the_store,
                    streams=streams,
                    scrub=threads.scrub,
                    watch=threads.watch,
                )
            finally:
                for thread in threads:
                    await thread.stop()
                await streams.stop()
                await runner.stop()
                await readers.stop()
                for_clients.stop()
                for_the_store.stop()


def _job_runner(settings: Settings, database: Database) -> JobRunner:
    """What runs jobs, in processes that open the stores by themselves."""
    config = StoreConfig(
        database.url,
        settings.data_folder,
        settings.blob_url,
        settings.blob_cache_bytes,
        settings.job_memory_bytes,
        settings.scatter_from_other_materials,
    )
    chosen = config, settings.workers, settings.dask_address, settings.job_cpu_seconds
    return JobRunner(
        database,
        executors(*chosen),
        executor_for_short_jobs(*chosen),
        attempts=settings.job_attempts,
        lease_seconds=settings.lease_seconds,
        poll_seconds=settings.poll_seconds,
        shutdown_seconds=settings.shutdown_seconds,
    )


class Background(NamedTuple):
    """What runs beside requests and jobs; all but the watch and the sweep only where the runner leads."""

    retention: Retention
    scrub: Scrub
    watch: StoreWatch
    webhook: Webhook
    sweep: SpoolSweep


def _background(settings: Settings, database: Database, blobs: BlobStore, runner: JobRunner) -> Background:
    """None of it started."""

    def leads() -> bool:
        return runner.leads

    retention = Retention(
        database,
        blobs,
        settings.keep_uploads_days,
        leads,
        unreferenced_days=settings.keep_unreferenced_days,
        audit_days=settings.keep_audit_days,
    )
    return Background(
        retention,
        Scrub(database, blobs, settings.scrub_bytes_per_second, leads),
        StoreWatch(database, blobs, settings.least_free_bytes),
        Webhook(database, settings.webhook_url, settings.webhook_secret, leads),
        SpoolSweep(blobs),
    )


def _enter(
    settings: Settings,
    database: Database,
    blobs: BlobStore,
    check: Callable[[Settings, Database], None] | None,
    alone: bool,
) -> None:
    if settings.migrate_at_start:
        identity.verify_before_upgrade(database, blobs)
        migrate.upgrade(database)
    else:
        migrate.check(database)
    identity.join(database, blobs, alone=alone)
    if check is not None:
        check(settings, database)
    if alone:
        if database.is_sqlite:  # whoever else worked on it worked in this folder
            _release_jobs_of_the_dead(database)
        blobs.clear_spool()


def _release_jobs_of_the_dead(database: Database) -> None:
    with database.write() as session:
        for dead in runners.list_all(session):
            runners.remove(session, dead.id)
