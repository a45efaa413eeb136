"""How hard a planner grips by few logs: `python -m benchmarks.planner.planned_force [--page docs/planner.md]`.

Materials of a population (benchmarks/estimators/population.py) are fitted to 3, 10 and 30 logs each, and
`required_normal_force` is asked for loads that a flat contact of 60 elements holds with 1 to 8 N in the hand of who
knows law and scales, where the gripper has 12 N: once by the default prior of how much grasps differ, once by that from
ten other materials. Counted over all cases: answered at all; force over that of who knows all (median, and the part of
1.5 times at most); and how often a new grasp slips under what was answered, over what was asked. Writes
planned_force.json.

`--nested`: instead, logs come one by one, and each material is fitted after each of them as the service does. Counted
are the steps by which an answer vanishes, how often a new grasp would have slipped under it, and the steps by which the
friction that a planner may count on falls by more than a twentieth, and whether the log that did it is named. Writes
planned_force_nested.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

import estimators
from benchmarks.estimators.population import MEDIANS, SCORES, drawn, recorded, scatters
from benchmarks.estimators.scatter import AREA, ASKED, CONTACT, TRUTH, Kind, factor, grasp
from benchmarks.pages import options, table, write
from estimators import FrictionModel as FittedModel
from estimators import Moments, ScatterPrior, WorkingPoint
from estimators.defaults import INFLUENCE
from estimators.influence import counted_on
from service.domain.models.stored_results import to_new_model
from service.domain.models.weakening import LOG, with_weakening
from stiction_client import Contact, FrictionModel, required_normal_force

LOGS, OTHERS = (3, 10, 30), (0, 10)
"""Of a material; and how many others tell before how much grasps of one differ."""
FORCES, LIMIT = (1.0, 8.0), 12.0
"""N: with which who knows all holds the loads, and what the gripper has. Logs have 2 to 13 N on as many elements."""
LOADS = 20
"""Of each material."""
AMPLE = 1.5
"""Times the force of who knows all: what is asked for at most, of three logs."""


class Case(NamedTuple):
    """A load on a new grasp of a material: ``force`` over that of who knows all, infinite where there was no answer,
    and the probability of ``slip`` under it over that ``asked``.
    """

    others: int
    logs: int
    asked: float
    force: float
    slip: float


def slips(kind: Kind, load: float, force: float) -> float:
    """Probability that the contact of a new grasp of this material slips under ``load`` N, pressed with ``force`` N."""
    mean = factor(kind, SCORES) * (TRUTH @ [1.0, 0.0, force / CONTACT])
    deviation = np.sqrt((kind.between_places**2 + kind.within**2) / CONTACT)
    weight = np.exp(-0.5 * SCORES**2)
    return float(weight @ special.ndtr((load / force - mean) / deviation) / weight.sum())


def load_of(kind: Kind, force: float, asked: float) -> float:
    """The load, N, that ``force`` N holds but for a probability ``asked``; 0 where grasps without friction are more
    frequent, as with a normal factor of a large scale.
    """
    if slips(kind, 0.0, force) >= asked:
        return 0.0
    return float(optimize.brentq(lambda load: slips(kind, load, force) - asked, 0.0, force * TRUTH[0]))


def model_of(logs: Sequence[Moments], prior: ScatterPrior) -> FrictionModel:
    """What a planner's client gets of them."""
    return of_planner(estimators.fit(logs, method="hierarchical", scatter_prior=prior))


def of_planner(found: FittedModel) -> FrictionModel:
    """A fitted model as a planner's client has it."""
    told = {entry.name: getattr(found, entry.name) for entry in fields(found) if entry.name != "draws"}
    return FrictionModel(**told, material="new", version=1)


def material(
    seed: int, median: float, count: int, *, normal: bool = False
) -> tuple[Kind, list[Moments], NDArray[np.float64]]:
    """One of a population, so many logs of it, and the forces, N, that hold its loads in the hand of who knows all.

    ``normal``: what its grasps scale friction by is normal, in place of log-normal.
    """
    rng = np.random.default_rng([seed, round(1e6 * median)])
    kind = replace(scatters(drawn(median, rng)), normal=normal)
    logs = [Moments.from_samples(grasp(kind, rng)) for _ in range(count)]
    return kind, logs, rng.uniform(*FORCES, LOADS)


def cases(seed: int, median: float, known: Sequence[FittedModel]) -> list[Case]:
    """All of one material, of whose sensor so many others are ``known``."""
    kind, logs, least = material(seed, median, max(LOGS))
    loads = {asked: np.array([load_of(kind, float(force), asked) for force in least]) for asked in ASKED}
    found = []
    for others, count, asked in product(OTHERS, LOGS, ASKED):
        model = model_of(logs[:count], estimators.population_scatter(known[:others]))
        forces = required_normal_force(model, loads[asked], asked, **ASKED_OF).normal_force
        for load, force, best in zip(loads[asked].tolist(), forces.tolist(), least.tolist(), strict=True):
            answered = np.isfinite(force)
            slip = slips(kind, load, force) / asked if answered else np.nan
            found.append(Case(others, count, asked, force / best if answered else np.inf, slip))
    return found


def row(found: Sequence[Case]) -> list[object]:
    """Answered and ample, %; median force and that which 95 % need at most, of those answered; slips over asked."""
    force: NDArray[np.float64] = np.array([each.force for each in found])
    answered = np.isfinite(force)
    slip = np.array([each.slip for each in found])[answered]
    quantiles = np.quantile(force[answered], [0.5, 0.95])
    shares = (100.0 * answered.mean(), 100.0 * (force <= AMPLE).mean())
    return [
        found[0].others,
        found[0].logs,
        f"{found[0].asked:g}",
        *(f"{share:.1f}" for share in shares),
        *quantiles,
        slip.mean(),
    ]


