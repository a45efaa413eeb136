"""What counts of an episode of grip control, and of many: held, force over the least that holds, slip, reaction."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.control.episodes import FRAME, Episode, Task
from benchmarks.control.tasks import CUT, PAPER, SEATED, TWIST

HELD = 3e-3
"""m that an object may slip and still be held."""

ASKED = 1.3
"""Final force over the least that holds, at most, that a controller is asked for."""


class Outcome(NamedTuple):
    """One episode of a ``strategy`` with a ``task`` from a ``seed``, in plain numbers.

    ``slipped`` m, of the finger that slipped most; ``crushed``: None where nothing can break; ``peak`` and ``final``
    force over the least that hold; ``late`` s: the longest time in which the force was below the least; ``signature``:
    what ``SIGNATURES`` take of the task, NaN where they take nothing; ``seconds`` of CPU that it took.
    """

    strategy: str
    task: str
    seed: int
    slipped: float
    crushed: bool | None
    peak: float
    final: float
    late: float
    signature: float
    seconds: float

    @property
    def held(self) -> bool:
        """Whether the object was held."""
        return self.slipped < HELD


def outcome_of(episode: Episode, strategy: str, seed: int, seconds: float = 0.0) -> Outcome:
    """What counts of an episode."""
    force, least = episode.normal.sum(axis=1), episode.least.sum(axis=1)
    signature = next((each for each in SIGNATURES if each.task.name == episode.task), None)
    return Outcome(
        strategy,
        episode.task,
        seed,
        slipped=float(episode.slipped[-1].max()),
        crushed=bool((episode.normal > episode.limit).any()) if math.isfinite(episode.limit) else None,
        peak=float(force.max() / least.max()),
        final=float(force[-1] / least[-1]),
        late=_longest(force < least),
        signature=signature.ratio(episode) if signature else math.nan,
        seconds=seconds,
    )


def _longest(below: np.ndarray) -> float:
    """The longest time, s, in which frames are ``below``."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], below.astype(np.int8), [0]])))
    return float(max(ends[1::2] - ends[::2], default=0)) * FRAME


def scores(name: str, outcomes: Sequence[Outcome]) -> dict[str, object]:
    """How many held, and how many of those that break were crushed; of what was held, median peak and final force, the
    share of final ones that is as asked, in %, and the largest, over the least that hold; largest slip; and the longest
    time, ms, in which a force was below the least (how late a strategy reacts).
    """
    held, fragile = [each for each in outcomes if each.held], [each for each in outcomes if each.crushed is not None]
    final = [each.final for each in held]
    return {
        "strategy": name,
        "held": f"{len(held)}/{len(outcomes)}",
        "crushed": f"{sum(bool(each.crushed) for each in fragile)}/{len(fragile)}",
        "peak": median([each.peak for each in held]),
        "final": median(final),
        "as_asked": 100.0 * sum(each <= ASKED for each in final) / len(final) if final else math.nan,
        "final_worst": max(final, default=math.nan),
        "slip_mm": 1e3 * max(each.slipped for each in outcomes),
        "reaction_ms": 1e3 * max(each.late for each in outcomes),
    }


def median(values: Sequence[float]) -> float:
    """NaN of nothing."""
    return float(np.median(values)) if values else math.nan


class Signature(NamedTuple):
    """What the paper tells of a task: a ``ratio`` of forces of an episode, to lie between ``low`` and ``high``."""

    name: str
    task: Task
    ratio: Callable[[Episode], float]
    low: float
    high: float

    def tell(self, ratios: Sequence[float]) -> str:
        """The median ratio, and in how many episodes it is as the paper says."""
        return f"{median(ratios):.2f}, {sum(self.low < ratio < self.high for ratio in ratios)}/{len(ratios)}"


def _at(episode: Episode, time_: float) -> float:
    return float(np.interp(time_, episode.time, episode.normal[:, 0]))


def _fast_over_gradual(episode: Episode) -> float:
    """Rates of the force while the thread takes up the torque, and while it draws tighter; 0 where it doesn't rise."""
    fast = (_at(episode, SEATED + 0.1) - _at(episode, TWIST)) / (SEATED + 0.1 - TWIST)
    gradual = (_at(episode, SEATED + 3.0) - _at(episode, SEATED + 0.6)) / 2.4
    return fast / gradual if gradual > 0.0 else 0.0


def _after_over_before(episode: Episode) -> float:
    return _at(episode, episode.time[-1]) / _at(episode, CUT - 0.1)


def _front_over_back(episode: Episode) -> float:
    return float(episode.normal[-1, 0] / episode.normal[-1, -1])


_SUDDEN, _SHELL, _CUP, _CAP, _BLOCK, _KNIFE = PAPER
SIGNATURES = (
    Signature("cap: rate of the fast over that of the gradual rise, above 2", _CAP, _fast_over_gradual, 2.0, np.inf),
    Signature("knife: force at the end over that before the cut, below 1", _KNIFE, _after_over_before, 0.0, 1.0),
    Signature("block: slippery over rough face at the end, above 1.1", _BLOCK, _front_over_back, 1.1, np.inf),
)
