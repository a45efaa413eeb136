"""What several methods of the literature look at: how a measure of each element has changed since it touched."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from slipcore.defaults import ContactOptions
from slipcore.detection.shared.interface import Method, ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.frames import BoolArray, FloatArray
from slipcore.surface.strain import Lattice

Options = TypeVar("Options", bound=ContactOptions)


@dataclass(frozen=True, slots=True, eq=False)
class MeasureAtTouch:
    """The measure [..., n, m] of each element when it touched, or now where it does not touch; zero at first."""

    measure: FloatArray


def threshold_method(
    options: type[Options],
    measure: Callable[[Lattice, ObservedFrame], FloatArray],
    slips: Callable[[Lattice, ObservedFrame, FloatArray, Options], BoolArray],
) -> Method[MeasureAtTouch, Options]:
    """A method without memory of its own: ``slips`` judges how ``measure`` [..., n, m] changed since the touch.

    The whole field is measured before the difference is taken: elements touch at different times, and a gradient of
    differences would see steps between them. The probability is 0 or 1.
    """

    def init(_: Lattice, __: Options) -> MeasureAtTouch:
        return MeasureAtTouch(np.zeros(()))

    def step(
        state: MeasureAtTouch, lattice: Lattice, seen: ObservedFrame, chosen: Options
    ) -> tuple[MeasureAtTouch, Decision]:
        now = measure(lattice, seen)
        start = np.where(seen.stays, state.measure, now)
        slip = slips(lattice, seen, now - start, chosen)
        return MeasureAtTouch(start), Decision(slip, slip.astype(float))

    return Method(options, init, step)
