"""Random requests over all effects of mechanics, for `benchmarks.contact.promise --requests N`: is the estimate right?

The truth is a run in twice the load steps a frame on four times the cells of what a request came to, or as many as
are 150 across (100 in coupled scenes), but on twice the cells at least. It errs by itself, on twice the cells at
first order by half as much: a true error is known to about that.
"""

import json
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from benchmarks.contact.random_scenes import random_scene
from slipcore.contact.defaults import ACCURACY
from slipcore.contact.errors import InfeasibleLoad, NotConverged, OutOfReach
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress
from slipcore.contact.scene import Scene
from slipcore.contact.solver.warm_up import load_kernels
from slipcore.contact.tiers import requests as runs
from slipcore.contact.tiers.accuracy import Refined, difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.price import Sizes
from slipcore.contact.tiers.probe import probe

ASKED = (0.1, 0.05, 0.03)
"""By turns."""
TUNING = 10_000
"""Seeds from here on are for choosing defaults, those below for reports."""
LONG, LONGER = 8, 8.0
"""Every so many scenes one lasts so many seconds."""
FACTOR = 3.0
"""Of the true error that an estimate should lie within."""
FINER, FINEST, TRUTH_CELLS, COUPLED_CELLS = 2, 4, 150, 100
"""Times the cells of an answer that its truth has, at least and at most; cells up to which it has more, and of coupled
scenes, where a run on 150 takes a minute.
"""
PROCESSOR = SimpleNamespace(perf_counter=time.process_time)
"""A clock that other programs do not drive."""
KEPT = 0.2
"""Part of a budget by which its use may differ from it."""
USUAL = Fidelity(50, aligned=False)
"""What most requests come to: for what a scene should cost beside others."""
DEARER = {"NormalTangentialCoupling": 4.0, "VelocityFriction": 3.0, "FiniteLayer": 1.5}
"""How much longer a load step takes with some effects, roughly."""
KINDS = ("NormalTangentialCoupling", "FiniteLayer", "Viscoelasticity", "VelocityFriction", "long")


class TooLong(Exception):
    """A scene took more processor seconds than are allowed."""


@dataclass(frozen=True, slots=True)
class RandomRequest:
    """One request: its scene's seed and ``kinds`` (effects, and "long"), what it ``became`` ("answered", "refused",
    "infeasible", "not converged", "too long"), the accuracy ``asked``, ``estimated`` and ``true`` (0 without an
    answer), and processor ``seconds``, the truth not among them.
    """

    seed: int
    kinds: tuple[str, ...]
    became: str
    asked: float
    estimated: float
    true: float
    seconds: float


def scene_of(seed: int) -> Scene:
    """The random scene, or one that is held for longer."""
    scene = random_scene(seed)
    return replace(scene, duration=LONGER) if seed % LONG == LONG - 1 else scene


def kinds_of(seed: int) -> tuple[str, ...]:
    """Its effects, and "long"."""
    scene = scene_of(seed)
    effects = tuple(sorted(type(effect).__name__ for effect in scene.present()))
    return (*effects, "long") if scene.duration == LONGER else effects


def expected_work(seed: int) -> float:
    """What a scene should cost, beside others: its load steps on a usual grid, by what its effects make of them."""
    plan = scene_of(seed).plan(seed)
    size = Sizes(plan, probe(plan)).of(USUAL)
    return size.work(ACCURACY.overhead_cells) * float(np.prod([DEARER.get(kind, 1.0) for kind in kinds_of(seed)]))


def until(end: float) -> Progress:
    """A listener that ends a run at a processor time."""

    def heard(_: float) -> None:
        if time.process_time() > end:
            raise TooLong

    return heard


def request(seed: int, cap: float) -> RandomRequest:
    """Ask one scene; it and its truth take ``cap`` processor seconds at most."""
    scene, asked, began = scene_of(seed), ASKED[seed % len(ASKED)], time.process_time()
    listener, estimated, true, seconds = until(began + cap), 0.0, 0.0, 0.0
    try:
        plan = scene.plan(seed)
        found = simulate_to(plan, accuracy=asked, progress=listener)
        seconds, estimated = time.process_time() - began, found.error.largest
        true = true_error(plan, found, listener)
        became = "answered"
    except OutOfReach:
        became = "refused"
    except InfeasibleLoad:
        became = "infeasible"
    except NotConverged:
        became = "not converged"
    except TooLong:
        became = "too long"
    return RandomRequest(seed, kinds_of(seed), became, asked, estimated, true, seconds or time.process_time() - began)


