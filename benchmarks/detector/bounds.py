"""Bounds of friction from whole contacts: `python -m benchmarks.detector.bounds [--page docs/patches.md]`.

All scenes of the library and of benchmarks/detector/scenes.py, seen by arrays of few elements
(benchmarks/detector/coarse.py) with noise of forces: how many bounds lie above the truth, and how much of the bound
that the same array without noise gives is left. The truth is the scene's friction or, where that depends on speed,
pressure or place, the largest load ratio that the scene itself bore, if that is more. Writes detector_bounds.json.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass

import numpy as np

from benchmarks.detector.coarse import coarse
from benchmarks.detector.scenes import cases, observed
from benchmarks.pages import options, picture_folder, table, write
from benchmarks.paper.common import scene_log
from slipcore import GraspLog, contact_friction, detect_slip
from slipcore.contact.effects import ForceNoise, MarkerNoise
from slipcore.contact.scene import library
from slipcore.patch_record import joined

ARRAYS = (5, 6, 10)
"""Elements a side."""
NOISES = (1e-4, 1e-3, 5e-3)
"""N, of forces."""
MARKER_NOISE = 1e-6
SEEDS = 3
SETS = ("tuning", "scoring", "reference")


@dataclass(frozen=True, slots=True)
class Bounds:
    """Of an array under a noise, N: how many bounds lie ``above`` the truth, of how many; the largest share of the
    truth that one is; and the median share that is left of the bound without noise.
    """

    elements: int
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


def low(log: GraspLog, noise: float, seed: int) -> float:
    """Lower end of the contact's friction under a noise of forces, N; NaN without."""
    seen = observed(log, MARKER_NOISE, noise, "force", seed)
    found = contact_friction(seen.time, detect_slip(seen).patches)
    return float("nan") if found is None else found.low


def measure() -> list[Bounds]:
    """All arrays under all noises."""
    shares, left = ({(elements, noise): list[float]() for elements in ARRAYS for noise in NOISES} for _ in range(2))
    for number, (log, truth) in enumerate(logs()):
        for elements in ARRAYS:
            seen = coarse(log, elements)
            without = low(seen, 0.0, number)
            for noise in NOISES:
                lows = [low(seen, noise, SEEDS * number + seed) for seed in range(SEEDS)]
                shares[elements, noise] += [each / truth for each in lows]
                left[elements, noise] += [each / without for each in lows if without > 0.0]
    return [
        Bounds(
            *key,
            int(np.isfinite(each).sum()),
            int((np.array(each) > 1.0).sum()),
            float(np.nanmax(each)),
            float(np.nanmedian(left[key])),
        )
        for key, each in shares.items()
    ]


def main() -> None:
    """Measure, print and store."""
    arguments = options(__doc__).parse_args()
    picture_folder(arguments)
    rows = measure()
    columns = ("array", "noise of forces, mN", "bounds", "above the truth", "largest over truth", "left, median")
    made = table(
        columns,
        [
            (f"{each.elements} × {each.elements}", 1e3 * each.noise, each.bounds, each.above, each.largest, each.left)
            for each in rows
        ],
    )
    print(made)
    write([asdict(each) for each in rows], {"bounds": made}, arguments, "detector_bounds.json")


if __name__ == "__main__":
    main()
