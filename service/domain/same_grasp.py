"""One grasp that was sent in several files: how it is known again, and what is said of it."""

import hashlib
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from db.records import Signature
from stiction_client.support import SAME_GRASPS

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

    from db.records import SamplesOfLog
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
"""Logs of a material, the newest, and frames of all of them, with which a new one is compared: .3 to .8 s of CPU time,
measured.
"""

LOOKED_AT, LEAST_VALUES = 200, 1000
"""Frames of a log, and different values of all its readings in these, from which on its sums tell it from others."""

ASKED = 64
"""Frames of a log, among those with more than half of its usual largest load, that are looked for in another."""

NEAREST = 16
"""Frames of the other log that are looked at for each: of a quiet hold all of its thousands are near."""

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
    grasp, and rounding changes them by far less than noise does. ``Sums`` compares them.
    Nothing of readings that take too few values.
    """
    measured = log.displacement if log.force is None else log.force
    if not _is_distinctive(measured):
        return b""
    signs = _signs(measured[0].size)
    kept = min(len(measured), MOST_FRAMES)
    parts = (measured[begin : min(begin + FRAMES, kept)] for begin in range(0, kept, FRAMES))
    sums = np.concatenate([part.reshape(len(part), -1) @ signs for part in parts])
    return (OF_DISPLACEMENT if log.force is None else OF_FORCE) + sums.astype("<f4").tobytes()


def find_alike(own: bytes, others: Iterable[Signature]) -> list[str]:
    """Those of the other logs that are of the same grasp, as far as they are compared; parts of it may not be alike."""
    if not own:  # nothing touched
        return []
    mine, compared, alike = Sums(own), 0, list[str]()
    for other in others:
        theirs = Sums(other.content)
        compared += len(theirs.frames)
        if compared > MOST_COMPARED:
            break
        if mine.are_alike(theirs):
            alike.append(other.log)
    return alike


class Grasps:
    """Tells the grasps of logs apart, by comparing each with ``MOST_LOGS`` before it."""

    def __init__(self) -> None:
        self._grasps: dict[str, str] = {}
        self._newest_first: deque[Signature] = deque(maxlen=MOST_LOGS)

    def see(self, log: "GraspLog", *, is_touched: bool) -> str:
        """Compare a log with those before it; its fingerprint."""
        own = fingerprint(log)
        if own in self._grasps:
            return own
        content = signature(log) if is_touched else b""
        alike = [self._grasps[each] for each in find_alike(content, self._newest_first)]
        self._grasps[own] = alike[-1] if alike else own
        if len(set(alike)) > 1:  # parts of it had been taken for grasps of their own
            self._grasps = {each: alike[-1] if of in alike else of for each, of in self._grasps.items()}
        if content:
            self._newest_first.appendleft(Signature(own, content))
        return own

    def of(self, own: str) -> str:
        """The grasp of the log with this fingerprint, as far as it is known by now: the same of all logs of one."""
        return self._grasps[own]


@dataclass(frozen=True)
class Sums:
    """A signature as it is compared with any number of others."""

    signature: bytes

    def are_alike(self, other: "Sums") -> bool:
        """Whether they are of one grasp: most frames under load of one of the logs are in the other, too."""
        if not self.signature or self.signature[:1] != other.signature[:1]:
            return False
        within = NOISE_SHARE * np.minimum(self._noise, other._noise)
        within = np.maximum(within, DIGITS * min(self._size, other._size))
        return bool(within.all()) and max(self._share_in(other, within), other._share_in(self, within)) >= SHARED

    @cached_property
    def frames(self) -> "FloatArray":
        """The sums of each frame [t, SUMS]."""
        return np.frombuffer(self.signature, "<f4", offset=1).reshape(-1, SUMS).astype(float)

    @cached_property
    def _size(self) -> float:
        return _usual(np.abs(self.frames).max(axis=1))

    @cached_property
    def _noise(self) -> "FloatArray":
        return _noise(self.frames)

    @cached_property
    def _widest(self) -> "FloatArray":
        """How far a frame of another log may be off at most [SUMS]."""
        return np.maximum(NOISE_SHARE * self._noise, DIGITS * self._size)

    @cached_property
    def _tree(self) -> "cKDTree":
        from scipy.spatial import cKDTree

        return cKDTree(self.frames / self._widest)

    @cached_property
    def _asked(self) -> "FloatArray":
        """Frames under load that are looked for in other logs [k, SUMS]."""
        load = np.linalg.norm(self.frames / self._widest, axis=1)
        loaded = np.flatnonzero(load > 0.5 * _usual(load))
        return np.asarray(self.frames[loaded[np.unique(np.linspace(0, len(loaded) - 1, ASKED).astype(int))]])

    def _share_in(self, other: "Sums", within: "FloatArray") -> float:
        """Share of its frames under load that are among the other's, which may be off by as much in each sum."""
        asked = self._asked / other._widest
        near = np.asarray(other._tree.query(asked, k=NEAREST, p=np.inf, distance_upper_bound=1.0)[1])
        frames = np.vstack([other.frames, np.full(SUMS, np.inf)])  # the last where there are no more
        off = np.abs(frames[near] - self._asked[:, None])
        return float(np.mean(np.any(np.all(off <= within, axis=2), axis=1)))


def _is_distinctive(measured: "FloatArray") -> bool:
    """Whether its readings [t, n, m, 3] tell its grasp from others: few elements in coarse steps take the same few
    values in many grasps.
    """
    some = measured[np.unique(np.linspace(0, len(measured) - 1, LOOKED_AT).astype(int))]
    return int(np.count_nonzero(np.diff(np.sort(some, axis=0), axis=0))) >= LEAST_VALUES


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


def same_grasp(others: Sequence[str]) -> "list[Finding]":
    """That a log is of the same grasp as ``others``, by their ids, where there are any."""
    from slipcore import Finding

    if not others:
        return []
    evidence = (
        f"the measurements are those of log {others[0]}, whole, cut or rounded: of such logs of a material the one "
        "with the most samples alone counts"
    )
    return [Finding("same grasp", evidence, REMEDY)]


def with_copies(model: "FrictionModel", logs: "Sequence[SamplesOfLog]") -> "FrictionModel":
    """The model with a note among its diagnostics where some of its ``logs`` came more than once."""
    pairs = [(copy, log.grasp_log_id) for log in logs for copy in log.copies]
    if not pairs:
        return model
    named = [f"{copy} of {counted}" for copy, counted in pairs[:TOLD]]
    more = [f"{len(pairs) - TOLD} more"] if len(pairs) > TOLD else []
    count = "1 log repeats" if len(pairs) == 1 else f"{len(pairs)} logs repeat"
    note = f"{count} the measurements of another log: counted once ({', '.join([*named, *more])}); {REMEDY}"
    return replace(model, diagnostics={**model.diagnostics, SAME_GRASPS: note})
