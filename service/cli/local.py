"""Commands that work on files, without a service: detect, check, fit, convert."""

from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.inputs import read_log, refuse_inputs
from service.cli.inspection import comparison, inspect_log
from service.cli.options import (
    DETECTOR_HELP,
    METHOD_HELP,
    FrameRate,
    GelFile,
    Json,
    Log,
    Logs,
    Mapping,
    Picture,
    Rest,
    Scale,
    SensorModelFile,
)
from service.cli.output import print_json, print_lines, print_table
from service.cli.progress import counted, shown_progress
from service.formatting import interval, number
from service.whole_files import write_whole

if TYPE_CHECKING:
    from estimators import FrictionModel
    from slipcore import Finding, FrictionSamples, GraspLog, SlipHistory
    from slipcore.forces import ForceComparison


def detect(
    log: Log,
    method: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    sensor_model: SensorModelFile = None,
    gel: GelFile = None,
    json: Json = False,
    picture: Picture = None,
) -> None:
    """Detect local slip in one grasp log and say what was seen."""

    grasp = read_log(log, mapping, scale, frame_rate, rest)
    with shown_progress(f"looking at {log.name}"):
        seen = inspect_log(grasp, method, sensor_model, gel)
    if picture is not None:
        from service.report.pictures import save, slip_over_time

        save(slip_over_time(seen.log, seen.history, log.name), picture)
    summary = _detection_summary(seen.log, seen.history, seen.seconds)
    if json:
        print_json(summary | {"time": seen.history.time, "stick_ratio": seen.history.stick_ratio})
    else:
        print_lines(f"{log.name}: local slip by {seen.history.method}", _detection_lines(summary))


def check(
    log: Log,
    method: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    sensor_model: SensorModelFile = None,
    gel: GelFile = None,
    json: Json = False,
) -> None:
    """Look for what makes the friction of a grasp log doubtful, and say what to do (docs/checks.md)."""

    grasp = read_log(log, mapping, scale, frame_rate, rest)
    with shown_progress(f"looking at {log.name}"):
        seen = inspect_log(grasp, method, sensor_model, gel)
    collected, because = seen.friction()
    findings, contact = seen.findings(collected), _contact_record(seen.log, seen.history)
    without = _without_friction(seen.log) or because
    compared = None if seen.reconstruction else comparison(seen.log, gel)
    if json:
        found = [_finding_record(each) for each in findings]
        record = {"log": log.name, "findings": found, "contact_friction": contact, "without_friction": without}
        print_json(record if compared is None else record | {"forces_by_gel": asdict(compared)})
        return
    for finding in findings:
        typer.echo(f"{finding.name}: {finding.evidence}\n  {finding.remedy}")
    if not findings:
        typer.echo(f"{log.name}: nothing found against it")
    doubts = [finding.name for finding in findings if finding.severity == "warning"]
    if doubts:
        typer.echo(f"friction from this log is doubtful: {', '.join(doubts)}")
    if without is not None:
        typer.echo(f"no friction from this log: {without}")
    if contact is not None:
        typer.echo(f"friction of the contact: {_contact_line(contact)}")
    if compared is not None:
        print_comparison(compared)


def fit(
    logs: Logs,
    method: Annotated[str, typer.Option("--method", help=METHOD_HELP)] = "auto",
    detector: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sampler.")] = 0,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    sensor_model: SensorModelFile = None,
    gel: GelFile = None,
    json: Json = False,
) -> None:
    """Fit the stochastic linear friction model to the slip seen in one or more grasp logs."""
    from estimators import fit as fit_model
    from estimators.fitting import check_method
    from service.domain.logs.doubtful_logs import with_doubts, with_reconstructed
    from service.domain.logs.same_grasp import Grasps, same_grasp
    from slipcore import InvalidInput

    check_method(method)
    grasps = Grasps()

    def found(path: Path) -> "tuple[str, FrictionSamples, list[Finding]]":
        log = read_log(path, mapping, scale, frame_rate, rest)
        seen = inspect_log(log, detector, sensor_model, gel)
        collected, because = seen.friction()
        if without := _without_friction(seen.log) or because:
            typer.echo(f"{path.name}: no friction from this log: {without}", err=True)
        own = grasps.see(log, is_touched=bool(seen.history.contact.any()))
        return own, collected.samples, seen.findings(collected)

    first = dict[str, Path]()
    copies: dict[str, list[tuple[FrictionSamples, list[Finding]]]] = {}
    looked_at = list(counted(map(found, logs), len(logs), "logs looked at"))
    for path, (own, samples, findings) in zip(logs, looked_at, strict=True):
        grasp = grasps.of(own)
        for finding in (*same_grasp([first[grasp].name] if grasp in first else []), *findings):
            typer.echo(f"{path.name}: {finding.name}: {finding.evidence}", err=True)
        first.setdefault(grasp, path)
        copies.setdefault(grasp, []).append((samples, findings))
    seen = [max(of_grasp, key=lambda each: len(each[0])) for of_grasp in copies.values()]
    if not any(len(samples) for samples, _ in seen):
        raise InvalidInput("logs", "without friction samples, for what is said of each above", "one that gives some")
    with shown_progress(f"fitting by {method}"):
        model = fit_model([samples for samples, _ in seen], method=method, seed=seed)
    names = [[finding.name for finding in findings] for _, findings in seen]
    model = with_reconstructed(with_doubts(model, names), names)
    if json:
        print_json(model_record(model))
    else:
        print_model(model, f"{method} fit of {model.n} samples from {len(seen)} grasp(s)")


