"""Forces of frames of one contact by all of these frames: those before, and those after."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipcore.forces.defaults import OVER_TIME
from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.inverse.over_time import Modes
from slipcore.forces.tracking.frame_forces import FrameEstimate
from slipcore.forces.tracking.tracker import Key, Tracker
from slipcore.frames import BoolArray, FloatArray

Frame = Callable[[int], tuple[ObservationModel, FloatArray]]
"""What a frame measures."""


def runs(tracker: Tracker, frame: Frame, touched: BoolArray, strongest: int) -> Iterator[tuple[Key, list[int]]]:
    """Frames that follow each other in which something ``touched`` [t] and a contact holds, with its key: followed from
    the ``strongest``, by which the ``tracker`` began, both ways.
    """
    onward = _one_way(tracker, frame, touched, range(strongest, len(touched)))
    back = _one_way(tracker, frame, touched, range(strongest - 1, -1, -1))
    (key, frames), before = next(onward), next(back, None)
    if before is not None and before[0] is key and before[1][-1] == strongest - 1:
        frames, before = [*before[1], *frames], None
    yield key, frames
    if before is not None:
        yield before
    yield from back
    yield from onward


def _one_way(now: Tracker, frame: Frame, touched: BoolArray, way: range) -> Iterator[tuple[Key, list[int]]]:
    frames = list[int]()
    for t in way:
        if not touched[t]:
            continue
        found = now.at(*frame(t))
        is_next = not frames or (found.key is now.key and abs(t - frames[-1]) == 1 and len(frames) < OVER_TIME.frames)
        if not is_next:
            yield now.key, sorted(frames)
            frames = []
        now = found
        frames.append(t)
    if frames:
        yield now.key, sorted(frames)


@dataclass(frozen=True, slots=True, eq=False)
class ContactRun:
    """Frames of one contact: a ``key`` whose fit is that by all of them, and the ``estimates`` of each."""

    key: Key
    estimates: tuple[FrameEstimate | None, ...]

    @classmethod
    def frame_by_frame(cls, key: Key, count: int) -> "ContactRun":
        """So many frames, each by itself."""
        return cls(key, (None,) * count)

    @classmethod
    def of(cls, key: Key, data: FloatArray, time: FloatArray, noise: float) -> "ContactRun":
        """Of ``data`` [t, m + 3] at ``time`` [t] s by markers of ``noise`` m, which is another in each frame.

        The covariance is that of the frame that is known least, the first or the last; the operator is that of a load
        that stays as it is, in the middle. A known resultant's error is taken to last, so that it counts in its own
        frame alone. Where each frame shows all that there is, it is by itself.
        """
        if len(data) == 1 or noise == 0.0:
            return cls.frame_by_frame(key, len(data))
        markers = key.observation.noise.copy()
        markers[-3:] = np.inf
        white = (noise / float(markers.min())) ** 2
        modes = Modes.of(ObservationModel(key.observation.response, markers), key.fit, white)
        seen = data @ modes.components.T
        memory = modes.memory(seen, time)
        lasts = modes.smoothed(seen, memory)
        by_all = modes.tractions(lasts)
        steady = modes.tractions(modes.smoothed(np.ones_like(seen), memory)).mean[len(data) // 2]
        found = _Posterior(
            by_all.mean @ modes.root.T,
            modes.root * np.sqrt(by_all.variance.max(axis=0)),
            modes.root @ (steady[:, None] * modes.components),
        )
        for row in range(len(markers) - 3, len(markers)):
            found = found.with_known(key, row, data[:, row])
        own = np.isfinite(markers)
        shown = lasts.mean @ modes.components * np.where(own, markers, 0.0) ** 2 + np.where(own, 0.0, data)
        fit = replace(key.fit, operator=found.operator, root=found.root)
        pairs = zip(found.mean, shown, strict=True)
        return cls(replace(key, fit=fit), tuple(FrameEstimate(mean.reshape(3, -1), each) for mean, each in pairs))


@dataclass(frozen=True, slots=True, eq=False)
class _Posterior:
    """Tractions' ``mean`` [t, 3 j] in each frame, and the ``root`` and ``operator`` of a fit."""

    mean: FloatArray
    root: FloatArray
    operator: FloatArray

    def with_known(self, key: Key, row: int, known: FloatArray) -> "_Posterior":
        """The same where the observation's ``row``, a resultant, is ``known`` [t] N, if it is.

        Potter's update of the covariance's root (Bierman, Factorization Methods for Discrete Sequential Estimation,
        1977, §II.6), which squares no condition number.
        """
        noise = float(key.observation.noise[row])
        if not np.isfinite(noise):
            return self
        whole = key.observation.response[row][:, key.fit.support].ravel()
        along = whole @ self.root
        spread = np.hypot(np.linalg.norm(along), noise)
        gain = self.root @ along / spread**2
        operator = self.operator - np.outer(gain, whole @ self.operator)
        operator[:, row] += gain
        mean = self.mean + np.outer(known - self.mean @ whole, gain)
        root = self.root - np.outer(gain, along) * (spread / (spread + noise))
        return _Posterior(mean, root, operator)
