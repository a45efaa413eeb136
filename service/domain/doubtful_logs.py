"""What speaks against the logs that a model was fitted to."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from service.domain.calibrate import CORRECTED_BY_ANOTHER
from slipcore.checks import AGAINST_FRICTION
from stiction_client.support import OTHERS_CALIBRATIONS, UNCHECKED

if TYPE_CHECKING:
    from estimators import FrictionModel


def with_doubts(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with ``doubtful_logs`` among its diagnostics where ``findings``, names for each of its logs, ask it."""
    doubts = [AGAINST_FRICTION.intersection(names) for names in findings]
    doubtful = sum(map(bool, doubts))
    if not doubtful:
        return model
    logs = "log is" if len(doubts) == 1 else "logs is" if doubtful == 1 else "logs are"
    told = f"{doubtful} of {len(doubts)} {logs} doubtful ({', '.join(sorted(set().union(*doubts)))})"
    return replace(model, diagnostics={**model.diagnostics, "doubtful_logs": told})


def with_others_calibrations(model: "FrictionModel", findings: Sequence[Collection[str]]) -> "FrictionModel":
    """The model with a note among its diagnostics where calibrations by another key than sent them correct logs."""
    count = sum(CORRECTED_BY_ANOTHER in names for names in findings)
    if not count:
        return model
    are = "log is" if len(findings) == 1 else "logs is" if count == 1 else "logs are"
    told = f"{count} of {len(findings)} {are} corrected by a sensor's calibration that another key stored"
    return replace(model, diagnostics={**model.diagnostics, OTHERS_CALIBRATIONS: told})


def with_unchecked(model: "FrictionModel", findings: Sequence[Collection[str] | None]) -> "FrictionModel":
    """The model with a note among its diagnostics where an older version did not look for ``findings`` of some logs."""
    unchecked = sum(each is None for each in findings)
    if not unchecked:
        return model
    were = "log was" if len(findings) == 1 else "logs was" if unchecked == 1 else "logs were"
    told = f"{unchecked} of {len(findings)} {were} stored before logs were checked: what is sent again is looked at"
    return replace(model, diagnostics={**model.diagnostics, UNCHECKED: told})
