"""Errors that last as long as a grasp: `python -m benchmarks.estimators.lasting_errors [--page docs/estimators.md]`.

Sets of twelve grasps of two seconds that scatter by 3 %, of one place (as of a force sensor) to ten: velocity, normal
force and an error of 0.01 wander, in each place for itself, and last for a second. Counted are the scatter between
grasps that is found, and 95 % intervals that hold the law. Of one such grasp alone the same, where they last for so
many samples: of its moments, the law's friction at rest and at the middle of the data, and slopes; and how often these
count as known. Writes lasting_errors.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

import estimators
from benchmarks.pages import options, table, write
from slipcore.samples import FrictionSamples
from stiction_client.support import uncertainty

LAW = np.array([0.5, 4.0, -0.01])
"""β₀ [-], β₁ [s/m] and β₂ [1/N]."""
SCATTER, ERROR = 0.03, 0.01
"""Between grasps, a part of friction; and of samples."""
LASTING = 0.995
"""Correlation from each to the next of 400 samples: that of 200 is 0.37."""
SAMPLES, FRAME_RATE, AREA = 400, 200.0, 1e-4
GRASPS, PLACES = 12, (1, 2, 3, 4, 10)
COLUMNS = ("places", "sets", "τ: median, 95 %, most", "held, %: β₀, β₁, β₂")
ALONE, ALONE_SETS = (0.0, 0.9, 0.98, LASTING), 2
"""Correlations of what wanders in one grasp by itself, and as many times the sets of such grasps."""
FEW_PLACES = (1, 2, 4, 10)
ALONE_COLUMNS = (
    "places",
    "errors last, samples of 400",
    "grasps",
    "held, %: μ in the middle, at rest",
    "β₁, β₂",
    "known, %: β₁, β₂",
    "half-width of β₁, s/m",
    "of μ in the middle, %",
)


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


class Alone(NamedTuple):
    """One grasp by itself: which 95 % intervals hold the law, of friction in the ``middle`` of its data and at ``rest``
    and of both ``slopes``, whether these count as ``known``, and half-widths of β₁ and, as a part of it, of friction in
    the middle.
    """

    middle: bool
    rest: bool
    slopes: NDArray[np.bool_]
    known: NDArray[np.bool_]
    width: float
    part: float


def alone(seed: int, places: int, lasting: float) -> Alone:
    """A grasp by itself, fitted from its moments as a service does."""
    record = grasp(np.random.default_rng([seed, places]), places, lasting)
    model = estimators.fit(estimators.Moments.from_samples(record), method="hierarchical")
    middle = np.array([np.mean(model.domain.tangential_velocity), np.mean(model.domain.normal_force)])
    held = []
    for v, f_n in (middle, middle * [0.0, 1.0]):
        half = float(uncertainty(model, v, f_n) * model.predict(v, f_n))
        held.append(abs(float(model.predict(v, f_n)) - LAW @ [1.0, v, f_n]) <= half)
    low, high = model.interval()[1:].T
    slopes = (low <= LAW[1:]) & (high >= LAW[1:])
    width, part = 0.5 * float(high[0] - low[0]), float(uncertainty(model, *middle))
    return Alone(*held, slopes, model.identifiable[1:], width, part)


def row_alone(places: int, lasting: float, seeds: Sequence[int]) -> list[object]:
    """Of all grasps by themselves with so many places, in which errors last so long."""
    found = [alone(seed, places, lasting) for seed in seeds]
    friction = [100.0 * np.mean([each.middle for each in found]), 100.0 * np.mean([each.rest for each in found])]
    slopes, known = (100.0 * np.mean([part[k] for part in found], axis=0) for k in (2, 3))
    return [
        places,
        f"{-1.0 / np.log(lasting):.0f}" if lasting else "0",
        len(found),
        " ".join(f"{share:.0f}" for share in friction),
        " ".join(f"{share:.0f}" for share in slopes),
        " ".join(f"{share:.0f}" for share in known),
        f"{np.median([each.width for each in found]):.1f}",
        f"{100.0 * np.median([each.part for each in found]):.0f}",
    ]


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--sets", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000, help="the first seed")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = [row(places, range(arguments.first, arguments.first + arguments.sets)) for places in PLACES]
    seeds = range(arguments.first, arguments.first + ALONE_SETS * arguments.sets)
    single = [row_alone(places, lasting, seeds) for places in FEW_PLACES for lasting in ALONE]
    tables = {"lasting errors": table(COLUMNS, rows), "lasting errors of one grasp": table(ALONE_COLUMNS, single)}
    for each in tables.values():
        print(each, end="\n\n")
    found = [dict(zip(COLUMNS, each, strict=True)) for each in rows]
    found += [dict(zip(ALONE_COLUMNS, each, strict=True)) for each in single]
    write(found, tables, arguments, "lasting_errors.json")


if __name__ == "__main__":
    main()
