"""How elements share a change of the load: sticking ones take their part and more, slipping ones ever less."""

from typing import NamedTuple

import numpy as np

from slipcore.defaults import NUMERICS, ForcesOnlyOptions
from slipcore.frames import BoolArray, FloatArray

_LEAST_FORCE = NUMERICS.least_element_force


class Loads(NamedTuple):
    """Forces on elements [k] at places [k, 2] m: ``normal`` N inwards, ``tangential`` [k, 3] N."""

    place: FloatArray
    normal: FloatArray
    tangential: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """Of tangential to normal force, [k]."""
        size: FloatArray = np.linalg.norm(self.tangential, axis=-1)
        return size / np.maximum(self.normal, _LEAST_FORCE)

    @property
    def evenly(self) -> FloatArray:
        """Each element's vector of force over normal force, [k, 3], if the load were shared by the normal force.

        With F_N = Σp, centre c = Σp x/F_N and arms r = x − c: q + ω ẑ × r for q = Σf/F_N and ω = Σ(r × f)/Σp r².
        """
        arm, polar = self._arms()
        total = self.normal.sum()
        turn = (arm[:, 0] * self.tangential[:, 1] - arm[:, 1] * self.tangential[:, 0]).sum() / polar
        even: FloatArray = np.tile(self.tangential.sum(axis=0) / total, (len(self.normal), 1))
        even[:, 0] -= turn * arm[:, 1]
        even[:, 1] += turn * arm[:, 0]
        return even

    def sideways(self, change: FloatArray) -> float:
        """Size of a ``change`` of the tangential forces [k, 3] as a whole, N: of its sum, and of its moment over the
        radius of gyration.
        """
        arm, polar = self._arms()
        moment = (arm[:, 0] * change[:, 1] - arm[:, 1] * change[:, 0]).sum()
        return float(np.hypot(np.linalg.norm(change.sum(axis=0)), moment / np.sqrt(polar / self.normal.sum())))

    def _arms(self) -> tuple[FloatArray, float]:
        arm = self.place - (self.normal[:, None] * self.place).sum(axis=0) / self.normal.sum()
        return arm, float((self.normal[:, None] * arm**2).sum()) + NUMERICS.least_spread


class Sharing(NamedTuple):
    """What a change of the load says of elements [k]: their force ``ratio``, and its ``deviation``; the ``part`` of the
    change of that ratio over what an element takes that goes on sharing as it did, with its ``part_deviation``; the
    change ``expected`` of it if the load were shared evenly, below 0 where it is taken back; whether the ratio
    ``falls``.
    """

    ratio: FloatArray
    deviation: FloatArray
    part: FloatArray
    part_deviation: FloatArray
    expected: FloatArray
    falls: BoolArray


def compare(before: Loads, now: Loads, noise: float, options: ForcesOnlyOptions) -> Sharing:
    """How elements shared the change from ``before`` to ``now``; ``noise`` of one component of force, N."""
    ratio, even = now.ratio, now.evenly
    along = now.tangential / np.maximum(np.linalg.norm(now.tangential, axis=-1), _LEAST_FORCE)[:, None]
    expected = ((even - before.evenly) * along).sum(axis=-1)
    level = np.maximum((even * along).sum(axis=-1), options.least_change)
    share = np.clip(ratio / level, 1.0 / options.largest_share, options.largest_share)
    deviation = noise * np.sqrt(1.0 + ratio**2) / np.maximum(now.normal, _LEAST_FORCE)
    most = np.maximum(np.abs(expected) * share, options.least_change)
    change = ratio - before.ratio
    return Sharing(ratio, deviation, change / most, np.sqrt(2.0) * deviation / most, expected, change < 0.0)


def log_density(x: FloatArray, mean: FloatArray | float, deviation: FloatArray | float) -> FloatArray:
    """Of a normal distribution, up to a constant."""
    density: FloatArray = -0.5 * ((x - mean) / deviation) ** 2 - np.log(deviation)
    return density


def stick_density(seen: Sharing, options: ForcesOnlyOptions) -> FloatArray:
    """Log density [k] of the part that sticking elements take: as before, or more for others that slip."""
    as_before = log_density(seen.part, 1.0, np.hypot(options.part_spread, seen.part_deviation))
    more = log_density(seen.part, options.overload, np.hypot(options.overload_spread, seen.part_deviation))
    share = options.overload_share
    mixed = np.logaddexp(np.log1p(-share) + as_before, np.log(share) + more)
    return _or_anything(mixed, seen, options)


def slip_density(seen: Sharing, friction: FloatArray, options: ForcesOnlyOptions) -> FloatArray:
    """Log density [g, k] of the part that slipping elements take, for each ``friction`` [g].

    An element slips from its rim inwards, and what sticks in it takes on load until nothing does: the compliance of a
    contact in partial slip (Mindlin, 1949) goes with (1 − f_t/μf_n)^⅓, here with an exponent of its own.
    """
    left = np.maximum(1.0 - seen.ratio / friction[:, None], 0.0)
    part = options.slip_part * left**options.slip_exponent
    taken = log_density(seen.part, part, np.hypot(options.slip_part_spread, seen.part_deviation))
    return _or_anything(taken, seen, options)


def _or_anything(density: FloatArray, seen: Sharing, options: ForcesOnlyOptions) -> FloatArray:
    share = options.outlier_share
    anything = log_density(seen.part, 1.0, np.hypot(1.0, seen.part_deviation))
    mixed: FloatArray = np.logaddexp(np.log1p(-share) + density, np.log(share) + anything)
    return mixed
