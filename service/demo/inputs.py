"""What the demo uploads: simulated ramps of known friction, and real recordings where they are at hand."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from service import formats
from slipcore import FrictionLaw, GraspLog
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


@dataclass(frozen=True, slots=True, eq=False)
class Ramp:
    """A simulated grasp that is to be made: a Coulomb coefficient, a normal force in N, and where its noise is from."""

    material: str
    friction: float
    normal_force: float
    noise: np.random.Generator

    def simulate(self) -> GraspLog:
        """A closed-form tangential ramp; each call goes on with the noise."""
        from slipcore.contact import tangential_ramp  # compiled: a server's process goes without it

        return tangential_ramp(
            friction=self.friction,
            normal_force=self.normal_force,
            marker_noise=MARKER_NOISE,
            force_noise=FORCE_NOISE,
            seed=self.noise,
        )


def ramps(seed: int) -> Iterator[Ramp]:
    """Every simulated material at every normal force."""
    wanted = [(*material, force) for material in FRICTION.items() for force in NORMAL_FORCES]
    for each, noise in zip(wanted, np.random.default_rng(seed).spawn(len(wanted)), strict=True):
        yield Ramp(*each, noise)


def simulated_logs(folder: Path, seed: int) -> Iterator[DemoLog]:
    """Closed-form tangential ramps of every simulated material at every normal force, written below ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    for ramp in ramps(seed):
        log = ramp.simulate()
        name = f"{ramp.material} {ramp.normal_force:g} N"
        path = folder / f"{name.replace(' ', '-')}.npz"
        container.write(log, path)
        truth = None if log.truth is None else log.truth.friction
        yield DemoLog(name, path, log, ramp.material, truth)


def recorded_logs(recordings: Path | None) -> Iterator[DemoLog]:
    """The real recordings below ``recordings`` that are there, each a Tac3D folder as its sensor's software left it."""
    for place, material in RECORDINGS.items():
        folder = None if recordings is None else recordings / place
        if folder is not None and folder.is_dir():
            yield DemoLog(place, folder, formats.read(folder), material, None)
