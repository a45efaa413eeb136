"""Forces by all frames of a contact, against each frame by itself (`python -m benchmarks.forces --only "over time"`).

A sphere on 5 mm is held, sheared further, held, and then lets a little of its shear go at once: what is gained while
the load rests, and what a change of it becomes.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from benchmarks.forces.scenes import LATTICES, Truth, press, seen
from benchmarks.pages import table
from slipcore import GraspLog
from slipcore.defaults import NORMAL_95
from slipcore.forces import Gel, Reconstruction, reconstruct
from slipcore.frames import BoolArray, FloatArray

GEL = Gel(1e6, 0.49, 5e-3)
NOISES = (1e-6, 3e-6, 10e-6)
PLACE = (0.21, -0.34)
"""Middle of the contact beside that of the lattice, in pitches."""
PHASE = 20
"""Frames of each part."""
BEFORE, AFTER, LEFT = 0.25, 0.75, 0.70
"""Shares of the largest shear, held before and after it grows, and that which is left after the step."""
NEAR = 2
"""Frames before and after a change of the load, by which it may be smeared."""


@dataclass(frozen=True, slots=True)
class Score:
    """One way on one sensor: relative errors, tangential and normal, of resultants and of the field while the load
    rests and while it grows, and of resultants near its changes; the share of the step that is found in the two frames
    before it; shares of intervals of 95 % that hold resultants and elements' forces; and ms of CPU a frame.
    """

    seen: str
    markers: str
    noise: float
    way: str
    at_rest: tuple[float, float]
    field_at_rest: tuple[float, float]
    growing: tuple[float, float]
    field_growing: tuple[float, float]
    near: tuple[float, float]
    early: float
    inside: tuple[float, float]
    elements_inside: tuple[float, float]
    milliseconds: float


def scores() -> Iterator[Score]:
    """Of all sensors and noises, both ways."""
    for with_depth, markers, noise in product((True, False), LATTICES, NOISES):
        lattice = LATTICES[markers]
        x, y = (lattice.pitch * part for part in PLACE)
        truth = press("sphere", GEL, lattice, (x, y), [(1.0, float(shear)) for shear in sheared()])
        log = seen(truth.log, noise, with_depth, np.random.default_rng(41))
        for over_time in (False, True):
            began = time.process_time()
            found = reconstruct(log, GEL, noise=noise, over_time=over_time)
            cost = 1e3 * (time.process_time() - began) / len(log)
            how = "with z" if with_depth else "in the plane", markers, noise
            yield _score(*how, "all frames" if over_time else "each by itself", truth, found, cost)


def sheared() -> FloatArray:
    """Share of the largest shear, frame by frame."""
    growing = BEFORE + (AFTER - BEFORE) * (np.arange(PHASE) + 1.0) / PHASE
    held = [np.full(PHASE, share) for share in (BEFORE, AFTER, LEFT)]
    return np.concatenate((held[0], growing, *held[1:]))


def _score(how: str, markers: str, noise: float, way: str, truth: Truth, found: Reconstruction, cost: float) -> Score:
    true, frame = _forces(truth.log), np.arange(len(truth.log))
    changes = np.array([1, 2, 3]) * PHASE
    near = (np.abs(frame[:, None] + 0.5 - changes) < NEAR).any(axis=1)
    growing = (frame >= PHASE) & (frame < 2 * PHASE)
    held = np.abs(found.resultant - truth.total) <= NORMAL_95 * found.resultant_deviation
    touched = found.contact | (true[..., 2] < 0.0)
    elements = (np.abs(found.force - true) <= NORMAL_95 * found.deviation)[touched]

    def errors(chosen: BoolArray) -> tuple[tuple[float, float], tuple[float, float]]:
        return _errors(found.resultant[chosen], truth.total[chosen]), _errors(found.force[chosen], true[chosen])

    at_rest, field_at_rest = errors(~growing & ~near)
    of_growth, field_of_growth = errors(growing & ~near)
    return Score(
        how, markers, noise, way, at_rest, field_at_rest, of_growth, field_of_growth, errors(near)[0],
        _early(found.resultant, truth.total), (float(held[:, :2].mean()), float(held[:, 2].mean())),
        (float(elements[:, :2].mean()), float(elements[:, 2].mean())), cost,
    )  # fmt: skip


def _forces(log: GraspLog) -> FloatArray:
    assert log.force is not None
    return log.force


def _errors(found: FloatArray, true: FloatArray) -> tuple[float, float]:
    parts = (np.s_[..., :2], np.s_[..., 2])
    tangential, normal = (float(np.linalg.norm((found - true)[part]) / np.linalg.norm(true[part])) for part in parts)
    return tangential, normal


def _early(found: FloatArray, true: FloatArray) -> float:
    """How much of the tangential step is found in the frames just before it, against those of the rest before."""
    at = 3 * PHASE
    step = true[at, :2] - true[at - 1, :2]
    change = found[at - NEAR : at, :2].mean(axis=0) - found[at - PHASE // 2 : at - NEAR, :2].mean(axis=0)
    return float(change @ step / (step @ step))


def over_time_table(found: Sequence[Score]) -> str:
    """Two rows a sensor; errors tangential / normal in percent."""
    columns = ("seen", "markers", "noise, µm", "by", "at rest: resultant", "field", "shear grows: resultant", "field",
               "near changes: resultant", "step found early, %", "inside: resultant", "inside: element",
               "CPU a frame, ms")  # fmt: skip
    rows = [
        (s.seen, s.markers, f"{1e6 * s.noise:g}", s.way,
         *(" / ".join(f"{100.0 * part:.2g}" for part in error)
           for error in (s.at_rest, s.field_at_rest, s.growing, s.field_growing, s.near)),
         f"{100.0 * s.early:+.0f}",
         *(" / ".join(f"{part:.0%}" for part in share) for share in (s.inside, s.elements_inside)), s.milliseconds)
        for s in found
    ]  # fmt: skip
    return table(columns, rows)
