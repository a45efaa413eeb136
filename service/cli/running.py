"""Commands that run a service: serve, open, worker, demo."""

import logging
import os
import signal
import socket
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.exit_codes import FAILURE, exit_code
from service.cli.options import DEFAULT_URL, Url
from service.cli.output import print_table

if TYPE_CHECKING:
    from service.settings import Settings

logger = logging.getLogger(__name__)


DataFolder = Annotated[Path | None, typer.Option(help="Folder of the raw uploads and the SQLite file.")]
DatabaseUrl = Annotated[str | None, typer.Option(help="SQLAlchemy URL in place of that SQLite file.")]


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.")] = None,
    lookup_port: Annotated[
        int | None, typer.Option(help="Port of a second process for look-ups, which wait for no upload there.")
    ] = None,
    data_folder: DataFolder = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Run the web service until it is told to stop (every setting: docs/settings.md)."""
    from service.lookup_server import server_of
    from service.processes.side_process import SWITCH_SECONDS

    sys.setswitchinterval(SWITCH_SECONDS)  # who is answered by the event loop does not wait for threads
    settings = _settings(
        host=host, port=port, lookup_port=lookup_port, data_folder=data_folder, database_url=database_url
    )
    _prepare(settings)
    server = server_of(settings)
    with suppress(SystemExit):  # its own, of a start that failed
        server.run()
    if not server.started:
        error = getattr(getattr(server.config.app, "state", None), "start_error", None)
        if error is None:
            _require_address(settings)
        elif exit_code(error) is not None:
            raise error  # told once more: the log ends with what says nothing
        raise typer.Exit(FAILURE)


def open_dashboard(url: Url = DEFAULT_URL) -> None:
    """Show the dashboard of a running service in a browser; without a browser, print its address."""
    import webbrowser

    if not webbrowser.open(url):
        typer.echo(url)


def worker(
    workers: Annotated[int | None, typer.Option(help="Worker processes, or jobs at once on a Dask cluster.")] = None,
    data_folder: DataFolder = None,
    database_url: DatabaseUrl = None,
) -> None:
    """Do the jobs of a service, without its web side, until told to stop (every setting: docs/settings.md)."""
    import asyncio

    settings = _settings(workers=workers, data_folder=data_folder, database_url=database_url)
    if settings.workers == 0:
        raise typer.BadParameter("workers is 0; allowed: 1 to 64")
    _prepare(settings)
    asyncio.run(_work(settings))


async def _work(settings: "Settings") -> None:
    """Take jobs until told to stop; raises ``SchemaMismatch`` once the database is of a newer version."""
    import asyncio

    from service.app import running

    stopping = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stopping.set)
    async with running(settings) as context:
        ends = [asyncio.ensure_future(end) for end in (stopping.wait(), context.jobs.until_outdated())]
        done, waiting = await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
        for end in waiting:
            end.cancel()
    for end in done:
        end.result()


def demo(
    output: Annotated[Path, typer.Option(help="Folder for the pictures, the report and the database.")],
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of real Tac3D recordings; left out where it isn't there.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated sensor noise and of the sampler.")] = 0,
) -> None:
    """Run the whole path on real input: recordings in, friction of each material, a planner's answer, a report."""
    from service.demo.run import run_demo

    run_demo(output, recordings, seed, partial(print_table, width=100))


def _require_address(settings: "Settings") -> None:
    """Raises ``OSError`` where this machine cannot listen at the address and the port."""
    try:
        with socket.create_server((settings.host, settings.port), family=_family(settings.host)):
            pass
    except (OSError, UnicodeError) as error:
        named = f"STICTION_HOST (--host) is {settings.host!r} and STICTION_PORT (--port) {settings.port}"
        why = getattr(error, "strerror", None) or error
        raise OSError(f"{named}: {why}; allowed: an address of this machine, and a free port") from error


def _family(host: str) -> socket.AddressFamily:
    return socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]


def _prepare(settings: "Settings") -> None:
    from service.observability import logs
    from service.processes import freed_memory
    from service.settings import unknown_variables

    logs.configure(logs.Logs(settings.log_format, settings.log_level))
    for name in unknown_variables(os.environ):
        logger.warning("%s is set and is no setting; allowed: those of docs/settings.md", name)
    freed_memory.keep()


def _settings(**given: Any) -> "Settings":
    """Those of the environment, with what was given in their place."""
    from service.settings import Settings

    return Settings(**{name: value for name, value in given.items() if value is not None})
