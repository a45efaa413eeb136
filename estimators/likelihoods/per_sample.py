"""Likelihoods that have to look at every sample: in chunks that fit the cache, for all walkers at once."""

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators import robust
from estimators.conjugate import exact_posterior
from estimators.defaults import PRIOR, REFERENCE, SAMPLING
from estimators.evidence import Evidence
from estimators.laplace import laplace, refine
from estimators.likelihoods.posterior import Summary, Whitening, corners, scatter, supported
from estimators.priors import positive_friction, prior_rows

FloatArray = NDArray[np.float64]

COARSE = 4000
"""Samples on which the mode is looked for first."""


class Rows(NamedTuple):
    """Some of the samples, contiguous [c]: v m/s, f_n N, μ, tangential force N, weight."""

    v: FloatArray
    f_n: FloatArray
    friction: FloatArray
    tangential_force: FloatArray
    weight: FloatArray


class Terms(Protocol):
    """What is special to a likelihood, and its own parameters as real coordinates, σ the first of them."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the natural parameters beside β, σ first."""
        ...

    @property
    def prior(self) -> str:
        """Their prior in words and numbers."""
        ...

    def start(self, scale: float) -> FloatArray:
        """Where to look for the mode, and the spread there, [2, m] coordinates; ``scale``: σ of the robust fit."""
        ...

    def natural(self, coordinates: FloatArray) -> FloatArray:
        """Natural parameters [k, m] of coordinates [k, m]."""
        ...

    def log_prior(self, coordinates: FloatArray) -> FloatArray:
        """Log prior density [k] of the coordinates, but for that of log σ and β; -inf where there is none."""
        ...

    def log_likelihood(self, beta: FloatArray, natural: FloatArray, rows: Rows) -> FloatArray:
        """Log likelihood [k] of some rows."""
        ...

    def scatter_degrees_of_freedom(self, natural: FloatArray, otherwise: float) -> float:
        """Degrees of freedom of a new ε/σ, from draws of the natural parameters."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PerSample:
    """Posterior of (β, σ, …) with the conjugate prior on (β, σ), friction positive over the data's domain.

    Coordinates: γ [3] and those of the ``terms``, whitened by Laplace's approximation; β = ``centre`` + ``root`` γ.
    """

    terms: Terms
    rows: Rows
    prior_rows: FloatArray
    corners: FloatArray
    effective_n: float
    centre: FloatArray
    root: FloatArray
    whitening: Whitening
    local: float = SAMPLING.local

    @property
    def names(self) -> tuple[str, ...]:
        """β and the natural parameters of the terms."""
        return ("beta0", "beta1", "beta2", *self.terms.names)

    @property
    def sampled(self) -> tuple[str, ...]:
        """The coordinates bear the names of what they stand for."""
        return self.names

    @property
    def prior(self) -> str:
        """The conjugate prior of (β, σ), and that of the rest."""
        return f"{positive_friction()}; {self.terms.prior}"

    def log_probability(self, whitened: FloatArray) -> FloatArray:
        """Log posterior density [k] in whitened coordinates."""
        coordinates = self.whitening(whitened)
        beta, natural = self.natural(coordinates)
        log = self._log_prior(beta, natural[:, 0]) + self.terms.log_prior(coordinates[:, 3:])
        log = supported(log, beta, self.corners)
        inside = np.isfinite(log)
        if inside.any():
            log[inside] += self.terms.log_likelihood(beta[inside], natural[inside], self.rows)
        return log

    def natural(self, coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """β [k, 3] and the other natural parameters [k, m]."""
        return self.centre + coordinates[:, :3] @ self.root.T, self.terms.natural(coordinates[:, 3:])

    def summarise(self, whitened: FloatArray, _rng: np.random.Generator, /) -> Summary:
        """Moments of the draws."""
        beta, natural = self.natural(self.whitening(whitened))
        scale, degrees = scatter(natural[:, 0] ** 2)
        every = -(-len(beta) // SAMPLING.kept_draws)
        return Summary(
            coefficients=beta.mean(axis=0),
            covariance=np.cov(beta.T),
            scale=scale,
            degrees_of_freedom=self.effective_n - 3.0,
            draws=np.column_stack([beta, natural])[::every],
            scatter_degrees_of_freedom=self.terms.scatter_degrees_of_freedom(natural, min(degrees, self.effective_n)),
        )

    def _log_prior(self, beta: FloatArray, sigma: FloatArray) -> FloatArray:
        misfit = beta @ self.prior_rows[:, :3].T - self.prior_rows[:, 3]
        square = np.einsum("ki,ki->k", misfit, misfit) + PRIOR.degrees_of_freedom * REFERENCE.scatter**2
        return np.asarray(-(3.0 + PRIOR.degrees_of_freedom) * np.log(sigma) - 0.5 * square / sigma**2)


def per_sample(evidence: Evidence, terms: Terms, name: str) -> PerSample:
    """Posterior around the robust fit, whose plane and scale no outlier moves far."""
    observations = evidence.raw(f"bayes, {name}")
    start = robust.fit(evidence, loss="tukey")
    v, f_n = observations.tangential_velocity, observations.normal_force
    initial, spread = terms.start(max(start.scale, 1e-9))
    posterior = PerSample(
        terms=terms,
        rows=Rows(v, f_n, observations.friction, observations.tangential_force, observations.weight),
        prior_rows=prior_rows(evidence.element_area),
        corners=corners(evidence.domain),
        effective_n=evidence.effective_n,
        centre=start.coefficients,
        root=max(start.scale, 1e-9) * exact_posterior(evidence).root,
        whitening=Whitening(np.concatenate([np.zeros(3), initial]), np.diag(np.concatenate([np.ones(3), spread]))),
    )
    for every in sorted({1, max(len(v) // COARSE, 1)}, reverse=True):  # a few samples tell where to look
        posterior = _rewhitened(posterior, every)
    return posterior


def _rewhitened(posterior: PerSample, every: int) -> PerSample:
    """Whitened by Laplace's approximation, refined by importance, to the posterior of every so many samples."""
    thin = Rows(*(np.ascontiguousarray(column[::every]) for column in posterior.rows))
    thin = thin._replace(weight=every * thin.weight)
    target = replace(posterior, rows=thin).log_probability
    mode, root = laplace(target, np.zeros(len(posterior.names)))
    even = 0.0
    if every == 1:
        mode, root, even = refine(target, mode, root, np.random.default_rng(0))
    before = posterior.whitening
    return replace(
        posterior,
        whitening=Whitening(before(mode[None])[0], before.root @ root),
        local=0.0 if even > SAMPLING.even else SAMPLING.local,
    )
