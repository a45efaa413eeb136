"""Options and arguments that several commands have, each with its help, once."""

from pathlib import Path
from typing import Annotated

import typer

from estimators.method_names import METHODS, PLANNING_METHODS

Log = Annotated[
    Path,
    typer.Argument(help="A grasp log in any format of docs/formats.md: NPZ, Tac3D, tracked markers, MCAP, ROS bag, …"),
]
DETECTOR_HELP = "Slip detector (docs/detector.md); the best one where none is named."
METHOD_HELP = f"Estimator: {', '.join(METHODS[:-1])} or {METHODS[-1]}."
Logs = Annotated[list[Path], typer.Argument(help="Grasp logs of one material, each one grasp.")]


def png_path(path: Path | None) -> Path | None:
    """The path of a picture, refused where its name is no PNG's; raises ``typer.BadParameter``."""
    if path is not None and path.suffix.lower() != ".png":
        raise typer.BadParameter(f"{path.name}; allowed: a name that ends in .png")
    return path


def drawn_path(path: Path | None) -> Path | None:
    """The path of a picture, refused where its name is neither a PNG's nor an SVG's; raises ``typer.BadParameter``."""
    if path is not None and path.suffix.lower() not in (".png", ".svg"):
        raise typer.BadParameter(f"{path.name}; allowed: a name that ends in .png or .svg")
    return path


Picture = Annotated[Path | None, typer.Option(callback=png_path, help="Write a picture of slip over time to this PNG.")]
Scale = Annotated[float | None, typer.Option(help="Of tracked markers: m per pixel.")]
FrameRate = Annotated[float | None, typer.Option(help="Of tracked markers whose file counts frames: 1/s.")]
Mapping = Annotated[
    Path | None,
    typer.Option(
        "--mapping", help="A JSON file that says which column or field is what, or a preset: papillarray, uskin."
    ),
]
Rest = Annotated[
    str | None,
    typer.Option(help="Frame without contact: first, least contact, its number, or a file of the sensor alone."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for a program to read.")]
SensorModelFile = Annotated[
    Path | None,
    typer.Option("--sensor-model", help="Correct the log by this JSON, which `stiction sensors calibrate` writes."),
]
GelFile = Annotated[
    Path | None,
    typer.Option("--gel", help="Of a sensor without forces: a JSON file of its gel, by which they are reconstructed."),
]

Url = Annotated[str, typer.Option("--url", envvar="STICTION_URL", help="Address of the service.")]
Key = Annotated[str | None, typer.Option("--key", envvar="STICTION_KEY", help="Access key, where the service asks.")]
Limit = Annotated[int, typer.Option("--limit", min=1, help="So many at most.")]
MaterialName = Annotated[str, typer.Argument(help="Name of a material.")]
Method = Annotated[
    str,
    typer.Option(
        "--method", help=f"Whose current model: {', '.join(PLANNING_METHODS[:-1])}, or auto: the recommended one."
    ),
]
GraspingSensor = Annotated[
    str | None, typer.Option("--sensor", help="That grasps: friction as it shows it, where the model knows its gain.")
]
Velocity = Annotated[float, typer.Option("--velocity", help="Tangential velocity of the slip, m/s.")]
DEFAULT_URL = "http://127.0.0.1:8000"
