"""The `stiction` command line: one module a group of commands."""

import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated, NoReturn

import typer

from service.cli import (
    accuracy,
    audit,
    benchmark,
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
    tracking,
)
from service.cli.exit_codes import INPUT_REFUSED, INTERRUPTED, exit_code, message

app = typer.Typer(
    name="stiction",
    help="Friction identification for robotic grasping: what a held object's micro-slips show of its friction.",
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
    accuracy.accuracy,
    tracking.track,
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
app.add_typer(benchmark.app, name="benchmark")
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
        _leave("interrupted; nothing is left half written", INTERRUPTED)
    except Exception as error:
        garbled = _garbled(sys.argv[1:] if arguments is None else arguments)
        if isinstance(error, UnicodeEncodeError) and garbled is not None:
            _leave(f"argument {garbled!a} is not UTF-8; allowed: UTF-8, but in names of files", INPUT_REFUSED)
        code = exit_code(error)
        if code is None:
            raise
        _leave(message(error), code)


def _leave(message: str, code: int) -> NoReturn:
    typer.echo(f"stiction: {message}", err=True)
    sys.exit(code)


def _garbled(arguments: Sequence[str]) -> str | None:
    """The first argument that is not what its system's encoding can read: no database and no address takes it."""
    return next((each for each in arguments if any("\ud800" <= letter <= "\udfff" for letter in each)), None)
