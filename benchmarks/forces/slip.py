"""Slip found with reconstructed forces, against displacement alone: gels, lattices, noises, with depth and without.

A sphere is pulled until it nearly slides, and back. Boundary elements of constant traction on cells of 0.15 mm are the
truth, with both directions coupled; a reconstruction has bilinear tractions one to a marker. In the plane the gripper's
force is known on a half-space alone. F1 of slip is taken over the whole lattice, where each finds the contact itself
(displacement alone by shape, in the plane by motion), and where the true contact is given to all.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.detector.accuracy import count
from benchmarks.detector.scenes import simulated
from benchmarks.forces.friction import FIDELITY, IN_PLANE, WITH_DEPTH
from benchmarks.pages import table
from slipcore import LOOKAHEAD, GraspLog, detect_slip
from slipcore.contact.effects import FiniteLayer, LoadPath, NormalTangentialCoupling, SensorSampling
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.forces import Gel, reconstruct
from slipcore.markers import contact_by_motion

GELS = {"half-space": np.inf, "5 mm": 5e-3, "2 mm": 2e-3}
LATTICES = {"20 × 20": SensorSampling((20, 20), 0.75e-3, 30.0), "10 × 7": SensorSampling((10, 7), 1.5e-3, 30.0)}
NOISES = (0.0, 1e-6, 3e-6, 10e-6)
FORCE, FRICTION = 9.0, 0.42
PULLED = 0.93 * FORCE * FRICTION


@dataclass(frozen=True, slots=True)
class Outcome:
    """One sensor: F1 by displacement alone, with reconstructed forces and with true ones, where the contact is
    ``found`` and where it is ``given``.
    """

    seen: str
    gel: str
    markers: str
    noise: float
    found: tuple[float, float, float]
    given: tuple[float, float, float]


def scene(gel: str, markers: str) -> Scene:
    """The sphere on a gel."""
    layer = () if np.isinf(GELS[gel]) else (FiniteLayer(GELS[gel]),)
    pull = LoadPath((0.4, 1.2, 1.7), force_x=(0.0, 0.8 * PULLED, -0.2 * PULLED), force_y=(0.0, 0.6 * PULLED, 0.0))
    effects = (LATTICES[markers], *layer, NormalTangentialCoupling(), pull)
    return Scene(f"pull and back, {gel}", effects, Finger(16e-3, 1e6, 0.49), FRICTION, Press(FORCE, 0.3), 1.7)


def outcomes(gel: str, markers: str, noise: float) -> Iterator[Outcome]:
    """With depth and in the plane."""
    log = simulated(scene(gel, markers), FIDELITY)
    assert log.force is not None
    assert log.truth is not None
    moved = log.displacement + noise * np.random.default_rng(33).standard_normal(log.displacement.shape)
    for seen in (WITH_DEPTH, IN_PLANE):
        shown = moved * [1.0, 1.0, seen == WITH_DEPTH]
        blind = GraspLog(log.time, log.position, shown, log.element_area)
        gripper = -log.force[..., 2].sum(axis=(1, 2)) if gel == "half-space" and seen == IN_PLANE else None
        by_gel = reconstruct(blind, Gel(1e6, 0.49, GELS[gel]), gripper).apply(blind)
        alone = blind if seen == WITH_DEPTH else replace(blind, contact=contact_by_motion(log.time, shown))
        told = alone, by_gel, replace(blind, force=log.force, normal=log.normal)
        found = tuple(f1(log, each) for each in told)
        given = tuple(f1(log, replace(each, contact=log.truth.contact)) for each in told)
        yield Outcome(seen, gel, markers, noise, found, given)


def f1(log: GraspLog, told: GraspLog) -> float:
    """Of slip over the whole lattice, by what is told of a log."""
    assert log.truth is not None
    return count(log.truth.slip_contact_factor & log.truth.contact, detect_slip(told, lookahead=LOOKAHEAD).slip).f1


def campaign(path: Path) -> list[Outcome]:
    """All outcomes, one a line of a file; those that are in it are not made again."""
    known = [Outcome(**json.loads(line)) for line in path.read_text().splitlines()] if path.is_file() else []
    done = {(each.gel, each.markers, each.noise) for each in known}
    for case in product(GELS, LATTICES, NOISES):
        if case not in done:
            found = list(outcomes(*case))
            with path.open("a") as file:
                file.writelines(f"{json.dumps(asdict(each))}\n" for each in found)
            known += found
    return sorted(
        known, key=lambda each: (each.seen == IN_PLANE, list(GELS).index(each.gel), each.markers != "20 × 20")
    )


def slip_table(found: list[Outcome]) -> str:
    """A row a sensor, with what reconstructed forces gain over displacement alone."""
    columns = ("seen", "gel", "markers", "noise, µm", "contact found: alone", "reconstructed", "true forces", "gain",
               "contact given: alone", "reconstructed", "true forces", "gain")  # fmt: skip
    rows = [
        (each.seen, each.gel, each.markers, f"{1e6 * each.noise:g}", *_cells(each.found), *_cells(each.given))
        for each in found
    ]
    return table(columns, rows)


def _cells(scores: tuple[float, float, float]) -> tuple[str, ...]:
    return *(f"{each:.3f}" for each in scores), f"{scores[1] - scores[0]:+.3f}"
