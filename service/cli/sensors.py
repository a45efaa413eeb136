"""Commands on a service's sensors: list, describe."""

from typing import Annotated

import typer

from service.cli.output import print_table
from service.cli.remote import DEFAULT_URL, Key, Url, connected

app = typer.Typer(help="Show sensors, and describe their gels.", no_args_is_help=True)


@app.command("list")
def list_sensors(url: Url = DEFAULT_URL, key: Key = None) -> None:
    """Print all sensors with the mechanics of their gels, where they are described."""
    columns = ("sensor", "young_modulus", "poisson_ratio", "thickness", "marker_depth")
    with connected(url, key) as client:
        rows = [[each["name"], *((each["gel"] or {}).get(name) for name in columns[1:])] for each in client.sensors()]
    print_table("Sensors", columns, [["" if cell is None else cell for cell in row] for row in rows])


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
