"""Slip on arrays of few elements: `python -m benchmarks.detector.coarse [--scenes SET] [--page docs/sensors.md]`.

Scenes of 20 × 20 points (benchmarks/detector/scenes.py) seen by 6 × 6, 4 × 4 and 3 × 3 elements: forces are summed over
each, displacement is the mean by pressure, and the truth is averaged: an element touches if a tenth of it does, and
slips if more than half of what touches does. The same at 1000 frames a second, and arrays of separate pillars
(benchmarks/detector/pillars.py). F1, and the share of sticking elements that are said to slip while the load grows, by
method. Writes detector_coarse.json. Defaults of method "forces_only" were chosen on the set `tuning`.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from benchmarks.detector import pillars
from benchmarks.detector.accuracy import score
from benchmarks.detector.scenes import Case, cases, observed
from benchmarks.pages import options, picture_folder, table, write
from slipcore import GraspLog, GroundTruth, SlipHistory, detect_slip
from slipcore.frames import FloatArray

TOUCHING = 0.1
"""Share of an element that touches, from which it counts as in contact."""
RATE = 1000.0
RUNS = {
    "filter, displacement alone": ("displacement", "filter"),
    "filter, forces": ("force", "filter"),
    "strain_rate, forces": ("force", "strain_rate"),
    "force_ratio": ("force", "force_ratio"),
    "forces_only": ("force", "forces_only"),
    "coarse": ("force", "coarse"),
}
"""What each method is given, and the method."""


@dataclass(frozen=True, slots=True)
class Array:
    """A sensor: how many elements a side, frames a second (None: as simulated), and noise of markers, m, and forces, N.

    Without a number of elements it is the array of separate pillars.
    """

    name: str
    elements: int | None
    rate: float | None
    marker_noise: float
    force_noise: float


ARRAYS = (
    Array("6 × 6, 2 mN", 6, None, 1e-6, 2e-3),
    Array("6 × 6, 10 mN", 6, None, 1e-6, 1e-2),
    Array("4 × 4, 2 mN", 4, None, 1e-6, 2e-3),
    Array("3 × 3, 2 mN", 3, None, 1e-6, 2e-3),
    Array("3 × 3, 10 mN", 3, None, 1e-6, 1e-2),
    Array("3 × 3 at 1 kHz, 10 mN", 3, RATE, 1e-6, 1e-2),
    Array("3 × 3 pillars at 1 kHz, 10 mN", None, RATE, 5e-6, 1e-2),
)


@dataclass(frozen=True, slots=True)
class Found:
    """Mean F1 of a method on an array over the scenes, the worst of them, and false slip while the load grows."""

    array: str
    method: str
    f1: float
    worst: float
    worst_scene: str
    false_slip: float
    each: dict[str, float]


def coarse(log: GraspLog, elements: int) -> GraspLog:
    """A log as so many elements a side would tell it."""
    assert log.force is not None
    assert log.truth is not None
    assert log.normal is not None
    share = overlap(log.grid[0], elements)
    area = (log.grid[0] / elements) ** 2
    pressing = np.maximum(-log.force[..., 2:], 0.0)
    truth, weight = log.truth, total(share, pressing)
    touching, slipping, moving = (
        total(share, mask[..., None].astype(float))[..., 0]
        for mask in (truth.contact, truth.slip_contact_factor & truth.contact, truth.slip_kinematic & truth.contact)
    )
    pressed = total(share, log.displacement * pressing) / np.where(weight > 0.0, weight, 1.0)
    normal = total(share, log.normal)
    return replace(
        log,
        position=total(share, log.position) / area,
        displacement=np.where(weight > 0.0, pressed, total(share, log.displacement) / area),
        force=total(share, log.force),
        normal=normal / np.linalg.norm(normal, axis=-1, keepdims=True),
        element_area=log.element_area * area,
        truth=GroundTruth(
            touching > TOUCHING * area,
            moving > 0.5 * touching,
            slipping > 0.5 * touching,
            truth.stick_ratio,
            truth.friction,
        ),
    )


def overlap(points: int, elements: int) -> FloatArray:
    """How much of each point's cell lies in each element, along a side: [elements, points]."""
    ends, cells = np.arange(elements + 1) * points / elements, np.arange(points)
    return np.clip(np.minimum(ends[1:, None], cells + 1) - np.maximum(ends[:-1, None], cells), 0.0, None)


