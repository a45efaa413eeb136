"""Slip found from dots without a lattice: `python -m benchmarks.detector.markers [--page docs/formats.md]`.

The unseen scenes of benchmarks/detector/scenes.py are simulated at 60 × 60 points; dots are some of them (on a lattice,
jittered, hexagonal, Poisson disc), with 1 µm of noise, none lost, 5 % lost for good, or 5 % lost in each frame anew.
Detection is from displacement alone, with contact from the shape or known. Writes markers.json, prints a table.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.detector.scenes import scoring, simulated
from benchmarks.pages import options, picture_folder, table, write
from service.slip_benchmark.measures import f1
from slipcore import GraspLog, detect_slip
from slipcore.contact.effects import SensorSampling
from slipcore.frames import FloatArray
from slipcore.markers import on_lattice

SIDE, STEP = 60, 3
SENSOR = SensorSampling((SIDE, SIDE), 0.25e-3, 30.0)
NOISE, LOST = 1e-6, 0.05
Places = NDArray[np.int64]
"""Points of the simulated lattice that are dots, [2, k]."""


def square(_: np.random.Generator) -> Places:
    """Every third point along both axes: a sensor of 20 × 20."""
    axis = np.arange(1, SIDE, STEP)
    return np.stack(np.meshgrid(axis, axis, indexing="ij")).reshape(2, -1)


def jittered(rng: np.random.Generator) -> Places:
    """The same, each moved by up to a third of the pitch along both axes."""
    places = square(rng)
    return np.clip(places + rng.integers(-1, 2, places.shape), 0, SIDE - 1)


def hexagonal(_: np.random.Generator) -> Places:
    """Rows that are set off by half a pitch, as dense as the square."""
    pitch = STEP * np.sqrt(2.0 / np.sqrt(3.0))
    row, column = np.meshgrid(np.arange(30), np.arange(30), indexing="ij")
    places = np.stack([row * pitch * np.sqrt(0.75), (column + 0.5 * (row % 2)) * pitch]).reshape(2, -1)
    return np.rint(places[:, (places < SIDE - 0.5).all(axis=0)]).astype(np.int64)


def poisson_disc(rng: np.random.Generator) -> Places:
    """Thrown at random, none nearer to another than 0.8 of the pitch."""
    kept: list[NDArray[np.int64]] = []
    for place in np.stack(np.divmod(rng.permutation(SIDE**2), SIDE), axis=1):
        if all(((place - other) ** 2).sum() >= (0.8 * STEP) ** 2 for other in kept):
            kept.append(place)
    return np.stack(kept, axis=1)


DOTS: dict[str, Callable[[np.random.Generator], Places]] = {
    "lattice": square,
    "jittered": jittered,
    "hexagonal": hexagonal,
    "Poisson disc": poisson_disc,
}
LOSSES = ("none", "for good", "each frame")


@dataclass(frozen=True, slots=True)
class Score:
    """Mean and worst F1 over scenes at the elements observed, and the share of dots that are elements."""

    dots: str
    lost: str
    contact: str
    used: float
    f1: float
    worst: float
    worst_scene: str


def without(displacement: FloatArray, lost: str, rng: np.random.Generator) -> FloatArray:
    """Displacement [t, k, 3] with NaN for what is lost."""
    shape = displacement.shape[:2]
    gone = rng.random(shape if lost == "each frame" else shape[1:]) < (0.0 if lost == "none" else LOST)
    return np.where(np.broadcast_to(gone, shape)[..., None], np.nan, displacement)


def score(log: GraspLog, place: Callable[[np.random.Generator], Places], lost: str, known: bool) -> tuple[float, float]:
    """F1 of one scene against the contact factor, and the share of dots that are elements."""
    assert log.truth is not None
    rng = np.random.default_rng(5)
    at = place(rng)
    displacement, contact, slips = (
        field[:, *at] for field in (log.displacement, log.truth.contact, log.truth.slip_contact_factor)
    )
    noisy = without(displacement + NOISE * rng.standard_normal(displacement.shape), lost, rng)
    dots, lattice = on_lattice(log.time, log.position[tuple(at)], noisy, contact if known else None)
    found = detect_slip(dots, "filter").slip
    assert dots.observed is not None
    scored = contact[:, lattice.marker] & dots.observed
    return f1(slips[:, lattice.marker] & scored, found & scored), float(lattice.occupied.sum() / at.shape[1])


def measure(logs: dict[str, GraspLog], dots: str, lost: str, known: bool) -> Score:
    """One kind of dots over all scenes."""
    each = {name: score(log, DOTS[dots], lost, known) for name, log in logs.items()}
    scores = {name: found for name, (found, _) in each.items() if not np.isnan(found)}
    worst = min(scores, key=lambda name: scores[name])
    used = float(np.mean([share for _, share in each.values()]))
    mean = float(np.mean(list(scores.values())))
    return Score(dots, lost, "known" if known else "from shape", used, mean, scores[worst], worst)


def dense_logs() -> dict[str, GraspLog]:
    """The unseen scenes that slip, at all points."""
    logs = {}
    for scene in scoring():
        effects = tuple(effect for effect in scene.effects if not isinstance(effect, SensorSampling))
        logs[scene.name] = simulated(replace(scene, effects=(SENSOR, *effects)))
        print(f"simulated: {scene.name}", flush=True)
    return {name: log for name, log in logs.items() if not name.startswith("press")}


def main() -> None:
    """Measure, print and write."""
    arguments = options(__doc__).parse_args()
    picture_folder(arguments)
    logs = dense_logs()
    scores = [measure(logs, dots, lost, known) for known in (True, False) for dots in DOTS for lost in LOSSES]
    columns = ("dots", "5 % lost", "contact", "dots used", "F1", "worst scene")
    rows = [(s.dots, s.lost, s.contact, f"{s.used:.0%}", s.f1, f"{s.worst:.2f} ({s.worst_scene})") for s in scores]
    text = table(columns, rows)
    print(text)
    write([asdict(score) for score in scores], {"markers": text}, arguments, "markers.json")


if __name__ == "__main__":
    main()
