"""Friction at rest where slip showed one speed: `python -m benchmarks.estimators.one_speed [--seeds N] [--page PAGE]`.

Materials of the population of `benchmarks.estimators.next_grasp`, of whose laws β₁ changes friction by a tenth over
5 mm/s (one standard deviation), are seen by the generator of `benchmarks.estimators.scatter`, "grasp and place", but
all at one speed, at two that are near to each other, or as its rim slips. Of friction at rest: the part of 95 %
intervals of the expected one that hold it, their median half-width in parts of it, how much more often the contact of a
new grasp has less than the quantile that was told than was asked for, what a planner may count on at 1e-2 over what
who knows law and scales may (median), and how often that is above 0. The first of two figures is with the prior of β₁
that is assumed where data do not show it, the second without it. Writes one_speed.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy import special

import estimators
from benchmarks.estimators.next_grasp import Material
from benchmarks.estimators.scatter import ASKED, CONTACT, KINDS, WORKING_POINT, achieved, factor, grasp
from benchmarks.pages import options, table, write
from benchmarks.sensitivity.rows import changed
from estimators import FrictionModel, Moments
from estimators.defaults import PRIOR

Speeds = Callable[[np.ndarray, np.random.Generator], np.ndarray]
"""Of samples that would slip at other speeds, both m/s."""

KIND = KINDS["grasp and place"]
GRASPS = (1, 2, 6)
REST = (0.0, WORKING_POINT[1])
NO_PRIOR = 10.0
"""Of ``velocity_effect``: friction may change by ten times itself."""
COLUMNS = ("slip", "grasps", "held, %", "half-width, %", *(f"slips at {asked:g}" for asked in ASKED))
COLUMNS += ("counted on", "answers, %", "at rest it is")


def at(speed: float) -> Speeds:
    """All at one speed but for a thousandth of it."""
    return lambda v, rng: speed * (1.0 + 1e-3 * rng.standard_normal(len(v)))


def of_two(slow: float, fast: float) -> Speeds:
    """Each sample at one of two speeds."""
    return lambda v, rng: np.where(rng.random(len(v)) < 0.5, slow, fast)


SLIP: dict[str, Speeds | None] = {
    "1 mm/s": at(1e-3),
    "5 mm/s": at(5e-3),
    "10 mm/s": at(1e-2),
    "4.95 and 5.05 mm/s": of_two(4.95e-3, 5.05e-3),
    "as the rim slips": None,
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """Of friction at rest by one model: whether the interval ``held`` it, its half-``width`` in parts of it, ``slips``
    over those asked for, what is ``counted_on`` over what may be, and its kind of ``support``.
    """

    held: bool
    width: float
    slips: tuple[float, ...]
    counted_on: float
    support: str


def outcome(model: FrictionModel, law: np.ndarray) -> Outcome:
    """How one model does, of a material of this law."""
    row = np.array([1.0, *REST])
    half = float(special.stdtrit(model.degrees_of_freedom, 0.975) * np.sqrt(row @ model.covariance @ row))
    truth = float(law @ row)
    told = [float(model.predict(*REST, asked, of="contact", elements=CONTACT)) for asked in ASKED]
    slips = tuple(achieved(KIND, each, REST, law) / asked for each, asked in zip(told, ASKED, strict=True))
    held = abs(float(model.predict(*REST)) - truth) <= half
    return Outcome(held, half / truth, slips, told[0] / least(truth), model.support_at(*REST).kind)


def least(friction: float) -> float:
    """The quantile at 1e-2 that who knows law and scales would tell."""
    shared = friction * (1.0 - float(factor(KIND, special.ndtri(ASKED[0]))))
    own = special.ndtri(ASKED[0]) * np.hypot(KIND.between_places, KIND.within) / np.sqrt(CONTACT)
    return friction - float(np.hypot(shared, own))


def outcomes(speeds: Speeds | None, grasps: int, seeds: range) -> Iterator[Outcome]:
    """Of one material a seed."""
    for seed in seeds:
        rng = np.random.default_rng([seed, grasps, 17])
        law = Material.drawn(rng).law
        data = [Moments.from_samples(grasp(KIND, rng, law, speeds)) for _ in range(grasps)]
        yield outcome(estimators.fit(data, method="hierarchical"), law)


def figures(found: list[Outcome]) -> list[str]:
    """A cell's means and medians, one a column."""
    slips = np.mean([each.slips for each in found], axis=0)
    return [
        f"{100.0 * np.mean([each.held for each in found]):.0f}",
        f"{100.0 * np.median([each.width for each in found]):.3g}",
        *(f"{value:.2f}" for value in slips),
        f"{np.median([each.counted_on for each in found]):.2f}",
        f"{100.0 * np.mean([each.counted_on > 0.0 for each in found]):.0f}",
    ]


def row(name: str, grasps: int, seeds: range) -> list[object]:
    """A row of the table."""
    found = list(outcomes(SLIP[name], grasps, seeds))
    with changed(PRIOR, "velocity_effect", NO_PRIOR):
        without = list(outcomes(SLIP[name], grasps, seeds))
    kinds = Counter(each.support for each in found).most_common()
    said = ", ".join(f"{kind} {100.0 * count / len(found):.0f} %" for kind, count in kinds)
    pairs = [" ".join(pair) for pair in zip(figures(found), figures(without), strict=True)]
    return [name, grasps, *pairs, said]


def main() -> None:
    """Run all cells, write and print."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="the first of the seeds")
    parser.add_argument("--only", nargs="+", choices=SLIP, default=list(SLIP))
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    rows = [row(name, grasps, seeds) for name in arguments.only for grasps in GRASPS]
    numbers = [dict(zip(COLUMNS, each, strict=True)) for each in rows]
    write(numbers, {"one speed": table(COLUMNS, rows)}, arguments, "one_speed.json")
    print(table(COLUMNS, rows))


if __name__ == "__main__":
    main()
