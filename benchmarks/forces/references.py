"""Forces found in scenes of an independent boundary-element solver, which shares no code with this one's mechanics.

Copies of ours are in tests/data/contact (its README has the scenes). Defaults marked "scenes" were chosen on these
scenes: the truth is another's, but not unseen. Half-space scenes have normal and tangential directions uncoupled, which
a gel of ν 0.49 is to 2 %; pressure moves no marker sideways there, so that only the layer is also seen in the plane.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.pages import table
from slipcore import GraspLog
from slipcore.forces import Gel, reconstruct
from slipcore.frames import FloatArray

FOLDER = Path("tests/data/contact")
SCENES = {"cond1": np.inf, "cond4": np.inf, "reversal": np.inf, "ring": np.inf, "cond1_layer5c": 5e-3}
"""Thickness of their gels, m."""
NOISES = (1e-6, 10e-6)
OUTWARD = np.array([1.0, 1.0, -1.0])
"""From the scenes' frame, z into the finger."""
NORMAL_95 = 1.959964


@dataclass(frozen=True, slots=True)
class Reference:
    """One scene: errors of the resultant, tangential and normal, relative to the whole true one (L2 over its frames),
    how many of its intervals of 95 % of x, y and z hold the truth, and of how many.
    """

    scene: str
    seen: str
    noise: float
    errors: tuple[float, float]
    inside: tuple[int, int, int]
    frames: int


def read(scene: str) -> tuple[GraspLog, FloatArray]:
    """Displacement without noise, and the true resultants [t, 3] N of the object on the finger, z outward."""
    with np.load(FOLDER / f"{scene}.npz") as stored:
        steps = stored["step"]
        moved = 1e-3 * stored["u"].transpose(0, 2, 1, 3) * OUTWARD
        x, y = np.meshgrid(1e-3 * stored["x"], 1e-3 * stored["y"], indexing="ij")
        normal, along = stored["F_N"][steps], stored["F_T"][steps]
    total = np.stack((along, np.zeros_like(along), -normal), axis=-1)
    position = np.stack((x, y, np.zeros_like(x)), axis=-1)
    return GraspLog(0.1 * np.arange(len(moved)), position, moved, 0.75e-3**2), total


def references() -> Iterator[Reference]:
    """All scenes with depth, and the layer also in the plane."""
    for scene, thickness in SCENES.items():
        log, total = read(scene)
        gel = Gel(1e6, 0.49, thickness)
        for depth_seen in (True, False) if np.isfinite(thickness) else (True,):
            for noise in NOISES:
                moved = log.displacement + noise * np.random.default_rng(29).standard_normal(log.displacement.shape)
                moved[..., 2] *= depth_seen
                found = reconstruct(replace(log, displacement=moved), gel, None, noise)
                seen = "with z" if depth_seen else "in the plane"
                yield _judged(scene, seen, noise, found.resultant - total, found.resultant_deviation, total)


def _judged(
    scene: str, seen: str, noise: float, error: FloatArray, deviation: FloatArray, total: FloatArray
) -> Reference:
    x, y, z = (np.abs(error) <= NORMAL_95 * deviation).sum(axis=0)
    tangential, normal = (
        float(np.linalg.norm(error[:, part]) / np.linalg.norm(total)) for part in (slice(2), slice(2, 3))
    )
    return Reference(scene, seen, noise, (tangential, normal), (int(x), int(y), int(z)), len(total))


def references_table(found: list[Reference]) -> str:
    """Errors in percent, and shares of intervals that hold the truth."""
    columns = ("scene", "seen", "noise, µm", "F_T, %", "F_z, %", "inside: F_x", "F_y", "F_z", "frames")
    rows = [
        (r.scene, r.seen, f"{1e6 * r.noise:g}", *(f"{100.0 * each:.2g}" for each in r.errors),
         *(f"{each / r.frames:.0%}" for each in r.inside), r.frames)
        for r in found
    ]  # fmt: skip
    return table(columns, rows)
