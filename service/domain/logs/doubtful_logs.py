"""What speaks against the logs that a model was fitted to."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from service.domain.sensors.calibrate import CORRECTED_BY_ANOTHER
from service.domain.sensors.reconstruct import BY_ANOTHERS_GEL, BY_DISPLACEMENT
from slipcore.checks import AGAINST_FRICTION
from stiction_client.support import OTHERS_CALIBRATIONS, OTHERS_GELS, RECONSTRUCTED_FORCES, UNCHECKED

if TYPE_CHECKING:
    from estimators import FrictionModel


def with_doubts(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with ``doubtful_logs`` among its diagnostics where ``findings``, names for each of its logs, ask it."""
    doubts = [AGAINST_FRICTION.intersection(names) for names in findings]
    named = ", ".join(sorted(set().union(*doubts)))
    return _counted(model, "doubtful_logs", [bool(names) for names in doubts], "is", "are", f"doubtful ({named})")


def with_others_calibrations(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with a note among its diagnostics where calibrations by another key than sent them correct logs."""
    by_others = [CORRECTED_BY_ANOTHER in names for names in findings]
    remark = "corrected by a sensor's calibration that another key stored"
    return _counted(model, OTHERS_CALIBRATIONS, by_others, "is", "are", remark)


def with_others_gels(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with a note among its diagnostics where forces of logs follow from a gel that another key described."""
    by_others = [BY_ANOTHERS_GEL in names for names in findings]
    return _counted(model, OTHERS_GELS, by_others, "has", "have", "forces by a sensor's gel that another key described")


def with_reconstructed(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with a note among its diagnostics where forces of logs are reconstructed."""
    by_displacement = [not BY_DISPLACEMENT.isdisjoint(names) for names in findings]
    remark = "forces reconstructed from displacement, as sure as the description of the sensor's gel"
    return _counted(model, RECONSTRUCTED_FORCES, by_displacement, "has", "have", remark)


def with_unchecked(model: "FrictionModel", checked: Sequence[bool]) -> "FrictionModel":
    """The model with a note among its diagnostics where an older version did not look at some logs as this one does."""
    remark = "stored before logs were checked as now: what is sent again is looked at"
    return _counted(model, UNCHECKED, [not each for each in checked], "was", "were", remark)


def _counted(
    model: "FrictionModel", name: str, logs: Sequence[bool], one: str, several: str, remark: str
) -> "FrictionModel":
    """The model with a diagnostic of this name that says of how many of its logs something is so, where of any."""
    count = sum(logs)
    if not count:
        return model
    verb = one if count == 1 else several
    sentence = f"{count} of {len(logs)} {'log' if len(logs) == 1 else 'logs'} {verb} {remark}"
    return replace(model, diagnostics={**model.diagnostics, name: sentence})
