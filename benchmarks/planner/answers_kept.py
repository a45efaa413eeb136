"""Answers of few logs that more take away: `python -m benchmarks.planner.answers_kept [--page docs/planner.md]`.

Materials and loads are those of `benchmarks.planner.planned_force --nested`, each fitted after each of its logs. What a
grasp scales friction by is normal in the model: with τ by the default prior, by that from thirty other materials, and
by who knows how τ is distributed in the population. It is log-normal in the generator: `PositiveFactor` takes it so, by
the default prior, by a wider one that lets slip about as seldom, and by the population's. One more rule has a memory:
an answer once given stays until its probability of slip is twice that asked for.

Counted: loads answered by one, two and three logs; how often a new grasp slips under answers of one, two, three and
five, over what was asked; answers that vanish with the second log, with the third to fifth, and with the sixth to
twentieth; steps in which any of a material's loads loses its answer. Writes answers_kept.json.

`--shapes`: instead, both factors and one between them in the model, in worlds of either: what it costs to take one for
the other. Writes answers_of_shapes.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

import estimators
from benchmarks.estimators.population import MEDIANS, SPREAD, recorded
from benchmarks.estimators.scatter import ASKED, Kind
from benchmarks.pages import options, table, write
from benchmarks.planner.planned_force import ASKED_OF, load_of, material, model_of, slips
from estimators import Moments, ScatterPrior
from stiction_client import FrictionModel, required_normal_force
from stiction_client.elementwise import Number

Array = NDArray[np.float64]

COUNT, OTHERS, LENIENT, WIDER = 20, 30, 2.0, 0.09
"""Logs of each material; others, whose scatter tells before; times the probability asked for, up to which one stays;
scale of a prior of τ by which a log-normal factor lets slip as seldom as a normal one by the default (seeds 8000 to
8059)."""
RULES = (
    ("normal", "default"),
    ("normal", f"{OTHERS} others"),
    ("normal", "its population"),
    ("normal", "default, kept"),
    ("log-normal", "default"),
    ("log-normal", f"scale {WIDER:g}"),
    ("log-normal", "its population"),
)
FEW, SLIPPED = (1, 2, 3), (1, 2, 3, 5)
STEPS = ((1, 1), (2, 4), (5, COUNT - 1))
"""Logs before the steps that are counted together."""
COLUMNS = (
    "factor",
    "prior of τ",
    "median τ",
    "answered by 1, 2, 3 logs, %",
    "slips by 1, 2, 3, 5, over asked",
    "vanish with log 2, 3 to 5, 6 to 20, %",
    "of all, %",
    "steps with one, %",
)
SHAPES: tuple[tuple[str, float, float | None], ...] = (
    ("normal", 1.0, None),
    ("cube of a normal one", 3.0, WIDER),
    ("log-normal", np.inf, WIDER),
)
"""Factors of the model, of which power of a normal one each is, and the scale of its prior where it is not the
default."""
GROWN = (1, 2, 3, 5, 10, 20)
SHAPE_COLUMNS = (
    "factor of the world",
    "of the model",
    "answered by 2 logs, %",
    "steps with one lost, %",
    *(f"slips at {asked:g} by {', '.join(map(str, GROWN))} logs, over asked" for asked in ASKED),
)


@dataclass(frozen=True, slots=True)
class LogNormalScatter(ScatterPrior):
    """Prior of τ that is log-normal about ``scale`` with ``spread``: that of who knows the population."""

    spread: float = SPREAD

    def log_density(self, tau: Array) -> Array:
        """Of τ, up to a constant."""
        score = np.log(tau / self.scale) / self.spread
        return np.asarray(-0.5 * score**2 - np.log(tau))


@dataclass(frozen=True, slots=True, eq=False)
class PositiveFactor(FrictionModel):
    """A model that takes what a grasp scales friction by for a ``power`` of a normal one (infinite: log-normal; the
    third is nearly gamma: Wilson & Hilferty, 1931, PNAS 17:684), of mean 1, and its ``common`` error too: as much of
    the coefficients' covariance as scales the whole law, which is then no more in it. For small quantiles.
    """

    common: float = 0.0
    power: float = np.inf

    @classmethod
    def of(cls, model: FrictionModel, power: float = np.inf) -> "PositiveFactor":
        """The same fit."""
        told = {entry.name: getattr(model, entry.name) for entry in fields(FrictionModel)}
        law = model.coefficients
        part = 1.0 / float(law @ np.linalg.solve(model.covariance, law))
        told["covariance"] = model.covariance - part * np.outer(law, law)
        return cls(**told, common=float(np.sqrt(part)), power=power)

    def scatter(self, quantile: Number, elements: Number = 1.0) -> tuple[Number, Number]:
        """The factor's quantile is the power, or the exponential, of that of a normal one."""
        shared, own = FrictionModel.scatter(self, quantile, elements)
        known = special.stdtrit(self.degrees_of_freedom, quantile) * self.common
        spread = 0.0 if self.scales is None else np.log1p(self.scales.between_grasps.value**2)
        away = float(np.hypot(shared, known))
        power = np.exp(-away) if np.isinf(self.power) else max(1.0 - away / self.power, 0.0) ** self.power
        return float(1.0 - power * np.exp(-0.5 * spread * (1.0 - 1.0 / self.power))), own


