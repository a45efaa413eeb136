"""What speaks against the logs that a model was fitted to."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from slipcore.checks import AGAINST_FRICTION

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
