"""Commands that run a service: serve, demo."""

from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.exit_codes import FAILURE


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.")] = None,
    data_folder: Annotated[Path | None, typer.Option(help="Folder of the raw uploads and the SQLite file.")] = None,
    database_url: Annotated[str | None, typer.Option(help="SQLAlchemy URL in place of that SQLite file.")] = None,
) -> None:
    """Run the web service until it is told to stop (every setting: docs/settings.md)."""
    import uvicorn

    from service.serving import configuration
    from service.settings import Settings

    given: dict[str, Any] = {"host": host, "port": port, "data_folder": data_folder, "database_url": database_url}
    settings = Settings(**{name: value for name, value in given.items() if value is not None})
    server = uvicorn.Server(configuration(settings))
    server.run()
    if not server.started:  # its log says why
        raise typer.Exit(FAILURE)


def demo(
    output: Annotated[Path, typer.Option(help="Folder for the pictures, the report and the database.")],
    recordings: Annotated[
        Path | None, typer.Option(help="Folder of real Tac3D recordings; left out where it isn't there.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the simulated sensor noise and of the sampler.")] = 0,
) -> None:
    """Run the whole path on real input: recordings in, friction of each material, a planner's answer, a report."""
    from service.demo.run import run_demo

    run_demo(output, recordings, seed)
