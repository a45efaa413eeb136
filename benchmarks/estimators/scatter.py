"""Intervals where friction scatters: `python -m benchmarks.estimators.scatter [--seeds N] [--only …]`.

A law is fitted to grasps of a fingertip that is not the estimators' model: Hertzian pressure on 12 × 12 elements, load
and slip annulus that grow, forces with noise of their own. Friction scatters by a log-normal factor between grasps,
from place to place (each by itself, or smoothly over three elements), and from sample to sample (normal, or Student-t
on 4 degrees of freedom). For each kind, number of grasps and method: the part of the 95 % intervals that hold β₀, β₁,
β₂; the median width of each over that of generalised least squares that knows all the scales; and the probability that
the contact of a new grasp has less friction than the quantile that was told, over the one asked for. Writes
scatter.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage, special

import estimators
from slipcore.samples import FrictionSamples

TRUTH = np.array([0.45, 8.0, -0.8])
SIDE, FRAMES, AREA = 12, 20, 1e-6
GRASPS = (1, 2, 3, 6, 12)
METHODS = ("ols", "hierarchical", "bayes", "auto")
ASKED = (1e-2, 1e-3)
CONTACT, WORKING_POINT = 60, (1e-3, 0.12)
"""Elements of the contact that is planned for, and its v (m/s) and f_n (N an element)."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Scales of the scatter; ``smooth``: over how many elements places go together; ``heavy``: Student-t samples;
    ``normal``: what grasps scale friction by is normal, not log-normal.
    """

    between_grasps: float = 0.0
    between_places: float = 0.0
    within: float = 0.03
    smooth: float = 0.0
    heavy: bool = False
    force_noise: float = 0.0
    normal: bool = False


KINDS = {
    "independent": Kind(),
    "place": Kind(between_places=0.03, within=0.01),
    "grasp": Kind(between_grasps=0.07),
    "grasp and place": Kind(0.07, 0.02, 0.03),
    "smooth places": Kind(0.07, 0.02, 0.02, smooth=1.0),
    "heavy tails": Kind(0.07, 0.02, 0.02, heavy=True),
    "noisy forces": Kind(0.07, 0.02, 0.02, force_noise=2e-3),
}


def grasp(
    kind: Kind,
    rng: np.random.Generator,
    law: np.ndarray = TRUTH,
    speeds: Callable[[np.ndarray, np.random.Generator], np.ndarray] | None = None,
) -> FrictionSamples:
    """Samples of one grasp: elements of a growing contact that slip from its rim inwards, at ``speeds`` (m/s) that
    are made of what they slip at.
    """
    axis = np.linspace(-1.0, 1.0, SIDE)
    radius = np.hypot(*np.meshgrid(axis, axis))
    load, reach = rng.uniform(0.8, 1.2) * np.linspace(0.6, 1.4, FRAMES), rng.uniform(0.2, 0.5)
    pressure = 0.2 * np.sqrt(np.maximum(1.0 - (radius / load[:, None, None] ** (1 / 3)) ** 2, 0.0))
    pressure *= load[:, None, None] ** (1 / 3)
    stick = 1.0 - reach * np.linspace(0.1, 1.0, FRAMES)[:, None, None]
    slipping = (radius > stick) & (pressure > 0.03)
    speed = 4e-3 * rng.uniform(0.5, 1.5) * np.maximum(radius - stick, 0.0) / reach + 2e-4
    frame, element = np.nonzero(slipping.reshape(FRAMES, -1))
    v, f_n = speed[slipping], pressure[slipping]
    v = v if speeds is None else speeds(v, rng)
    expected = law @ [np.ones(len(v)), v, f_n]
    error = rng.standard_t(4.0, len(v)) / np.sqrt(2.0) if kind.heavy else rng.standard_normal(len(v))
    mu = factor(kind, rng.standard_normal()) * expected + places(kind, rng)[element] + kind.within * error
    seen = f_n + kind.force_noise * rng.standard_normal(len(v))
    seen = np.maximum(seen, 1e-3)
    one = np.ones(len(v))
    return FrictionSamples(mu, v, seen, mu * seen, frame / 30.0, element, one, AREA, kind.force_noise)


def factor(kind: Kind, score: np.ndarray | float) -> np.ndarray:
    """Factor of mean 1 between grasps, log-normal unless the kind is of a normal one, which is not below 0."""
    if kind.normal:
        return np.maximum(1.0 + kind.between_grasps * np.asarray(score), 0.0)
    spread = np.sqrt(np.log1p(kind.between_grasps**2))
    return np.exp(spread * np.asarray(score) - 0.5 * spread**2)


def places(kind: Kind, rng: np.random.Generator) -> np.ndarray:
    """What each element's friction is off by."""
    field = rng.standard_normal((SIDE, SIDE))
    if kind.smooth:
        field = ndimage.gaussian_filter(field, kind.smooth, mode="wrap")
        field /= field.std()
    return kind.between_places * field.ravel()


