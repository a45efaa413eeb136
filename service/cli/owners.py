"""Commands on the owners of a service's materials: list, add, remove."""

from typing import Annotated

import typer

from service.cli.connection import connected
from service.cli.options import DEFAULT_URL, Json, Key, MaterialName, Url
from service.cli.output import print_json

app = typer.Typer(help="Show and change whose a material is.", no_args_is_help=True)
Owner = Annotated[str, typer.Argument(help="A key such as key:3f9c2a7b51de, or a group of keys such as group:lab.")]


@app.command("list")
def list_owners(material: MaterialName, url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """Print the owners of a material, one a line; none: whoever has the scope may add to it."""
    with connected(url, key) as client:
        found = client.owners(material)
    if json:
        print_json({"owners": found})
    else:
        for owner in found:
            typer.echo(owner)


@app.command()
def add(material: MaterialName, owner: Owner, url: Url = DEFAULT_URL, key: Key = None) -> None:
    """Let a key or a group own a material, too."""
    with connected(url, key) as client:
        typer.echo(f"{material} belongs to {', '.join(client.add_owner(material, owner))}")


@app.command()
def remove(material: MaterialName, owner: Owner, url: Url = DEFAULT_URL, key: Key = None) -> None:
    """Take a material from an owner."""
    with connected(url, key) as client:
        client.remove_owner(material, owner)
    typer.echo(f"{material} does not belong to {owner} any more")
