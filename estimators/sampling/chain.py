"""emcee where the posterior is nearly known: independence proposals, and a chain that says how wrong it still is."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import SAMPLING
from estimators.errors import InvalidSamples
from estimators.sampling.proposal import StudentMixture, flattened

FloatArray = NDArray[np.float64]
LogProbability = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Draws of an ensemble after burn-in, [steps, walkers, d], and how far they can be trusted.

    ``autocorrelation_time`` [d] in steps; ``effective_sample_size`` [d]; ``monte_carlo_error``: the largest over the
    parameters of the standard error of mean, 5 % and 95 % quantile, in posterior standard deviations;
    ``split_rhat``: the largest, or NaN where walkers are not independent chains; ``trouble``: why the chain cannot be
    trusted, or ""; ``stopped``: "accuracy", "seconds" or "steps".
    """

    draws: FloatArray
    autocorrelation_time: FloatArray
    effective_sample_size: FloatArray
    monte_carlo_error: float
    acceptance: float
    split_rhat: float
    move: str
    trouble: str
    stopped: str

    def flat(self) -> FloatArray:
        """All draws, [steps · walkers, d]."""
        return self.draws.reshape(-1, self.draws.shape[-1])


def sample(
    log_probability: LogProbability,
    proposal: StudentMixture,
    accuracy: float | None = None,
    seconds: float | None = None,
    seed: int = 0,
    local: float = 0.0,
) -> Chain:
    """Sample a density in d dimensions until its Monte-Carlo error is under ``accuracy`` (or time is up).

    Independence proposals make every walker a chain of its own; ``local`` is the part of the steps that are small
    instead, which frees walkers from where the proposal seldom comes. Where the density, which should be close to
    N(0, I), is too far from the proposal, differential evolution takes over. ``log_probability`` takes [k, d].
    """
    from emcee.moves import GaussianMove  # emcee takes a second to load

    from estimators.sampling.ensemble import EvolutionMove, IndependenceMove

    deadline = np.inf if seconds is None else time.perf_counter() + seconds
    goal = SAMPLING.accuracy if accuracy is None else accuracy
    task = _Task(
        log_probability, proposal, _walkers(goal, SAMPLING.local_slowness if local > 0.0 else 1.0), goal, deadline, seed
    )
    small = GaussianMove((SAMPLING.local_step**2 / proposal.dimension) * np.ones(proposal.dimension))
    chain = _run(task, [(IndependenceMove(proposal), 1.0 - local), (small, local)], "independence")
    if chain.acceptance >= SAMPLING.min_acceptance:
        return chain
    return _run(task, EvolutionMove(), "differential evolution")


