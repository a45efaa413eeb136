"""How many probes it takes: `python -m benchmarks.estimators.next_grasp [--output FOLDER] [--materials N]`.

Materials of all kinds (level, slopes, scatter) are probed by a robot that reads the hierarchical fit after each probe
and asks for the next (`estimators.next_grasp`), by one that goes through a fixed schedule of three normal forces by
three speeds, by one that always makes the same grasp in the middle, and by one that no robot is: each of its grasps has
many places over all forces and speeds and determines the whole law, but for how that grasp differs from others: no
choice of grasps can do with fewer. Grasps come from a generator that is not the model: Hertzian pressure whose rim
slips, log-normal scatter between grasps. Counted are the probes after which the conservative friction (1 % quantile of
a contact of 60 elements) at the planner's working point is within 10 % of that of who knows the law and all scales, and
stays so for two more. With ``--others`` the prior of how much grasps differ is that from so many other materials of
the population, of six grasps of the schedule each. Writes next_grasp.json.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle, islice, product
from pathlib import Path

import numpy as np
from scipy import special

import estimators
from estimators.grasp_design import Probing, WorkingPoint, next_grasp
from slipcore.samples import FrictionSamples

SIDE, AREA, RATE = 11, 1e-6, 30.0
FORCES, SPEEDS, LENGTH = (0.05, 0.45), (5e-4, 4e-3), 1e-3
MOST, STAYS, WITHIN = 30, 2, 0.1
QUANTILE, ELEMENTS = 1e-2, 60
RECORDED = 6
"""Grasps of each other material."""

Grasp = tuple[float, float, float]
"""Mean normal force of an element N, speed m/s and length m of the slip."""

Choose = Callable[[estimators.FrictionModel, int], Grasp]
"""The next grasp, by what so many grasps have told."""

PLACES, FRAMES = 60, 40
"""Of a grasp that determines the law."""


@dataclass(frozen=True, slots=True)
class Material:
    """The law (β₀, β₁, β₂), its scatter between grasps, between places and within, and where it is to be held."""

    law: np.ndarray
    scales: tuple[float, float, float]
    working_point: WorkingPoint

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> "Material":
        """One of a population: slopes change friction by some hundredths over 5 mm/s and 0.2 N."""
        level = rng.uniform(0.25, 0.8)
        law = np.array([level, rng.normal(0.0, 0.1 * level) / 5e-3, rng.normal(-0.05, 0.1) * level / 0.2])
        scales = (0.05 * np.exp(0.4 * rng.standard_normal()), 0.02, 0.03)
        force = float(np.exp(rng.uniform(*np.log(FORCES))))
        return cls(law, scales, WorkingPoint(force, 0.0, QUANTILE, ELEMENTS))

    def conservative(self) -> float:
        """The quantile that who knows all would tell."""
        between, places, within = self.scales
        friction = float(self.law @ [1.0, 0.0, self.working_point.normal_force])
        spread = np.sqrt(np.log1p(between**2))
        shared = friction * (1.0 - np.exp(spread * special.ndtri(QUANTILE) - 0.5 * spread**2))
        own = special.ndtri(QUANTILE) * np.hypot(places, within) / np.sqrt(ELEMENTS)
        return friction - float(np.hypot(shared, own))


Probed = Callable[[Material, Grasp, np.random.Generator], estimators.Moments]
"""What a grasp of a material gives."""


def probe(material: Material, grasp: Grasp, rng: np.random.Generator) -> estimators.Moments:
    """What one grasp tells."""
    force, speed, length = grasp
    axis = np.linspace(-1.0, 1.0, SIDE)
    radius = np.hypot(*np.meshgrid(axis, axis)).ravel()
    pressure = np.sqrt(np.maximum(1.0 - radius**2, 0.0))
    rim = (radius > 0.5) & (pressure > 0.1)
    frames = max(int(RATE * length / speed), 2)
    f_n = np.tile(force * pressure[rim] / pressure[pressure > 0.0].mean(), frames)
    v = speed * np.tile(radius[rim] - 0.45, frames) * rng.uniform(0.5, 1.5, frames).repeat(rim.sum())
    return told(material, v, f_n, np.tile(np.flatnonzero(rim), frames), rng)


def probe_of_all(material: Material, grasp: Grasp, rng: np.random.Generator) -> estimators.Moments:
    """What a grasp would tell whose places have all forces and speeds there are, whichever is asked for."""
    del grasp
    f_n = np.tile(np.exp(rng.uniform(*np.log(FORCES), PLACES)), FRAMES)
    return told(material, rng.uniform(0.0, SPEEDS[1], len(f_n)), f_n, np.tile(np.arange(PLACES), FRAMES), rng)


def told(
    material: Material, v: np.ndarray, f_n: np.ndarray, element: np.ndarray, rng: np.random.Generator
) -> estimators.Moments:
    """Moments of one grasp's samples, [frames × places] of them at these v, f_n and elements, frame by frame."""
    between, places, within = material.scales
    spread = np.sqrt(np.log1p(between**2))
    factor = np.exp(spread * rng.standard_normal() - 0.5 * spread**2)
    mu = factor * (material.law @ [np.ones(len(v)), v, f_n]) + within * rng.standard_normal(len(v))
    mu += (places * rng.standard_normal(int(element.max()) + 1))[element]
    time = np.arange(len(v)) // len(np.unique(element)) / RATE
    return estimators.Moments.from_samples(FrictionSamples(mu, v, f_n, mu * f_n, time, element, np.ones(len(v)), AREA))


