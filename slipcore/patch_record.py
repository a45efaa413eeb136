"""What is known of contact patches."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from slipcore.frames import FloatArray

Regime = Literal["none", "stick", "incipient", "sliding", "pivoting", "rolling"]
REGIMES: tuple[Regime, ...] = ("none", "stick", "incipient", "sliding", "pivoting", "rolling")
MACRO_SLIP: tuple[Regime, ...] = ("sliding", "pivoting")
"""Regimes in which the whole patch slips."""


@dataclass(frozen=True, slots=True)
class ContactFriction:
    """Friction that follows from the resultants of a contact, with its 95 % interval from ``low`` to ``high``.

    ``coefficient``: the median ratio of loads while these stood on the limit surface. Without such a plateau it
    ``is_bound``: the coefficient is the largest ratio of loads that was held, noise and all, ``low`` is what friction
    is at least, freed of that noise, and ``high`` is infinite. ``reason``: what it was found from, or why there is no
    more than a bound.
    """

    coefficient: float
    low: float
    high: float
    is_bound: bool
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """A connected contact from its first touch to its last: arrays [k] over its ``frames`` of the log, of which
    ``first`` is the number of the first; NaN where it is absent between them.

    ``pose`` [k, 3]: where it lies among the markers at rest, x m, y m and yaw rad of its longer axis; ``speed`` m/s:
    mean speed of the object over the markers; ``regime``: one of ``REGIMES``; ``normal_force`` N,
    ``tangential_force`` [k, 2] N, ``moment`` N·m about its mean normal; ``load_ratio``: least friction coefficient that
    bears these, the standard deviation ``ratio_noise`` that noise of the forces gives it, and ``noise_frames``, in how
    many frames in a row that noise is no less sure than in one (1: white); ``element_force`` N: mean normal force of
    its elements, weighted by force. Without forces all of these are NaN (``noise_frames`` 1), and ratio and noise where
    what presses is not beyond noise.
    """

    first: int
    pose: FloatArray
    speed: FloatArray
    regime: NDArray[np.str_]
    normal_force: FloatArray
    tangential_force: FloatArray
    moment: FloatArray
    load_ratio: FloatArray
    element_force: FloatArray
    ratio_noise: FloatArray
    noise_frames: FloatArray
    plateau: NDArray[np.bool_]

    @property
    def frames(self) -> slice:
        """Its frames among those of the log."""
        return slice(self.first, self.first + len(self.pose))


def joined(patches: Sequence[Patch], field: str) -> NDArray[Any]:
    """A field of one or more patches, end to end: [k] over the frames of all of them."""
    return np.concatenate([getattr(patch, field) for patch in patches])


def bounds_of(patches: Sequence[Patch]) -> NDArray[np.int64]:
    """Where each patch begins in what is ``joined``, and where the last one ends: [p + 1]."""
    return np.cumsum([0, *(len(patch.pose) for patch in patches)])


def frames_of(patches: Sequence[Patch]) -> NDArray[np.int64]:
    """Which frame of the log each entry of what is ``joined`` is of, [k]."""
    bounds, first = bounds_of(patches), np.array([patch.first for patch in patches], np.int64)
    return np.arange(bounds[-1]) + np.repeat(first - bounds[:-1], np.diff(bounds))
