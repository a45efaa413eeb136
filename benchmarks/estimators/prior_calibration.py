"""Calibration of the hierarchical model by its own priors: `python -m benchmarks.estimators.prior_calibration`.

Law and scales are drawn from the priors, grasps from the model with these; of each truth the part of its posterior
that lies below is then uniform between 0 and 1 if, and only if, priors, likelihood and numerics agree (Talts et al.,
2018, "Validating Bayesian inference algorithms with simulation-based calibration"). For one, three and twelve grasps,
the posterior on the grid and that of emcee: p of a χ² test over ten bins for β₀, β₁, β₂ and the logarithms of the
scales. σ above 0.3 is left out of its prior, which has no end, and so are data that do not show β₁, of which the fit
assumes more: of what is left the same is true. Writes prior_calibration.json and prior_calibration.png.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from scipy import special, stats

import estimators
from benchmarks.pages import options, picture_folder, save, table, write
from estimators.defaults import PRIOR, REFERENCE
from estimators.friction_model import Domain
from estimators.linear.fit_data import gather
from estimators.linear.posterior_grid import SIGMA_NODES, posterior_grid
from estimators.linear.priors import weak_spans
from slipcore.samples import FrictionSamples

NAMES = ("β₀", "β₁", "β₂", "log τ", "log ω", "log σ")
GRASPS = (1, 3, 12)
PLACES, REPEATS, AREA = 20, 8, 1e-6
"""Elements of a grasp, the samples of each, and its area, m²."""
MOST_WITHIN = 0.3
BINS, LEVEL = 10, 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """Of so many grasps and one posterior: the part of it ``below`` each truth, [fits, 6]."""

    grasps: int
    posterior: str
    below: np.ndarray

    @property
    def p(self) -> list[float]:
        """Of each of ``NAMES``."""
        return [float(value) for value in p_values(self.below)]

    def record(self) -> dict[str, object]:
        """Numbers for a file: how many fits lie in each of ten bins, and p."""
        counts = {name: counted(column).tolist() for name, column in zip(NAMES, self.below.T, strict=True)}
        p = dict(zip(NAMES, self.p, strict=True))
        return {"grasps": self.grasps, "posterior": self.posterior, "fits": len(self.below), "counts": counts, "p": p}


def regressors(grasps: int, rng: np.random.Generator) -> np.ndarray:
    """v m/s and f_n N of all samples, [grasps, samples, 2]: a range of its own for each grasp."""
    share = rng.uniform(0.5, 1.0, (grasps, 1, 2)) * rng.uniform(0.1, 1.0, (grasps, PLACES * REPEATS, 2))
    return np.asarray(share * [5e-3, 0.15])


def law(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """β [3] from its prior, which is of friction at the mean of the data and of what slopes change over their spans."""
    low, high = x.min(axis=(0, 1)), x.max(axis=(0, 1))
    domain = Domain((low[0], high[0]), (low[1], high[1]))
    slopes = PRIOR.width * rng.standard_normal(2) / weak_spans(domain, AREA)
    level = REFERENCE.friction + PRIOR.width * rng.standard_normal()
    return np.array([level - x.mean(axis=(0, 1)) @ slopes, *slopes])


def scales(rng: np.random.Generator) -> np.ndarray:
    """(τ, ω, σ) from their priors."""
    between = PRIOR.grasp_scatter * abs(rng.standard_t(PRIOR.grasp_degrees_of_freedom))
    places = REFERENCE.scatter * abs(rng.standard_t(PRIOR.effect_degrees_of_freedom))
    within = np.inf
    while within > MOST_WITHIN:
        precision = rng.gamma(0.5 * PRIOR.degrees_of_freedom, 2.0 / PRIOR.degrees_of_freedom / REFERENCE.scatter**2)
        within = 1.0 / np.sqrt(max(precision, np.finfo(float).tiny))
    return np.array([between, places, within])


def drawn(grasps: int, rng: np.random.Generator) -> tuple[list[FrictionSamples], np.ndarray]:
    """Grasps of a material drawn from the priors, and the truth of each of ``NAMES``, [6]."""
    x = regressors(grasps, rng)
    beta, (between, places, within) = law(x, rng), (scatter := scales(rng))
    element = np.repeat(np.arange(PLACES), REPEATS)
    data = []
    for v, f_n in x.swapaxes(1, 2):
        mean = (1.0 + between * rng.standard_normal()) * (beta[0] + beta[1] * v + beta[2] * f_n)
        mu = mean + places * rng.standard_normal(PLACES)[element] + within * rng.standard_normal(len(v))
        time = np.arange(len(v)) / 30.0
        data.append(FrictionSamples(mu, v, f_n, mu * f_n, time, element, np.ones(len(v)), AREA))
    return data, np.concatenate([beta, np.log(scatter)])


def below_on_grid(data: list[FrictionSamples], truth: np.ndarray) -> np.ndarray:
    """The part [6] of the posterior on the grid that lies below the truth.

    τ and ω of a node are spread over its cell; log σ is taken as normal at each pair of them.
    """
    grid = posterior_grid(gather(data))
    nodes = grid.nodes
    weight = nodes.weight * (nodes.scatter[:, 0] <= MOST_WITHIN)
    weight /= weight.sum()
    deviation = np.sqrt(np.einsum("kii->ki", nodes.covariance))
    of_law = weight @ special.ndtr((truth[:3] - nodes.mean) / deviation)
    width = 0.5 * np.array([np.diff(axis[:2])[0] for axis in grid.axes[:2]])
    of_effects = weight @ np.clip((truth[3:5] - np.log(nodes.scatter[:, 1:3])) / width + 0.5, 0.0, 1.0)
    share, log_sigma = (each.reshape(-1, len(SIGMA_NODES)) for each in (weight, np.log(nodes.scatter[:, 0])))
    pairs = np.maximum(share.sum(axis=1), np.finfo(float).tiny)
    mean = (share * log_sigma).sum(axis=1) / pairs
    spread = np.sqrt((share * (log_sigma - mean[:, None]) ** 2).sum(axis=1) / pairs)
    of_within = pairs @ special.ndtr((truth[5] - mean) / np.maximum(spread, np.finfo(float).tiny))
    return np.concatenate([of_law, of_effects, [of_within]])


def below_in_draws(data: list[FrictionSamples], truth: np.ndarray, seed: int) -> np.ndarray:
    """The part [6] of emcee's draws that lies below the truth."""
    draws = estimators.fit(data, method="bayes", seed=seed).draws
    assert draws is not None
    kept = draws[draws[:, 3] <= MOST_WITHIN]
    told = np.column_stack([kept[:, :3], np.log(kept[:, [4, 5, 3]])])
    return np.asarray((told < truth).mean(axis=0))


