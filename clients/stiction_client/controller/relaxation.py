"""Whether a contact slides while its grip is relaxed under a load at rest: then it bears ever less."""

import math
from dataclasses import dataclass, replace

from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.settings import ControlSettings
from stiction_client.defaults import REST_FRAMES, TAKEN_AWAY


@dataclass(frozen=True, slots=True)
class Relaxation:
    """The ``load`` N that a grip bore while that was at rest (``since``, s), for so many ``frames``; and, as the grip
    is relaxed, what it ``bore`` of its force when that began, what it ``bears``, and how much load it ``lost`` N, a sum
    over frames (Page's cumulative sum, 1954).

    A contact that holds bears its load under any force; one that slides bears less, the less it is pressed. A detector
    that sees the sensor alone finds nothing: no marker moves while all of a contact slides.
    """

    since: float = math.inf
    load: float = 0.0
    frames: int = 0
    bore: float = 0.0
    bears: float = 0.0
    lost: float = 0.0

    def step(self, load: LoadEstimate, normal: float, relaxed: bool) -> "Relaxation":
        """The same after one more frame, under ``normal`` N; what is lost within the load's noise is no loss."""
        if not math.isfinite(load.steady):
            return Relaxation()
        if load.steady != self.since:
            return Relaxation(load.steady, load.size, 1)
        if not relaxed or normal == 0.0:
            return self._averaged(load, 0.0)
        bore, bears = self.bore or self.load / normal, load.size / normal
        if bears < TAKEN_AWAY * bore:
            return Relaxation()
        return replace(self, bore=bore, bears=bears)._averaged(load, self.lost + self.load - load.size - load.noise)

    def _averaged(self, load: LoadEstimate, lost: float) -> "Relaxation":
        """With what was lost; while that is more than noise, the load from before stands."""
        if lost > load.noise:
            return replace(self, lost=lost)
        mean = self.load + (load.size - self.load) / min(self.frames + 1.0, REST_FRAMES)
        return replace(self, load=mean, frames=self.frames + 1, lost=max(lost, 0.0))

    def slides(self, load: LoadEstimate, settings: ControlSettings) -> bool:
        """Whether more was lost than noise explains, and than a load at rest may change by, but not by less load."""
        explained = max(settings.slide_deviations * load.noise, settings.steady_share * self.load)
        return self.lost > explained and self.bears >= self.bore