def needed(
    material: Material,
    choose: Choose,
    seed: int,
    probed: Probed = probe,
    prior: estimators.ScatterPrior | None = None,
) -> tuple[int, float]:
    """Probes and seconds of robot time until the conservative friction is right; of ``MOST`` probes where it is not."""
    rng, truth = np.random.default_rng(seed), material.conservative()
    point, grasp = material.working_point, (0.15, 2e-3, LENGTH)  # the first is everybody's
    data, seconds, held = [], [], 0
    for count in range(1, MOST + 1):
        data.append(probed(material, grasp, rng))
        seconds.append(Probing().seconds + grasp[2] / grasp[1])
        model = estimators.fit(data, method="hierarchical", scatter_prior=prior or estimators.ScatterPrior())
        counted_on = float(model.predict(0.0, point.normal_force, QUANTILE, of="contact", elements=ELEMENTS))
        held = held + 1 if abs(counted_on / truth - 1.0) <= WITHIN else 0
        if held > STAYS:
            return count - STAYS, float(sum(seconds[: count - STAYS]))
        grasp = choose(model, count)
    return MOST, float(sum(seconds))


def designed(material: Material) -> Choose:
    """Asks for what to record next."""
    probing = Probing(normal_force=FORCES, speed=(5e-4, 1e-3, 2e-3, 4e-3), length=(LENGTH,))

    def choose(model: estimators.FrictionModel, grasps: int) -> Grasp:
        asked = next_grasp(model, material.working_point, probing, grasps)
        return asked.normal_force, asked.speed, asked.slip_length

    return choose


def scheduled(model: estimators.FrictionModel | None, grasps: int) -> Grasp:
    """Three forces by three speeds, again and again."""
    del model
    grid = product(np.geomspace(*FORCES, 3), np.geomspace(*SPEEDS, 3))
    force, speed = next(islice(cycle(grid), grasps - 1, None))
    return float(force), float(speed), LENGTH


def same(model: estimators.FrictionModel | None, grasps: int) -> Grasp:
    """The first grasp again."""
    del model, grasps
    return 0.15, 2e-3, LENGTH


def known(materials: int) -> estimators.ScatterPrior:
    """The prior of how much grasps differ, by so many other materials."""
    models = []
    for number in range(materials):
        rng = np.random.default_rng([2, number])
        material = Material.drawn(rng)
        data = [probe(material, scheduled(None, count), rng) for count in range(1, RECORDED + 1)]
        models.append(estimators.fit(data, method="hierarchical"))
    return estimators.population_scatter(models)


ROBOTS: dict[str, tuple[Callable[[Material], Choose], Probed]] = {
    "next_grasp": (designed, probe),
    "schedule": (lambda _: scheduled, probe),
    "same grasp": (lambda _: same, probe),
    "each grasp determines the law": (lambda _: same, probe_of_all),
}
"""How each chooses, and what its grasps are."""


def main() -> None:
    """Run the campaign and print it as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--materials", type=int, default=200)
    parser.add_argument("--others", type=int, default=0, help="materials known before")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    population = [Material.drawn(np.random.default_rng([1, number])) for number in range(options.materials)]
    rows, prior = {}, known(options.others)
    for name, (chooser, probed) in ROBOTS.items():
        found = np.array([needed(m, chooser(m), seed, probed, prior) for seed, m in enumerate(population)])
        rows[name] = found.tolist()
        quartiles = np.quantile(found[:, 0], [0.25, 0.5, 0.75, 0.9])
        never = float(np.mean(found[:, 0] == MOST))
        cells = f"{' '.join(f'{x:g}' for x in quartiles)} | {np.median(found[:, 1]):.0f} | {never:.1%}"
        print(f"| {name} | {cells} |", flush=True)
    (options.output / "next_grasp.json").write_text(json.dumps(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
