"""NUTS of NumPyro in the interpreter that has it: one JSON job on standard input, one JSON answer on standard output.

Started by `benchmarks.estimators`; needs nothing of this project. Model: μ = β₀ + β₁ v + β₂ f_n + ε on
standardised columns, flat priors, normal, Student-t or mixture errors. Compilation is told apart from sampling.
"""

import json
import sys
import time
from typing import Any

import numpy as np


def main() -> None:
    """Sample, and answer seconds, effective sample sizes and the draws of (β on standardised columns, log σ)."""
    job = json.load(sys.stdin)
    import jax
    import numpyro
    import numpyro.distributions as dist
    from numpyro.diagnostics import effective_sample_size
    from numpyro.infer import MCMC, NUTS

    jax.config.update("jax_enable_x64", True)
    table = np.load(job["data"])
    x, y = jax.numpy.asarray(table[:, :3]), jax.numpy.asarray(table[:, 3])

    def model() -> None:
        beta = numpyro.sample("beta", dist.ImproperUniform(dist.constraints.real, (), (3,)))
        log_sigma = numpyro.sample("log_sigma", dist.ImproperUniform(dist.constraints.real, (), ()))
        numpyro.sample("y", errors(dist, numpyro, job["likelihood"], x @ beta, jax.numpy.exp(log_sigma)), obs=y)

    sampler = MCMC(NUTS(model), num_warmup=job["warmup"], num_samples=job["draws"], progress_bar=False)
    start = {"beta": jax.numpy.asarray(job["start"][:3]), "log_sigma": jax.numpy.asarray(job["start"][3])}
    seconds = []
    for seed in (0, 1):  # the first run compiles
        begin = time.perf_counter()
        sampler.run(jax.random.PRNGKey(seed), init_params=start if job["likelihood"] == "gaussian" else None)
        jax.block_until_ready(sampler.get_samples())
        seconds.append(time.perf_counter() - begin)
    draws = {name: np.asarray(value) for name, value in sampler.get_samples().items()}
    sizes = [float(np.min(effective_sample_size(value[None]))) for value in draws.values()]
    np.save(job["output"], np.column_stack([draws["beta"], draws["log_sigma"]]))
    answer = {"version": numpyro.__version__, "seconds": seconds[1], "compiling": seconds[0] - seconds[1]}
    print(json.dumps(answer | {"ess": min(sizes)}))


def errors(dist: Any, numpyro: Any, likelihood: str, mean: Any, sigma: Any) -> Any:
    """Distribution of the observations."""
    if likelihood == "student_t":
        return dist.StudentT(numpyro.sample("nu", dist.Gamma(2.0, 0.1)), mean, sigma)
    if likelihood == "outlier":
        part = numpyro.sample("part", dist.Beta(1.0, 4.0))
        ratio = numpyro.sample("ratio", dist.LogNormal(np.log(6.0), 0.5))
        offset = numpyro.sample("offset", dist.Normal(-0.1, 0.2))
        near, far = dist.Normal(mean, sigma), dist.Normal(mean + offset, sigma * (1.0 + ratio))
        return dist.MixtureGeneral(dist.Categorical(probs=jax_stack([1.0 - part, part])), [near, far])
    return dist.Normal(mean, sigma)


def jax_stack(values: list[Any]) -> Any:
    """Two probabilities in one array."""
    import jax.numpy

    return jax.numpy.stack(values, axis=-1)


if __name__ == "__main__":
    main()
