"""Would a choice by predictive score be better: `python -m benchmarks.estimators.predictive_choice [--seeds N]`.

Materials of the generator (benchmarks/estimators/scatter.py), of six grasps each, are fitted by each method; one more
kind has a tenth of false slip. Scored is what a model predicts of the mean friction of a new grasp's contact, by the
continuous ranked probability score (Gneiting & Raftery, 2007, Journal of the American Statistical Association 102:359)
over that of `auto`; and of whoever takes, for each material, the method with the best score of the six grasps, each
predicted by the other five. Also the part of new grasps below the 5 %, 50 % and 95 % quantiles of `auto`. Writes
predictive_choice.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import estimators
from benchmarks.estimators.scatter import CONTACT, KINDS, TRUTH, WORKING_POINT, Kind, factor, grasp
from benchmarks.pages import options, table, write
from slipcore.samples import FrictionSamples

FloatArray = NDArray[np.float64]

METHODS = ("hierarchical", "robust", "ols")
GRASPS, NEW = 6, 400
PARTS = np.linspace(0.025, 0.975, 20)
"""Quantiles by which a score is summed."""
FALSE_SLIP = 0.1
COLUMNS = ("scatter", *METHODS, "best of the six left out", "its choices", "below 5, 50, 95 % of auto")


def material(name: str, seed: int) -> tuple[list[FrictionSamples], FloatArray]:
    """Six grasps, and the mean friction of the contacts of new ones at the working point."""
    kind, rng = KINDS.get(name, Kind(0.07, 0.02, 0.02)), np.random.default_rng([seed, 11])
    grasps = [grasp(kind, rng) for _ in range(GRASPS)]
    if name not in KINDS:
        grasps = [with_false_slip(part, rng) for part in grasps]
    mean = factor(kind, rng.standard_normal(NEW)) * (TRUTH @ [1.0, *WORKING_POINT])
    own = np.hypot(kind.between_places, kind.within) / np.sqrt(CONTACT)
    return grasps, np.asarray(mean + own * rng.standard_normal(NEW))


def with_false_slip(samples: FrictionSamples, rng: np.random.Generator) -> FrictionSamples:
    """Some samples of what still sticks: any part of friction."""
    part = np.where(rng.random(len(samples)) < FALSE_SLIP, rng.uniform(0.2, 1.0, len(samples)), 1.0)
    mu = samples.friction_coefficient * part
    return replace(samples, friction_coefficient=mu, tangential_force=mu * samples.normal_force)


def quantiles(model: estimators.FrictionModel, v: float, f_n: float, elements: float) -> FloatArray:
    """Of a contact's mean friction in a new grasp, at ``PARTS``."""
    return np.array([model.predict(v, f_n, part, of="contact", elements=elements) for part in PARTS.tolist()])


def score(told: FloatArray, friction: FloatArray) -> float:
    """Mean continuous ranked probability score of quantiles of what came out as ``friction`` [k]: twice their loss."""
    off = friction - told[:, None]
    return float(2.0 * np.mean(np.where(off > 0.0, PARTS[:, None], PARTS[:, None] - 1.0) * off))


def left_out(method: str, grasps: Sequence[FrictionSamples]) -> float:
    """Score of each grasp's mean friction, predicted by the others."""
    total = 0.0
    for k, part in enumerate(grasps):
        model = estimators.fit([one for n, one in enumerate(grasps) if n != k], method=method)
        v, f_n = float(part.tangential_velocity.mean()), float(part.normal_force.mean())
        places = float(len(np.unique(part.element)))
        total += score(quantiles(model, v, f_n, places), np.array([part.friction_coefficient.mean()]))
    return total


def row(name: str, seeds: range) -> list[object]:
    """One kind of material."""
    scores, chosen, below = dict.fromkeys((*METHODS, "auto", "chosen"), 0.0), list[str](), list[FloatArray]()
    for seed in seeds:
        grasps, new = material(name, seed)
        best = min(METHODS, key=lambda method: left_out(method, grasps))
        chosen.append(best)
        for method in (*METHODS, "auto"):
            model = estimators.fit(grasps, method=method)
            own = score(quantiles(model, *WORKING_POINT, CONTACT), new)
            scores[method] += own
            scores["chosen"] += own * (method == best)
        ends = [model.predict(*WORKING_POINT, part, of="contact", elements=CONTACT) for part in (0.05, 0.5, 0.95)]
        below.append(np.mean(new < np.array(ends)[:, None], axis=1))
    parts = [f"{scores[method] / scores['auto']:.3f}" for method in (*METHODS, "chosen")]
    picked = ", ".join(f"{method} {chosen.count(method)}" for method in METHODS if method in chosen)
    return [name, *parts, picked, " ".join(f"{100.0 * part:.0f}" for part in np.mean(below, axis=0))]


def main() -> None:
    """Run, print, write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    rows = []
    for name in (*KINDS, "false slip"):
        rows.append(row(name, seeds))
        print(rows[-1], flush=True)
    tables = {"predictive choice": table(list(COLUMNS), rows)}
    print(tables["predictive choice"])
    write([dict(zip(COLUMNS, each, strict=True)) for each in rows], tables, arguments, "predictive_choice.json")


if __name__ == "__main__":
    main()
