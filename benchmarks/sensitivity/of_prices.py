"""What requests of the simulator expect of time: the seconds of a run before it is made, and those left of a request.

Runs are made and timed once; each value of a default then expects the same runs.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from time import process_time
from unittest.mock import patch

import numpy as np

from benchmarks.sensitivity.measures import OF_TIME, SCENES
from benchmarks.sensitivity.rows import Known, Row, of_tables
from slipcore.contact import defaults as of_contact
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress
from slipcore.contact.tiers import requests
from slipcore.contact.tiers.accuracy import simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.price import Pace, Size, Sizes
from slipcore.contact.tiers.probe import probe
from slipcore.frames import GraspLog

CELLS = (12, 20, 32, 52, 84)
LEARNT = 2
"""Grids that the prices of the others follow from."""
ASKED = 0.03


@cache
def ladder(name: str) -> tuple[tuple[Size, float], ...]:
    """Sizes of a scene's runs on ever more cells, and the processor seconds they take."""
    plan = SCENES[name].plan()
    sizes, found = Sizes(plan, probe(plan)), []
    for cells in CELLS:
        fidelity, began = Fidelity(cells, 1, 1e-3, aligned=False), process_time()
        run(plan, fidelity)
        found.append((sizes.of(fidelity), process_time() - began))
    return tuple(found)


def price_error() -> float:
    """Mean distance of the price of a run from what it takes, as a logarithm."""
    errors = []
    for name in SCENES:
        pace = Pace()
        for size, took in ladder(name)[:LEARNT]:
            pace.learn(size, took)
        errors += [abs(np.log(pace.seconds(size) / took)) for size, took in ladder(name)[LEARNT:]]
    return float(np.mean(errors))


@dataclass
class Replayed:
    """Runs of requests, each made once: afterwards it takes the ``now`` of the first time."""

    now: float = 0.0
    made: dict[tuple[str, float, Fidelity], tuple[GraspLog, list[tuple[float, float]]]] = field(default_factory=dict)

    def of(self, name: str) -> Callable[[Plan, Fidelity, Progress], GraspLog]:
        """For one scene, what stands for ``run``."""

        def replay(plan: Plan, fidelity: Fidelity, progress: Progress) -> GraspLog:
            assert plan.sampling is not None
            key, before = (name, plan.sampling.frame_rate, fidelity), self.now
            if key not in self.made:
                began, marks = process_time(), list[tuple[float, float]]()
                log = run(plan, fidelity, lambda part: marks.append((part, process_time() - began)))
                self.made[key] = log, marks
            log, marks = self.made[key]
            for part, seconds in marks:
                self.now = before + seconds
                progress(part)
            return log

        return replay


CLOCK = Replayed()


def left_error() -> float:
    """Mean distance of the time left that is told from that which is left, until half of it is over; as a logarithm."""
    errors: list[float] = []
    for name, scene in SCENES.items():
        CLOCK.now, told = 0.0, list[tuple[float, float]]()
        with patch.object(requests, "run", CLOCK.of(name)):
            simulate_to(scene.plan(), accuracy=ASKED, progress=lambda part, told=told: told.append((CLOCK.now, part)))
        soon = [(now, part) for now, part in told if now <= 0.5 * CLOCK.now]
        errors += [abs(np.log(now * (1.0 / part - 1.0) / (CLOCK.now - now))) for now, part in soon]
    return float(np.mean(errors))


def expected() -> dict[str, float]:
    """Both errors."""
    return {"price": price_error(), "time left": left_error()}


def of_prices(known: Known) -> list[Row]:
    """Numbers that only the time of requests depends on."""
    return of_tables(of_contact, [f"ACCURACY.{name}" for name in OF_TIME], expected, known)
