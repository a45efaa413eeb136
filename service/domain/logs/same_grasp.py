"""One grasp that was sent in several files: how it is recognised, and what is said of it.

The same file, or the same numbers in another format, have the same ``fingerprint`` (a hash). A log that was cut,
rounded or scaled by a little has not, but its ``signature`` agrees: a random projection of each frame to a few numbers,
which keeps distances between frames (with signs of ±1: Achlioptas, J. Comput. Syst. Sci. 66 (2003) 671).
"""

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

FRAMES_AT_ONCE = 1000
"""Hashed or projected at once, so that no copy of a whole log is made."""

PROJECTIONS = 8
"""Numbers that a frame is projected to: 32 bytes of a signature."""

MOST_FRAMES = 20_000
"""Of a log, from its beginning, that its signature has."""

MOST_LOGS, MOST_COMPARED = 1000, 1_000_000
"""Logs of a material, the newest, and frames of all of them, with which a new one is compared: .3 to .8 s of CPU time,
measured.
"""

LOOKED_AT, LEAST_VALUES = 200, 1000
"""Frames that are looked at, and least number of changes of value in these, for a signature to be distinctive."""

SOUGHT_FRAMES = 64
"""Frames of a log, among those with more than half of its usual largest load, that are sought in another."""

NEAREST_FRAMES = 16
"""Frames of the other log that each is compared with: of a quiet hold all of its thousands are near."""

OF_FORCE, OF_DISPLACEMENT = b"f", b"d"
"""Of which readings a signature is, in its first byte."""

LEAST_SHARED = 0.75
"""-, share of the frames sought that the other log must have, for both to be of one grasp."""

NOISE_SHARE = 0.3
"""-, of the noise of a projection, within which two are the same reading: of two frames of equal load in different
grasps all projections are as near in 6 of 10⁷ pairs.
"""

ROUNDING_SHARE = 5e-4
"""-, of the smaller log's usual largest projection, within which two are the same whatever the noise: rounding."""

NAMED_COPIES = 5
"""Copies that a note names; of more it says how many there are."""

REMEDY = "withdraw the one that is not to count"


def fingerprint(log: "GraspLog") -> str:
    """SHA-256 of what the sensor measured: its forces or, where it has none, its displacements, in single precision.

    Friction is a ratio of forces: who has the same forces has learnt nothing new, whatever file they came in, and
    whatever its times, places and names. Noise makes those of two grasps differ.
    """
    measured = log.displacement if log.force is None else log.force
    digest = hashlib.sha256(repr(measured.shape).encode())
    for begin in range(0, len(measured), FRAMES_AT_ONCE):
        part = measured[begin : begin + FRAMES_AT_ONCE].astype(np.float32) + np.float32(0.0)  # no -0.0
        digest.update(part.tobytes())
    return digest.hexdigest()


def signature(log: "GraspLog") -> bytes:
    """The frames of a log, each as ``PROJECTIONS`` sums of its readings with random signs, in bytes.

    Noise makes them differ from grasp to grasp, and rounding changes them by far less than noise does; see
    ``ProjectedFrames``. Empty for readings that take too few values.
    """
    measured = log.displacement if log.force is None else log.force
    if not _is_distinctive(measured):
        return b""
    signs = _signs(measured[0].size)
    kept = min(len(measured), MOST_FRAMES)
    parts = (measured[begin : min(begin + FRAMES_AT_ONCE, kept)] for begin in range(0, kept, FRAMES_AT_ONCE))
    projected = np.concatenate([part.reshape(len(part), -1) @ signs for part in parts])
    return (OF_DISPLACEMENT if log.force is None else OF_FORCE) + projected.astype("<f4").tobytes()


