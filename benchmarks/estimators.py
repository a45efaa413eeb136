"""Accuracy against time of the estimators: `python -m benchmarks.estimators [--output FOLDER] [--quick] [--only …]`.

Parts: `gaussian` (sampled against exact posterior, with emcee as its tutorial has it and statsmodels in the same run),
`likelihoods` (those that read every sample, and grasp effects), `ols` (time and memory), `import`, `digits` (NIST StRD
beside statsmodels, NumPy and SciPy) and `coverage` (what the intervals of each method cover on each fault). Medians of
several runs. Writes JSON, pictures and a Markdown table a part.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"  # before numpy is first imported: small products gain nothing from threads
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import json
import statistics
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import emcee
import numpy as np
from matplotlib.figure import Figure
from scipy import stats

import estimators
from benchmarks.nist import digits_table
from estimators.conjugate import NormalInverseGamma, exact_posterior
from estimators.evidence import gather
from estimators.likelihoods.gaussian import gaussian
from estimators.sampling import sample
from slipcore.samples import FrictionSamples

TRUTH, SIGMA, AREA = np.array([0.4, 2.0, -0.8]), 0.02, 1e-6
TAILS = np.array([0.05, 0.95])
Row = dict[str, float | str]


def make(n: int, seed: int, elements: int = 20) -> FrictionSamples:
    """Samples of one grasp with known truth."""
    rng = np.random.default_rng(seed)
    v, f_n = rng.uniform(0.0, 5e-3, n), rng.uniform(0.02, 0.1, n)
    mu = TRUTH @ [np.ones(n), v, f_n] + SIGMA * rng.standard_normal(n)
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(n) * 0.01, rng.integers(0, elements, n), np.ones(n), AREA)


def correlated(data: FrictionSamples, seed: int) -> FrictionSamples:
    """Errors shared within an element."""
    shared = np.random.default_rng([seed, 1]).standard_normal(20)
    return with_friction(data, data.friction_coefficient + 0.015 * shared[data.element])


def heteroscedastic(data: FrictionSamples, seed: int) -> FrictionSamples:
    """Scatter that grows with the force, from a third to five thirds."""
    noise = np.random.default_rng([seed, 2]).standard_normal(len(data)) * data.normal_force / 0.06
    clean = TRUTH @ [np.ones(len(data)), data.tangential_velocity, data.normal_force]
    return with_friction(data, clean + SIGMA * noise)


def outliers(data: FrictionSamples, seed: int) -> FrictionSamples:
    """A twelfth of false slip."""
    rng = np.random.default_rng([seed, 3])
    low = rng.uniform(0.0, 0.3, len(data))
    return with_friction(data, np.where(rng.random(len(data)) < 0.08, low, data.friction_coefficient))


def noisy_forces(data: FrictionSamples, seed: int) -> FrictionSamples:
    """2 mN on each component of the force."""
    rng = np.random.default_rng([seed, 4])
    f_n, f_t = (np.abs(f + 2e-3 * rng.standard_normal(len(f))) for f in (data.normal_force, data.tangential_force))
    return replace(data, normal_force=f_n, tangential_force=f_t, friction_coefficient=f_t / f_n)


def with_friction(data: FrictionSamples, friction: np.ndarray) -> FrictionSamples:
    """The same samples with other friction."""
    return replace(data, friction_coefficient=friction, tangential_force=friction * data.normal_force)


FAULTS = {
    "autocorrelated": correlated,
    "heteroscedastic": heteroscedastic,
    "outliers": outliers,
    "noisy f_n": noisy_forces,
}


def median_seconds(call: Callable[[int], object], repeats: int) -> float:
    """Median wall time of calls with the seeds 0, 1, …"""
    seconds = []
    for seed in range(repeats):
        begin = time.perf_counter()
        call(seed)
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)


def errors(draws: np.ndarray, exact: NormalInverseGamma) -> dict[str, float]:
    """Worst error over (β, log σ) of mean, sd and 5/95 % quantile of draws [k, 4], in posterior sd."""
    centre, width = exact.log_scale()
    nu, scale = exact.degrees_of_freedom, np.sqrt(np.diag(exact.covariance))
    spread = np.array([*(scale * np.sqrt(nu / (nu - 2.0))), width])
    mean = np.array([*exact.mean, centre])
    log_sigma = np.log(exact.scale) + 0.5 * np.log(nu / stats.chi2(nu).ppf(1.0 - TAILS))
    quantiles = np.column_stack([exact.mean + scale * stats.t(nu).ppf(TAILS)[:, None], log_sigma])
    values = np.column_stack([draws[:, :3], np.log(draws[:, 3])])
    return {
        "mean": float(np.abs((values.mean(axis=0) - mean) / spread).max()),
        "sd": float(np.abs(values.std(axis=0) / spread - 1.0).max()),
        "quantile": float(np.abs((np.quantile(values, TAILS, axis=0) - quantiles) / spread).max()),
    }


def gaussian_part(quick: bool) -> list[Row]:
    """Ours at several accuracies, the tutorial's emcee and statsmodels, for growing n."""
    rows: list[Row] = []
    for n in (200, 2_000, 20_000, 200_000) if quick else (200, 2_000, 20_000, 200_000, 2_000_000):
        data, repeats = make(n, n), 5 if n > 100_000 else 9
        moments = estimators.Moments.from_samples(data)
        seconds = median_seconds(lambda _, d=data: estimators.Moments.from_samples(d), repeats)
        rows.append({"n": n, "what": "moments", "seconds": seconds})
        evidence = gather(moments)
        exact = exact_posterior(evidence)
        rows += [
            {"n": n, "what": f"ours, accuracy {accuracy:g}", **ours(moments, exact, accuracy, repeats)}
            for accuracy in (0.1, 0.05, 0.02, 0.01)
        ]
        rows.append({"n": n, "what": "exact draws (4,000)", **exact_draws(exact)})
        if n <= 200_000:
            rows.append({"n": n, "what": "emcee as in its tutorial", **tutorial(data, exact, 5.0 if quick else 20.0)})
        rows.append({"n": n, "what": "statsmodels OLS", "seconds": median_seconds(lambda _, d=data: peer_ols(d), 3)})
    return rows


