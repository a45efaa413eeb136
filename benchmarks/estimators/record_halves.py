"""What half of a real record says of the other half: `python -m benchmarks.estimators.record_halves [--page FILE]`.

Each public record (benchmarks/estimators/friction_records.py) is cut into blocks of time, of which a random half is
fitted, each block as a grasp, and the other half is predicted: which part of its samples lies below the 5 %, 50 % and
95 % quantiles of an element. Rocks slide at micrometres a second, for which the priors of slopes are not made: their
velocities count in millimetres. Of the bench also the second half of each stroke, where the record has left the elastic
ramp. Beside the methods stand what a normal with the mean and the deviation of the record's own residuals has below the
same quantiles, and what a prediction has that knows how far the blocks before and after in time are off the law. Then
whether levels scatter as a normal or as a log-normal factor: of the rocks' blocks and of the bench's strokes each is
predicted from all others, by the Student-t of their mean and deviation, and of those of their logarithms. Writes
record_halves.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

import estimators
from benchmarks.estimators.friction_records import ROCKS, bench, rock
from benchmarks.pages import options, table, write
from slipcore.samples import FrictionSamples

METHODS = ("auto", "hierarchical", "ols", "robust")
BLOCKS = 40
QUANTILES = (0.05, 0.5, 0.95)
COLUMNS = (
    "record",
    "blocks",
    *(f"{method}: below 5, 50, 95 %" for method in METHODS),
    "the right normal",
    "by blocks beside in time",
)

SHAPE_COLUMNS = ("record", "levels", "deviation, % of friction", "log score of a log-normal factor over a normal one")
LEAST_STROKE = 30
"""Samples; less is a part of a stroke."""


def records() -> dict[str, FrictionSamples]:
    """Those of rocks with a thousandfold velocity, and that of the bench whole and in part."""
    found = {}
    for name in ROCKS:
        record = rock(name)
        found[f"rock gouge, {name}"] = replace(record, tangential_velocity=1e3 * record.tangential_velocity)
    return {**found, "friction bench": bench(), "friction bench, second half of strokes": bench(from_middle=True)}


def blocks_of(record: FrictionSamples, count: int) -> list[FrictionSamples]:
    """The record in so many stretches of time, each with as many samples."""
    order = np.argsort(record.time, kind="stable")
    return [record.take(np.isin(np.arange(len(record)), part)) for part in np.array_split(order, count)]


def below(parts: Sequence[FrictionSamples], chosen: NDArray[np.bool_], method: str) -> list[float]:
    """Part of the samples of the blocks that were not ``chosen`` below each quantile of a fit to those that were."""
    try:
        model = estimators.fit([part for part, use in zip(parts, chosen, strict=True) if use], method=method)
    except estimators.NotConverged as refused:  # an M-estimate of what is half ramp
        model = refused.model
    rest = FrictionSamples.concatenate([part for part, use in zip(parts, chosen, strict=True) if not use])
    v, f_n, mu = rest.tangential_velocity, rest.normal_force, rest.friction_coefficient
    return [float((mu < model.predict(v, f_n, quantile, of="element")).mean()) for quantile in QUANTILES]


def residuals(parts: Sequence[FrictionSamples], fitted: Sequence[FrictionSamples]) -> list[NDArray[np.float64]]:
    """What the samples of each block are off the law of those that were ``fitted``."""
    model = estimators.fit(fitted, method="hierarchical")
    return [part.friction_coefficient - model.predict(part.tangential_velocity, part.normal_force) for part in parts]


def right_normal(parts: Sequence[FrictionSamples]) -> list[float]:
    """Part of the samples below each quantile of a normal with the mean and the deviation of their residuals."""
    off = np.concatenate(residuals(parts, parts))
    return [float((off < off.mean() + score * off.std()).mean()) for score in special.ndtri(QUANTILES)]


def beside(parts: Sequence[FrictionSamples], chosen: NDArray[np.bool_]) -> list[float]:
    """As ``below``, by a law whose level goes straight from each chosen block to the next in time."""
    off = residuals(parts, [part for part, use in zip(parts, chosen, strict=True) if use])
    level, known, rest = np.array([each.mean() for each in off]), np.flatnonzero(chosen), np.flatnonzero(~chosen)
    missed = [level[k] - np.interp(k, known[known != k], level[known[known != k]]) for k in known]
    scatter = np.sqrt(np.mean(np.square(missed)) + np.mean([off[k].var() for k in known]))
    left = np.concatenate([off[k] - np.interp(k, known, level[known]) for k in rest])
    return [float((left < score * scatter).mean()) for score in special.ndtri(QUANTILES)]


def strokes_of(record: FrictionSamples) -> list[FrictionSamples]:
    """Of the bench: what lies between two reversals, where samples are left out."""
    order = np.argsort(record.time, kind="stable")
    ends = np.flatnonzero(np.diff(record.time[order]) > 2.5 * np.median(np.diff(record.time[order]))) + 1
    parts = [part for part in np.split(order, ends) if len(part) >= LEAST_STROKE]
    return [record.take(np.isin(np.arange(len(record)), part)) for part in parts]


def factors(parts: Sequence[FrictionSamples]) -> NDArray[np.float64]:
    """Mean friction of each part over what a law that is fitted to all expects of it."""
    model = estimators.fit(parts, method="hierarchical")
    expected = [model.predict(part.tangential_velocity, part.normal_force).mean() for part in parts]
    return np.array([part.friction_coefficient.mean() for part in parts]) / np.array(expected)


def left_out_scores(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log density of each value by the Student-t of the mean and the deviation of all others."""
    found = np.empty(len(values))
    for k, value in enumerate(values):
        others = np.delete(values, k)
        spread = others.std(ddof=1) * np.sqrt(1.0 + 1.0 / len(others))
        found[k] = stats.t.logpdf(value, len(others) - 1, others.mean(), spread)
    return found


def shape_row(name: str, record: FrictionSamples) -> list[object]:
    """Whether the levels of one record say how they scatter: the sum of the scores' differences, and its error."""
    levels = factors(strokes_of(record) if "bench" in name else blocks_of(record, BLOCKS))
    better = left_out_scores(np.log(levels)) - np.log(levels) - left_out_scores(levels)
    told = f"{better.sum():+.2f} ± {better.std() * np.sqrt(len(better)):.2f}"
    return [name, len(levels), f"{100.0 * levels.std(ddof=1) / levels.mean():.2f}", told]


def row(name: str, record: FrictionSamples, halves: int) -> list[object]:
    """Means over random halves of one record, by each method."""
    rng, parts = np.random.default_rng(0), blocks_of(record, BLOCKS)
    chosen = [rng.permutation(BLOCKS) < BLOCKS // 2 for _ in range(halves)]
    found = {method: np.mean([below(parts, each, method) for each in chosen], axis=0) for method in METHODS}
    told = [*found.values(), right_normal(parts), np.mean([beside(parts, each) for each in chosen], axis=0)]
    return [name, BLOCKS, *(" ".join(f"{part:.3f}" for part in each) for each in told)]


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--halves", type=int, default=20)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    rows = [row(name, record, arguments.halves) for name, record in records().items()]
    shapes = [shape_row(name, record) for name, record in records().items()]
    tables = {"record halves": table(COLUMNS, rows), "record shapes": table(SHAPE_COLUMNS, shapes)}
    print(*tables.values(), sep="\n\n")
    found = [dict(zip(COLUMNS, each, strict=True)) for each in rows]
    found += [dict(zip(SHAPE_COLUMNS, each, strict=True)) for each in shapes]
    write(found, tables, arguments, "record_halves.json")


if __name__ == "__main__":
    main()
