"""Command that makes a log of images: `stiction track`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.inputs import refuse_inputs
from service.cli.options import Json
from service.cli.output import print_json, print_lines
from service.cli.progress import counted
from service.formatting import number
from service.whole_files import write_whole

if TYPE_CHECKING:
    from service.formats.marker_tracking import DotTracks

INSTALL = "the extra `images`, which brings it: pip install 'stiction[images]'"


def track(
    images: Annotated[list[Path], typer.Argument(help="Images of a marker gel, a folder of them, or one video.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The table of tracked markers to write (CSV).")],
    rate: Annotated[
        float | None, typer.Option(help="Frames a second, to be kept in the table; else what a video states.")
    ] = None,
    dark: Annotated[
        bool | None, typer.Option("--dark/--light", help="Whether dots are darker than the gel; else it is seen.")
    ] = None,
    json: Json = False,
) -> None:
    """Follow the dots of a marker gel through images, and write a table of tracked markers for the other commands."""
    from service.formats import import_with_library, tracked_markers

    low, high = tracked_markers.FRAME_RATE
    if rate is not None and not low <= rate <= high:
        raise typer.BadParameter(f"--rate {rate}; allowed: {low:g} to {high:g} 1/s")
    refuse_inputs(output, *images)
    reading = import_with_library("service.formats.marker_images", "images", INSTALL)
    tracking = import_with_library("service.formats.marker_tracking", "images", INSTALL)
    found = reading.find(images)
    seen = tracking.track(counted(found, found.stated or len(found.files), "images"), dark)
    frame_rate = found.frame_rate if rate is None else rate
    write_whole(output, lambda beside: tracked_markers.write(beside, seen.place, frame_rate))
    summary = _summary(seen, frame_rate)
    if json:
        print_json(summary)
    else:
        print_lines(f"{output.name}: tracked markers", _lines(summary))
    if found.stated and len(seen.place) < found.stated:
        typer.echo(f"{images[0].name} ends after {len(seen.place)} of the {found.stated} frames it states", err=True)
    if seen.largest_step > tracking.FAR * seen.dots.pitch:
        typer.echo("a marker moves so far between two frames that it may be taken for its neighbour", err=True)


def _summary(seen: "DotTracks", frame_rate: float | None) -> dict[str, Any]:
    return {
        "frames": seen.place.shape[0],
        "markers": seen.place.shape[1],
        "dark": seen.dots.dark,
        "radius": round(seen.dots.radius, 3),
        "pitch": round(seen.dots.pitch, 3),
        "lost_places": seen.lost_places,
        "largest_step": round(seen.largest_step, 3),
        "frame_rate": frame_rate,
    }


def _lines(summary: dict[str, Any]) -> list[tuple[str, str | None]]:
    kind, rate = "dark" if summary["dark"] else "light", summary["frame_rate"]
    return [
        ("frames", f"{summary['frames']}{'' if rate is None else f' at {number(rate)} a second'}"),
        ("markers", f"{summary['markers']}, {kind}, of radius {number(summary['radius'])} px"),
        ("distance between them", f"{number(summary['pitch'])} px"),
        ("lost", f"{summary['lost_places']} of {summary['frames'] * summary['markers']} places"),
        ("largest step", f"{number(summary['largest_step'])} px from one frame to the next"),
    ]
