"""One grasp that was sent in several files: how it is known again, and what is said of it."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction_client.support import SAME_GRASPS

if TYPE_CHECKING:
    from db.records import SamplesOfLog
    from estimators import FrictionModel
    from slipcore import Finding, GraspLog

FRAMES = 1000
"""Hashed at once, so that no copy of a whole log is made."""

TOLD = 5
"""Copies that a note names; of more it says how many there are."""

REMEDY = "withdraw the one that is not to count"


def fingerprint(log: "GraspLog") -> str:
    """SHA-256 of what the sensor measured: its forces or, where it has none, its displacements, in single precision.

    Friction is a ratio of forces: who has the same forces has learnt nothing new, whatever file they came in, and
    whatever its times, places and names. Noise makes those of two grasps differ.
    """
    measured = log.displacement if log.force is None else log.force
    digest = hashlib.sha256(repr(measured.shape).encode())
    for begin in range(0, len(measured), FRAMES):
        digest.update((measured[begin : begin + FRAMES].astype(np.float32) + np.float32(0.0)).tobytes())  # no -0.0
    return digest.hexdigest()


def same_grasp(others: Sequence[str]) -> "list[Finding]":
    """That a log has the same measurements as ``others``, by their ids, where there are any."""
    from slipcore import Finding

    if not others:
        return []
    evidence = f"the measurements are those of log {others[0]}: of such logs of a material the first alone counts"
    return [Finding("same grasp", evidence, REMEDY)]


def with_copies(model: "FrictionModel", logs: "Sequence[SamplesOfLog]") -> "FrictionModel":
    """The model with a note among its diagnostics where some of its ``logs`` came more than once."""
    pairs = [(copy, log.grasp_log_id) for log in logs for copy in log.copies]
    if not pairs:
        return model
    named = [f"{copy} of {first}" for copy, first in pairs[:TOLD]]
    more = [f"{len(pairs) - TOLD} more"] if len(pairs) > TOLD else []
    count = "1 log repeats" if len(pairs) == 1 else f"{len(pairs)} logs repeat"
    told = f"{count} the measurements of another log: counted once ({', '.join([*named, *more])}); {REMEDY}"
    return replace(model, diagnostics={**model.diagnostics, SAME_GRASPS: told})
