"""What several methods of the literature look at: how a measure of each element has changed since it touched."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from slipcore.defaults import ContactOptions
from slipcore.detection.shared.interface import Method, Observation
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice

Options = TypeVar("Options", bound=ContactOptions)


@dataclass(frozen=True, slots=True, eq=False)
class SinceTouch:
    """The measure [..., n, m] of each element when it touched, or now where it does not touch; zero at first."""

    measure: FloatArray


def threshold_method(
    options: type[Options],
    measure: Callable[[Lattice, Observation], FloatArray],
    slips: Callable[[Lattice, Observation, FloatArray, Options], BoolArray],
) -> Method[SinceTouch, Options]:
    """A method without memory of its own: ``slips`` judges how ``measure`` [..., n, m] changed since the touch.

    The whole field is measured before the difference is taken: elements touch at different times, and a gradient of
    differences would see steps between them. The probability is 0 or 1.
    """

    def init(_: Lattice, __: Options) -> SinceTouch:
        return SinceTouch(np.zeros(()))

    def step(state: SinceTouch, lattice: Lattice, seen: Observation, chosen: Options) -> tuple[SinceTouch, Decision]:
        now = measure(lattice, seen)
        start = np.where(seen.stays, state.measure, now)
        slip = slips(lattice, seen, now - start, chosen)
        return SinceTouch(start), Decision(slip, slip.astype(float))

    return Method(options, init, step)
