"""What the demo uploads: simulated ramps of known friction, and real recordings where they are at hand."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from service import formats
from slipcore import FrictionLaw, GraspLog
from slipcore.contact import tangential_ramp
from stiction_client import container

FRICTION = {"polished steel": 0.25, "cardboard": 0.45, "rubber": 0.8}
"""Coulomb coefficients of the simulated materials: a smooth, a common and a grippy surface."""

NORMAL_FORCES = (4.0, 6.0, 9.0, 13.0)
"""N; one simulated grasp each, so that the normal force of an element varies as it does over a fleet's grasps."""

MARKER_NOISE, FORCE_NOISE = 1e-6, 2e-3
"""m and N; noise of a good vision-based tactile sensor."""

RECORDINGS = {
    "example_1/AD2-0065L": "tac3d example 1",
    "example_2/HDL1-GWH0021": "tac3d example 2",
    "example_2/HDL1-GWH0022": "tac3d example 2",
}
"""Real recordings and what to call what they touch (it isn't documented); the last two are fingers of one grasp."""


@dataclass(frozen=True, slots=True, eq=False)
class DemoLog:
    """A grasp log on disk, with its material's name and, where it is simulated, its true friction."""

    name: str
    path: Path
    log: GraspLog
    material: str
    truth: FrictionLaw | None


def simulated_logs(folder: Path, seed: int) -> Iterator[DemoLog]:
    """Closed-form tangential ramps of every simulated material at every normal force, written below ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    generators = iter(np.random.default_rng(seed).spawn(len(FRICTION) * len(NORMAL_FORCES)))
    for material, friction in FRICTION.items():
        for force in NORMAL_FORCES:
            log = tangential_ramp(
                friction=friction,
                normal_force=force,
                marker_noise=MARKER_NOISE,
                force_noise=FORCE_NOISE,
                seed=next(generators),
            )
            name = f"{material} {force:g} N"
            path = folder / f"{name.replace(' ', '-')}.npz"
            container.write(log, path)
            truth = None if log.truth is None else log.truth.friction
            yield DemoLog(name, path, log, material, truth)


def recorded_logs(recordings: Path | None) -> Iterator[DemoLog]:
    """The real recordings below ``recordings`` that are there, each a Tac3D folder as its sensor's software left it."""
    for place, material in RECORDINGS.items():
        folder = None if recordings is None else recordings / place
        if folder is not None and folder.is_dir():
            yield DemoLog(place, folder, formats.read(folder), material, None)
