"""Few grasps by a prior from other materials: `python -m benchmarks.estimators.population [--medians TAU …]`.

Of a population of materials whose scatter between grasps τ is log-normal, some were recorded with 4 to 12 grasps each;
of new ones there are 1, 2, 3 and 5. Those are fitted by the default prior of τ and by that from 3, 10 and 30 of the
others. Counted over the new materials: the probability that the contact of a new grasp has less friction than the
quantile that was told, over the one asked for, and the grip force that this quantile asks for, over that of who knows
law and scales (median; "none" where the quantile is 0). The same of materials with twice the population's median τ.
Grasps come from the generator of `benchmarks.estimators.scatter`, which is not the model. Writes population.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

import estimators
from benchmarks.estimators.scatter import ASKED, CONTACT, TRUTH, WORKING_POINT, Kind, factor, grasp
from benchmarks.pages import options, table, write
from estimators import FrictionModel, Moments, ScatterPrior

GRASPS, OTHERS = (1, 2, 3, 5), (0, 3, 10, 30)
RECORDED = 60
"""Materials from which the others are taken."""
FEWEST, MOST = 4, 12
"""Grasps of each of them."""
SPREAD = 0.4
"""Standard deviation of log τ between materials."""
MEDIANS = (0.05, 0.12)
SCORES = np.linspace(-8.0, 8.0, 1601)
"""Of a grasp's effect, over which slips are summed."""
COLUMNS = ("median τ", "τ", "grasps", *(f"{what} at {asked:g}" for what in ("slips", "force") for asked in ASKED))
"""Of the table, which has in each cell the figures by the prior from each number of others."""


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """Of so many ``grasps`` by the prior of so many ``others``: ``slip`` over asked and ``force`` over the least,
    [materials, asked].
    """

    median: float
    tau: str
    grasps: int
    others: int
    slip: np.ndarray
    force: np.ndarray

    def figures(self) -> list[str]:
        """Mean slips and median forces."""
        forces = (f"{value:.2f}" if np.isfinite(value) else "none" for value in np.median(self.force, axis=0))
        return [*(f"{value:.2f}" for value in self.slip.mean(axis=0)), *forces]

    def record(self) -> dict[str, object]:
        """The same as numbers, with how often there was no answer."""
        return {
            "median": self.median,
            "tau": self.tau,
            "grasps": self.grasps,
            "others": self.others,
            "slips": self.slip.mean(axis=0).tolist(),
            "standard_error": (self.slip.std(axis=0) / np.sqrt(len(self.slip))).tolist(),
            "force": [value if np.isfinite(value) else None for value in np.median(self.force, axis=0).tolist()],
            "none": np.isinf(self.force).mean(axis=0).tolist(),
        }


def row(cells: tuple[Cell, ...]) -> tuple[object, ...]:
    """A line of the table: of as many grasps, by the prior from each number of others."""
    columns = zip(*(cell.figures() for cell in cells), strict=True)
    return (f"{cells[0].median:g}", cells[0].tau, cells[0].grasps, *(" ".join(column) for column in columns))


def scatters(tau: float) -> Kind:
    """Scales of a material."""
    return Kind(tau, 0.02, 0.03)


def drawn(median: float, rng: np.random.Generator) -> float:
    """τ of a material of the population."""
    return float(median * np.exp(SPREAD * rng.standard_normal()))


def slips(kind: Kind, told: float) -> float:
    """Probability that the mean friction of a new grasp's contact is below what was told at the working point."""
    mean = factor(kind, SCORES) * (TRUTH @ [1.0, *WORKING_POINT])
    deviation = np.sqrt((kind.between_places**2 + kind.within**2) / CONTACT)
    weight = np.exp(-0.5 * SCORES**2)
    return float(weight @ special.ndtr((told - mean) / deviation) / weight.sum())


def least(kind: Kind, asked: float) -> float:
    """The quantile that who knows all would tell."""
    return float(optimize.brentq(lambda told: slips(kind, told) - asked, 0.0, TRUTH[0]))


def recorded(median: float, rng: np.random.Generator) -> list[FrictionModel]:
    """Models of the materials known."""
    found = []
    for _ in range(RECORDED):
        kind = scatters(drawn(median, rng))
        grasps = [Moments.from_samples(grasp(kind, rng)) for _ in range(rng.integers(FEWEST, MOST + 1))]
        found.append(estimators.fit(grasps, method="hierarchical"))
    return found


def new_material(kind: Kind, priors: list[ScatterPrior], rng: np.random.Generator) -> np.ndarray:
    """Slip over asked, and force over the least, [grasps, priors, 2, asked]."""
    data = [Moments.from_samples(grasp(kind, rng)) for _ in range(max(GRASPS))]
    known = np.array([least(kind, asked) for asked in ASKED])
    found = np.empty((len(GRASPS), len(priors), 2, len(ASKED)))
    for row, count in zip(found, GRASPS, strict=True):
        for cell, prior in zip(row, priors, strict=True):
            model = estimators.fit(data[:count], method="hierarchical", scatter_prior=prior)
            told = [float(model.predict(*WORKING_POINT, asked, of="contact", elements=CONTACT)) for asked in ASKED]
            cell[0] = [slips(kind, quantile) / asked for quantile, asked in zip(told, ASKED, strict=True)]
            cell[1] = np.divide(known, told, out=np.full(len(ASKED), np.inf), where=np.array(told) > 0.0)
    return found


def cells(median: float, materials: range, seed: int) -> Iterator[Cell]:
    """All cells of a population, of ``materials`` drawn from it and of as many with twice its median τ."""
    known = recorded(median, np.random.default_rng([seed, round(1e6 * median)]))
    for tau in ("drawn", "twice"):
        whole = np.stack([one(median, tau, known, (seed, number)) for number in materials], axis=-1)
        for count, row in zip(GRASPS, whole, strict=True):
            for others, (slip, force) in zip(OTHERS, row, strict=True):
                yield Cell(median, tau, count, others, slip.T, force.T)


def one(median: float, tau: str, known: list[FrictionModel], seed: tuple[int, int]) -> np.ndarray:
    """What `new_material` tells of one of a population, by priors from some of those known."""
    rng = np.random.default_rng([*seed, round(1e6 * median), int(tau == "twice")])
    order = rng.permutation(RECORDED)
    priors = [estimators.population_scatter([known[k] for k in order[:count]]) for count in OTHERS]
    kind = scatters(2.0 * median if tau == "twice" else drawn(median, rng))
    return new_material(kind, priors, rng)


def main() -> None:
    """Run all populations, write and print."""
    parser = options(__doc__)
    parser.add_argument("--materials", type=int, default=80)
    parser.add_argument("--medians", type=float, nargs="+", default=MEDIANS)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    materials = range(arguments.materials)
    found = [cell for median in arguments.medians for cell in cells(median, materials, arguments.seed)]
    rows = table(COLUMNS, map(row, zip(*(found[k :: len(OTHERS)] for k in range(len(OTHERS))), strict=True)))
    write([cell.record() for cell in found], {"population": rows}, arguments, "population.json")
    print(rows)


if __name__ == "__main__":
    main()
