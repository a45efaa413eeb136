"""What is measured of markers that lie anywhere: how they are laid onto a lattice, and their contact in the plane."""

from functools import cache

import numpy as np

from benchmarks.detector.markers import DOTS, LOSSES, SENSOR, score
from benchmarks.sensitivity.rows import Known, Row, of_tables
from service.slip_benchmark.measures import f1
from slipcore import GraspLog
from slipcore import defaults as of_slipcore
from slipcore.contact.effects import LoadPath, ObjectMotion
from slipcore.contact.scene import Scene, simulate
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.markers import contact_by_motion

PULLED = Scene("pulled", (SENSOR, LoadPath((1.0, 2.0), force_x=(0.0, 2.6))))
PUSHED = Scene("pushed", (SENSOR, ObjectMotion((1.0, 2.0), (0.0, 3e-4), (0.0, 1e-4))))
"""Scenes of no other benchmark."""
NOISE = 1e-6


@cache
def dense() -> tuple[GraspLog, ...]:
    """Logs at more points than there are markers."""
    return tuple(simulate(scene, fidelity=Fidelity(32, 1, 1e-4)) for scene in (PULLED, PUSHED))


def laid() -> dict[str, float]:
    """Mean F1 of slip of dots, and share of dots that are elements; F1 of contact that is seen in the plane only."""
    scores = [score(log, DOTS[dots], lost, True) for log in dense() for dots in DOTS for lost in LOSSES]
    found, used = np.mean(scores, axis=0)
    return {
        "F1": float(found),
        "dots used": float(used),
        "contact F1": float(np.mean([_touching(log) for log in dense()])),
    }


def _touching(log: GraspLog) -> float:
    """F1 of contact by motion, at the frames in which something touches."""
    assert log.truth is not None
    seen = log.displacement + NOISE * np.random.default_rng(73).standard_normal(log.displacement.shape)
    return f1(log.truth.contact, contact_by_motion(log.time, seen))


def of_markers(known: Known) -> list[Row]:
    """How markers are laid onto a lattice, and which of them are taken to touch."""
    return of_tables(of_slipcore, ("MARKERS",), laid, known)
