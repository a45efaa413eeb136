"""A scene in, a log with truth out."""

import zlib
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipcore.arguments import of_kind
from slipcore.contact.errors import Interrupted
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.tiers import boundary_elements
from slipcore.contact.tiers.accuracy import Refined, Stopped, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.choice import cheapest, check_request, named
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog


def simulate(
    scene: SceneDescription,
    accuracy: float | None = None,
    seconds: float | None = None,
    seed: int = 0,
    fidelity: Fidelity | None = None,
    tier: str | None = None,
    progress: Progress = no_progress,
) -> GraspLog:
    """Simulate a scene to an ``accuracy``, within ``seconds``, or at a ``fidelity``; with none of them, at the default
    one. For an accuracy the cheapest tier is taken that has it, unless ``tier`` names one: "closed form", "beams" (the
    paper's, at its own accuracy) or "boundary elements".

    ``accuracy`` is the largest of: absolute error of the stick ratio, relative L2 error over time of displacement and
    of force at the sensor's points, all before observation effects. ``seed`` draws random fields and noise. The
    metadata give tier, grid, steps, tolerance, estimated accuracy and seconds, and which loads the scene's end has cut
    short. ``progress`` is given the part done.

    Raises ``InfeasibleLoad`` where friction cannot carry a load, ``OutOfReach`` for an accuracy or seconds that cannot
    be kept, with what can, ``NotConverged`` and ``InvalidInput``; ``Interrupted``, with the best log until then, where
    Ctrl-C ends a request that has one.
    """
    of_kind("scene", scene, SceneDescription)
    of_kind("fidelity", fidelity, Fidelity | None)
    check_request(accuracy, seconds, tier)
    plan = scene.plan(seed)
    if fidelity is not None and (accuracy is not None or seconds is not None):
        raise InvalidInput("fidelity", fidelity, "no fidelity beside an accuracy or seconds")
    cheap = None
    if tier is not None:
        cheap = named(tier, scene, plan, accuracy)
    elif accuracy is not None:
        cheap = cheapest(scene, plan, accuracy)
    if cheap is not None:
        log, estimated = cheap.run(scene, plan), f"{cheap.accuracy(scene, plan):.2g}"
    elif accuracy is None and seconds is None:
        log, estimated = boundary_elements.run(plan, fidelity, progress), "not asked for"
    else:
        try:
            return _requested(scene, plan, simulate_to(plan, accuracy, seconds, progress))
        except Stopped as stopped:
            raise Interrupted(_requested(scene, plan, stopped.found, {"stopped": "interrupted"})) from stopped
    return observe(plan, _described(scene, plan, log, {"estimated accuracy": estimated}))


def _requested(scene: SceneDescription, plan: Plan, found: Refined, more: Mapping[str, str] | None = None) -> GraspLog:
    """The log of a request as the sensor sees it, with what it has come to."""
    about = {"seconds": f"{found.seconds:.3f}", "estimated accuracy": f"{found.error.largest:.2g}", **(more or {})}
    return observe(plan, _described(scene, plan, found.log, about))


def _described(scene: SceneDescription, plan: Plan, log: GraspLog, about: Mapping[str, str]) -> GraspLog:
    """The log with the scene's name, what its end cut short, and more in its metadata."""
    cut = plan.cut_short()
    short = {"cut short": cut} if cut else {}
    return replace(log, metadata={"scene": scene.name, **log.metadata, **about, **short})


def observe(plan: Plan, log: GraspLog) -> GraspLog:
    """The log as the plan's observation effects let it be seen; each has a random generator of its own."""
    for effect in sorted(plan.observations, key=lambda effect: (effect.stage, type(effect).__name__, repr(effect))):
        own = zlib.crc32(type(effect).__name__.encode())
        log = effect.observe(log, np.random.default_rng([plan.seed, own]))
    return log
