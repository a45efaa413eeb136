"""The `stiction` command line: one module a group of commands."""

import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from service.cli import (
    audit,
    blobs,
    database,
    jobs,
    keys,
    local,
    logs,
    materials,
    owners,
    remote,
    reporting,
    running,
    scenes,
    sensors,
    simulation,
    streaming,
)
from service.cli.exit_codes import INTERRUPTED, exit_code, message

app = typer.Typer(
    name="stiction",
    help="Friction identification for robotic grasping: what a held object's micro-slips tell of its friction.",
    epilog="Exit codes: 0 done, 1 failure, 2 wrong usage, 3 input refused, 4 service unreachable or refusing, "
    "5 no force holds the load, 130 interrupted. More: docs/cli.md.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"stiction {version('stiction')}")
        raise typer.Exit


@app.callback()
def _about(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and leave.")
    ] = False,
) -> None:
    """Without a docstring of its own: the help is the application's."""


for command in (
    running.demo,
    running.serve,
    running.worker,
    simulation.simulate,
    simulation.campaign,
    local.detect,
    local.check,
    local.fit,
    local.convert,
    local.export,
    remote.upload,
    remote.lookup,
    remote.plan,
    streaming.stream,
    reporting.report,
    audit.audit,
    scenes.check_scene,
):
    app.command()(command)
app.command("next")(remote.next_grasp)
app.command("open")(running.open_dashboard)
app.add_typer(materials.app, name="materials")
app.add_typer(logs.app, name="logs")
app.add_typer(jobs.app, name="jobs")
app.add_typer(owners.app, name="owners")
app.add_typer(sensors.app, name="sensors")
app.add_typer(sensors.app, name="sensor", hidden=True)  # as people say it of one
app.add_typer(database.app, name="db")
app.add_typer(blobs.app, name="blobs")
app.add_typer(keys.app, name="keys")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command and leave with its documented exit code."""
    try:
        app(arguments)
    except (SystemExit, KeyboardInterrupt) as end:
        if isinstance(end, SystemExit) and end.code != INTERRUPTED:
            raise
        typer.echo("stiction: interrupted; nothing is left half written", err=True)
        sys.exit(INTERRUPTED)
    except Exception as error:
        code = exit_code(error)
        if code is None:
            raise
        typer.echo(f"stiction: {message(error)}", err=True)
        sys.exit(code)
