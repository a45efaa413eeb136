"""Errors that last as long as a grasp: `python -m benchmarks.estimators.lasting_errors [--page docs/estimators.md]`.

Sets of twelve grasps of two seconds that scatter by 3 %, of one place (as of a force sensor) to ten: velocity, normal
force and an error of 0.01 wander, in each place for itself, and last for a second. Counted are the scatter between
grasps that is found, and 95 % intervals that hold the law. Writes lasting_errors.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import signal

import estimators
from benchmarks.pages import options, table, write
from slipcore.samples import FrictionSamples

LAW = np.array([0.5, 4.0, -0.01])
"""β₀ [-], β₁ [s/m] and β₂ [1/N]."""
SCATTER, ERROR = 0.03, 0.01
"""Between grasps, a part of friction; and of samples."""
LASTING = 0.995
"""Correlation from each to the next of 400 samples: that of 200 is 0.37."""
SAMPLES, FRAME_RATE, AREA = 400, 200.0, 1e-4
GRASPS, PLACES = 12, (1, 2, 3, 4, 10)
COLUMNS = ("places", "sets", "τ: median, 95 %, most", "held, %: β₀, β₁, β₂")


def grasp(
    rng: np.random.Generator, places: int, lasting: float = LASTING, scatter: float = SCATTER, error: float = ERROR
) -> FrictionSamples:
    """A grasp of so many places, off the law by a common factor."""
    white = rng.standard_normal((3, places, 3000))
    wanders = signal.lfilter([np.sqrt(1.0 - lasting**2)], [1.0, -lasting], white)[..., -SAMPLES:].reshape(3, -1)
    v, f_n, one = np.abs(2e-3 + 5e-4 * wanders[0]), 5.0 + 0.3 * wanders[1], np.ones(places * SAMPLES)
    mu = (1.0 + scatter * rng.standard_normal()) * (LAW @ [one, v, f_n]) + error * wanders[2]
    time, place = np.tile(np.arange(SAMPLES) / FRAME_RATE, places), np.repeat(np.arange(places), SAMPLES)
    return FrictionSamples(mu, v, f_n, mu * f_n, time, place, one, AREA)


def found(seed: int, places: int) -> tuple[float, NDArray[np.bool_]]:
    """The scatter between grasps of one set, and which intervals [3] hold the law."""
    rng = np.random.default_rng([seed, places])
    model = estimators.fit([grasp(rng, places) for _ in range(GRASPS)], method="hierarchical")
    assert model.scales is not None
    low, high = model.interval().T
    return model.scales.between_grasps.value, (low <= LAW) & (high >= LAW)


def row(places: int, seeds: Sequence[int]) -> list[object]:
    """Of all sets with so many places in each grasp."""
    scatters, held = zip(*(found(seed, places) for seed in seeds), strict=True)
    scatter = " ".join(f"{value:.3f}" for value in np.quantile(scatters, [0.5, 0.95, 1.0]))
    return [places, len(seeds), scatter, " ".join(f"{100.0 * share:.0f}" for share in np.mean(held, axis=0))]


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000, help="the first seed")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = [row(places, range(arguments.first, arguments.first + arguments.sets)) for places in PLACES]
    tables = {"lasting errors": table(COLUMNS, rows)}
    print(tables["lasting errors"])
    write([dict(zip(COLUMNS, each, strict=True)) for each in rows], tables, arguments, "lasting_errors.json")


if __name__ == "__main__":
    main()
