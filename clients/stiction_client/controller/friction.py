"""What a grip controller knows of friction: a model, or what it learnt in this grasp."""

import math
from dataclasses import dataclass, field, replace
from statistics import NormalDist, median

from stiction_client.contacts import Contact
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.settings import ControlSettings
from stiction_client.defaults import LEAST_CERTAIN, NORMAL_DEVIATIONS
from stiction_client.holding import LoadedContact
from stiction_client.linear_friction import LinearFriction
from stiction_client.quantile import FrictionQuantile


@dataclass(frozen=True, slots=True, eq=False)
class KnownFriction:
    """A conservative ``quantile`` of a contact's friction over the normal force of its elements, ``unit``·F^(1/n) N.

    ``deviations``: standard deviations that it lies below the mean; ``of_others``: it is of other grasps, so
    that samples of this one can sharpen it; ``sharpened``: the quantile of this grasp, by them, over that of any;
    ``shifted``: likewise its mean; ``samples``: of how many elements these are; ``learnt``: that more samples would
    not sharpen it much, or would cost slip.
    """

    contact: Contact
    quantile: FrictionQuantile
    unit: float
    deviations: float = NORMAL_DEVIATIONS
    of_others: bool = False
    sharpened: float = 1.0
    shifted: float = 1.0
    samples: int = 0
    learnt: bool = False

    @classmethod
    def of_model(cls, model: LinearFriction, settings: ControlSettings) -> "KnownFriction":
        """What the planner's answers are computed from (``required_normal_force``).

        Where the model has scales, of the contact: scatter within it averages over as many elements as touch
        under ``least_force``, the fewest that there will be, so that one quantile serves all loads.
        """
        contact, area = settings.contact, model.element_area
        touching = 1.0 if model.scales is None else max(float(contact.elements(settings.least_force, area)), 1.0)
        quantile = FrictionQuantile.of(model, 0.0, settings.slip_probability, touching)
        deviations = -NormalDist().inv_cdf(min(settings.slip_probability, LEAST_CERTAIN))
        return cls(contact, quantile, float(contact.element_force(1.0, area)), deviations, of_others=True)

    @classmethod
    def slid(cls, friction: float, settings: ControlSettings) -> "KnownFriction":
        """Of a contact that slid: it bears its friction over all of its elements, but for what is common to all."""
        return cls.learned(friction * (1.0 - NORMAL_DEVIATIONS * settings.learned_error), friction, settings.contact)

    @classmethod
    def learned(cls, low: float, mean: float, contact: Contact) -> "KnownFriction":
        """One friction coefficient at any force: one grasp does not determine slopes."""
        return cls(contact, FrictionQuantile(a=mean, c=0.0, s=mean - low, k=0.0, g=0.0), 1.0)

    def required(self, tangential: float, torque: float, most: float) -> float:
        """Least normal force, N, that holds the load; infinite where none up to ``most`` N does."""
        load, moment = self.contact.as_forces(tangential / self.sharpened, torque / self.sharpened)
        loaded = LoadedContact(self.quantile, load, moment, self.unit, self.contact.power)
        least, holds = loaded.lowest(loaded.root(most))
        return float(loaded.force(least)) if holds else math.inf

    def expected(self, force: float) -> float:
        """The mean of this grasp's friction under ``force`` N."""
        return self.shifted * self._low_and_mean(force)[1]

    def bounds(self, force: float) -> tuple[float, float]:
        """The quantile under ``force`` N, and its mirror image above the mean."""
        low, mean = self._low_and_mean(force)
        return low, 2.0 * mean - low

    def refuted(self, learned: "LearnedFriction", load: LoadEstimate, force: float, settings: ControlSettings) -> bool:
        """Whether the latest samples together speak for less friction under ``force`` N than both errors explain.

        They have to agree, unless by what they say less its error the ``load`` to come would leave less sticking than
        ``learn_stick_ratio``: until then more of them can be waited for. A contact that bears a load has at least that
        friction, whatever samples say.
        """
        if not learned.values:
            return False
        borne = utilisation(settings.learn_stick_ratio) * learned.low(settings) * force
        if load.lead(settings) <= borne and not learned.agrees(settings.contradiction_frames, settings):
            return False
        mean, error = self._mean_and_error(learned, force, settings)
        return mean - max(learned.mean, load.size / force) > settings.contradiction_deviations * error

    def surpassed(self, learned: "LearnedFriction", force: float, settings: ControlSettings) -> bool:
        """Whether the latest samples together speak for more friction under ``force`` N than both errors explain."""
        mean, error = self._mean_and_error(learned, force, settings)
        return learned.mean - mean > settings.contradiction_deviations * error

    def _mean_and_error(
        self, learned: "LearnedFriction", force: float, settings: ControlSettings
    ) -> tuple[float, float]:
        """The mean under ``force`` N, and one standard deviation of what the samples' mean may differ by from it."""
        low, mean = self._low_and_mean(force)
        return mean, math.hypot((mean - low) / self.deviations, learned.error(settings) * mean)

    def sharpen(self, learned: "LearnedFriction", force: float, settings: ControlSettings) -> "KnownFriction":
        """The same with what the samples of this grasp say under ``force`` N, once ``contradiction_frames`` agree.

        The contact's friction is normal about the model's mean, with the model's scatter; the samples' mean is normal
        about the contact's, with their error. The quantile becomes that of the contact's friction given the samples.
        Of samples from different times the most are taken: later ones are often of single elements, which a detector
        takes for slipping while they rest.
        """
        count = learned.count
        if not self.of_others or force == 0.0 or count < self.samples:
            return self
        if not learned.agrees(settings.contradiction_frames, settings):
            return self
        low, mean = self._low_and_mean(force)
        if not 0.0 < low < mean:
            return self
        scatter, error = (mean - low) / self.deviations, learned.error(settings) * learned.mean
        weight = scatter**2 / (scatter**2 + error**2)
        expected = mean + weight * (learned.mean - mean)
        posterior = expected - self.deviations * math.sqrt(weight) * error
        if posterior <= 0.0:
            return self
        enough = settings.sample_error <= settings.learned_error * math.sqrt(count)
        learnt = self.learnt or (enough and not self.surpassed(learned, force, settings))
        return replace(self, sharpened=posterior / low, shifted=expected / mean, samples=count, learnt=learnt)

    def disproved(self) -> "KnownFriction":
        """Without what the samples of this grasp said; no more are sought."""
        return replace(self, sharpened=1.0, shifted=1.0, samples=0, learnt=True)

    def _low_and_mean(self, force: float) -> tuple[float, float]:
        element = self.unit * (force if self.contact.power == 1 else force ** (1.0 / 3.0))
        return float(self.quantile(element)[0]), float(self.quantile.mean(element))