class Followed(NamedTuple):
    """Forces [logs, loads], infinite where there is no answer, that were told of a material of this ``kind``, and its
    ``loads``, N.
    """

    kind: Kind
    loads: Array
    forces: Array

    def answered(self) -> NDArray[np.bool_]:
        """Where there is an answer, [logs, loads]."""
        return np.isfinite(self.forces)

    def slips(self, count: int) -> list[float]:
        """How often a new grasp slips, over what was asked, under each of the answers by so many logs."""
        cases = zip(self.loads.tolist(), self.forces[count - 1].tolist(), strict=True)
        return [slips(self.kind, load, force) / ASKED[0] for load, force in cases if np.isfinite(force)]


def told(models: Sequence[FrictionModel], loads: Array, asked: float) -> Array:
    """Smallest and largest forces [2, models, loads] that keep slip so rare; infinite where none does, as for a load of
    0, which stands for one that who knows all cannot hold (``load_of``).
    """
    found = [required_normal_force(model, loads, asked, **ASKED_OF).feasible_interval for model in models]
    forces = np.stack(found, axis=1)
    return np.where(np.isnan(forces) | (loads == 0.0), np.inf, forces)


def kept(forces: Array, lenient: Array) -> Array:
    """Forces [logs, loads] with answers that stay while the ``lenient`` rule, [2, logs, loads], has one, as near to
    what they were as it allows: the rule of the worked example.
    """
    found = forces.copy()
    for now, before, (low, high) in zip(found[1:], found, lenient.swapaxes(0, 1)[1:], strict=False):
        stays = np.where(np.isfinite(before), np.clip(before, low, high), np.inf)
        now[:] = np.where(np.isfinite(now), now, stays)
    return found


def followed(seed: int, median: float, learnt: ScatterPrior) -> list[Followed]:
    """One material log by log, by each of ``RULES``; ``learnt``: the prior from others."""
    kind, logs, least = material(seed, median, COUNT)
    loads = np.array([load_of(kind, float(force), ASKED[0]) for force in least])
    default, others, population = (growing(logs, prior) for prior in (ScatterPrior(), learnt, LogNormalScatter(median)))
    forces = [told(each, loads, ASKED[0])[0] for each in (default, others, population)]
    forces.append(kept(forces[0], told(default, loads, LENIENT * ASKED[0])))
    wider = growing(logs, ScatterPrior(scale=WIDER))
    forces += [told([*map(PositiveFactor.of, models)], loads, ASKED[0])[0] for models in (default, wider, population)]
    return [Followed(kind, loads, each) for each in forces]


def growing(logs: Sequence[Moments], prior: ScatterPrior) -> list[FrictionModel]:
    """Models of the first log, of the first two, and so on."""
    return [model_of(logs[:count], prior) for count in range(1, len(logs) + 1)]