def peer_ols(data: FrictionSamples) -> np.ndarray:
    """Standard errors by statsmodels."""
    from statsmodels.regression.linear_model import OLS

    x = np.column_stack([np.ones(len(data)), data.tangential_velocity, data.normal_force])
    return OLS(data.friction_coefficient, x).fit().bse


def ours(moments: estimators.Moments, exact: NormalInverseGamma, accuracy: float, repeats: int) -> Row:
    """Time of a fit after the moments exist, and the median over seeds of its errors over all draws."""
    posterior = gaussian(gather(moments))
    seconds = median_seconds(
        lambda seed: moments.fit("bayes", accuracy=accuracy, seed=seed, likelihood="gaussian"), repeats
    )
    chains = [sample(posterior.log_probability, posterior.proposal, accuracy, seed=seed) for seed in range(repeats)]
    found = [errors(np.column_stack(posterior._natural(chain.flat())), exact) for chain in chains]
    size = statistics.median(float(chain.effective_sample_size.min()) for chain in chains)
    return {"seconds": seconds, "ess": size, **{k: statistics.median(f[k] for f in found) for k in found[0]}}


def exact_draws(exact: NormalInverseGamma) -> Row:
    """The closed form, drawn from."""
    seconds = median_seconds(lambda seed: exact.draw(4000, np.random.default_rng(seed)), 9)
    return {"seconds": seconds, "ess": 4000.0, **errors(exact.draw(4000, np.random.default_rng(0)), exact)}


