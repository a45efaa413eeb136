"""Likelihoods that have to look at every sample: in chunks that fit the cache, for all walkers at once."""

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.defaults import PRIOR, PROPOSAL, REFERENCE, SAMPLING
from estimators.errors import InvalidSamples
from estimators.likelihoods.posterior import PosteriorSummary, Whitening, corners, scatter, supported
from estimators.linear.fit_data import FitData
from estimators.linear.m_estimate import LOSSES, m_estimate
from estimators.linear.normal_inverse_gamma import exact_posterior
from estimators.linear.priors import positive_friction, prior_rows
from estimators.sampling.adaptation import ProposalFit, adapted
from estimators.sampling.laplace import laplace, refine
from estimators.sampling.proposal import StudentMixture, standard

FloatArray = NDArray[np.float64]


class Rows(NamedTuple):
    """Some of the samples, contiguous [c]: v m/s, f_n N, μ, tangential force N, weight."""

    v: FloatArray
    f_n: FloatArray
    friction: FloatArray
    tangential_force: FloatArray
    weight: FloatArray


class LikelihoodTerms(Protocol):
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

    terms: LikelihoodTerms
    rows: Rows
    prior_rows: FloatArray
    corners: FloatArray
    effective_n: float
    centre: FloatArray
    root: FloatArray
    whitening: Whitening
    proposal: StudentMixture
    local: float

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
        with np.errstate(over="ignore"):  # no density is right where a square is too large for a double
            log = self._log_prior(beta, natural[:, 0]) + self.terms.log_prior(coordinates[:, 3:])
        log = supported(log, beta, self.corners)
        inside = np.isfinite(log)
        if inside.any():
            with np.errstate(over="ignore"):
                log[inside] += self.terms.log_likelihood(beta[inside], natural[inside], self.rows)
        return np.where(np.isnan(log), -np.inf, log)

    def natural(self, coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """β [k, 3] and the other natural parameters [k, m]."""
        return self.centre + coordinates[:, :3] @ self.root.T, self.terms.natural(coordinates[:, 3:])

    def moved(self, centre: FloatArray, root: FloatArray) -> "PerSample":
        """The same in coordinates about ``centre`` [d] of these, with unit ``root`` [d, d]."""
        return replace(self, whitening=Whitening(self.whitening(centre[None])[0], self.whitening.root @ root))

    def summarise(self, whitened: FloatArray, _rng: np.random.Generator, /) -> PosteriorSummary:
        """Moments of the draws."""
        beta, natural = self.natural(self.whitening(whitened))
        scale, degrees = scatter(natural[:, 0] ** 2)
        every = -(-len(beta) // SAMPLING.kept_draws)
        return PosteriorSummary(
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


def per_sample(data: FitData, terms: LikelihoodTerms, name: str) -> PerSample:
    """Posterior around the robust fit, whose plane and scale no outlier moves far."""
    observations = data.raw(f"bayes, {name}")
    start = m_estimate(data, observations, LOSSES["tukey"])
    forces = observations.normal_force, observations.friction, observations.tangential_force
    columns = (observations.tangential_velocity, *forces, observations.weight)
    scale = float(np.hypot(start.scale, REFERENCE.scatter * np.sqrt(PRIOR.degrees_of_freedom / data.effective_n)))
    initial, spread = terms.start(scale)
    posterior = PerSample(
        terms=terms,
        rows=Rows(*(np.require(column, requirements=["C", "W"]) for column in columns)),  # else kernels compile anew
        prior_rows=prior_rows(data.element_area),
        corners=corners(data.domain),
        effective_n=data.effective_n,
        centre=_possible(start.linear.coefficients.astype(float), data),
        root=scale * exact_posterior(data).root,
        whitening=Whitening(np.concatenate([np.zeros(3), initial]), np.diag(np.concatenate([np.ones(3), spread]))),
        proposal=standard(3 + len(initial)),
        local=SAMPLING.local,
    )
    if len(observations) > 2 * PROPOSAL.coarse_samples:  # a few samples show where to look
        posterior = _rewhitened(posterior, len(observations) // PROPOSAL.coarse_samples)
    return _proposing(_rewhitened(posterior, 1))


def _possible(plane: FloatArray, data: FitData) -> FloatArray:
    """The plane, or a level one where it is not above 0 over the data's domain; raises ``InvalidSamples`` for none."""
    at = corners(data.domain)
    if (at @ plane > 0.0).all():
        return plane
    middle = float(at.mean(axis=0) @ plane)
    if middle > 0.0:
        return np.array([middle, 0.0, 0.0])
    raise InvalidSamples("mean friction", f"{middle:.3g}", "above 0 over the range of the data")


def _rewhitened(posterior: PerSample, every: int) -> PerSample:
    """Whitened by Laplace's approximation to the posterior of every so many samples."""
    thin = Rows(*(np.ascontiguousarray(column[::every]) for column in posterior.rows))
    thin = thin._replace(weight=every * thin.weight)
    target = replace(posterior, rows=thin).log_probability
    return posterior.moved(*laplace(target, np.zeros(len(posterior.names))))


def _proposing(posterior: PerSample) -> PerSample:
    """Whitened again by importance, and with a proposal of several components where one does not do."""
    size, rng = len(posterior.names), np.random.default_rng(0)
    centre, root, even = refine(posterior.log_probability, np.zeros(size), np.eye(size), rng)
    moved = posterior.moved(centre, root)
    fit = ProposalFit(moved.proposal, even) if even > SAMPLING.even else adapted(moved.log_probability, size, rng)
    return replace(moved, proposal=fit.proposal, local=0.0 if fit.even > SAMPLING.even else SAMPLING.local)
