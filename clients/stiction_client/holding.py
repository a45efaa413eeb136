"""Which normal forces hold a loaded contact: the roots of a concave function, for one grasp or for arrays of them."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiction_client.defaults import ENDLESS, MOST_STEPS, ROUNDING
from stiction_client.elementwise import FloatArray, Number, Truth, anywhere, greatest, hypot, least, of_these, select
from stiction_client.quantile import FrictionQuantile

SMALLEST = 1e-300
"""N; added to what may be 0 before it divides."""

MANY = 1000
"""Entries of arrays: once more than so many have their root, the others are taken out to be searched on."""


@dataclass(frozen=True, slots=True, eq=False)
class LoadedContact:
    """A contact's share T (N) and M (as force M/b at x = 1, N) of the load, in x = F^(1/n) of its normal force F.

    n is 1 where the area is fixed, and 3 where it grows with F^⅔: the normal force of its elements, each weighted with
    itself, then is ``unit``·x, the torque arm b grows as x^j with j = (n − 1)/2, and the contact holds where

        q(unit·x) ≥ L(x)/xⁿ,   L(x) = √(T² + (M·x^-j)²)

    q is concave and the right side convex: their difference has no root, one, or two. Newton's steps on a concave
    function never pass the root next to them, so that none is missed and a bracket isn't needed. Numbers are floats,
    or arrays that broadcast.
    """

    quantile: FrictionQuantile
    load: Number
    moment: Number
    unit: Number
    power: int

    def root(self, force: Number) -> Number:
        """x of a normal force, N."""
        return force if self.power == 1 else force ** (1.0 / 3.0)

    def force(self, x: Number) -> Number:
        """Normal force of the contact, N."""
        return x if self.power == 1 else x * x * x

    def only(self, where: NDArray[np.bool_]) -> "LoadedContact":
        """The contacts of these entries."""
        load, moment, unit = (of_these(each, where) for each in (self.load, self.moment, self.unit))
        return LoadedContact(self.quantile.only(where), load, moment, unit, self.power)

    def expected(self) -> "LoadedContact":
        """The same contact, were friction its mean and nothing about it uncertain."""
        return replace(self, quantile=self.quantile.expected())

    def lowest(self, most: Number) -> tuple[Number, Truth]:
        """The least x that holds, and whether there is one up to ``most``."""
        return self._lowest(self.quantile.asymptote, most, 0.0)

    def interval(self, most: Number, above: Number = 0.0) -> tuple[Number, Number, Truth]:
        """The least x that holds, the greatest up to ``most``, and whether there are such; none is below ``above``."""
        line = self.quantile.asymptote
        low, holds = self._lowest(line, most, above)
        high = end = self._end(line, most)
        bounded = (end > 0.0) & (end < math.inf)
        if anywhere(bounded):
            high = select(bounded, self._search(select(bounded, end, 1.0), -1)[0], end)
        rests = self.load + self.moment == 0.0
        if anywhere(rests):  # where no friction is sure, no force but 0 is sure to hold
            high = select(rests & (self.quantile(0.0)[0] <= 0.0), 0.0, high)
        return low, select(high > low, high, low), holds

    def best(self, most: float) -> float:
        """The x up to ``most`` at which most of the load is held: 0 where none ever is, infinite if it has no end."""
        end = float(self._end(self.quantile.asymptote, most))
        if not end < math.inf:
            return end
        least = min(self.quantile.peak() / float(self.unit), end)
        if not self.quantile(self.unit * least)[0] > 0.0:
            return 0.0
        return end if self._growth(end)[0] > 0.0 else self._turning_point(max(least, 1e-9 * end), end)

    def held(self, x: float, load: float) -> float:
        """To what a ``load`` N that grows in proportion to the contact's may grow at x; without one, ``load`` times so
        many newtons.
        """
        return float(self.force(x) * self.quantile(self.unit * x)[0] * (load / (self._load(x)[0] or 1.0)))

    def _lowest(self, line: tuple[Number, Number], most: Number, above: Number) -> tuple[Number, Truth]:
        """As ``lowest``, with the ``line`` above friction, and an x that is ``above`` none that holds."""
        loaded = (self.load > 0.0) | (self.moment > 0.0)
        low, found = self._search(select(loaded, greatest(self._start(line), above), 1.0), 1)
        low = select(loaded, low, 0.0)
        return low, (found | (low == 0.0)) & (low <= most * (1.0 + ROUNDING))

    def _end(self, line: tuple[Number, Number], most: Number) -> Number:
        """An x up to ``most`` beyond which nothing holds: where the ``line`` above friction meets 0."""
        height, slope = line
        falls = slope < 0.0
        zero = -height / select(falls, slope, -1.0) / self.unit
        end = select(falls, zero, select((slope > 0.0) | (height > 0.0), math.inf, 0.0))
        end = select(self.unit * end < ENDLESS, end, math.inf)
        return select(end < most, greatest(end, 0.0), most)

    def _load(self, x: Number) -> tuple[Number, Number]:
        """L(x), N, and −d log L / d log x: what part of it is torque that a larger contact bears more easily."""
        if isinstance(self.moment, float) and self.moment == 0.0:
            return self.load, 0.0
        twist = self.moment if self.power == 1 else self.moment / x
        load = hypot(self.load, twist)
        return load, 0.0 if self.power == 1 else (twist / (load + (load == 0.0))) ** 2

    def surplus(self, x: Number) -> tuple[Number, Number]:
        """q(unit·x) − L(x)/xⁿ, and its slope."""
        friction, slope = self.quantile(self.unit * x)
        load, relief = self._load(x)
        asked = load / x if self.power == 1 else load / x / x / x  # no power of x may underflow
        return friction - asked, self.unit * slope + (self.power + relief) * asked / x

    def _search(self, x: Number, direction: int) -> tuple[Number, Truth]:
        """Newton's method from ``x``: the next root in ``direction``, 1 or -1, and whether there is one."""
        q = self.quantile
        rounding = ROUNDING * ((q.a * q.a + q.k * q.k) ** 0.5 + q.s)
        value, slope = self.surplus(x)
        for _ in range(MOST_STEPS):
            onwards = direction * slope > 0.0
            step = -value / (slope + (slope == 0.0))
            moving = (
                (value < -0.25 * rounding)
                & onwards
                & (direction * step > 0.25 * ROUNDING * x)
                & (step > -x)  # friction may fall in a straight line to 0 without load: then there is no root
                & (self.unit * x < ENDLESS)
            )
            if not isinstance(moving, np.ndarray):
                if not moving:
                    break
                x = x + step
            elif (left := np.count_nonzero(moving)) == 0:
                break
            else:
                x = x + np.where(moving, step, 0.0)
                if moving.size > MANY + 2 * left:
                    ends = (value >= -rounding) | (onwards & (self.unit * x < ENDLESS))
                    return self._searched_on(x, ends, moving, direction)
            value, slope = self.surplus(x)
        return x, (value >= -rounding) | (onwards & (self.unit * x < ENDLESS))

    def _searched_on(
        self, x: Number, ends: Truth, moving: NDArray[np.bool_], direction: int
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """What ``_search`` gives, of entries that have their ``ends`` but for those that are ``moving``."""
        found = np.broadcast_to(x, moving.shape).copy(), np.broadcast_to(ends, moving.shape).copy()
        found[0][moving], found[1][moving] = self.only(moving)._search(found[0][moving], direction)
        return found

    def _start(self, line: tuple[Number, Number]) -> Number:
        """An x that is no greater than the least that holds: where friction, if it were on that line, would."""
        height, slope = line
        rises = slope > 0.0  # then each of its two parts bears half at least, and else the first bears all
        height = select(rises, 0.5, 1.0) / (greatest(height, 0.0) + SMALLEST)
        slope = 0.5 / (greatest(slope, 0.0) + SMALLEST) / self.unit
        loads = ((self.load, 3), (self.moment, 4)) if self.power == 3 else ((hypot(self.load, self.moment), 1),)
        start: Number = SMALLEST ** (1.0 / self.power)  # below it a force has no digits
        for load, power in loads:
            start = greatest(start, least((load * height) ** (1.0 / power), (load * slope) ** (1.0 / (power + 1))))
        return start

    def _growth(self, x: float) -> tuple[float, float]:
        """Sign of the growth with x of the load that is held, φ = q·(n + relief) + unit·x·q', and its slope."""
        f = self.unit * x
        (friction, slope), (_, relief) = self.quantile(f), self._load(x)
        curvature = self.quantile.second_derivative(f)
        growth = friction * (self.power + relief) + f * slope
        relieving = -2.0 * relief * (1.0 - relief) / x
        bent = self.unit * (slope * (self.power + relief + 1.0) + f * curvature) + friction * relieving
        return float(growth), float(bent)

    def _turning_point(self, below: float, above: float) -> float:
        """Where φ, positive at ``below`` and negative at ``above``, changes its sign: Newton's method in a bracket."""
        x = 0.5 * (below + above)
        for _ in range(MOST_STEPS):
            growth, slope = self._growth(x)
            below, above = (x, above) if growth > 0.0 else (below, x)
            guess = x - growth / slope if slope < 0.0 else math.inf
            guess = guess if below <= guess <= above else 0.5 * (below + above)
            near, x = abs(guess - x) <= ROUNDING**0.5 * x, guess
            if near:  # one step from there squares what is left
                break
        return x
