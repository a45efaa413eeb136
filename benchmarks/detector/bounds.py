"""Bounds of friction from whole contacts: `python -m benchmarks.detector.bounds [--page docs/patches.md]`.

All scenes of the library and of benchmarks/detector/scenes.py, seen by arrays of few elements
(benchmarks/detector/coarse.py) with noise of forces: how many bounds lie above the truth, and how much of the bound
that the same array without noise gives is left. The truth is the scene's friction or, where that depends on speed,
pressure or place, the largest load ratio that the scene itself bore, if that is more. And loads that are held still, so
that nothing but noise is in the bound: how many lie above what was held. Writes detector_bounds.json.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.signal import lfilter

from benchmarks.detector.coarse import coarse
from benchmarks.detector.scenes import cases, observed
from benchmarks.pages import options, picture_folder, table, write
from benchmarks.paper.common import scene_log
from slipcore import GraspLog, contact_friction, detect_slip
from slipcore.contact.effects import ForceNoise, MarkerNoise
from slipcore.contact.scene import library
from slipcore.defaults import NORMAL_95, PatchOptions
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch.following import follow_patches
from slipcore.patch_record import ContactFriction, joined

Shape = tuple[int, ...]
ARRAYS = (2, 3, 5, 6, 10)
"""Elements a side."""
MARKER_NOISE = 1e-6
SEEDS = 3
SETS = ("tuning", "scoring", "reference")
SMOOTHING = 1.2
"""Elements, of noise that a sensor smooths over them."""
TIME_CONSTANT = 10.0
"""Frames, of noise that lasts."""
HELD, NORMAL_FORCE, HELD_NOISE, HELD_SEEDS = 0.35, 0.8, 5e-3, 200
"""A load ratio that is held by a normal force, N, under noise, N."""


def white(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """Noise of 1, [t, n, m, 3], independent among elements and frames."""
    return rng.standard_normal(shape)


def common(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """Noise of all elements together, in the sum what ``white`` noise of 1 is."""
    elements = shape[1] * shape[2]
    return np.broadcast_to(rng.standard_normal((shape[0], 1, 1, shape[3])), shape) / np.sqrt(elements)


def smoothed(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """``white`` noise that is smoothed over elements, and smaller by it."""
    return np.asarray(gaussian_filter(white(shape, rng), (0.0, SMOOTHING, SMOOTHING, 0.0)))


def lasting(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """Noise of 1 behind a low-pass filter, [t, ...]."""
    memory, settling = float(np.exp(-1.0 / TIME_CONSTANT)), round(10.0 * TIME_CONSTANT)
    noise = rng.standard_normal((shape[0] + settling, *shape[1:]))
    return np.asarray(lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise, axis=0)[settling:])


def smoothed_lasting(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """``lasting`` noise that is ``smoothed`` as well."""
    return np.asarray(gaussian_filter(lasting(shape, rng), (0.0, SMOOTHING, SMOOTHING, 0.0)))


def common_lasting(shape: Shape, rng: np.random.Generator) -> FloatArray:
    """``lasting`` noise of all elements together, in the sum as large as ``common`` noise."""
    return np.broadcast_to(lasting((shape[0], 1, 1, shape[3]), rng), shape) / np.sqrt(shape[1] * shape[2])


Noise = Callable[[Shape, np.random.Generator], FloatArray]
NOISES: tuple[tuple[Noise, float], ...] = (
    (white, 1e-4),
    (white, 1e-3),
    (white, 5e-3),
    (common, 5e-3),
    (smoothed, 5e-3),
    (lasting, 5e-3),
    (smoothed_lasting, 5e-3),
    (common_lasting, 5e-3),
)
"""And N, of forces."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """Of an array under a kind of noise, N: how many bounds lie ``above`` the truth, of how many; the largest share of
    the truth that one is; and the median share that is left of the bound without noise.
    """

    elements: int
    kind: str
    noise: float
    bounds: int
    above: int
    largest: float
    left: float


def logs() -> Iterator[tuple[GraspLog, float]]:
    """Logs without noise, each with the most that friction is in it."""
    for name in library():
        yield with_truth(scene_log(name, without=(MarkerNoise, ForceNoise)))
    for which in SETS:
        yield from (with_truth(case.log) for case in cases(which))


def with_truth(log: GraspLog) -> tuple[GraspLog, float]:
    """The log, and the most that friction is in it."""
    assert log.force is not None
    assert log.truth is not None
    borne = np.nanmax(joined(detect_slip(log).patches, "load_ratio"))
    return log, max(log.truth.friction.coefficients[0], float(borne))


def low(log: GraspLog, kind: Noise, noise: float, seed: int) -> float:
    """Lower end of the contact's friction under a kind of noise of forces, N; NaN without."""
    seen = observed(log, MARKER_NOISE, 0.0, "force", seed)
    assert seen.force is not None
    seen = replace(seen, force=seen.force + noise * kind(seen.force.shape, np.random.default_rng([seed, 1])))
    found = contact_friction(seen.time, detect_slip(seen).patches)
    return float("nan") if found is None else found.low