def find_alike(own: bytes, others: Iterable[Signature]) -> list[str]:
    """Those of the other logs that are of the same grasp, as far as they are compared; parts of it may not be alike."""
    if not own:  # nothing touched
        return []
    mine, compared, alike = ProjectedFrames(own), 0, list[str]()
    for other in others:
        theirs = ProjectedFrames(other.content)
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
class ProjectedFrames:
    """A signature read for comparison with any number of others."""

    signature: bytes

    def are_alike(self, other: "ProjectedFrames") -> bool:
        """Whether they are of one grasp: most frames under load of one of the logs are in the other, too."""
        if not self.signature or self.signature[:1] != other.signature[:1]:
            return False
        within = NOISE_SHARE * np.minimum(self._noise, other._noise)
        within = np.maximum(within, ROUNDING_SHARE * min(self._size, other._size))
        return bool(within.all()) and max(self._share_in(other, within), other._share_in(self, within)) >= LEAST_SHARED

    @cached_property
    def frames(self) -> "FloatArray":
        """The projections of each frame, [t, PROJECTIONS], in the unit of the readings."""
        return np.frombuffer(self.signature, "<f4", offset=1).reshape(-1, PROJECTIONS).astype(float)

    @cached_property
    def _size(self) -> float:
        return _usual(np.abs(self.frames).max(axis=1))

    @cached_property
    def _noise(self) -> "FloatArray":
        return _noise(self.frames)

    @cached_property
    def _tolerance(self) -> "FloatArray":
        """How far a frame of another log may be off at most, [PROJECTIONS]."""
        return np.maximum(NOISE_SHARE * self._noise, ROUNDING_SHARE * self._size)

    @cached_property
    def _tree(self) -> "cKDTree":
        from scipy.spatial import cKDTree

        return cKDTree(self.frames / self._tolerance)

    @cached_property
    def _sought(self) -> "FloatArray":
        """Frames under load that are sought in other logs, [k, PROJECTIONS]."""
        load = np.linalg.norm(self.frames / self._tolerance, axis=1)
        loaded = np.flatnonzero(load > 0.5 * _usual(load))
        return np.asarray(self.frames[loaded[np.unique(np.linspace(0, len(loaded) - 1, SOUGHT_FRAMES).astype(int))]])

    def _share_in(self, other: "ProjectedFrames", within: "FloatArray") -> float:
        """Share of the frames sought that are among the other's, ``within`` so much in each projection."""
        scaled = self._sought / other._tolerance
        near = np.asarray(other._tree.query(scaled, k=NEAREST_FRAMES, p=np.inf, distance_upper_bound=1.0)[1])
        frames = np.vstack([other.frames, np.full(PROJECTIONS, np.inf)])  # the last where there are no more
        off = np.abs(frames[near] - self._sought[:, None])
        return float(np.mean(np.any(np.all(off <= within, axis=2), axis=1)))


def _is_distinctive(measured: "FloatArray") -> bool:
    """Whether readings [t, n, m, 3] take enough values: few elements in coarse steps read alike in many grasps."""
    some = measured[np.unique(np.linspace(0, len(measured) - 1, LOOKED_AT).astype(int))]
    return int(np.count_nonzero(np.diff(np.sort(some, axis=0), axis=0))) >= LEAST_VALUES


def _signs(readings: int) -> "FloatArray":
    """The projection, [readings, PROJECTIONS] of 1 and -1: the same in every version, since signatures are stored."""
    drawn = hashlib.shake_256(b"stiction").digest(readings * PROJECTIONS // 8)
    return np.asarray(2.0 * np.unpackbits(np.frombuffer(drawn, np.uint8)).reshape(readings, PROJECTIONS) - 1.0, float)


def _usual(values: "FloatArray") -> float:
    """The 95 % quantile, 0 of nothing: a largest value that one outlier does not change."""
    return float(np.quantile(values, 0.95)) if len(values) else 0.0


def _noise(projected: "FloatArray") -> "FloatArray":
    """Standard deviation [PROJECTIONS] from frame to frame, by second differences; 0 of less than three frames."""
    if len(projected) < 3:
        return np.zeros(PROJECTIONS)
    return np.asarray(1.4826 * np.median(np.abs(np.diff(projected, 2, axis=0)), axis=0) / np.sqrt(6.0))


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
    named = [f"{copy} of {counted}" for copy, counted in pairs[:NAMED_COPIES]]
    more = [f"{len(pairs) - NAMED_COPIES} more"] if len(pairs) > NAMED_COPIES else []
    count = "1 log repeats" if len(pairs) == 1 else f"{len(pairs)} logs repeat"
    note = f"{count} the measurements of another log: counted once ({', '.join([*named, *more])}); {REMEDY}"
    return replace(model, diagnostics={**model.diagnostics, SAME_GRASPS: note})