def convert(
    log: Log,
    output: Annotated[Path, typer.Argument(help="Where to write it: a name that ends in .npz, .parquet or .mcap.")],
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    json: Json = False,
) -> None:
    """Write a grasp log of any format as a Stiction NPZ, Parquet or MCAP, bit for bit."""
    from service.formats import writing

    name = writing.format_of(output)
    refuse_inputs(output, log, mapping)
    grasp = read_log(log, mapping, scale, frame_rate, rest)
    write_whole(output, lambda beside: writing.write(grasp, beside, name))
    if json:
        print_json({"output": str(output), "format": name, "frames": len(grasp), "grid": grasp.grid})
    else:
        typer.echo(f"{output}: {len(grasp)} frames of {grasp.grid[0]} × {grasp.grid[1]} markers")


def export(
    logs: Annotated[list[Path], typer.Argument(help="Grasp logs in any format of docs/formats.md.")],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help="Where to write: NAME.mcap for Foxglove, NAME.rrd for Rerun, each of one log; a folder for LeRobot.",
        ),
    ],
    method: Annotated[str | None, typer.Option(help=DETECTOR_HELP)] = None,
    scale: Scale = None,
    frame_rate: FrameRate = None,
    mapping: Mapping = None,
    rest: Rest = None,
    sensor_model: SensorModelFile = None,
    gel: GelFile = None,
    json: Json = False,
) -> None:
    """Write grasp logs with the slip detected in them for Foxglove, Rerun or LeRobot (docs/exports.md)."""
    from service import exports

    target = exports.target_of(output)
    exports.check_output(output, target)

    def recorded(path: Path) -> exports.DetectedLog:
        seen = inspect_log(read_log(path, mapping, scale, frame_rate, rest), method, sensor_model, gel)
        return exports.DetectedLog(seen.log, seen.history, path.name)

    recordings = list(counted(map(recorded, logs), len(logs), "logs looked at"))
    exports.write(recordings, output, target)
    frames = sum(len(recording.log) for recording in recordings)
    by_displacement = sum(recording.log.has_reconstructed_force for recording in recordings)
    if json:
        about = {"output": str(output), "target": target, "frames": frames, "grasps": len(logs)}
        print_json(about | {"with_reconstructed_forces": by_displacement})
        return
    typer.echo(f"{output}: {frames} frames of {len(logs)} grasp(s), for {target}")
    if by_displacement:
        typer.echo(f"forces of {by_displacement} of {len(logs)} grasp(s) are reconstructed from displacement")


def print_comparison(found: "ForceComparison") -> None:
    """Print how a sensor's own forces agree with those that follow from its gel."""
    rows = [
        (name, number(agreement.ratio), number(agreement.correlation))
        for name, agreement in (
            ("normal, of elements", found.normal),
            ("normal, of the contact", found.total_normal),
            ("tangential, of elements", found.tangential),
            ("tangential, of the contact", found.total_tangential),
        )
    ]
    print_table("The sensor's own forces against those by its gel", ("", "own / by gel", "correlation"), rows)


def model_record(model: "FrictionModel") -> dict[str, Any]:
    """A fitted model as JSON shows it."""
    return {
        "method": model.method,
        "coefficients": model.coefficients,
        "standard_errors": model.standard_errors,
        "interval_95": model.interval(0.95),
        "covariance": model.covariance,
        "scale": model.scale,
        "n": model.n,
        "degrees_of_freedom": model.degrees_of_freedom,
        "scatter_degrees_of_freedom": model.scatter_degrees_of_freedom,
        "scales": None if model.scales is None else model.scales.to_json(),
        "domain": {
            "tangential_velocity": model.domain.tangential_velocity,
            "normal_force": model.domain.normal_force,
        },
        "identifiable": model.identifiable,
        "element_area": model.element_area,
        "diagnostics": dict(model.diagnostics),
        "cost": {"seconds": model.cost.seconds, "monte_carlo_error": model.cost.monte_carlo_error},
        "support": model.support,
        "advice": model.advice,
        "notes": model.notes,
    }


