"""What a log shows of its markers: displacements as rows of data, which of them were seen, and their noise."""

from dataclasses import dataclass

import numpy as np

from slipcore.errors import InvalidInput, UnknownScale
from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.frames import BoolArray, FloatArray, GraspLog


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Displacements ``data`` [t, m] m along the ``axes`` that are seen, one after the other, z into the gel; which are
    ``seen`` [t, m]; and the ``noise`` m of each.
    """

    data: FloatArray
    seen: BoolArray
    axes: tuple[int, ...]
    noise: float

    @classmethod
    def of(cls, log: GraspLog, noise: float | None) -> "Recording":
        """Of a log; ``noise`` None is estimated from it. Raises ``UnknownScale`` for one not in metres and
        ``InvalidInput`` for a noise that is none.
        """
        if not log.is_scaled:
            raise UnknownScale("forces follow from displacement in m, and the log's scale is unknown")
        axes = (0, 1, 2) if log.displacement[..., 2].any() else (0, 1)
        inwards = np.moveaxis(log.displacement * [1.0, 1.0, -1.0], -1, 1)[:, list(axes)]
        shown = np.ones(inwards.shape, bool) if log.observed is None else log.observed[:, None] & (inwards == inwards)
        return cls(inwards.reshape(len(log), -1), shown.reshape(len(log), -1), axes, _noise(log, noise))

    def touched(self) -> BoolArray:
        """Frames [t] in which markers moved by more than noise."""
        count = np.maximum(self.seen.sum(axis=1), 1)
        power = np.sum(np.where(self.seen, self.data, 0.0) ** 2, axis=1) / count
        return np.asarray(power > self.noise**2 * (1.0 + RECONSTRUCTION.significant * np.sqrt(2.0 / count)))

    def strongest(self) -> int:
        """The frame in which something touches and markers moved most."""
        return int(np.argmax(np.where(self.touched(), np.sum(self.data**2, axis=1), 0.0)))

    def error(self, data: FloatArray, seen: BoolArray, noise: float) -> FloatArray:
        """Standard deviation [m] of one frame's data about what bilinear tractions can explain; infinite unseen."""
        largest = np.abs(data[seen]).max(initial=0.0)
        return np.where(seen, np.hypot(noise, RECONSTRUCTION.discretisation * largest), np.inf)


def _noise(log: GraspLog, noise: float | None) -> float:
    if noise is None:
        from slipcore.noise import estimate_noise  # compiled

        plane = log.displacement[..., :2].reshape(len(log), -1, 2).swapaxes(1, 2)
        return float(np.nan_to_num(estimate_noise(log.time, plane)))
    if not 0.0 <= noise < np.inf:
        raise InvalidInput("noise", noise, "0 m or more, finite")
    return noise
