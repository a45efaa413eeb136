"""Accuracy against time of the estimators: `python -m benchmarks.estimators [--output FOLDER] [--quick] [--only …]`.

Parts: `gaussian` (sampled against exact posterior for n = 200 to 2,000,000, with emcee as its tutorial has it, NUTS of
NumPyro and statsmodels in the same run), `settings` (emcee's moves and numbers of walkers on the same posterior),
`likelihoods` (those without a closed form, against a very long run), `ols` (time and memory), `import`, and `digits`
(NIST StRD beside statsmodels, NumPy and SciPy). What intervals cover has a command of its own,
`benchmarks.estimators.coverage`. Seconds are CPU seconds of one thread: a shared machine makes wall times longer, not
these. Medians of several runs. ``--peers-python`` names the interpreter that has NumPyro; without it NUTS is left out.
Writes JSON, pictures and a Markdown table a part.
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
import tempfile
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
from benchmarks.estimators.nist import digits_table
from estimators.likelihoods.gaussian import gaussian
from estimators.linear.fit_data import gather
from estimators.linear.normal_inverse_gamma import NormalInverseGamma, exact_posterior
from estimators.methods.bayes import LIKELIHOODS
from estimators.sampling.chain import Chain, autocorrelation_time, sample
from estimators.sampling.ensemble import IndependenceMove, VectorisedSampler
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


def median_seconds(call: Callable[[int], object], repeats: int) -> float:
    """Median CPU time of calls with the seeds 0, 1, …, after one that warms up."""
    call(0)
    seconds = []
    for seed in range(repeats):
        begin = time.process_time()
        call(seed)
        seconds.append(time.process_time() - begin)
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


def gaussian_part(options: argparse.Namespace) -> list[Row]:
    """Ours at several accuracies, the tutorial's emcee, NUTS and statsmodels, for growing n."""
    rows: list[Row] = []
    for n in (2_000, 200_000) if options.quick else (200, 2_000, 20_000, 200_000, 2_000_000):
        data, repeats = make(n, n), 5 if n > 100_000 else 9
        moments = estimators.Moments.from_samples(data)
        seconds = median_seconds(lambda _, d=data: estimators.Moments.from_samples(d), repeats)
        rows.append({"n": n, "what": "moments", "seconds": seconds})
        exact = exact_posterior(gather(moments))
        own = [
            {"n": n, "what": f"ours, accuracy {accuracy:g}", **ours(moments, exact, accuracy, repeats)}
            for accuracy in (0.1, 0.05, 0.02, 0.01)
        ]
        rows += [*own, {"n": n, "what": "exact draws (4,000)", **exact_draws(exact)}]
        if n <= 200_000:
            goal = float(own[0]["quantile"])
            found = tutorial(data, exact, min(4.0 + n / 4_000, 40.0), goal)
            found["times ours at equal error"] = float(found["seconds to ours at 0.1"]) / float(own[0]["seconds"])
            rows.append({"n": n, "what": "emcee as in its tutorial", **found})
            if options.peers_python and n <= 20_000:  # beyond, minutes a chain
                rows.append({"n": n, "what": "NUTS (NumPyro)", **nuts(data, exact, options.peers_python)})
        rows.append({"n": n, "what": "statsmodels OLS", "seconds": median_seconds(lambda _, d=data: peer_ols(d), 3)})
    return rows