def tutorial(data: FrictionSamples, exact: NormalInverseGamma, budget: float) -> Row:
    """32 walkers in a tiny ball about least squares, stretch moves, a function that takes one point at a time."""
    x = np.column_stack([np.ones(len(data)), data.tangential_velocity, data.normal_force])
    y = data.friction_coefficient

    def log_probability(theta: np.ndarray) -> float:
        sigma = np.exp(theta[3])
        return float(-len(y) * theta[3] - 0.5 * np.sum((y - x @ theta[:3]) ** 2) / sigma**2)

    start = np.array([*np.linalg.lstsq(x, y)[0], np.log(np.std(y))]) * (
        1.0 + 1e-4 * np.random.default_rng(0).standard_normal((32, 4))
    )
    sampler = emcee.EnsembleSampler(32, 4, log_probability)
    begin, state = time.perf_counter(), start
    while time.perf_counter() - begin < budget and sampler.iteration < 20_000:
        state = sampler.run_mcmc(state, 50)
    seconds = time.perf_counter() - begin
    chain = sampler.get_chain(discard=sampler.iteration // 5)
    tau = float(np.max(emcee.autocorr.integrated_time(chain, quiet=True)))
    draws = chain.reshape(-1, 4)
    found = errors(np.column_stack([draws[:, :3], np.exp(draws[:, 3])]), exact)
    size = len(draws) / tau
    return {"seconds": seconds, "ess": size, **found, "seconds_to_ess_10000": seconds * 10_000 / size}


def likelihood_part(quick: bool) -> list[Row]:
    """Seconds to an effective sample size of 1,000 where no closed form exists."""
    rows: list[Row] = []
    heavy = with_friction(
        make(20_000, 1), make(20_000, 1).friction_coefficient + 0.02 * np.random.default_rng(9).standard_t(3, 20_000)
    )
    cases = {
        "student_t": heavy,
        "outlier": outliers(make(20_000, 2), 2),
        "errors_in_variables": noisy_forces(make(20_000, 3), 3),
    }
    for name, data in cases.items():
        rows.append({"likelihood": name, "n": 20_000, **timed(data, name, 3 if quick else 5)})
    offsets = 0.03 * np.random.default_rng(4).standard_normal(400)
    grasps = [make(50, 100 + g) for g in range(400)]
    shifted = [with_friction(g, g.friction_coefficient + u) for g, u in zip(grasps, offsets, strict=True)]
    rows.append({"likelihood": "grasp_effects, 400 grasps", "n": 20_000, **timed(shifted, "grasp_effects", 5)})
    kept = [estimators.Moments.from_samples(g) for g in shifted]
    rows.append({"likelihood": "grasp_effects, 400 moments", "n": 20_000, **timed(kept, "grasp_effects", 5)})
    return rows


def timed(data: object, likelihood: str, repeats: int) -> Row:
    """Median seconds and least effective sample size of fits with the seeds 0, 1, …"""
    models = []

    def fit(seed: int) -> None:
        models.append(estimators.fit(data, "bayes", accuracy=0.067, seed=seed, likelihood=likelihood))

    seconds = median_seconds(fit, repeats)
    told = models[-1].diagnostics
    sizes = [float(value) for name, value in told.items() if name.startswith("effective_sample_size")]
    return {"seconds": seconds, "ess": min(sizes), "acceptance": told["acceptance"], "move": told["move"]}


def ols_part(quick: bool) -> list[Row]:
    """Time and peak memory of least squares, with its cluster jackknife."""
    rows: list[Row] = []
    for n in (2_000, 200_000) if quick else (2_000, 200_000, 2_000_000):
        data = make(n, 1, elements=400)
        seconds = median_seconds(lambda _, d=data: estimators.fit(d), 5)
        tracemalloc.start()
        estimators.fit(data)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        rows.append({"n": n, "seconds": seconds, "peak memory / samples": peak / (7 * 8 * n)})
    return rows


def import_part(_: bool) -> list[Row]:
    """Wall time of `import estimators` in a fresh interpreter, less that of the interpreter and NumPy."""

    def run(code: str) -> float:
        return median_seconds(lambda _: subprocess.run([sys.executable, "-c", code], check=True), 5)

    return [{"what": "import estimators", "seconds": run("import estimators") - run("pass")}]


def coverage_part(quick: bool) -> list[Row]:
    """Part of 95 % intervals that hold the true coefficients, n = 400, over each kind of data."""
    fits = 100 if quick else 1000
    methods = {
        "ols": {"method": "ols"},
        "robust": {"method": "robust"},
        "conjugate": {"method": "conjugate"},
        "bayes, grasp_effects": {"method": "bayes", "accuracy": 0.1},
        "auto": {"method": "auto", "accuracy": 0.1},
    }
    kinds: dict[str, Callable[[FrictionSamples, int], FrictionSamples]] = {"clean": lambda data, _: data, **FAULTS}
    rows: list[Row] = []
    for kind, spoil in kinds.items():
        for name, options in methods.items():
            inside, failed = np.zeros(3), 0
            for seed in range(fits):
                try:
                    low, high = estimators.fit(spoil(make(400, 7000 + seed), seed), **options).interval().T
                except estimators.NotConverged:
                    failed += 1
                    continue
                inside += (low <= TRUTH) & (high >= TRUTH)
            share = inside / max(fits - failed, 1)
            rows.append(
                {
                    "data": kind,
                    "method": name,
                    **{f"beta{k}": float(p) for k, p in enumerate(share)},
                    "not converged": failed,
                }
            )
    return rows


PARTS: dict[str, Callable[[bool], list[Row]]] = {
    "gaussian": gaussian_part,
    "likelihoods": likelihood_part,
    "ols": ols_part,
    "import": import_part,
    "digits": lambda _: digits_table(),
    "coverage": coverage_part,
}


def markdown(rows: list[Row]) -> str:
    """A table with all columns that occur."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    lines = ["| " + " | ".join(names) + " |", "|" + "---|" * len(names)]
    cells = [[row.get(name, "") for name in names] for row in rows]
    texts = [[f"{cell:,.4g}" if isinstance(cell, float) else f"{cell}" for cell in line] for line in cells]
    return "\n".join(lines + ["| " + " | ".join(line) + " |" for line in texts])


def picture(rows: list[Row], path: Path) -> None:
    """Error of the worst quantile against seconds, a line an n, the tutorial's emcee beside it."""
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    axes = figure.subplots()
    for k, n in enumerate(sorted({int(row["n"]) for row in rows})):
        own = [row for row in rows if row["n"] == n and str(row["what"]).startswith("ours")]
        axes.loglog(
            [row["seconds"] for row in own], [row["quantile"] for row in own], "o-", color=f"C{k}", label=f"n = {n:,}"
        )
        for row in rows:
            if row["n"] == n and row["what"] == "emcee as in its tutorial":
                axes.loglog(row["seconds"], row["quantile"], "x", color=f"C{k}", markersize=9)
    axes.set_xlabel("seconds (moments excluded)")
    axes.set_ylabel("worst error of a 5 % or 95 % quantile, posterior sd")
    axes.set_title("Gaussian fit: this package (o) and emcee as in its tutorial (x)")
    axes.legend()
    axes.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=130)


def main() -> None:
    """Run the parts asked for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--quick", action="store_true", help="fewer sizes and repeats")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        rows = PARTS[name](options.quick)
        (options.output / f"estimators-{name}.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        print(f"\n## {name}\n\n{markdown(rows)}", flush=True)
        if name == "gaussian":
            picture(rows, options.output / "estimators-gaussian.png")


if __name__ == "__main__":
    main()