def autocorrelation_time(series: FloatArray) -> FloatArray:
    """Integrated autocorrelation time [d] of chains [steps, walkers, d], averaged over walkers (Sokal; as emcee's).

    Lag by lag until the window is five times the time: a good proposal needs a handful of lags, where a Fourier
    transform would cost more than the chain. Of long chains as many walkers are read as hold 2¹⁵ draws.
    """
    steps = len(series)
    centred = (series - series.mean(axis=(0, 1)))[:, : max(16, SAMPLING.longest_series // steps)]
    variance = np.einsum("swd,swd->d", centred, centred)
    variance[variance == 0.0] = 1.0
    times = np.ones_like(variance)
    growing = np.ones(len(variance), dtype=bool)
    for lag in range(1, steps):
        growing &= lag < SAMPLING.window * times
        if not growing.any():
            break
        covariance = np.einsum("swd,swd->d", centred[lag:], centred[:-lag])
        times = np.where(growing, times + 2.0 * covariance / variance, times)
    return np.asarray(np.maximum(times, 1.0 / steps))


def split_rhat(draws: FloatArray) -> float:
    """Largest split-R̂ over the parameters of independent chains [steps, chains, d] (Gelman et al., BDA3, §11.4)."""
    half = len(draws) // 2
    split = np.concatenate([draws[:half], draws[half : 2 * half]], axis=1)
    within = split.var(axis=0, ddof=1).mean(axis=0)
    between = split.mean(axis=0).var(axis=0, ddof=1)
    return float(np.sqrt((half - 1) / half + between / within).max()) if (within > 0.0).all() else np.inf


def monte_carlo_error(draws: FloatArray, times: FloatArray) -> float:
    """Largest standard error of mean and tail quantiles, in posterior standard deviations.

    A quantile's error is half the distance between the quantiles one standard error of its rank to either side, with
    the autocorrelation time of its own indicator (Vehtari et al. 2021, §4.3).
    """
    ranked = np.sort(draws.reshape(-1, draws.shape[-1]), axis=0)
    count, last = len(ranked), len(ranked) - 1
    errors = [np.sqrt(times / count) * ranked.std(axis=0)]
    for tail in (SAMPLING.tail, 1.0 - SAMPLING.tail):
        below = (draws <= ranked[int(tail * last)]).astype(float)
        step = np.sqrt(tail * (1.0 - tail) * autocorrelation_time(below) / count)
        rows = np.clip([tail - step, tail + step], 0.0, 1.0) * last
        low, high = np.take_along_axis(ranked, np.rint(rows).astype(int), axis=0)
        errors.append(0.5 * (high - low))
    spread = ranked.std(axis=0)
    return float((np.array(errors) / spread).max()) if (spread > 0.0).all() else np.inf


class _Task(NamedTuple):
    """What is to be sampled, by how many walkers, how well and until when."""

    log_probability: LogProbability
    proposal: StudentMixture
    walkers: int
    goal: float
    deadline: float
    seed: int


def _run(task: _Task, move: object, name: str) -> Chain:
    from emcee import State

    from estimators.sampling.ensemble import VectorisedSampler

    sampler = VectorisedSampler(task.walkers, task.proposal.dimension, task.log_probability, moves=move, vectorize=True)
    random = np.random.RandomState(np.random.MT19937(np.random.SeedSequence(task.seed)))
    begin = time.perf_counter()
    start = _start(task, random)
    sampler.random_state = random.get_state()
    state = State(start, log_prob=task.log_probability(start))
    cost = (time.perf_counter() - begin) / (SAMPLING.candidates + 1)  # of a step: as many walkers are looked at
    steps = int(np.clip((task.deadline - time.perf_counter()) / cost, SAMPLING.batch, SAMPLING.block))
    begin = time.perf_counter()
    while True:
        state = sampler.run_mcmc(state, steps, skip_initial_state_check=True)
        chain = _judge(sampler.get_chain(), float(sampler.acceptance_fraction.mean()), name)
        now, done = time.perf_counter(), sampler.iteration
        if _acceptance_too_low(chain) or (not chain.trouble and chain.monte_carlo_error <= task.goal):
            return chain
        affordable = min((task.deadline - now) * done / (now - begin), float(SAMPLING.max_steps - done))
        if affordable < 1.0:
            return replace(chain, stopped="steps" if done >= SAMPLING.max_steps else "seconds")
        steps = int(min(_missing(chain, task.goal), 4 * done, affordable))


def _walkers(goal: float, slowness: float) -> int:
    """Even number of walkers whose first block should do: a quantile's error is ``tail_error``/√ESS.

    More are drawn, as the worst of all parameters counts and a second look costs as much as they do.
    """
    fewest, most = SAMPLING.fewest_walkers, SAMPLING.most_walkers
    slowness *= SAMPLING.more_walkers * SAMPLING.expected_time
    draws = slowness * (SAMPLING.tail_error / goal) ** 2
    return 2 * int(np.clip(np.ceil(draws / SAMPLING.block / 2.0), fewest // 2, most // 2))


def _start(task: _Task, random: np.random.RandomState) -> FloatArray:
    """Walkers [w, d] near the posterior already: proposals resampled by their importance, never all of them one.

    Where none of these is possible, as next to a bound, they are taken nearer to 0, where the mode is.
    """
    candidates = task.proposal.draw(random, SAMPLING.candidates * task.walkers)
    drawn = task.proposal.log_density(candidates)
    for _ in range(SAMPLING.nearer_starts):
        log_weight = task.log_probability(candidates) - drawn
        if np.isfinite(log_weight.max()):
            weight = flattened(log_weight)
            return np.asarray(candidates[random.choice(len(weight), task.walkers, p=weight / weight.sum())])
        candidates = SAMPLING.nearer * candidates
    raise InvalidSamples("mean friction", "0 or less with near certainty", "above 0 over the range of the data")


def _acceptance_too_low(chain: Chain) -> bool:
    return chain.move == "independence" and chain.acceptance < SAMPLING.min_acceptance


def _missing(chain: Chain, goal: float) -> float:
    """Steps that the chain still lacks, with a tenth to spare, so that it seldom has to be looked at again."""
    length = len(chain.draws)
    accurate = length * (chain.monte_carlo_error / goal) ** 2
    wanted = SAMPLING.more_steps * max(accurate, SAMPLING.chain_lengths * float(chain.autocorrelation_time.max()))
    return float(SAMPLING.batch * np.ceil(max(wanted - length, SAMPLING.block / 4) / SAMPLING.batch))


def _judge(draws: FloatArray, acceptance: float, move: str) -> Chain:
    """Drop the burn-in of five autocorrelation times and say what the rest is worth."""
    burn_in = min(int(np.ceil(SAMPLING.window * autocorrelation_time(draws).max())), len(draws) // 2)
    kept = draws[burn_in:]
    times = autocorrelation_time(kept)
    rhat = split_rhat(kept) if move == "independence" else np.nan
    return Chain(
        draws=kept,
        autocorrelation_time=times,
        effective_sample_size=kept.shape[0] * kept.shape[1] / np.maximum(times, 1.0),
        monte_carlo_error=monte_carlo_error(kept, times),
        acceptance=acceptance,
        split_rhat=rhat,
        move=move,
        trouble=_trouble(len(kept), float(times.max()), rhat),
        stopped="accuracy",
    )


def _trouble(steps: int, time_steps: float, rhat: float) -> str:
    if steps < SAMPLING.chain_lengths * time_steps:
        return f"{steps} steps at an autocorrelation time of {time_steps:.1f}; {SAMPLING.chain_lengths:g} times needed"
    if rhat > SAMPLING.max_split_rhat:
        return f"split R-hat {rhat:.3f}; at most {SAMPLING.max_split_rhat:g} allowed"
    return ""
