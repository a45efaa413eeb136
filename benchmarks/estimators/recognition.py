"""Recognition of ten simulated materials from one grasp each: `python -m benchmarks.estimators.recognition`.

A material is a plane and two scatters; its model is fitted to eight grasps that differ by an intercept. New grasps of
5 to 40 samples are recognised: accuracy, a reliability diagram (of answers with probability p, how many are right),
and how many grasps of unknown materials, drawn from the stated population, are called unknown. Writes recognition.png.
"""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import estimators
from estimators.defaults import RECOGNITION, REFERENCE
from estimators.recognition import SLOPES
from slipcore.samples import FrictionSamples

AREA, MATERIALS, GRASPS, TRIALS = 1e-6, 10, 8, 4000
SIZES = (5, 10, 20, 40)
BETWEEN = 0.01
"""Scatter of the intercept between grasps of one material."""
SPANS = np.concatenate([[1.0], REFERENCE.spans(AREA)])


def material(rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Plane and scatter of a material from the population that "unknown" stands for."""
    slope = RECOGNITION.slope * rng.choice(SLOPES)
    changes = np.array([RECOGNITION.level, slope, slope]) * rng.standard_normal(3)
    plane = (np.array([REFERENCE.friction, 0.0, 0.0]) + changes) / SPANS
    return plane, REFERENCE.scatter * abs(float(rng.standard_t(RECOGNITION.scatter_freedom)))


def grasp(plane: np.ndarray, scatter: float, n: int, rng: np.random.Generator) -> FrictionSamples:
    """Samples of one grasp."""
    v, f_n = rng.uniform(0.0, 5e-3, n), rng.uniform(0.01, 0.08, n)
    mu = plane @ [np.ones(n), v, f_n] + scatter * rng.standard_normal(n) + BETWEEN * rng.standard_normal()
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(n) / 30, rng.integers(0, 20, n), np.ones(n), AREA)


def trial(
    rng: np.random.Generator, truths: list[tuple[np.ndarray, float]], known: dict[str, estimators.FrictionModel]
) -> dict[str, float | str]:
    """One grasp, unknown as often as its prior says, and the answer."""
    k, n = int(rng.integers(MATERIALS)), int(rng.choice(SIZES))
    stranger = rng.random() < RECOGNITION.unknown
    answer = estimators.recognise(grasp(*(material(rng) if stranger else truths[k]), n, rng), known)
    best = max(answer, key=answer.__getitem__)
    return {
        "n": n,
        "truth": "unknown" if stranger else f"material {k}",
        "answer": best,
        "probability": answer[best],
        "unknown": answer["unknown"],
    }


def summary(trials: list[dict[str, float | str]]) -> list[str]:
    """Accuracy by number of samples, and how unknown materials fare, as a table."""
    lines = ["| samples of the grasp | right | mean probability stated | unknown called so | known called unknown |"]
    lines.append("|---|---|---|---|---|")
    for n in (*SIZES, 0):
        some = [t for t in trials if n in (0, t["n"])]
        right = np.mean([t["answer"] == t["truth"] for t in some])
        claimed = np.mean([float(t["probability"]) for t in some])
        strange = [t["answer"] == "unknown" for t in some if t["truth"] == "unknown"]
        wrongly = np.mean([t["answer"] == "unknown" for t in some if t["truth"] != "unknown"])
        parts = f"{right:.1%} | {claimed:.1%} | {np.mean(strange):.0%} of {len(strange)} | {wrongly:.2%}"
        lines.append(f"| {n or 'all'} | {parts} |")
    stated = np.array([float(t["unknown"]) for t in trials])
    strangers, error = sum(t["truth"] == "unknown" for t in trials), np.sqrt(np.sum(stated * (1.0 - stated)))
    lines.append(
        f"\nUnknown: {strangers} grasps; stated: {stated.sum():.0f} expected, with a standard error of {error:.0f}."
    )
    return lines


def picture(trials: list[dict[str, float | str]], path: Path) -> None:
    """Part of right answers against the probability stated, with two standard errors; as many trials in every bin."""
    stated = np.array([float(t["probability"]) for t in trials])
    right = np.array([t["answer"] == t["truth"] for t in trials], dtype=float)
    edges = [0.0, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 0.995, 1.0]
    figure = Figure(figsize=(6.0, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.2, 1], [0.2, 1], color="0.7", linewidth=1, label="as stated")
    for k, (low, high) in enumerate(pairwise(edges)):
        some = (stated > low) & (stated <= high)
        if some.sum() >= 10:
            mean, part, count = stated[some].mean(), right[some].mean(), int(some.sum())
            error = 2.0 * np.sqrt(max(mean * (1.0 - mean), 1e-6) / count)
            axes.errorbar(mean, part, error, fmt="o", color="C0", capsize=3)
            # The last bins lie side by side: their numbers on either side.
            beside, side = ((-7, 4), "right") if k % 2 else ((7, -11), "left")
            axes.annotate(f"{count}", (mean, part), textcoords="offset points", xytext=beside, ha=side, fontsize=8)
    axes.set_xlabel("probability stated for the answer")
    axes.set_ylabel("part of right answers")
    axes.set_title(
        "Ten materials and strangers, one grasp each (bars: two standard errors; number of grasps)", fontsize=8
    )
    axes.set_xlim(right=1.08)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=120)


def main() -> None:
    """Learn, recognise, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--method", default="auto", help="whose models are compared")
    options = parser.parse_args()
    output = options.output
    output.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(10)
    truths = [material(rng) for _ in range(MATERIALS)]
    learnt = [[grasp(*truth, 60, rng) for _ in range(GRASPS)] for truth in truths]
    known = {f"material {k}": estimators.fit(grasps, method=options.method) for k, grasps in enumerate(learnt)}
    trials = [trial(rng, truths, known) for _ in range(TRIALS)]
    picture(trials, output / "recognition.png")
    print("\n".join(summary(trials)))


if __name__ == "__main__":
    main()