def print_model(model: "FrictionModel", title: str) -> None:
    """Print a fitted model as a table: estimate, interval, and whether the data determine the coefficient at all."""
    names = ("β₀ [-]", "β₁ [s/m]", "β₂ [1/N]")
    rows: list[tuple[str, str, str, str]] = [
        (name, number(value), interval(bounds), "yes" if known else "no")
        for name, value, bounds, known in zip(
            names, model.coefficients, model.interval(0.95), model.identifiable, strict=True
        )
    ]
    rows.append(("σ [-]", number(model.scale), "", ""))
    print_table(title, ("", "estimate", "95 % interval", "identifiable"), rows)
    typer.echo(f"{model.support}: {model.advice}")
    if "unknown_velocity" in model.diagnostics:
        typer.echo(str(model.diagnostics["unknown_velocity"]))
    for note in model.notes:
        typer.echo(note)


def _detection_summary(log: "GraspLog", history: "SlipHistory", seconds: float) -> dict[str, Any]:
    import numpy as np

    in_contact = ~np.isnan(history.stick_ratio)
    events = history.events
    return {
        "method": history.method,
        "frames": len(log),
        "duration": round(float(log.time[-1] - log.time[0]), 6),
        "frames_in_contact": int(in_contact.sum()),
        "frames_in_macro_slip": int(history.macro_slip.sum()),
        "smallest_stick_ratio": float(np.nanmin(history.stick_ratio)) if in_contact.any() else None,
        "slip_onsets": len(events.onset),
        "slip_ends": len(events.end),
        "touches": len(events.touch),
        "releases": len(events.release),
        "marker_noise": history.noise if log.is_scaled else None,
        "seconds": round(seconds, 6),
        "contact_friction": _contact_record(log, history),
        **({} if log.is_scaled else {"unknown": "the scale: no noise, velocity or friction can be given in SI units"}),
    }


def _finding_record(finding: "Finding") -> dict[str, Any]:
    return asdict(finding) | {"severity": finding.severity}


def _contact_record(log: "GraspLog", history: "SlipHistory") -> dict[str, Any] | None:
    from slipcore import contact_friction

    found = contact_friction(log.time, history.patches)
    return None if found is None else asdict(found) | {"high": None if found.is_bound else found.high}


def _without_friction(log: "GraspLog") -> str | None:
    """Why a log gives no friction samples whatever slips in it, and what to do; None where it may."""
    if not log.is_scaled:
        return "its scale is unknown: say how many metres a pixel is (--scale)"
    if log.force is None:
        return (
            "it has no forces: describe the sensor's gel, from which they follow (--gel, docs/forces.md), or map the "
            "columns that have them"
        )
    if not log.has_displacement:
        return "it has no displacement, and with that no velocity: forces alone show slip"
    return None


def _contact_line(found: dict[str, Any] | None) -> str | None:
    if found is None:
        return None
    if found["is_bound"]:
        return f"at least {number(found['low'])}: {found['reason']}"
    return f"{number(found['coefficient'])}, {interval((found['low'], found['high']))}: {found['reason']}"


def _detection_lines(summary: dict[str, Any]) -> list[tuple[str, str | None]]:
    seen = {name: number(value) for name, value in summary.items() if isinstance(value, float)}
    begin, end, noise = summary["slip_onsets"], summary["slip_ends"], summary["marker_noise"]
    return [
        ("frames", f"{summary['frames']} in {seen['duration']} s"),
        ("in contact", f"{summary['frames_in_contact']} frames; {summary['frames_in_macro_slip']} slip as a whole"),
        ("stick ratio", seen.get("smallest_stick_ratio") and f"{seen['smallest_stick_ratio']} at its smallest"),
        ("elements", f"{summary['touches']} touch, {begin} begin to slip, {end} stick again"),
        ("friction of the contact", _contact_line(summary["contact_friction"])),
        ("marker noise", None if noise is None or isnan(noise) else f"{number(1e6 * noise)} µm"),
        ("computed in", f"{seen['seconds']} s"),
        ("unknown", summary.get("unknown")),
    ]