def total(share: FloatArray, field: FloatArray) -> FloatArray:
    """Sum of a field [..., n, m, k] over elements."""
    return np.asarray(np.einsum("ai,bj,...ijk->...abk", share, share, field, optimize=True))


def at_rate(case: Case, rate: float) -> Case:
    """The case at another frame rate: fields run smoothly and without overshoot through those of its frames."""
    log = case.log
    assert log.truth is not None
    time = np.arange(log.time[0], log.time[-1], 1.0 / rate)
    frames = np.minimum(np.searchsorted(log.time, time - 0.5 / rate), len(log) - 1)

    def between(field: FloatArray | None) -> FloatArray | None:
        return None if field is None else PchipInterpolator(log.time, field)(time)

    normal = between(log.normal)
    faster = replace(
        log,
        time=time,
        displacement=PchipInterpolator(log.time, log.displacement)(time),
        force=between(log.force),
        normal=None if normal is None else normal / np.linalg.norm(normal, axis=-1, keepdims=True),
        object_pose=between(log.object_pose),
        truth=log.truth.take(frames),
    )
    return Case(case.name, faster, tuple(np.array(case.phase)[frames]))


def seen_by(array: Array, which: str) -> Iterator[Case]:
    """The cases of a set as an array sees them, without noise."""
    if array.elements is None:
        yield from pillars.cases(which)
        return
    for case in cases(which):
        seen = Case(case.name, coarse(case.log, array.elements), case.phase)
        yield seen if array.rate is None else at_rate(seen, array.rate)


def slips(case: Case) -> bool:
    """Whether any element of this array slips beyond its rim: a press scores in false slip alone."""
    truth = case.log.truth
    assert truth is not None
    return not case.name.startswith("press") and bool((truth.slip_contact_factor & truth.contact).any())


def false_slip(case: Case, history: SlipHistory) -> tuple[int, int]:
    """How many elements stick while the load grows, over all frames, and how many of them are said to slip."""
    truth = case.log.truth
    assert truth is not None
    grows = (np.array(case.phase) == "shear")[:, None, None]
    sticks = truth.contact & ~truth.slip_contact_factor & grows
    return int(sticks.sum()), int((history.slip & sticks).sum())


def measure(array: Array, which: str, runs: dict[str, tuple[str, str]] = RUNS) -> list[Found]:
    """All methods on an array."""
    scores = dict[str, dict[str, float]]({name: {} for name in runs})
    counts = {name: np.zeros(2) for name in runs}
    for seed, case in enumerate(seen_by(array, which)):
        for name, (inputs, method) in runs.items():
            log = observed(case.log, array.marker_noise, array.force_noise, inputs, seed)
            history = detect_slip(log, method)
            counts[name] += false_slip(case, history)
            if slips(case):
                scores[name][case.name] = score(case, log, history).f1
    found = []
    for name, each in scores.items():
        worst = min(each, key=each.__getitem__)
        sticks, slipping = counts[name]
        found.append(
            Found(array.name, name, float(np.mean(list(each.values()))), each[worst], worst, slipping / sticks, each)
        )
    return found


def main() -> None:
    """Measure, print and store."""
    parser = options(__doc__)
    parser.add_argument("--scenes", default="scoring", choices=("tuning", "scoring"))
    arguments = parser.parse_args()
    picture_folder(arguments)
    rows = [measure(array, arguments.scenes) for array in ARRAYS]
    columns = ("array", *RUNS)
    made = {
        "coarse": table(columns, [(row[0].array, *(found.f1 for found in row)) for row in rows]),
        "coarse false slip": table(columns, [(row[0].array, *(found.false_slip for found in row)) for row in rows]),
    }
    print("\n\n".join(made.values()))
    write([asdict(found) for row in rows for found in row], made, arguments, "detector_coarse.json")


if __name__ == "__main__":
    main()
