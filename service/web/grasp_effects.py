"""How the newest grasps of a material differ from its model, as a page shows it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from db.records import SampledLog, StoredModel
from service.domain.models.stored_results import to_friction_model
from service.domain.sensors.names import grasping
from service.web.charts import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, Axis, Tick

if TYPE_CHECKING:
    from estimators import GraspEffect

MOST_GRASPS = 40
"""Told apart in a picture."""


@dataclass(frozen=True, slots=True)
class Differing:
    """A log with the effect of its grasp; ``is_certain``: its interval does not hold 0."""

    log: SampledLog
    effect: "GraspEffect"

    @property
    def is_certain(self) -> bool:
        """Whether the interval leaves 0 out."""
        low, high = self.effect.interval
        return not low <= 0.0 <= high


@dataclass(frozen=True, slots=True)
class Whisker:
    """A grasp's place in the picture, and those of its effect and of the ends of its interval."""

    x: float
    y: float
    low: float
    high: float
    is_certain: bool


@dataclass(frozen=True, slots=True)
class EffectChart:
    """The numbers of an SVG: a whisker a grasp, oldest first, and where no difference stands."""

    whiskers: Sequence[Whisker]
    zero: float
    y_ticks: Sequence[Tick]

    x_ticks: Sequence[Tick] = ()
    width, height, left, right, top, bottom = WIDTH, HEIGHT, LEFT, WIDTH - RIGHT, TOP, HEIGHT - BOTTOM


def differing(stored: StoredModel, logs: Sequence[SampledLog]) -> list[Differing]:
    """Effects of the logs' grasps, in their order; none by a model without scatter between grasps.

    Logs whose moments an older version stored, without their places, are left out.
    """
    if stored.model.scales is None:
        return []
    from estimators import Moments, grasp_effects  # loads the numerics, which the server starts without

    kept = [(log, log.samples.moments) for log in logs if log.samples.moments]
    moments = [(log, Moments.from_bytes(content).of_sensor(grasping(log.samples.sensor))) for log, content in kept]
    known = [(log, each) for log, each in moments if len(each.grasps) == 1]
    effects = grasp_effects(to_friction_model(stored.model), [each for _, each in known])
    return [Differing(log, effect) for (log, _), effect in zip(known, effects, strict=True)]


def draw_effects(found: Sequence[Differing]) -> EffectChart:
    """The chart of one grasp or more, in per cent."""
    most = max(1e-3, *(abs(end) for each in found for end in each.effect.interval))
    up = Axis(-105.0 * most, 105.0 * most, HEIGHT - BOTTOM, TOP)
    across = Axis(-0.5, len(found) - 0.5, LEFT, WIDTH - RIGHT)
    whiskers = []
    for k, each in enumerate(found):
        y, low, high = (up.place(100.0 * value) for value in (each.effect.value, *each.effect.interval))
        whiskers.append(Whisker(across.place(k), y, low, high, each.is_certain))
    return EffectChart(whiskers, up.place(0.0), up.ticks())
