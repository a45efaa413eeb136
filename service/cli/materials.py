"""Commands on the materials of a running service: list, show, fit, rename, merge, begin an epoch."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.connection import connected
from service.cli.exit_codes import CODE_OF_STATUS
from service.cli.options import DEFAULT_URL, Json, Key, MaterialName, Method, Url
from service.cli.output import print_json, print_lines, print_table, when
from service.formatting import interval, number

if TYPE_CHECKING:
    from stiction_client import FrictionModel, Material

app = typer.Typer(help="Look at the materials of a service, and look after them.", no_args_is_help=True)


@app.command("list")
def list_materials(url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """List all materials with the friction that the recommended model expects in the middle of what was observed."""
    with connected(url, key) as client:
        found = client.materials()
    if json:
        print_json({"materials": [asdict(material) for material in found]})
    else:
        columns = ("name", "grasp logs", "μ", "method", "support", "made")
        print_table("Materials", columns, [_row(material) for material in found])


@app.command()
def show(material: MaterialName, url: Url = DEFAULT_URL, key: Key = None, json: Json = False) -> None:
    """Show a material's current model of each method: coefficients with their 95 % intervals."""
    with connected(url, key) as client:
        found = client.material(material)
    if json:
        print_json(asdict(found))
        return
    about = [
        ("grasp logs", str(found.grasp_logs)),
        ("made", when(found.created_at)),
        ("recommended", found.recommended),
        ("support", _support(found)),
    ]
    print_lines(found.name, [("about", found.description or None), *about])
    columns = ("method", "version", "β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]", "samples")
    print_table("", columns, [_model_row(model) for model in found.models.values()])


@app.command()
def fit(
    material: MaterialName,
    method: Method = "auto",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sampler.")] = 0,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Fit a material again over the samples of all its logs, and wait until that is done."""
    with connected(url, key) as client:
        job = client.wait(client.fit(material, method, seed))
    if json:
        print_json(asdict(job))
    else:
        typer.echo(f"{material}: {job.status}, {job.reason or f'version {job.model_version} by {method}'}")
    raise typer.Exit(CODE_OF_STATUS.get(job.status, 0))


@app.command()
def rename(
    material: MaterialName,
    new_name: Annotated[str, typer.Argument(help="What it is called from now on; the old name goes on to lead to it.")],
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Give a material another name."""
    with connected(url, key) as client:
        typer.echo(f"{material} is {client.rename_material(material, new_name).name} now")


@app.command()
def merge(
    material: MaterialName,
    source: Annotated[str, typer.Argument(help="The material whose logs and names move here, for good.")],
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Move all logs of another material here: two names of one thing."""
    with connected(url, key) as client:
        typer.echo(f"{source} is part of {client.merge_materials(material, source).name} now")


@app.command()
def begin_epoch(
    material: MaterialName,
    reason: Annotated[str, typer.Option(help="What is different now; kept with each log that is withdrawn.")],
    first: Annotated[
        str | None, typer.Option(help="Id of the first log that counts; without it none until now does.")
    ] = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
) -> None:
    """Withdraw all logs from before a material's surface changed; they stay as history."""
    with connected(url, key) as client:
        found = client.begin_epoch(material, reason, first)
    left = found.grasp_logs - found.withdrawn_grasp_logs
    typer.echo(f"{left} of the {found.grasp_logs} logs of {found.name} count")


def _row(material: "Material") -> list[str | None]:
    name, made, logs = material.name, when(material.created_at), str(material.grasp_logs)
    model = material.models.get(material.recommended or "")
    if model is None:
        return [name, logs, None, None, None, made]
    middle = 0.5 * sum(model.domain.normal_force)
    expected = float(model.predict(0.0, middle))
    friction = number(expected) if expected > 0.0 else None
    return [name, logs, friction, model.method, model.support_at(0.0, middle).kind, made]


def _support(material: "Material") -> str | None:
    """What the recommended model rests on in the middle of its data, and what to do about it."""
    model = material.models.get(material.recommended or "")
    if model is None:
        return None
    support = model.support_at(0.0, 0.5 * sum(model.domain.normal_force))
    return f"{support.kind}: {support.advice}"


def _model_row(model: "FrictionModel") -> list[str | None]:
    shown = zip(model.coefficients, model.interval(0.95), strict=True)
    cells = [f"{number(value)} ({interval(bounds)})" for value, bounds in shown]
    return [model.method, str(model.version), *cells, number(model.scale), str(model.n)]