class Step(NamedTuple):
    """One more log of a material, from so many ``logs``: loads ``answered`` before, how many of these ``vanished``, and
    of these under ``light`` loads, that half of the gripper's force holds in the hand of who knows all; the sum of
    probabilities of ``slip`` under the forces that vanished, over that asked; whether the friction that may be counted
    on ``fell`` by more than a twentieth, a log is ``named``, and it is the newest.
    """

    logs: int
    answered: int
    vanished: int
    light: int
    slip: float
    fell: bool
    named: bool
    newest: bool


def steps(seed: int, median: float) -> list[Step]:
    """All steps of one material, without other materials."""
    kind, came, least = material(seed, median, NESTED[-1][1] + 1)
    moments = {str(k): log for k, log in enumerate(came)}
    loads = np.array([load_of(kind, float(force), ASKED[0]) for force in least])
    found, before, held = list[Step](), None, np.full(LOADS, np.inf)
    for count in range(1, len(moments) + 1):
        logs = dict(list(moments.items())[:count])
        model = estimators.fit(list(logs.values()), method="hierarchical")
        forces = required_normal_force(of_planner(model), loads, ASKED[0], **ASKED_OF).normal_force
        if before is not None:
            (model,) = with_weakening([model], {model.method: to_new_model(before)}, logs, ScatterPrior())
            at = WorkingPoint(0.5 * sum(before.domain.normal_force))
            fell = counted_on(model, at) < (1.0 - INFLUENCE.fall) * counted_on(before, at)
            log = model.diagnostics.get(LOG)
            answered = np.isfinite(held)
            lost = answered & ~np.isfinite(forces)
            slip = sum(slips(kind, load, force) for load, force in zip(loads[lost], held[lost], strict=True)) / ASKED[0]
            light = int(np.count_nonzero(lost & (least <= 0.5 * LIMIT)))
            counts = int(np.count_nonzero(answered)), int(np.count_nonzero(lost)), light
            found.append(Step(count - 1, *counts, slip, fell, log is not None, log == str(count - 1)))
        before, held = model, forces
    return found


def nested_row(first: int, last: int, found: Sequence[Step]) -> list[object]:
    """Of the steps from ``first`` to ``last`` logs: answers that vanish, %, how many of them under light loads, and how
    often they slipped over what was asked; steps in which some do, and of a fall.
    """
    chosen = [each for each in found if first <= each.logs <= last]
    vanishing = [each for each in chosen if each.vanished]
    fallen = [each for each in chosen if each.fell]
    vanished = sum(each.vanished for each in chosen)
    share = vanished / max(sum(each.answered for each in chosen), 1)
    told = [f"{100.0 * share:.2f}", f"{sum(each.light for each in chosen)} of {vanished}"]
    told += [f"{sum(each.slip for each in chosen) / max(vanished, 1):.1f}"]
    told += [f"{100.0 * len(vanishing) / len(chosen):.2f}"]
    told += [f"{sum(each.named for each in vanishing)} of {len(vanishing)}"]
    told += [f"{100.0 * len(fallen) / len(chosen):.2f}", f"{sum(each.named for each in fallen)} of {len(fallen)}"]
    return [f"{first} to {last}", len(chosen), *told, sum(each.newest for each in fallen)]


NESTED = ((1, 1), (2, 4), (5, 11), (12, 19), (1, 19))
"""Steps that are counted together, by the logs before them; the last are all."""
NESTED_COLUMNS = (
    "logs before",
    "steps",
    "answers that vanish, %",
    f"of loads that {0.5 * LIMIT:g} N hold",
    "they slipped, over asked",
    "steps with one, %",
    "log named",
    "steps with a fall, %",
    "log named then",
    "the newest",
)
ASKED_OF = {"contacts": Contact.flat(CONTACT * AREA), "normal_force_limit": LIMIT, "of": "contact"}

COLUMNS = (
    "other materials",
    "logs",
    "asked",
    "answered, %",
    f"≤ {AMPLE:g} times, %",
    "median force",
    "95 % below",
    "slips over asked",
)


def main() -> None:
    """Run, write and print."""
    parser = options(__doc__)
    parser.add_argument("--materials", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--nested", action="store_true", help="add logs one by one")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.seed, arguments.seed + arguments.materials)
    if arguments.nested:
        came = [step for median in MEDIANS for seed in seeds for step in steps(seed, median)]
        lines = [nested_row(*ends, came) for ends in NESTED]
        printed = {"nested logs": table(list(NESTED_COLUMNS), lines)}
        print(printed["nested logs"])
        records = [dict(zip(NESTED_COLUMNS, each, strict=True)) for each in lines]
        write(records, printed, arguments, "planned_force_nested.json")
        return
    known = {
        median: recorded(median, np.random.default_rng([arguments.seed, round(1e6 * median)])) for median in MEDIANS
    }
    found = [case for median in MEDIANS for seed in seeds for case in cases(seed, median, known[median])]
    cells = product(OTHERS, ASKED, LOGS)
    rows = [row([each for each in found if each[:3] == (others, logs, asked)]) for others, asked, logs in cells]
    tables = {"planned force": table(list(COLUMNS), rows)}
    print(tables["planned force"])
    write([dict(zip(COLUMNS, each, strict=True)) for each in rows], tables, arguments, "planned_force.json")


if __name__ == "__main__":
    main()
