"""Commands that ask a running service: upload, lookup, plan."""

from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.connection import connected
from service.cli.exit_codes import CODE_OF_STATUS
from service.cli.inputs import rest_of
from service.cli.options import (
    DEFAULT_URL,
    DETECTOR_HELP,
    FrameRate,
    GraspingSensor,
    Json,
    Key,
    Mapping,
    MaterialName,
    Method,
    Rest,
    Scale,
    Url,
    Velocity,
)
from service.cli.output import print_json, print_lines, print_table
from service.cli.progress import counted
from service.cli.sources import Source, found
from service.formatting import at_least, further_warning, number

if TYPE_CHECKING:
    from stiction_client import FrictionAnswer, FrictionClient, FrictionModel, NextGrasp, RequiredForce


LARGEST_AREA = 0.02
"""m², of a hand: whoever names a larger contact area is asked back."""


def upload(
    logs: Annotated[
        list[Path], typer.Argument(help="Grasp logs in any format of docs/formats.md, or folders of them.")
    ],
    material: Annotated[
        str | None, typer.Option(help="Material that was held; without it slip is only detected.")
    ] = None,
    sensor: Annotated[str | None, typer.Option(help="That recorded, in place of the one that the logs name.")] = None,
    detector: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    create: Annotated[bool, typer.Option("--create", help="Create the material if it isn't there.")] = False,
    wait: Annotated[bool, typer.Option(help="Wait for detection and fit.")] = True,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Upload grasp logs and wait until their slip is detected and the material's model is fitted."""
    from stiction_client import StictionError

    if create and material is None:
        raise typer.BadParameter("--create needs --material")
    sources = found(logs, mapping, scale=scale, frame_rate=frame_rate, rest=rest_of(rest))
    with connected(url, key) as client:
        if create and material is not None:
            client.ensure_material(material)
        asked = material, sensor, detector
        results: list[dict[str, Any]] = []
        try:
            sent = (_upload(client, each, wait, asked) for each in sources)
            results.extend(counted(sent, len(sources), "logs"))  # those before an error stay
        except (StictionError, KeyboardInterrupt):
            _print_broken_off(results, sources, json)
            raise
    _print_uploads(results, json)
    raise typer.Exit(max(CODE_OF_STATUS.get(result["status"], 0) for result in results))


def lookup(
    material: MaterialName,
    velocity: Velocity = 0.0,
    normal_force: Annotated[float | None, typer.Option(help="Normal force of one element, N.")] = None,
    quantile: Annotated[float | None, typer.Option(help="A quantile of μ, such as 0.05, in place of its mean.")] = None,
    elements: Annotated[
        int | None, typer.Option(min=1, help="The quantile of a contact of so many elements, not of one element.")
    ] = None,
    sensor: GraspingSensor = None,
    element_area: Annotated[
        float | None, typer.Option(help="Of the element that the force and their number are of, m²; else the model's.")
    ] = None,
    method: Method = "auto",
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Look a material's friction coefficient up."""

    with connected(url, key) as client:
        force, area = normal_force, element_area
        if force is None:
            model = _model(client, material, method)
            force = _middle_force(model) * (1.0 if area is None else area / model.element_area)
        answer = client.friction(
            material, velocity, force, quantile, method, elements=elements, sensor=sensor, element_area=area
        )
    if json:
        print_json(asdict(answer))
    else:
        print_lines(f"Friction of {material}", _friction_lines(answer))


def next_grasp(
    material: MaterialName,
    normal_force: Annotated[
        float | None,
        typer.Option(help="Where friction is to be known: N an element; by default the middle of the data."),
    ] = None,
    velocity: Velocity = 0.0,
    quantile: Annotated[float, typer.Option(help="Quantile of friction that the planner asks for.")] = 1e-2,
    elements: Annotated[int, typer.Option(min=1, help="Elements of the planner's contact.")] = 60,
    load: Annotated[float, typer.Option(help="Load that the contact bears while it is probed, N.")] = 0.0,
    drop_probability: Annotated[float, typer.Option(help="With which it may drop that load.")] = 1e-3,
    sensor: GraspingSensor = None,
    method: Method = "auto",
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Say which grasp to record next, to know friction best per second of robot time."""

    with connected(url, key) as client:
        grasp = client.next_grasp(
            material,
            normal_force,
            velocity,
            quantile,
            elements,
            method=method,
            load=load,
            drop_probability=drop_probability,
            sensor=sensor,
        )
    if json:
        print_json(asdict(grasp))
    else:
        print_lines(f"Record next of {material}", _probe_lines(grasp))


def plan(
    material: MaterialName,
    load: Annotated[float, typer.Option(help="Tangential load that the finger must hold, N.")],
    contact_area: Annotated[float, typer.Option(help="Area of one finger's contact, m².")],
    torque: Annotated[float, typer.Option(help="Torque beside the load, N·m.")] = 0.0,
    fingers: Annotated[int, typer.Option(help="Equal fingers that share load and torque.")] = 1,
    round_at: Annotated[
        float | None, typer.Option(help="Of a round fingertip: normal force under which it has that area, N.")
    ] = None,
    object_radius: Annotated[
        float | None, typer.Option(help="Radius of a round object, m, where the torque is about its axis.")
    ] = None,
    safety_factor: Annotated[float, typer.Option(help="Multiplies load and torque.")] = 1.0,
    slip_probability: Annotated[float, typer.Option(help="Largest probability of slip that is accepted.")] = 1e-3,
    velocity: Velocity = 0.0,
    limit: Annotated[float | None, typer.Option(help="Largest normal force that the object bears, N.")] = None,
    of: Annotated[
        str | None,
        typer.Option(
            help="Whose scatter counts: element or contact; by default the contact's where the model has its scales."
        ),
    ] = None,
    elements: Annotated[
        float | None, typer.Option(min=1.0, help="Elements of one contact, where they do not follow from its area.")
    ] = None,
    sensor: GraspingSensor = None,
    method: Method = "auto",
    url: Url = DEFAULT_URL,
    key: Key = None,
    json: Json = False,
) -> None:
    """Say how hard to grip so that slip stays improbable, with the model's uncertainty in the answer."""
    from stiction_client import grasp, required_normal_force

    _check_area(contact_area)
    with connected(url, key) as client:
        model = _model(client, material, method)
    model = model if sensor is None else model.on_sensor(sensor)
    because = model.chosen_because if method == "auto" else None
    answer = required_normal_force(
        model,
        load,
        slip_probability=slip_probability,
        contacts=grasp(contact_area, round_at, fingers, object_radius),
        torque=torque,
        tangential_velocity=velocity,
        safety_factor=safety_factor,
        normal_force_limit=limit,
        of=of,
        elements=elements,
    )
    if json:
        chosen = {"material": model.material, "method": model.method, "version": model.version}
        print_json(chosen | {"chosen_because": because} | asdict(answer))
    else:
        print_lines(f"Grip for {load:g} N on {material}", _grip_lines(answer, model, because))


def _model(client: "FrictionClient", material: str, method: str) -> "FrictionModel":
    """A material's model; where there is none, raises the service's own refusal, which says what it knows instead."""
    from stiction_client import NoModel

    try:
        return client.model(material, method=method)
    except NoModel:
        client.friction(material, 0.0, 0.0, method=method)
        raise


def _check_area(area: float) -> None:
    """Ask back about a large one; raises ``typer.BadParameter`` where it was none, or nobody answers."""
    if area <= LARGEST_AREA:
        return
    asked = f"{area:g} m² are {area * 1e4:g} cm², more than a hand; 1 cm² is 1e-4. Is it m²?"
    try:
        is_meant = typer.confirm(asked, err=True)
    except typer.Abort:
        typer.echo(err=True)  # the question has no end of its own
        is_meant = False
    if not is_meant:
        raise typer.BadParameter(f"--contact-area is {area:g} m²; allowed: that of one finger, such as 1e-4")


def _upload(
    client: "FrictionClient",
    source: Source,
    wait: bool,
    asked: tuple[str | None, str | None, str | None],
) -> dict[str, Any]:
    """Upload one log: ``asked`` are its material, sensor and detector.

    That it is not read or that the service does not take it is a result like any other.
    """
    from slipcore import InvalidInput
    from stiction_client import ProblemError, problems

    try:
        log, options = source.log()
        receipt = client.upload(log, *asked, **options)
    except problems.UnknownMaterial:  # so it will be for the others
        raise
    except (InvalidInput, ProblemError) as refusal:
        return {"file": source.name, "status": "rejected", "reason": str(refusal)}
    job = client.wait(receipt.job) if wait else receipt.job
    detection = client.grasp_log(receipt.id).detection if wait else receipt.detection
    findings = () if detection is None else detection.findings or ()
    for finding in findings:
        typer.echo(f"{source.name}: {finding.name}: {finding.evidence}; {finding.remedy}", err=True)
    outcome = {**asdict(job), "findings": [asdict(each) for each in findings]}
    return {"file": source.name, "grasp_log": receipt.id, **outcome}


def _print_uploads(results: list[dict[str, Any]], json: bool) -> None:
    if json:
        print_json({"uploads": results})
    else:
        columns = ("file", "grasp_log", "status", "reason", "model_version")
        print_table("Uploads", columns, [[result.get(column) for column in columns] for result in results])


def _print_broken_off(done: list[dict[str, Any]], sources: list[Source], json: bool) -> None:
    """What became of each log where an error or Ctrl-C ended the uploads, and how to go on; nothing of a first one."""
    if not done:
        return
    left = [{"file": source.name, "status": "not sent"} for source in sources[len(done) :]]
    if left:  # Ctrl-C may come when all are done
        left[0] |= {"status": "not known", "reason": "it may have been sent"}
    _print_uploads(done + left, json)
    again = "the same command sends the rest, and stores none twice"
    typer.echo(f"{len(done)} of {len(sources)} logs are done; {again}", err=True)


def _middle_force(model: "FrictionModel") -> float:
    low, high = model.domain.normal_force
    return 0.5 * (low + high)


def _friction_lines(answer: "FrictionAnswer") -> list[tuple[str, str | None]]:
    whose = f"of a contact of {answer.elements} elements" if answer.of == "contact" else "of one element"
    friction = number(answer.friction_coefficient)
    area = "" if answer.element_area is None else f" of {number(1e6 * answer.element_area)} mm²"
    if answer.quantile is not None:
        friction += f", the {answer.quantile:g} quantile {whose}"
        friction += f"; the mean is {number(answer.mean)}" if answer.mean > 0.0 else ""
    return [
        ("μ", friction),
        ("at", f"{number(answer.tangential_velocity)} m/s and {number(answer.normal_force)} N an element{area}"),
        ("model", f"{answer.method}, version {answer.version}"),
        ("because", answer.chosen_because),
        *_support(answer.support, answer.advice, answer.warning),
        *(("note", note) for note in answer.notes),
    ]


def _support(support: str | None, advice: str | None, warning: str | None) -> list[tuple[str, str | None]]:
    """How far data support an answer, with the advice, and what the warning says beyond that; no support of a service
    of before 0.1.
    """
    told = support if advice is None else f"{support}: {advice}"
    return [("support", told), ("warning", further_warning(warning, advice or "") or None)]


def _probe_lines(grasp: "NextGrasp") -> list[tuple[str, str | None]]:
    length, speed = number(grasp.slip_length * 1e3), number(grasp.speed * 1e3)
    slip = f"{length} mm at {speed} mm/s, towards {number(grasp.direction)} rad"
    return [
        ("press with", f"{number(grasp.normal_force)} N an element"),
        ("slip by", slip),
        ("takes", f"{number(grasp.seconds)} s"),
        ("known to", f"± {number(grasp.uncertainty)} now, ± {number(grasp.after)} after that"),
        ("support", f"{grasp.support}: {grasp.advice}"),
        ("mind", grasp.beyond),
        *(("note", note) for note in grasp.notes),
    ]


def _grip_lines(grip: "RequiredForce", model: "FrictionModel", because: str | None) -> list[tuple[str, str | None]]:
    whose = f"a contact of {grip.elements:.0f} elements" if grip.of == "contact" else "one element"
    most = grip.feasible_interval[1]
    return [
        ("press with", f"{at_least(grip.normal_force)} N, each finger"),
        ("at most", f"{number(most)} N" if isfinite(most) else None),
        ("slips with", f"a probability of {grip.slip_probability:g} at most"),
        ("largest load", f"{number(grip.largest_load)} N" if isfinite(grip.largest_load) else None),
        ("μ", f"{number(grip.friction_coefficient)}, so low in {whose} at {number(grip.element_force)} N an element"),
        ("model", f"{model.method}, version {model.version}"),
        ("because", because),
        *_support(grip.support, grip.advice, grip.warning),
        *(("note", note) for note in grip.notes),
    ]
