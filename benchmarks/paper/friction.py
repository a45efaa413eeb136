"""Friction models of six materials, as the paper's Fig. 17: `python -m benchmarks.paper.friction [--output FOLDER]`.

Samples are drawn from known planes, materials 2 and 5 alike as the paper's two cardboards are, 2 and 6 of large
scatter; six grasps each, which differ a little. Draws samples and fitted planes, and their projections on v = 0 with
the truth and the uncertainty. Prints a table; writes paper_figure17.png.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import estimators
from benchmarks.pages import save
from slipcore.samples import FrictionSamples

AREA, GRASPS, SAMPLES = 1e-6, 6, 60
FASTEST, FORCES = 8e-3, (0.01, 0.1)
"""Range of v (m/s) and of an element's f_n (N) in the pictures."""


@dataclass(frozen=True, slots=True)
class Material:
    """True plane (β₀, β₁ s/m, β₂ 1/N), scatter ε within a grasp, and of the intercept between grasps."""

    name: str
    plane: tuple[float, float, float]
    scatter: float
    between: float


MATERIALS = (
    Material("1 glass", (0.28, 3.0, -0.4), 0.015, 0.006),
    Material("2 cardboard, printed", (0.47, 6.0, -0.9), 0.055, 0.012),
    Material("3 rubber", (0.92, 10.0, -2.5), 0.030, 0.015),
    Material("4 wood", (0.38, -4.0, -0.3), 0.025, 0.010),
    Material("5 cardboard, plain", (0.48, 5.5, -1.0), 0.040, 0.012),
    Material("6 cloth", (0.66, -6.0, -1.2), 0.070, 0.015),
)


def grasps_of(material: Material, seed: int) -> list[FrictionSamples]:
    """Six grasps: slow slip is the most common, and harder grasps press all elements more."""
    rng, found = np.random.default_rng([17, seed]), []
    for _ in range(GRASPS):
        v = np.minimum(rng.exponential(2e-3, SAMPLES), FASTEST)
        f_n = rng.uniform(0.5, 1.0) * rng.uniform(*FORCES, SAMPLES)
        mu = np.array(material.plane) @ [np.ones(SAMPLES), v, f_n] + material.between * rng.standard_normal()
        mu += material.scatter * rng.standard_normal(SAMPLES)
        element = rng.integers(0, 30, SAMPLES)
        found.append(FrictionSamples(mu, v, f_n, mu * f_n, np.arange(SAMPLES) / 30, element, np.ones(SAMPLES), AREA))
    return found


def picture(data: list[list[FrictionSamples]], models: list[estimators.FrictionModel], path: Path) -> None:
    """Samples with fitted planes above, projections below."""
    figure = Figure(figsize=(11.0, 10.5))
    above, below = figure.subfigures(2, 1, height_ratios=[2.0, 1.0])
    above.subplots_adjust(left=0.0, right=0.97, bottom=0.04, top=0.97, wspace=0.0, hspace=0.05)
    below.subplots_adjust(left=0.07, right=0.76, bottom=0.13, top=0.92)
    for k, (material, grasps, model) in enumerate(zip(MATERIALS, data, models, strict=True)):
        space(above.add_subplot(2, 3, k + 1, projection="3d"), k, material, grasps, model)
    flat = below.add_subplot()
    force = np.linspace(*FORCES, 60)
    for k, (material, model) in enumerate(zip(MATERIALS, models, strict=True)):
        at = np.stack([np.ones_like(force), np.zeros_like(force), force])
        low, high = np.quantile(model.draws[:, :3] @ at, [0.025, 0.975], axis=0)
        flat.fill_between(force * 1e3, low, high, color=f"C{k}", alpha=0.25)
        flat.plot(force * 1e3, model.predict(0.0, force), color=f"C{k}", label=material.name)
        flat.plot(force * 1e3, np.array(material.plane) @ at, "--", color=f"C{k}", linewidth=1)
    flat.set_xlabel("normal force of an element, mN")
    flat.set_ylabel("friction at v = 0")
    flat.set_title("Projections on v = 0: fitted, with 95 % intervals of the plane; truth dashed", fontsize=10)
    flat.legend(fontsize=9, loc="center left", bbox_to_anchor=(1.01, 0.5))
    save(figure, path)


def space(
    axes: object, k: int, material: Material, grasps: list[FrictionSamples], model: estimators.FrictionModel
) -> None:
    """One material's samples, fitted plane (filled) and true plane (wires)."""
    v, f_n = np.meshgrid(np.linspace(0.0, FASTEST, 5), np.linspace(*FORCES, 5))
    for part in grasps:
        columns = (part.tangential_velocity * 1e3, part.normal_force * 1e3, part.friction_coefficient)
        axes.plot(*columns, ".", color=f"C{k}", markersize=2, alpha=0.6)
    axes.plot_surface(v * 1e3, f_n * 1e3, model.predict(v, f_n), color=f"C{k}", alpha=0.35)
    truth = material.plane[0] + material.plane[1] * v + material.plane[2] * f_n
    axes.plot_wireframe(v * 1e3, f_n * 1e3, truth, color="black", linewidth=0.5)
    axes.set_title(material.name, fontsize=10)
    axes.set_xlabel("v, mm/s", fontsize=8)
    axes.set_ylabel("fₙ, mN", fontsize=8)
    axes.set_zlabel("μ", fontsize=8)
    axes.set_zlim(0.0, 1.1)
    axes.tick_params(labelsize=7)
    axes.set_box_aspect((1.0, 1.0, 0.75), zoom=0.9)
    axes.patch.set_visible(False)  # it would cover the labels of its neighbour


def main() -> None:
    """Fit, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    data = [grasps_of(material, k) for k, material in enumerate(MATERIALS)]
    models = [estimators.fit(grasps, method="bayes", accuracy=0.02) for grasps in data]
    print("| material | β₀ (truth) | β₁, s/m (truth) | β₂, 1/N (truth) | σ within and between grasps (truth) |")
    print("|---|---|---|---|---|")
    for material, model in zip(MATERIALS, models, strict=True):
        half = 0.5 * np.diff(model.interval())[:, 0]
        cells = [f"{b:.3g} ± {h:.2g} ({t:g})" for b, h, t in zip(model.coefficients, half, material.plane, strict=True)]
        true = float(np.hypot(material.scatter, material.between))
        print(f"| {material.name} | {' | '.join(cells)} | {model.scale:.3f} ({true:.3f}) |")
    picture(data, models, output / "paper_figure17.png")


if __name__ == "__main__":
    main()
