"""Friction samples at slipping points (stage 5: samples)."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FrictionSamples:
    """Friction observed at slipping micro-elements, one entry an element and frame: arrays [k].

    ``friction_coefficient`` f_t/f_n [-], ``tangential_velocity`` m/s (≥ 0), ``normal_force`` N and
    ``tangential_force`` N of the element (paper, eq. 38–39, as magnitudes), ``time`` s, ``element`` row-major index,
    ``weight`` probability that the element did slip, ``element_area`` m².
    """

    friction_coefficient: FloatArray
    tangential_velocity: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    time: FloatArray
    element: NDArray[np.int64]
    weight: FloatArray
    element_area: float

    def __post_init__(self) -> None:
        count = len(self.friction_coefficient)
        for entry in fields(self)[:-1]:
            shape = np.shape(getattr(self, entry.name))
            if shape != (count,):
                raise InvalidInput(entry.name, f"of shape {list(shape)}", f"shape [{count}]")

    def __len__(self) -> int:
        return len(self.friction_coefficient)

    @classmethod
    def concatenate(cls, parts: Sequence["FrictionSamples"]) -> "FrictionSamples":
        """Join samples of elements of one size; raises ``InvalidInput`` where the element areas differ."""
        areas = sorted({part.element_area for part in parts})
        if len(areas) != 1:
            raise InvalidInput("element_area", areas, "one element area for all parts")
        joined = {
            entry.name: np.concatenate([getattr(part, entry.name) for part in parts]) for entry in fields(cls)[:-1]
        }
        return cls(**joined, element_area=areas[0])