def true_error(plan: Plan, found: Refined, progress: Progress) -> float:
    """Of the log of a request, whose points a scene without a sensor has of its own."""
    cells, substeps = found.fidelity.cells, found.fidelity.substeps
    most = COUPLED_CELLS if plan.problem.coupled else TRUTH_CELLS
    finer = replace(found.fidelity, cells=max(FINER * cells, min(FINEST * cells, most)), substeps=2 * substeps)
    return difference(found.log, run(plan, finer, progress)).largest


def requests(path: Path, seeds: Iterable[int], cap: float, seconds: float = np.inf) -> list[RandomRequest]:
    """Requests of these seeds, the cheapest first, within so many processor seconds; but not those in ``path``."""
    load_kernels()  # what must be compiled is no part of the first
    entries = json.loads(path.read_text()) if path.exists() else []
    known = [RandomRequest(**{**entry, "kinds": tuple(entry["kinds"])}) for entry in entries]
    done, began, wanted = {entry.seed for entry in known}, time.process_time(), list(seeds)
    for seed in sorted(set(wanted) - done, key=expected_work):
        if time.process_time() - began > seconds:
            break
        known.append(request(seed, cap))
        path.write_text(json.dumps([asdict(entry) for entry in known], indent=1))
        print(known[-1], flush=True)
    return [entry for entry in known if entry.seed in set(wanted)]


@dataclass(frozen=True, slots=True)
class BudgetRequest:
    """A request for the best log within so many seconds: it ``used`` so many (0 where it was refused), and estimated
    its error.
    """

    seed: int
    seconds: float
    used: float
    estimated: float


def budget_request(seed: int, seconds: float) -> BudgetRequest | None:
    """Ask one scene, by processor time; None where friction does not carry its load."""
    try:
        with patch.object(runs, "time", PROCESSOR):
            found = simulate_to(scene_of(seed).plan(seed), seconds=seconds)
    except OutOfReach:
        return BudgetRequest(seed, seconds, 0.0, 0.0)
    except InfeasibleLoad:
        return None
    return BudgetRequest(seed, seconds, found.seconds, found.error.largest)


def budget_table(made: list[BudgetRequest]) -> str:
    """How much of their budgets requests used."""
    parts = np.array([entry.used / entry.seconds for entry in made if entry.used > 0.0])
    low, high = ((parts < 1.0 - KEPT).sum(), (parts > 1.0 + KEPT).sum())
    lines = ["| requests | refused | used within 20 % | less | more | least | median | most | median estimate |"]
    lines.append("|---|---|---|---|---|---|---|---|---|")
    if parts.size == 0:
        return "\n".join(lines)
    estimated = np.median([entry.estimated for entry in made if entry.used > 0.0])
    lines.append(
        f"| {len(made)} | {len(made) - parts.size} | {parts.size - low - high} | {low} | {high} | {parts.min():.2f} "
        f"| {np.median(parts):.2f} | {parts.max():.2f} | {estimated:.3f} |"
    )
    return "\n".join(lines)


def table(made: list[RandomRequest], seeds: Iterable[int]) -> str:
    """How requests ended, how often their accuracy was kept, and how far estimates were off, by effect; of how many
    scenes of all ``seeds``.
    """
    drawn = Counter(kind for seed in seeds for kind in ("all", *kinds_of(seed)))
    lines = [
        "| scenes | drawn | requests | answered | refused | too long | kept | within a factor of 3 | below a third "
        "| median estimate/true | median seconds |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for kind in ("all", *KINDS):
        own = [entry for entry in made if kind == "all" or kind in entry.kinds]
        own = [entry for entry in own if entry.became != "infeasible"]
        answered = [entry for entry in own if entry.became == "answered"]
        if not answered:
            continue
        ratio = np.array([entry.estimated / max(entry.true, np.finfo(float).tiny) for entry in answered])
        kept = np.mean([entry.true <= entry.asked for entry in answered])
        counts = [sum(entry.became == ended for entry in own) for ended in ("refused", "too long")]
        within, below = ((ratio >= 1.0 / FACTOR) & (ratio <= FACTOR)).mean(), (ratio < 1.0 / FACTOR).mean()
        lines.append(
            f"| {kind} | {drawn[kind]} | {len(own)} | {len(answered)} | {counts[0]} | {counts[1]} | {100 * kept:.0f} % "
            f"| {100 * within:.0f} % | {100 * below:.0f} % | {np.median(ratio):.1f} "
            f"| {np.median([entry.seconds for entry in answered]):.1f} |"
        )
    return "\n".join(lines)