def measure() -> list[Bounds]:
    """All arrays under all noises."""
    keys = [(elements, *each) for elements in ARRAYS for each in NOISES]
    shares, left = ({key: list[float]() for key in keys} for _ in range(2))
    for number, (log, truth) in enumerate(logs()):
        for elements in ARRAYS:
            seen = coarse(log, elements)
            without = low(seen, white, 0.0, number)
            for each in NOISES:
                lows = [low(seen, *each, SEEDS * number + seed) for seed in range(SEEDS)]
                shares[elements, *each] += [bound / truth for bound in lows]
                left[elements, *each] += [bound / without for bound in lows if without > 0.0]
    return [summary(*key, np.array(each), float(np.nanmedian(left[key]))) for key, each in shares.items()]


def summary(elements: int, kind: Noise, noise: float, shares: FloatArray, left: float) -> Bounds:
    """Of bounds over the truth, NaN where there is none."""
    above, known = int((shares > 1.0).sum()), int(np.isfinite(shares).sum())
    return Bounds(elements, kind.__name__, noise, known, above, float(np.nanmax(shares)), left)


def held_by(elements: BoolArray, share: float, noise: FloatArray) -> ContactFriction:
    """What holds ``share`` of a normal force by these elements [n, m] of 3 mm, under noise [t, n, m, 3] N of forces."""
    time = np.arange(len(noise)) / 30.0
    axes = (3e-3 * (np.arange(length) - 0.5 * (length - 1)) for length in elements.shape)
    position = np.stack([*np.meshgrid(*axes, indexing="ij"), np.zeros(elements.shape)], axis=-1)
    force = noise.copy()
    force[:, elements] += NORMAL_FORCE / elements.sum() * np.array([share, 0.0, -1.0])
    log = GraspLog(time, position, np.zeros_like(force), 9e-6, force, np.broadcast_to([0.0, 0.0, 1.0], force.shape))
    touching = np.tile(elements, (len(force), 1, 1))
    found = contact_friction(time, follow_patches(log, touching, np.zeros_like(touching)))
    assert found is not None
    return found


def held() -> list[Bounds]:
    """Loads held for 2 s, without what is taken off for errors of sums, which are exact here."""
    sums, found = 1.0 - NORMAL_95 * PatchOptions().resultant_error, []
    for side in ARRAYS:
        for kind in (white, common, smoothed, lasting, smoothed_lasting, common_lasting):
            noises = (HELD_NOISE * kind((60, side, side, 3), np.random.default_rng(s)) for s in range(HELD_SEEDS))
            lows = np.array([held_by(np.ones((side, side), bool), HELD, each).low for each in noises]) / (HELD * sums)
            found.append(summary(side, kind, HELD_NOISE, lows, float(np.median(lows))))
    return found


def page(rows: list[Bounds], last: str) -> str:
    """The table of these."""
    columns = ("array", "noise of forces", "mN", "bounds", "above the truth", "largest over truth", last)
    return table(
        columns,
        [
            (
                f"{e.elements} × {e.elements}",
                e.kind.replace("_", " and "),
                1e3 * e.noise,
                e.bounds,
                e.above,
                e.largest,
                e.left,
            )
            for e in rows
        ],
    )


def main() -> None:
    """Measure, print and store."""
    arguments = options(__doc__).parse_args()
    picture_folder(arguments)
    found = {"bounds": measure(), "held": held()}
    pages = {name: page(found[name], last) for name, last in (("bounds", "left, median"), ("held", "median"))}
    print("\n\n".join(pages.values()))
    stored = {name: [asdict(each) for each in rows] for name, rows in found.items()}
    write(stored, pages, arguments, "detector_bounds.json")


if __name__ == "__main__":
    main()