def counted(below: np.ndarray) -> np.ndarray:
    """How many of [fits] lie in each of ten bins."""
    return np.bincount(np.minimum((BINS * below).astype(int), BINS - 1), minlength=BINS)


def p_values(below: np.ndarray) -> np.ndarray:
    """p [q] of the χ² test that each column of ``below`` [fits, q] is uniform."""
    return np.array([stats.chisquare(counted(column)).pvalue for column in below.T])


def calibrated(grasps: int, fits: int, sampled: bool = False) -> np.ndarray:
    """The part of the posterior below the truth in so many ``fits``, [fits, 6]."""
    found = np.empty((fits, len(NAMES)))
    for seed in range(fits):
        rng = np.random.default_rng([seed, grasps])
        data, truth = drawn(grasps, rng)
        while posterior_grid(gather(data)).slope is not None:
            data, truth = drawn(grasps, rng)
        found[seed] = below_in_draws(data, truth, seed) if sampled else below_on_grid(data, truth)
    return found


def cells(fits: int) -> Iterator[Cell]:
    """Both posteriors of each number of grasps."""
    for grasps in GRASPS:
        for name in ("hierarchical", "bayes"):
            yield Cell(grasps, name, calibrated(grasps, fits, sampled=name == "bayes"))


def draw(found: list[Cell]) -> Figure:
    """How far the distribution of what lies below is from a uniform one, and how far chance takes it."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots(2, len(GRASPS), sharex=True, sharey=True)
    for cell, place in zip(found, axes.T.ravel(), strict=True):
        ordered = np.sort(cell.below, axis=0)
        part = (np.arange(len(ordered)) + 0.5) / len(ordered)
        for name, column in zip(NAMES, ordered.T, strict=True):
            place.plot(column, part - column, linewidth=1, label=name)
        band = stats.kstwo.ppf(1.0 - LEVEL, len(ordered))
        place.axhspan(-band, band, color="0.92", zorder=0)
        place.set_title(f"{cell.posterior}, {cell.grasps} grasp{'s' * (cell.grasps > 1)}", fontsize=9)
    figure.supxlabel("part of the posterior below the truth")
    figure.supylabel("distribution less a uniform one")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(NAMES))
    return figure


def main() -> None:
    """Run all cells, write, print and draw."""
    parser = options(__doc__)
    parser.add_argument("--fits", type=int, default=500)
    arguments = parser.parse_args()
    folder = picture_folder(arguments)
    found = list(cells(arguments.fits))
    rows = table(("grasps", "posterior", *NAMES), ((cell.grasps, cell.posterior, *cell.p) for cell in found))
    write([cell.record() for cell in found], {"prior_calibration": rows}, arguments, "prior_calibration.json")
    save(draw(found), folder / "prior_calibration.png")
    print(rows)


if __name__ == "__main__":
    main()
