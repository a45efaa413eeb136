"""Commands on a service's sensors: list, describe."""

from collections.abc import Mapping
from typing import Annotated

import typer

from service.cli.output import print_json, print_table
from service.cli.remote import DEFAULT_URL, Json, Key, Url, connected
from service.formatting import number

app = typer.Typer(help="Show sensors, and describe their gels.", no_args_is_help=True)


@app.command("list")
def list_sensors(url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """List all sensors with the mechanics of their gels, where they are described."""
    with connected(url, key) as client:
        found = client.sensors()
    if json:
        print_json({"sensors": found})
    else:
        columns = ("sensor", "Young's modulus [Pa]", "Poisson's ratio", "thickness [m]", "marker depth [m]")
        print_table("Sensors", columns, [[each["name"], *_cells(each["gel"])] for each in found])


def _cells(gel: Mapping[str, float | None] | None) -> list[str]:
    """The mechanics of a gel; a thickness of None is that of a half-space."""
    if gel is None:
        return []
    thickness = gel["thickness"]
    own, depth = (number(gel[name]) for name in ("young_modulus", "poisson_ratio")), number(gel["marker_depth"])
    return [*own, "thick" if thickness is None else number(thickness), depth]


@app.command()
def describe(
    sensor: Annotated[str, typer.Argument(help="Name of the sensor, as its logs give it.")],
    young_modulus: Annotated[float, typer.Option(help="Young's modulus of the gel, Pa.")],
    poisson_ratio: Annotated[float, typer.Option(help="Poisson's ratio of the gel.")],
    thickness: Annotated[
        float | None, typer.Option(help="Surface to rigid base, m; without it the gel is thick against any contact.")
    ] = None,
    marker_depth: Annotated[float, typer.Option(help="Of the markers below the surface, m.")] = 0.0,
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Describe a sensor's gel, so that forces of its logs are reconstructed where they have none."""
    with connected(url, key) as client:
        client.describe_sensor(sensor, young_modulus, poisson_ratio, thickness, marker_depth)
    typer.echo(f"{sensor} is described: logs of it without forces get reconstructed ones from now on")
