"""One grasp that was sent in several files: how it is known again, and what is said of it."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stiction_client.support import SAME_GRASPS

if TYPE_CHECKING:
    from db.records import SamplesOfLog, Signature
    from estimators import FrictionModel
    from slipcore import Finding, GraspLog
    from slipcore.frames import FloatArray

FRAMES = 1000
"""Hashed at once, so that no copy of a whole log is made."""

SUMS = 8
"""Sums of a frame's readings, each with signs of its own, that are kept of it: 32 bytes."""

MOST_FRAMES = 20_000
"""Of a log, whose sums are kept: its first ones."""

MOST_LOGS, MOST_COMPARED = 1000, 1_000_000
"""Logs of a material, the newest, and frames of all of them, with which a new one is compared: a second at most."""

ASKED = 64
"""Frames of a log, among those with more than half of its usual largest load, that are looked for in another."""

OF_FORCE, OF_DISPLACEMENT = b"f", b"d"
"""Of which readings a signature is, in its first byte."""

SHARED = 0.75
"""-, of these frames that another log has, from which on both are of one grasp."""

NOISE_SHARE = 0.3
"""-, of the noise of a sum, within which it is the same reading: of two frames of equal load in different grasps all
sums are as near in 6 of 10⁷ pairs.
"""

DIGITS = 5e-4
"""-, of the smaller log's usual largest sum, within which it is the same whatever the noise: readings were rounded."""

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


def signature(log: "GraspLog") -> bytes:
    """By which the same measurements are known again in a log that was cut, rounded or scaled by a little.

    Sums of the readings of each frame, with signs that are drawn once for all: noise makes them differ from grasp to
    grasp, and rounding changes them by far less than noise does. ``is_alike`` compares them.
    """
    measured = log.displacement if log.force is None else log.force
    signs = _signs(measured[0].size)
    kept = min(len(measured), MOST_FRAMES)
    parts = (measured[begin : min(begin + FRAMES, kept)] for begin in range(0, kept, FRAMES))
    sums = np.concatenate([part.reshape(len(part), -1) @ signs for part in parts])
    return (OF_DISPLACEMENT if log.force is None else OF_FORCE) + sums.astype("<f4").tobytes()


def find_alike(own: bytes, others: "Iterable[Signature]") -> "Signature | None":
    """The first of the others that is of the same grasp, as far as they are compared."""
    compared = 0
    for other in others:
        compared += len(other.content) // (4 * SUMS)
        if compared > MOST_COMPARED:
            return None
        if is_alike(own, other.content):
            return other
    return None


def is_alike(one: bytes, other: bytes) -> bool:
    """Whether these signatures are of one grasp: most frames under load of one of the logs are in the other, too."""
    if one[:1] != other[:1]:
        return False
    sums = [np.frombuffer(each, "<f4", offset=1).reshape(-1, SUMS).astype(float) for each in (one, other)]
    within = NOISE_SHARE * np.minimum(*map(_noise, sums))
    within = np.maximum(within, DIGITS * min(_usual(np.abs(each).max(axis=1)) for each in sums))
    if not within.all():
        return False
    frames, others = (each / within for each in sums)
    return max(_shared(frames, others), _shared(others, frames)) >= SHARED


def _signs(readings: int) -> "FloatArray":
    """Of each reading in each sum, [readings, SUMS], 1 or -1: the same in every version."""
    drawn = hashlib.shake_256(b"stiction").digest(readings * SUMS // 8)
    return np.asarray(2.0 * np.unpackbits(np.frombuffer(drawn, np.uint8)).reshape(readings, SUMS) - 1.0, float)


def _usual(values: "FloatArray") -> float:
    """The largest but for a twentieth: one reading that is odd makes nothing else small."""
    return float(np.quantile(values, 0.95)) if len(values) else 0.0


def _noise(sums: "FloatArray") -> "FloatArray":
    """Standard deviation of each sum [SUMS] from frame to frame, by second differences; 0 of less than three frames."""
    if len(sums) < 3:
        return np.zeros(SUMS)
    return np.asarray(1.4826 * np.median(np.abs(np.diff(sums, 2, axis=0)), axis=0) / np.sqrt(6.0))


def _shared(frames: "FloatArray", others: "FloatArray") -> float:
    """Share of the frames under load [t, SUMS] that are among the others, where 1 is as far as they may be off."""
    from scipy.spatial import cKDTree

    load = np.linalg.norm(frames, axis=1)
    loaded = np.flatnonzero(load > 0.5 * _usual(load))
    if not loaded.size:
        return 0.0
    asked = frames[loaded[np.unique(np.linspace(0, len(loaded) - 1, ASKED).astype(int))]]
    distance = cKDTree(others).query(asked, p=np.inf, distance_upper_bound=1.0)[0]
    return float(np.isfinite(distance).mean())


def same_grasp(others: Sequence[str]) -> "list[Finding]":
    """That a log is of the same grasp as ``others``, by their ids, where there are any."""
    from slipcore import Finding

    if not others:
        return []
    evidence = (
        f"the measurements are those of log {others[0]}, whole, cut or rounded: of such logs of a material the first "
        "alone counts"
    )
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
