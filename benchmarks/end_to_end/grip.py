"""From five grasps to a grip that holds, on boundary elements: `python -m benchmarks.end_to_end.grip [--page FILE]`.

Five grasps of a material are simulated on boundary elements (`slipcore.contact.simulate`) with noise; slip is detected,
friction sampled and fitted, and `required_normal_force` asked for one finger's load. A new grasp of the material is
then pressed with that force and loaded step by step on boundary elements: held, or not. Friction differs from grasp to
grasp (standard deviation 0.02) and over each contact (5 %, in spots of 2 mm). Beside it the least force that just
holds that grasp. Six grasps share five logs. Writes end_to_end_grip.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from itertools import product
from typing import NamedTuple

import numpy as np

import estimators
from benchmarks.control import elements as control_elements
from benchmarks.control.episodes import (
    BETWEEN,
    FORCE_NOISE,
    LENGTH,
    MARKER_NOISE,
    PITCH,
    POINTS,
    SCATTER,
    contact_of,
    least_force,
    world_of,
)
from benchmarks.control.tasks import lift
from benchmarks.pages import options, table, write
from slipcore import FrictionSamples, collect_samples, detect_slip
from slipcore.contact.effects import ForceNoise, MarkerNoise, RandomFriction, SensorSampling, TangentialLoad
from slipcore.contact.reduced import GRAVITY, Load
from slipcore.contact.scene import Finger, Press, Scene, simulate
from slipcore.contact.tiers.boundary_elements import Fidelity
from stiction_client import FrictionModel, NoFeasibleForce, required_normal_force

FRICTIONS, LOADS = (0.3, 0.45, 0.7), (1.0, 2.0)
"""Means of the materials; N of one finger."""
PRESSED = (2.0, 3.0, 4.0, 6.0, 8.0)
"""N, of a material's five grasps."""
SHARE = 0.9
"""Of what friction can carry, to which they are pulled."""
ASKED = (1e-2, 1e-3)
LIMIT = 40.0
"""N of the gripper."""
FIDELITY = Fidelity(cells=24, substeps=1, tolerance=1e-4)
GRASPS = 6
"""That are gripped by the same five logs."""
STEPS = 6
"""In which the load comes onto a grasp."""


class Trial(NamedTuple):
    """One grasp with a force by five logs; NaN where there was no answer."""

    friction: float
    load: float
    asked: float
    seed: int
    force: float
    least: float
    held: bool


def samples_of(friction: float, number: int, rng: np.random.Generator) -> FrictionSamples:
    """Of one simulated grasp of a material."""
    mean, pressed = friction + BETWEEN * rng.standard_normal(), PRESSED[number % len(PRESSED)]
    effects = (
        SensorSampling(POINTS, PITCH, 60.0),
        TangentialLoad((SHARE * mean * pressed, 0.0), start=0.4, duration=1.2),
        RandomFriction(SCATTER * mean, LENGTH),
        MarkerNoise(MARKER_NOISE),
        ForceNoise(FORCE_NOISE),
    )
    scene = Scene("a grasp to learn from", effects, Finger(), mean, Press(pressed, 0.3), 1.7)
    log = simulate(scene, seed=int(rng.integers(2**31)), fidelity=FIDELITY)
    return collect_samples(log, detect_slip(log))


def model_of(friction: float, seed: int) -> FrictionModel:
    """What a planner's client gets of five grasps."""
    rng = np.random.default_rng([seed, round(100 * friction)])
    grasps = [samples_of(friction, number, rng) for number in range(len(PRESSED))]
    found = estimators.fit([each for each in grasps if len(each)], method="hierarchical")
    told = {entry.name: getattr(found, entry.name) for entry in fields(found) if entry.name != "draws"}
    return FrictionModel(**told, material="simulated", version=1)


def trials(friction: float, seed: int) -> list[Trial]:
    """New grasps of the material under each load, with the forces that the same five logs ask for."""
    model = model_of(friction, seed)
    seeds, cells = range(GRASPS * seed, GRASPS * (seed + 1)), product(LOADS, ASKED)
    return [trial(model, friction, load, asked, grasp) for (load, asked), grasp in product(cells, seeds)]


def trial(model: FrictionModel, friction: float, load: float, asked: float, seed: int) -> Trial:
    """One grasp, whose load comes in some steps."""
    world = world_of(lift(load / GRAVITY, friction), seed)
    least = least_force(world, Load(load / GRAVITY))
    try:
        told = required_normal_force(model, load, asked, contacts=contact_of(world), normal_force_limit=LIMIT)
    except NoFeasibleForce:
        return Trial(friction, load, asked, seed, np.nan, least, False)
    force = float(told.normal_force)
    state = control_elements.init(world, force)
    for count in range(STEPS):
        part = Load(load / GRAVITY, 1.0 - (count + 1) / STEPS)
        state = control_elements.step(world, state, np.array([force]), part, 1.0 / 60.0)
    return Trial(friction, load, asked, seed, force, least, not state.contact.velocity.any())


def row(found: Sequence[Trial]) -> list[object]:
    """How many were held, and median and largest force over the least of those answered."""
    ratio = np.array([each.force / each.least for each in found])
    answered = ratio[np.isfinite(ratio)]
    counts = f"{sum(each.held for each in found)}/{len(found)}", f"{answered.size}/{len(found)}"
    spread = (np.median(answered), answered.min(), answered.max()) if answered.size else (np.nan,) * 3
    return [f"μ {found[0].friction:g}, {found[0].load:g} N", f"{found[0].asked:g}", *counts, *spread]


COLUMNS = ("material and load", "asked", "held", "answered", "median force over the least", "least", "most")


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--logs", type=int, default=5, help="times that five logs of each material are taken")
    parser.add_argument("--first", type=int, default=0, help="seed of the first of them")
    parser.add_argument("--processes", type=int, default=1, help="that share the trials")
    arguments = parser.parse_args()
    jobs = list(product(FRICTIONS, range(arguments.first, arguments.first + arguments.logs)))
    with ProcessPoolExecutor(arguments.processes) as pool:
        found = [each for some in pool.map(trials, *zip(*jobs, strict=True)) for each in some]
    cells = product(ASKED, FRICTIONS, LOADS)
    rows = [row([each for each in found if (each.asked, each.friction, each.load) == cell]) for cell in cells]
    tables = {"end to end grip": table(list(COLUMNS), rows)}
    print(tables["end to end grip"])
    arguments.output.mkdir(parents=True, exist_ok=True)
    write([each._asdict() for each in found], tables, arguments, "end_to_end_grip.json")


if __name__ == "__main__":
    main()
