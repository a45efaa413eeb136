"""Inspect a log on this machine: correct it by its sensor's calibration, reconstruct forces by its gel, detect slip."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import typer

from service.cli.progress import shown_progress

if TYPE_CHECKING:
    from slipcore import Collected, Finding, GraspLog, SlipHistory
    from slipcore.forces import ForceComparison, Reconstruction

COMPARED_FRAMES = 20
"""Evenly spaced: ratios need no more, and markers in the plane can take seconds to show a frame's contact."""


@dataclass(frozen=True, slots=True)
class InspectedLog:
    """A log as corrected, its slip, the ``seconds`` that detection took, and the ``reconstruction`` of its forces (None
    where they are the sensor's own, or missing).
    """

    log: "GraspLog"
    history: "SlipHistory"
    seconds: float
    reconstruction: "Reconstruction | None"

    def friction(self) -> "tuple[Collected, str | None]":
        """What it says of friction, and if there are no samples, why."""
        from service.domain.logs.collect_friction import collect

        return collect(self.log, self.history, self.reconstruction)

    def findings(self, collected: "Collected") -> "list[Finding]":
        """What makes friction that was ``collected`` from it doubtful."""
        from service.domain.sensors.reconstruct import reconstruction_findings
        from slipcore import check_log

        return [
            *reconstruction_findings(self.log, self.reconstruction),
            *check_log(self.log, self.history, collected.elements),
        ]


def inspect_log(
    log: "GraspLog", method: str | None = None, sensor_model: Path | None = None, gel: Path | None = None
) -> InspectedLog:
    """Correct a log, reconstruct forces that it lacks, and detect slip in it."""
    from slipcore import LOOKAHEAD, detect_slip
    from slipcore.method_choice import recommended_method

    method = method or recommended_method(log)
    log, options = _corrected(log, sensor_model, method)
    log, reconstruction = with_forces_by(gel, log)
    begin = perf_counter()
    history = detect_slip(log, method=method, lookahead=LOOKAHEAD, sensor_model=None, **options)
    return InspectedLog(log, history, perf_counter() - begin, reconstruction)


def comparison(log: "GraspLog", gel: Path | None) -> "ForceComparison | None":
    """How the log's own forces agree with those by the gel alone, where there are both, in ``COMPARED_FRAMES`` of those
    in which something touches; None of forces that are reconstructed themselves. Raises ``InvalidInput`` for a log of
    forces alone.
    """
    if gel is None or log.force is None or log.has_reconstructed_force:
        return None
    import numpy as np

    from slipcore import InvalidInput
    from slipcore.forces import Gel, compare_forces, reconstruct
    from slipcore.forces.recording import DisplacementData

    if not log.has_displacement:
        raise InvalidInput("gel", "given for a log of forces alone", "a log with displacement")
    by_gel = replace(log, gripper_force=None, gripper_force_deviation=None)  # which would hide what is wrong of the gel
    described = Gel.from_json(_read_json(gel, "gel"))
    with shown_progress("reconstructing forces"):
        shown = DisplacementData.of(by_gel, None)
        touched = np.flatnonzero(shown.touched())
        spaced = np.linspace(0, len(touched), COMPARED_FRAMES, endpoint=False, dtype=int)
        frames = np.union1d(touched[spaced] if len(touched) else touched, (0, len(log) - 1))
        return compare_forces(log.take(frames), reconstruct(by_gel.take(frames), described, noise=shown.noise))


def _corrected(log: "GraspLog", sensor_model: Path | None, method: str) -> "tuple[GraspLog, dict[str, float]]":
    """The log as a calibration of its sensor corrects it, and options of detection; what that changed goes to standard
    error.
    """
    if sensor_model is None:
        return log, {}
    from slipcore import SensorModel

    found, changed, options = SensorModel.from_json(_read_json(sensor_model, "sensor model")).apply(log, method)
    typer.echo(f"{sensor_model.name}: {'; '.join(changed) or 'nothing to correct'}", err=True)
    return found, dict(options)


def with_forces_by(gel: Path | None, log: "GraspLog") -> "tuple[GraspLog, Reconstruction | None]":
    """By the gel, if there is one, where the log has none; raises ``UnknownScale`` for one that is not in metres."""
    from service.domain.sensors.reconstruct import with_forces

    if gel is None:
        return log, None
    described = _read_json(gel, "gel")
    if log.force is not None:
        whose = "the forces in it, which were reconstructed" if log.has_reconstructed_force else "the log's own forces"
        typer.echo(f"{gel.name}: slip and friction are by {whose}", err=True)
        return log, None
    return with_forces(log, described)


def _read_json(path: Path, name: str) -> Mapping[str, Any]:
    from service.formats.json_text import parse_object

    return parse_object(name, path.read_bytes())
