"""Resultants known from elsewhere, such as a gripper's force: one more observation beside displacements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipcore.arguments import number, real_array
from slipcore.errors import InvalidInput
from slipcore.forces.defaults import RECONSTRUCTION
from slipcore.forces.operator.gel import Gel
from slipcore.forces.recording import OUTWARD
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class KnownForce:
    """``force`` [..., 3] N by the object in the gel's frame (z into it), NaN where it is not known, and its standard
    ``deviation`` [..., 3] N.
    """

    force: FloatArray
    deviation: FloatArray

    @classmethod
    def of(
        cls, total_force: ArrayLike | None, deviation: float | None, frames: int, largest: float = 0.0
    ) -> "KnownForce":
        """Of normal forces [t] N or forces [t, 3] N on the sensor, NaN where unknown; without a ``deviation`` N they
        are known to a share of each, and of the ``largest`` N there is or was before. Raises ``InvalidInput``.
        """
        spread = None if deviation is None else _deviation(deviation, total_force is not None)
        total = np.full((frames, 3), np.nan)
        if total_force is not None:
            force = real_array("total_force", total_force).astype(np.float64)
            if force.shape not in {(frames,), (frames, 3)} or np.isinf(force).any():
                allowed = f"finite, [{frames}] or [{frames}, 3] N"
                raise InvalidInput("total_force", f"of shape {list(force.shape)}", allowed)
            total[:, 2 if force.ndim == 1 else slice(3)] = force if force.ndim == 1 else force * OUTWARD
        if spread is not None:
            return cls(total, np.full(total.shape, spread))
        size, share = np.abs(total), RECONSTRUCTION.force_tolerance
        most = np.nanmax(size, initial=max(largest, RECONSTRUCTION.least_force))
        return cls(total, share * np.maximum(size, share * most))

    def __getitem__(self, frame: int) -> "KnownForce":
        """Of one frame."""
        return KnownForce(self.force[frame], self.deviation[frame])

    @property
    def given(self) -> BoolArray:
        """Which components [..., 3] are known."""
        return np.isfinite(self.force)

    @property
    def noise(self) -> FloatArray:
        """Standard deviations [..., 3] N, infinite of what is not known."""
        return np.where(self.given, self.deviation, np.inf)

    def away(self, resultant: FloatArray, deviation: FloatArray) -> FloatArray:
        """By how many standard deviations [..., 3] it differs from a resultant that is found, z outward, with the
        ``deviation`` N of that; NaN where it is not known.
        """
        return np.asarray(np.abs(resultant - self.force * OUTWARD) / np.hypot(deviation, self.deviation))

    def check(self, name: str, gel: Gel, area: float) -> None:
        """Raises ``InvalidInput`` of this name for more than a gel of so many m² in all bears."""
        bearable = RECONSTRUCTION.largest_pressure * gel.young_modulus * area
        largest = np.nanmax(np.abs(self.force), initial=0.0)
        if largest > bearable:
            share = f"{RECONSTRUCTION.largest_pressure:g} times Young's modulus on all elements"
            allowed = f"at most {bearable:.3g} N, {share} (is it in N, and of this gel?)"
            raise InvalidInput(name, f"up to {largest:.3g} N", allowed)


def _deviation(deviation: float, has_force: bool) -> float:
    """A standard deviation N, refused where it is none and where there is no force that it could be of."""
    name, allowed = "total_force_deviation", "above 0 N and finite, beside total_force"
    value = number(name, deviation, allowed)
    if not has_force or not 0.0 < value < np.inf:
        raise InvalidInput(name, deviation, allowed)
    return value


def contradicts(away: FloatArray) -> BoolArray:
    """Whether what is known and what is found [..., 3] are not alike, by standard deviations."""
    return np.asarray((away > RECONSTRUCTION.contradiction).any(axis=-1))