def row(rule: tuple[str, str], median: str, found: Sequence[Followed]) -> list[object]:
    """A line of the table, over all materials."""
    answered = np.stack([each.answered() for each in found])
    lost = answered[:, :-1] & ~answered[:, 1:]
    slipped = [np.mean([slip for each in found for slip in each.slips(count)]) for count in SLIPPED]
    parts = [_share(lost[:, first - 1 : last], answered[:, first - 1 : last]) for first, last in STEPS]
    return [
        *rule,
        median,
        " ".join(f"{100.0 * answered[:, count - 1].mean():.1f}" for count in FEW),
        " ".join(f"{slip:.2f}" for slip in slipped),
        " ".join(parts),
        _share(lost, answered[:, :-1]),
        f"{100.0 * lost.any(axis=2).mean():.2f}",
    ]


def of_shapes(seed: int, median: float, *, normal: bool) -> list[tuple[NDArray[np.bool_], Array]]:
    """One material of a world, log by log, by each of ``SHAPES``: where there are answers, [logs, loads], and how often
    a new grasp slips over what was asked, [asked, ``GROWN``], by the answers of so many logs.
    """
    kind, logs, least = material(seed, median, COUNT, normal=normal)
    loads = {asked: np.array([load_of(kind, float(force), asked) for force in least]) for asked in ASKED}
    found = []
    for _, power, scale in SHAPES:
        models = growing(logs, ScatterPrior() if scale is None else ScatterPrior(scale=scale))
        models = models if power == 1.0 else [PositiveFactor.of(each, power) for each in models]
        forces = {asked: told(models, each, asked)[0] for asked, each in loads.items()}
        slipped = [[_mean_slip(kind, loads[asked], forces[asked][k - 1], asked) for k in GROWN] for asked in ASKED]
        found.append((np.isfinite(forces[ASKED[0]]), np.array(slipped)))
    return found


def _mean_slip(kind: Kind, loads: Array, forces: Array, asked: float) -> float:
    """How often a new grasp slips over what was asked, of the loads that got an answer; NaN where none did."""
    cases = zip(loads.tolist(), forces.tolist(), strict=True)
    slipped = [slips(kind, load, force) / asked for load, force in cases if np.isfinite(force)]
    return float(np.mean(slipped)) if slipped else np.nan


def shape_rows(seeds: Sequence[int]) -> list[list[object]]:
    """Lines of the table of both worlds."""
    rows = list[list[object]]()
    for normal in (False, True):
        cases = [of_shapes(seed, median, normal=normal) for median in MEDIANS for seed in seeds]
        for (factor, _, scale), found in zip(SHAPES, zip(*cases, strict=True), strict=True):
            answered, slipped = np.stack([each[0] for each in found]), np.nanmean([each[1] for each in found], axis=0)
            lost = answered[:, :-1] & ~answered[:, 1:]
            rows.append(
                [
                    "normal" if normal else "log-normal",
                    factor if scale is None else f"{factor}, scale {scale:g}",
                    f"{100.0 * answered[:, 1].mean():.1f}",
                    f"{100.0 * lost.any(axis=2).mean():.2f}",
                    *(" ".join(f"{slip:.2f}" for slip in each) for each in slipped),
                ]
            )
    return rows


def _share(some: NDArray[np.bool_], of: NDArray[np.bool_]) -> str:
    return f"{100.0 * some.sum() / of.sum():.2f}"


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--materials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shapes", action="store_true", help="other factors, in worlds of either")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.seed, arguments.seed + arguments.materials)
    if arguments.shapes:
        rows = shape_rows(seeds)
        print(table(SHAPE_COLUMNS, rows))
        write([dict(zip(SHAPE_COLUMNS, each, strict=True)) for each in rows], {}, arguments, "answers_of_shapes.json")
        return
    found: dict[str, list[list[Followed]]] = {}
    for median in MEDIANS:
        others = recorded(median, np.random.default_rng([arguments.seed, round(1e6 * median)]))[:OTHERS]
        learnt = estimators.population_scatter(others)
        found[f"{median:g}"] = [list(each) for each in zip(*(followed(s, median, learnt) for s in seeds), strict=True)]
    found["both"] = [list(chain(*each)) for each in zip(*found.values(), strict=True)]
    rows = [row(rule, median, found[median][place]) for place, rule in enumerate(RULES) for median in found]
    printed = {"answers kept": table(list(COLUMNS), rows)}
    print(printed["answers kept"])
    write([dict(zip(COLUMNS, each, strict=True)) for each in rows], printed, arguments, "answers_kept.json")


if __name__ == "__main__":
    main()