@dataclass(frozen=True, slots=True)
class LearnedFriction:
    """The contact's friction by the elements that slipped: ``values`` of the latest frames that had any, by how many
    elements (``counts``).

    ``sampled``: of the latest frames that had samples, those among them that the stick ratio contradicts. ``count``:
    of all elements in these frames; ``mean``: of their friction, NaN without any; ``spread``: of the frames about it,
    relative, each by the number of its elements.
    """

    values: tuple[float, ...] = ()
    counts: tuple[int, ...] = ()
    sampled: tuple[float, ...] = ()
    count: int = field(init=False, compare=False, default=0)
    mean: float = field(init=False, compare=False, default=math.nan)
    spread: float = field(init=False, compare=False, default=math.nan)

    def __post_init__(self) -> None:
        count = sum(self.counts)
        if count == 0:
            return
        mean = sum(value * each for value, each in zip(self.values, self.counts, strict=True)) / count
        squares = sum((value - mean) ** 2 * each for value, each in zip(self.values, self.counts, strict=True))
        spread = math.sqrt(squares / count) / mean if mean > 0.0 else math.inf
        for name, value in (("count", count), ("mean", mean), ("spread", spread)):
            object.__setattr__(self, name, value)  # the record is frozen, and asked for them several times a frame

    def with_frame(self, friction: float, count: int, agrees: bool, settings: ControlSettings) -> "LearnedFriction":
        """The same after one more frame; of the older ones ``learn_frames`` are kept."""
        frames = settings.learn_frames
        sampled = (*self.sampled, friction)[-frames:]
        if not agrees:
            return LearnedFriction(self.values, self.counts, sampled)
        return LearnedFriction((*self.values, friction)[-frames:], (*self.counts, count)[-frames:], sampled)

    def error(self, settings: ControlSettings) -> float:
        """Of the mean, relative: one standard deviation, of which the bias common to all samples is a part."""
        return error_of_mean(self.count, settings)

    def low(self, settings: ControlSettings) -> float:
        """The mean less what it may err by; 0 without samples."""
        return self.mean * (1.0 - NORMAL_DEVIATIONS * self.error(settings)) if self.values else 0.0

    def lowest(self, settings: ControlSettings) -> float:
        """The least friction to expect while the force is being lowered; NaN while there are few samples.

        It counts all samples, those among them that the stick ratio contradicts: a detector that misses slip makes the
        stick ratio contradict samples that are right.
        """
        if len(self.sampled) < settings.learn_frames:
            return math.nan
        return median(self.sampled) * (1.0 - NORMAL_DEVIATIONS * settings.learned_error)

    def agrees(self, frames: int, settings: ControlSettings) -> bool:
        """Whether there are so many ``frames`` of them, to within ``learn_spread``."""
        return len(self.values) >= frames and self.spread <= settings.learn_spread

    def known(self, settings: ControlSettings) -> KnownFriction | None:
        """A model of it, once ``learn_frames`` agree to within ``learn_spread``."""
        if not self.agrees(settings.learn_frames, settings):
            return None
        low = self.low(settings)
        return KnownFriction.learned(low, self.mean, settings.contact) if low > 0.0 else None


def error_of_mean(count: int, settings: ControlSettings) -> float:
    """Of friction by the samples of ``count`` elements, relative: one standard deviation."""
    return math.hypot(settings.learned_error, settings.sample_error / math.sqrt(count))


def utilisation(stick_ratio: float) -> float:
    """Load over what a contact can hold, of the area that sticks: 1 − sr^(3/2) (Cattaneo 1938, Mindlin 1949).

    Exact for a Hertzian contact whose load grew, or whose normal force fell, alone.
    """
    return 1.0 - stick_ratio * math.sqrt(stick_ratio)
