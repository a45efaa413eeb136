"""Whether a contact slides while its grip is relaxed under a load at rest: then it bears ever less."""

import math
from dataclasses import dataclass

from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.settings import ControlSettings
from stiction_client.controller.stick_ratio import StickRatioEstimate
from stiction_client.defaults import BORNE, FALLING, KNOWN_FRAMES, LEAST_NOISE, REST_FRAMES, TAKEN_AWAY


@dataclass(frozen=True, slots=True)
class Relaxation:
    """The ``load`` N that a grip bore while that was at rest (``since``, s), the mean of so many ``frames``.

    Of the latest frames of a grip that is being relaxed whose loads look like those of a contact that slides: the force
    ``start`` N before them, 0 without any; how many there are (``sliding``), the sums of what they ``bore`` and of what
    they were ``pressed`` with, N; and, of the load that each lacks, the sums of what is ``expected`` by a slide,
    squared, and of that times what is ``lost``, N².

    A contact that holds bears its load under any force; one that slides bears less, the less it is pressed. A detector
    that sees the sensor alone finds nothing: no marker moves while all of a contact slides.
    """

    since: float = math.inf
    load: float = 0.0
    frames: int = 0
    start: float = 0.0
    sliding: int = 0
    bore: float = 0.0
    pressed: float = 0.0
    expected: float = 0.0
    lost: float = 0.0

    def step(self, load: LoadEstimate, normal: float, relaxed: bool) -> "Relaxation":
        """The same after one more frame, under ``normal`` N.

        Frames count while a slide explains their loads better than a contact that holds (Page's test, 1954); else they
        add to the mean of what it holds.
        """
        if not math.isfinite(load.steady):
            return Relaxation()
        if load.steady != self.since:
            return Relaxation(load.steady, load.size, 1)
        known = relaxed and self.start > 0.0 and self.frames >= KNOWN_FRAMES
        expected, lost = self.load * (1.0 - normal / self.start) if known else 0.0, self.load - load.size
        if lost > 2.0 * max(expected, 0.0) + TAKEN_AWAY * load.noise:
            return Relaxation(load.steady, load.size, 1)
        squares, lost = self.expected + expected**2, self.lost + expected * lost
        sliding, bore, pressed = self.sliding + 1, self.bore + load.size, self.pressed + normal
        if expected >= 0.0 and lost > 0.5 * squares:
            return Relaxation(self.since, self.load, self.frames, self.start, sliding, bore, pressed, squares, lost)
        frames = self.frames + sliding
        share = min(sliding / min(frames, REST_FRAMES), 1.0)
        held = self.load + (bore / sliding - self.load) * share
        return Relaxation(self.since, held, frames, normal if relaxed else 0.0)

    @property
    def bears(self) -> float:
        """Load over force of the frames in which the contact slides, its friction."""
        return self.bore / self.pressed

    def slides(self, load: LoadEstimate, sticking: StickRatioEstimate, settings: ControlSettings) -> bool:
        """Whether a slide explains the loads so much better that noise does not, and no load that is taken away.

        Less is enough while the stick ratio falls: a slide of all elements alike is slow to show in it, but then at
        once. What slides bears its friction of its force, which is no less than what it bore of it before.
        """
        evidence = self.lost - 0.5 * self.expected
        if evidence <= 0.0 or self.lost > 2.0 * self.expected or self.bears < BORNE * sticking.bore:
            return False
        deviations = settings.slide_deviations * (FALLING if sticking.falls(settings) else 1.0)
        return evidence > 0.5 * (deviations * max(load.noise, LEAST_NOISE * self.load)) ** 2
