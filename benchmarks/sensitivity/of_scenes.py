"""What is measured of scenes beside the solver: what explains them, and the tiers that cost nothing."""

from dataclasses import replace
from functools import cache

import numpy as np

from benchmarks.contact.random_scenes import random_scene
from benchmarks.sensitivity.measures import FINE, SCENES
from benchmarks.sensitivity.rows import Known, Row, of_tables
from slipcore.contact import defaults as of_contact
from slipcore.contact.errors import ManyRuns
from slipcore.contact.scene import Finger, Scene, explain
from slipcore.contact.tiers import beam_lattice, closed_form
from slipcore.contact.tiers.accuracy import difference
from slipcore.contact.tiers.boundary_elements import run
from slipcore.frames import GraspLog

EXPLAINED = tuple(random_scene(seed) for seed in range(7101, 7125))
"""Seeds of no other benchmark."""
PLAIN = {
    "at ν = 0": replace(SCENES["shear"], finger=Finger(poisson_ratio=0.0)),
    "sheared": SCENES["shear"],
}
"""Scenes that have a closed form."""
BEAMS = {**PLAIN, "velocity": SCENES["velocity"]}


def explained() -> dict[str, float]:
    """Of explanations: how many are given; effects a scene to add and to leave out; changes and cost, in logarithms."""
    given = [told for scene in EXPLAINED if (told := _explanation(scene)) is not None]
    actions = [proposal.action for told in given for proposal in told.proposals]
    changes = [report.change.largest for told in given for report in told.effects if report.change is not None]
    return {
        "given": len(given) / len(EXPLAINED),
        "to add": actions.count("add") / max(len(given), 1),
        "to leave out": actions.count("leave out") / max(len(given), 1),
        "change": float(np.mean(np.log(np.maximum(changes, 1e-6)))) if changes else 0.0,
        "applications": float(np.mean([np.log(told.applications) for told in given])) if given else 0.0,
    }


def _explanation(scene: Scene) -> explain.Explanation | None:
    """None where more runs are needed than are made unasked."""
    try:
        return explain.explain(scene)
    except ManyRuns:
        return None


@cache
def _fine(name: str) -> GraspLog:
    return run(BEAMS[name].plan(), FINE)


def cheaply() -> dict[str, float]:
    """Of the closed form and of beams: the largest error, and what is promised of it, in logarithms of their means."""
    told: dict[str, float] = {}
    for tier, scenes in ((closed_form, PLAIN), (beam_lattice, BEAMS)):
        plans = {name: scene.plan() for name, scene in scenes.items()}
        errors = [difference(tier.run(scenes[name], plan), _fine(name)).largest for name, plan in plans.items()]
        promises = [tier.accuracy(scenes[name], plan) for name, plan in plans.items()]
        told[f"{tier.NAME} error"] = float(np.log(np.mean(errors)))
        told[f"{tier.NAME} promise"] = float(np.log(np.mean(promises)))
    return told


def of_explanations(known: Known) -> list[Row]:
    """When an effect is proposed, and what coarse runs show."""
    return of_tables(of_contact, ("EXPLAIN",), explained, known)


def of_cheap_tiers(known: Known) -> list[Row]:
    """What the closed form and the beams miss."""
    return of_tables(of_contact, ("CHEAP_TIERS",), cheaply, known)
