"""Which of some known materials a grasp is of, by the samples of its first second."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from stiction_client.arguments import of_kind
from stiction_client.controller.friction import KnownFriction, error_of_mean, utilisation
from stiction_client.controller.settings import ControlSettings
from stiction_client.defaults import UNKNOWN_FRICTION, UNKNOWN_LEVEL, UNKNOWN_SHARE
from stiction_client.elementwise import FloatArray
from stiction_client.errors import InvalidArgument
from stiction_client.linear_friction import LinearFriction, check_model
from stiction_client.quantile import FrictionQuantile

UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, eq=False)
class GripRecognition:
    """``materials`` by name, as they are gripped, and their quantiles together (fields [materials]), of an element that
    bears ``unit``·F^(1/``power``) N, ``deviations`` below their means.

    ``loaded``: when the load began, s. Of all samples within ``recognise_time`` of ``sampled`` s: their ``mean``
    friction by the number of elements (``count``), and how many ``frames`` had any.
    """

    materials: Mapping[str, KnownFriction]
    quantile: FrictionQuantile
    unit: FloatArray
    power: int
    deviations: float
    loaded: float = math.inf
    sampled: float = -math.inf
    mean: float = 0.0
    count: int = 0
    frames: int = 0

    @classmethod
    def among(cls, models: Mapping[str, LinearFriction], settings: ControlSettings) -> "GripRecognition | None":
        """Of these materials; None of none. Raises ``InvalidArgument`` for one that is called "unknown", and for what
        is no model.
        """
        of_kind("materials", models, Mapping)
        for name, model in models.items():
            check_model(model, f"materials[{name!r}]")
        if UNKNOWN in models:
            raise InvalidArgument("materials", sorted(models), f'names other than "{UNKNOWN}"')
        if not models:
            return None
        known = {name: KnownFriction.of_model(model, settings) for name, model in models.items()}
        one = next(iter(known.values()))
        unit = np.array([each.unit for each in known.values()])
        return cls(known, _together(known), unit, one.contact.power, one.deviations)

    def waits(self, time: float, settings: ControlSettings) -> bool:
        """Whether samples may still come of a load that is borne with little force."""
        return time - self.loaded <= settings.recognise_time

    def step(
        self, time: float, loaded: bool, friction: float, count: int, settings: ControlSettings
    ) -> "GripRecognition":
        """The same after a frame with the ``friction`` of so many elements, NaN without any.

        What was sampled more than ``recognise_time`` ago is forgotten by the next sample.
        """
        begun = replace(self, loaded=min(self.loaded, time)) if loaded else self
        if math.isnan(friction):
            return begun
        if not time - self.sampled <= settings.recognise_time:
            return replace(begun, sampled=time, mean=friction, count=count, frames=1)
        total = self.count + count
        mean = self.mean + (friction - self.mean) * count / total
        return replace(begun, mean=mean, count=total, frames=self.frames + 1)

    def borne(self, force: float, settings: ControlSettings) -> float:
        """Load over a force of ``force`` N up to which the grip stays as it is, so that something slips.

        Of the stickiest material then slips what learning needs; what is more slippery slips before, and the stick
        ratio and the samples show it.
        """
        stickiest = float(self._low_and_mean(force)[0].max()) * utilisation(settings.learn_stick_ratio)
        sampled = self.mean * utilisation(settings.reflex_stick_ratio) if self.frames else math.inf
        return max(min(stickiest, sampled), settings.unknown_friction)

    def likeliest(self, force: float, settings: ControlSettings) -> tuple[str, float]:
        """The name with the largest of ``probabilities``, and that."""
        weight = self.probabilities(force, settings)
        best = int(weight.argmax())
        return (*self.materials, UNKNOWN)[best], float(weight[best])

    def probabilities(self, force: float, settings: ControlSettings) -> FloatArray:
        """Of each material, and then of "unknown", given the samples' mean under ``force`` N.

        Friction of a grasp is normal about the model's mean with the model's scatter, that of a surface of which
        nothing is known about ``UNKNOWN_FRICTION``; the samples' mean is normal about it, with their error.
        """
        low, mean = self._low_and_mean(force)
        each, error = (1.0 - UNKNOWN_SHARE) / len(mean), (error_of_mean(self.count, settings) * self.mean) ** 2
        density = np.empty(len(mean) + 1)
        density[:-1] = _log_normal(self.mean - mean, ((mean - low) / self.deviations) ** 2 + error) + math.log(each)
        unknown = UNKNOWN_LEVEL**2 + error
        density[-1] = math.log(UNKNOWN_SHARE) - 0.5 * (
            math.log(unknown) + (self.mean - UNKNOWN_FRICTION) ** 2 / unknown
        )
        weight = np.exp(density - density.max())
        return np.asarray(weight / weight.sum())

    def _low_and_mean(self, force: float) -> tuple[FloatArray, FloatArray]:
        element = self.unit * (force if self.power == 1 else force ** (1.0 / 3.0))
        return np.asarray(self.quantile(element)[0]), np.asarray(self.quantile.mean(element))


def _log_normal(away: FloatArray, variance: FloatArray) -> FloatArray:
    return np.asarray(-0.5 * (np.log(variance) + away**2 / variance))


def _together(known: Mapping[str, KnownFriction]) -> FrictionQuantile:
    names = [entry.name for entry in fields(FrictionQuantile)]
    columns: dict[str, Any] = {
        name: np.array([getattr(each.quantile, name) for each in known.values()]) for name in names
    }
    return FrictionQuantile(**columns)