def oracle_widths(kind: Kind, data: list[FrictionSamples]) -> np.ndarray:
    """95 % widths of generalised least squares that knows law and scales, all but what is smooth or noisy."""
    information = np.zeros((3, 3))
    for part in data:
        x = np.column_stack([np.ones(len(part)), part.tangential_velocity, part.normal_force])
        law = x @ TRUTH
        covariance = kind.within**2 * np.eye(len(part)) + kind.between_grasps**2 * np.outer(law, law)
        covariance += kind.between_places**2 * (part.element[:, None] == part.element)
        information += x.T @ np.linalg.solve(covariance, x)
    return np.asarray(2.0 * special.ndtri(0.975) * np.sqrt(np.diag(np.linalg.inv(information))))


def achieved(kind: Kind, told: float, at: tuple[float, float] = WORKING_POINT, law: np.ndarray = TRUTH) -> float:
    """Probability that the mean friction of a new grasp's contact is below what was told ``at`` v and f_n."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    v, f_n = at
    mean = factor(kind, nodes) * (law @ [1.0, v, f_n])
    deviation = np.sqrt((kind.between_places**2 + kind.within**2) / CONTACT)
    return float(weights @ special.ndtr((told - mean) / deviation) / weights.sum())


def cell(kind: Kind, grasps: int, seeds: int) -> list[dict[str, Any]]:
    """One row a method."""
    inside = {method: np.zeros(3) for method in METHODS}
    width: dict[str, list[np.ndarray]] = {method: [] for method in METHODS}
    slip: dict[str, list[list[float]]] = {method: [] for method in METHODS}
    for seed in range(seeds):
        rng = np.random.default_rng([seed, grasps])
        data = [grasp(kind, rng) for _ in range(grasps)]
        known = oracle_widths(kind, data)
        for method in METHODS:
            model = estimators.fit(data, method=method, seed=seed)
            low, high = model.interval().T
            inside[method] += (low <= TRUTH) & (high >= TRUTH)
            width[method].append((high - low) / known)
            told = [float(model.predict(*WORKING_POINT, asked, of="contact", elements=CONTACT)) for asked in ASKED]
            slip[method].append([achieved(kind, quantile) for quantile in told])
    return [
        {
            "grasps": grasps,
            "method": method,
            "covered": (100.0 * inside[method] / seeds).tolist(),
            "width": np.median(width[method], axis=0).tolist(),
            "achieved_over_asked": (np.mean(slip[method], axis=0) / ASKED).tolist(),
        }
        for method in METHODS
    ]


def line(row: dict[str, Any]) -> str:
    """The figures of a row as cells of a table."""
    columns = ((row["covered"], 0), (row["width"], 2), (row["achieved_over_asked"], 2))
    return " | ".join(" ".join(f"{x:.{digits}f}" for x in part) for part, digits in columns)


def main() -> None:
    """Run the campaign and print it as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--seeds", type=int, default=400)
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| scatter | grasps | method | covered | width | achieved/asked at 1e-2, 1e-3 |\n|---|---|---|---|---|---|")
    for name in options.only:
        for grasps in GRASPS:
            for row in cell(KINDS[name], grasps, options.seeds):
                rows.append({"scatter": name, "seeds": options.seeds, **row})
                print(f"| {name} | {grasps} | {row['method']} | {line(row)} |", flush=True)
    (options.output / "scatter.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
