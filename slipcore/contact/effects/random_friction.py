"""Friction that differs from place to place at random (the paper's ε)."""

import zlib
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from slipcore.contact.defaults import SCENE
from slipcore.contact.plan.entries import check_own_types
from slipcore.contact.plan.plan import Plan
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True)
class RandomFriction:
    """μ has a normal deviation of standard deviation ``scale``, correlated as exp(−r²/2ℓ²) over ``correlation_length``
    ℓ m.

    The field is a sum of random waves, so it is the same whatever the grid.
    """

    scale: float
    correlation_length: float

    why: ClassVar[str] = "real surfaces have no single coefficient: fronts are ragged, fits have scatter"
    cost: ClassVar[str] = "nothing: one field, made before the first step"

    def __post_init__(self) -> None:
        check_own_types(self)
        if not self.scale >= 0.0:
            raise InvalidInput("scale of random friction", self.scale, "at least 0")
        if not self.correlation_length > 0.0:
            raise InvalidInput("correlation_length", self.correlation_length, "above 0 m")

    @property
    def absent(self) -> bool:
        """Whether there is no scatter."""
        return self.scale == 0.0

    def extend(self, plan: Plan) -> Plan:
        """Add the field, and its scatter to the scene's friction law."""
        rng = np.random.default_rng([plan.seed, zlib.crc32(repr(self).encode())])
        wave = rng.normal(scale=1.0 / self.correlation_length, size=(SCENE.random_waves, 2))
        phase = rng.uniform(0.0, 2.0 * np.pi, size=SCENE.random_waves)
        amplitude = self.scale * np.sqrt(2.0 / SCENE.random_waves)

        def field(x: FloatArray, y: FloatArray) -> FloatArray:
            total = np.zeros_like(x)
            for (kx, ky), shift in zip(wave, phase, strict=True):
                total += np.cos(kx * x + ky * y + shift)
            return np.asarray(amplitude * total)

        problem = replace(plan.problem, friction_fields=(*plan.problem.friction_fields, field))
        return replace(plan, problem=problem, law=replace(plan.law, scale=float(np.hypot(plan.law.scale, self.scale))))