def settings_part(options: argparse.Namespace) -> list[Row]:
    """emcee's moves and numbers of walkers on the whitened posterior from moments, n = 200,000; 20,000 draws each."""
    moments = estimators.Moments.from_samples(make(200_000, 200_000))
    posterior, exact = gaussian(gather(moments)), exact_posterior(gather(moments))
    moves: dict[str, Callable[[], object]] = {
        "stretch": emcee.moves.StretchMove,
        "differential evolution": emcee.moves.DEMove,
        "kernel density": emcee.moves.KDEMove,
        "independence": lambda: IndependenceMove(posterior.proposal),
    }
    rows: list[Row] = []
    for name, move in moves.items():
        for walkers in (32, 200) if options.quick else (32, 100, 200, 440):
            found = []
            for seed in range(3):
                start = posterior.proposal.draw(np.random.default_rng(seed), walkers)
                sampler = VectorisedSampler(walkers, 4, posterior.log_probability, moves=move(), vectorize=True)
                begin = time.process_time()
                sampler.run_mcmc(start, 22_000 // walkers, skip_initial_state_check=True)
                seconds = time.process_time() - begin
                chain = sampler.get_chain(discard=2_000 // walkers)
                size = chain.shape[0] * walkers / max(float(autocorrelation_time(chain).max()), 1.0)
                draws = np.column_stack(posterior._natural(chain.reshape(-1, 4)))
                found.append({"seconds": seconds, "ess": size, **errors(draws, exact)})
            middle = {key: statistics.median(one[key] for one in found) for key in found[0]}
            rows.append({"move": name, "walkers": walkers, **middle, "ess a second": middle["ess"] / middle["seconds"]})
    return rows


def nuts(data: FrictionSamples, exact: NormalInverseGamma, python: str) -> Row:
    """NUTS on standardised columns, 500 + 2,000 draws; wall seconds of an interpreter of its own, without compiling."""
    columns = np.column_stack([data.tangential_velocity, data.normal_force])
    centre, width = columns.mean(axis=0), columns.std(axis=0)
    x = np.column_stack([np.ones(len(data)), (columns - centre) / width])
    y = data.friction_coefficient
    with tempfile.TemporaryDirectory() as folder:
        job = {"data": f"{folder}/data.npy", "output": f"{folder}/draws.npy", "likelihood": "gaussian"}
        np.save(job["data"], np.column_stack([x, y]))
        job |= {"start": [*np.linalg.lstsq(x, y)[0], float(np.log(y.std()))], "warmup": 500, "draws": 2000}
        worker = Path(__file__).with_name("peer_worker.py")
        done = subprocess.run([python, worker], input=json.dumps(job), capture_output=True, text=True, check=True)
        answer, draws = json.loads(done.stdout), np.load(job["output"])
    slopes = draws[:, 1:3] / width
    beta = np.column_stack([draws[:, 0] - slopes @ centre, slopes])
    found = errors(np.column_stack([beta, np.exp(draws[:, 3])]), exact)
    return {"seconds": answer["seconds"], "ess": answer["ess"], **found}


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


def tutorial(data: FrictionSamples, exact: NormalInverseGamma, budget: float, goal: float) -> Row:
    """32 walkers in a tiny ball about least squares, stretch moves, a function that takes one point at a time.

    "seconds to ours at 0.1": until the worst quantile of the chain's later half stays within ``goal``; or, where it
    never did, all the seconds that it had, which is a lower bound.
    """
    x = np.column_stack([np.ones(len(data)), data.tangential_velocity, data.normal_force])
    y = data.friction_coefficient

    def log_probability(theta: np.ndarray) -> float:
        sigma = np.exp(theta[3])
        return float(-len(y) * theta[3] - 0.5 * np.sum((y - x @ theta[:3]) ** 2) / sigma**2)

    start = np.array([*np.linalg.lstsq(x, y)[0], np.log(np.std(y))]) * (
        1.0 + 1e-4 * np.random.default_rng(0).standard_normal((32, 4))
    )
    sampler = emcee.EnsembleSampler(32, 4, log_probability)
    begin, state, trace = time.process_time(), start, []
    while time.process_time() - begin < budget and sampler.iteration < 20_000:
        state = sampler.run_mcmc(state, 50)
        later = sampler.get_chain(discard=sampler.iteration // 2, flat=True)
        trace.append((time.process_time() - begin, natural_errors(later, exact)["quantile"]))
    far = [k for k, (_, error) in enumerate(trace) if error > goal]
    reached = trace[min(far[-1] + 1 if far else 0, len(trace) - 1)][0]
    chain = sampler.get_chain(discard=sampler.iteration // 5)
    tau = float(np.max(emcee.autocorr.integrated_time(chain, quiet=True)))
    found = natural_errors(chain.reshape(-1, 4), exact)
    return {"seconds": trace[-1][0], "ess": chain[..., 0].size / tau, **found, "seconds to ours at 0.1": reached}


def natural_errors(draws: np.ndarray, exact: NormalInverseGamma) -> dict[str, float]:
    """Errors of draws [k, 4] of (β, log σ)."""
    return errors(np.column_stack([draws[:, :3], np.exp(draws[:, 3])]), exact)


def likelihood_part(options: argparse.Namespace) -> list[Row]:
    """Seconds and errors where no closed form exists, against a run to 0.01 posterior standard deviations."""
    rows: list[Row] = []
    for n in (200, 20_000) if options.quick else (200, 2_000, 20_000, 200_000, 2_000_000):
        data = make(n, 1)
        error = np.random.default_rng(9).standard_t(3, n) - np.random.default_rng(1).standard_normal(n)
        cases: dict[str, object] = {
            "student_t": with_friction(data, data.friction_coefficient + SIGMA * error),
            "outlier": outliers(make(n, 2), 2),
            "errors_in_variables": noisy_forces(make(n, 3), 3),
        }
        if n == 20_000:
            offsets = 0.03 * np.random.default_rng(4).standard_normal(400)
            grasps = [make(50, 100 + g) for g in range(400)]
            shifted = [with_friction(g, g.friction_coefficient + u) for g, u in zip(grasps, offsets, strict=True)]
            cases["hierarchical, 400 grasps"] = shifted
            cases["hierarchical, 400 moments"] = [estimators.Moments.from_samples(g) for g in shifted]
        for name, given in cases.items():
            rows += against_long_run(n, name, given, (0.2, 0.08) if options.quick else (0.2, 0.08, 0.05, 0.02))
    return rows


def against_long_run(n: int, name: str, data: object, accuracies: tuple[float, ...]) -> list[Row]:
    """Median seconds of whole fits, and errors of chains to the same accuracy in their whitened coordinates."""
    likelihood = name.split(",")[0]
    posterior = LIKELIHOODS[likelihood].posterior(gather(data))

    def chain(accuracy: float, seed: int) -> Chain:
        return sample(posterior.log_probability, posterior.proposal, accuracy, seed=seed, local=posterior.local)

    long, repeats = (chain(0.01, 99).flat() if n <= 20_000 else None), (3 if n <= 200_000 else 1)
    rows: list[Row] = []
    for accuracy in accuracies if long is not None else (0.08,):
        options = {"likelihood": likelihood, "accuracy": accuracy}
        seconds = median_seconds(lambda seed, o=options: estimators.fit(data, "bayes", seed=seed, **o), repeats)
        chains = [chain(accuracy, seed) for seed in range(repeats)]
        size = statistics.median(float(one.effective_sample_size.min()) for one in chains)
        row: Row = {"likelihood": name, "n": n, "accuracy": accuracy, "seconds": seconds, "ess": size}
        if long is not None:
            found = [whitened_errors(one.flat(), long) for one in chains]
            row |= {key: statistics.median(one[key] for one in found) for key in found[0]}
        rows.append(row | {"acceptance": chains[0].acceptance, "trouble": chains[0].trouble})
    return rows


def whitened_errors(draws: np.ndarray, long: np.ndarray) -> dict[str, float]:
    """Worst error over the coordinates of mean, sd and 5/95 % quantile of draws [k, d], in the long run's sd."""
    spread = long.std(axis=0)
    quantiles = np.quantile(draws, TAILS, axis=0) - np.quantile(long, TAILS, axis=0)
    return {
        "mean": float(np.abs((draws.mean(axis=0) - long.mean(axis=0)) / spread).max()),
        "sd": float(np.abs(draws.std(axis=0) / spread - 1.0).max()),
        "quantile": float(np.abs(quantiles / spread).max()),
    }


def ols_part(options: argparse.Namespace) -> list[Row]:
    """Time and peak memory of least squares, with its cluster-robust errors."""
    rows: list[Row] = []
    for n in (2_000, 200_000) if options.quick else (2_000, 200_000, 2_000_000):
        data = make(n, 1, elements=400)
        seconds = median_seconds(lambda _, d=data: estimators.fit(d), 5)
        tracemalloc.start()
        estimators.fit(data)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        rows.append({"n": n, "seconds": seconds, "peak memory / samples": peak / (7 * 8 * n)})
    return rows


def import_part(_: argparse.Namespace) -> list[Row]:
    """Wall time of `import estimators` in a fresh interpreter, less that of the interpreter; the least of seven."""

    def run(code: str) -> float:
        seconds = []
        for _ in range(7):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            seconds.append(time.perf_counter() - begin)
        return min(seconds)

    return [{"what": "import estimators", "seconds": run("import estimators") - run("pass")}]


PARTS: dict[str, Callable[[argparse.Namespace], list[Row]]] = {
    "gaussian": gaussian_part,
    "settings": settings_part,
    "likelihoods": likelihood_part,
    "ols": ols_part,
    "import": import_part,
    "digits": lambda _: digits_table(),
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
            if row["n"] == n and str(row["what"]).startswith("NUTS"):
                axes.loglog(row["seconds"], row["quantile"], "s", color=f"C{k}", markerfacecolor="none")
    axes.set_xlabel("CPU seconds (moments excluded)")
    axes.set_ylabel("worst error of a 5 % or 95 % quantile, posterior sd")
    axes.set_title("Gaussian fit: this package (o), emcee as in its tutorial (x), NUTS (□)")
    axes.legend()
    axes.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=130)


def main() -> None:
    """Run the parts asked for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=Path("benchmark-output"))
    parser.add_argument("--quick", action="store_true", help="fewer sizes and repeats")
    parser.add_argument("--peers-python", help="interpreter of an environment that has NumPyro")
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        rows = PARTS[name](options)
        (options.output / f"estimators-{name}.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        print(f"\n## {name}\n\n{markdown(rows)}", flush=True)
        if name == "gaussian":
            picture(rows, options.output / "estimators-gaussian.png")


if __name__ == "__main__":
    main()
