"""What a grip controller knows of friction: a model, or what it learnt in this grasp."""

import math
from dataclasses import dataclass
from statistics import median

from stiction_client.contacts import Contact
from stiction_client.controller.settings import ControlSettings
from stiction_client.holding import LoadedContact
from stiction_client.model import FrictionModel
from stiction_client.quantile import FrictionQuantile

NORMAL_DEVIATIONS = 3.0902
"""Standard deviations of a normal quantile of 1e-3, the default bound: what is learnt in one grasp has no better."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownFriction:
    """A conservative ``quantile`` of a contact's friction over the normal force of its elements, ``unit``·F^(1/n) N."""

    contact: Contact
    quantile: FrictionQuantile
    unit: float

    @classmethod
    def of_model(cls, model: FrictionModel, settings: ControlSettings) -> "KnownFriction":
        """What the planner's answers are computed from (``required_normal_force``).

        Where the model tells its scales, of the contact: scatter within it averages over as many elements as touch
        under ``least_force``, the fewest that there will be, so that one quantile serves all loads.
        """
        contact, area = settings.contact, model.element_area
        touching = 1.0 if model.scales is None else max(float(contact.elements(settings.least_force, area)), 1.0)
        quantile = FrictionQuantile.of(model, 0.0, settings.slip_probability, touching)
        return cls(contact, quantile, float(contact.element_force(1.0, area)))

    @classmethod
    def learned(cls, low: float, mean: float, contact: Contact) -> "KnownFriction":
        """One friction coefficient at any force: one grasp tells no slopes."""
        return cls(contact, FrictionQuantile(a=mean, c=0.0, s=mean - low, k=0.0, g=0.0), 1.0)

    def required(self, tangential: float, torque: float, most: float) -> float:
        """Least normal force, N, that holds the load; infinite where none up to ``most`` N does."""
        power = self.contact.power
        loaded = LoadedContact(self.quantile, tangential, self._twist(torque), self.unit, power)
        least, _, holds = loaded.interval(loaded.root(most))
        return float(loaded.force(least)) if holds else math.inf

    def bounds(self, force: float) -> tuple[float, float]:
        """The quantile under ``force`` N, and its mirror image above the mean."""
        element = self.unit * (force if self.contact.power == 1 else force ** (1.0 / 3.0))
        low, mean = float(self.quantile(element)[0]), float(self.quantile.expected()(element)[0])
        return low, 2.0 * mean - low

    def _twist(self, torque: float) -> float:
        return torque / float(self.contact.arm(1.0)) if torque > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class LearnedFriction:
    """The contact's friction by the elements that slipped: ``values`` of the latest frames that told it.

    ``sampled``: of the latest frames that had samples, those among them that the stick ratio contradicts.
    """

    values: tuple[float, ...] = ()
    sampled: tuple[float, ...] = ()

    def with_frame(self, friction: float, agrees: bool, settings: ControlSettings) -> "LearnedFriction":
        """The same after one more frame; of the older ones ``learn_frames`` are kept."""
        values = (*self.values, friction)[-settings.learn_frames :] if agrees else self.values
        return LearnedFriction(values, (*self.sampled, friction)[-settings.learn_frames :])

    def lowest(self, settings: ControlSettings) -> float:
        """The least friction to expect while the force is being lowered; NaN while there are few samples.

        It counts all samples, those among them that the stick ratio contradicts: a detector that misses slip makes the
        stick ratio contradict samples that are right.
        """
        if len(self.sampled) < settings.contradiction_frames:
            return math.nan
        return median(self.sampled) * (1.0 - NORMAL_DEVIATIONS * settings.learned_error)

    def known(self, settings: ControlSettings) -> KnownFriction | None:
        """A model of it, once ``learn_frames`` agree to within ``learn_spread``.

        Frames of one grasp share their errors, so that their spread is not divided by their number.
        """
        count = len(self.values)
        if count < settings.learn_frames:
            return None
        mean = sum(self.values) / count
        spread = math.sqrt(sum((value - mean) ** 2 for value in self.values) / (count - 1))
        if spread > settings.learn_spread * mean:
            return None
        low = mean - NORMAL_DEVIATIONS * math.hypot(spread, settings.learned_error * mean)
        return KnownFriction.learned(low, mean, settings.contact) if low > 0.0 else None


def utilisation(stick_ratio: float) -> float:
    """Load over what a contact can hold, of the area that sticks: 1 − sr^(3/2) (Cattaneo 1938, Mindlin 1949).

    Exact for a Hertzian contact whose load grew, or whose normal force fell, alone.
    """
    return 1.0 - stick_ratio * math.sqrt(stick_ratio)
