"""emcee's ensemble sampler over a log probability that takes many points at once, and a move that gives it many."""

from collections.abc import Iterator

import emcee
import numpy as np
from emcee.moves import Move
from numpy.typing import NDArray

from estimators.defaults import SAMPLING

FloatArray = NDArray[np.float64]


class VectorisedSampler(emcee.EnsembleSampler):  # type: ignore[misc]
    """Takes the array of log probabilities as it is: emcee would walk through it in Python, at twice the cost."""

    def compute_log_prob(self, coords: FloatArray) -> tuple[FloatArray, None]:
        """Log probability [k] of positions [k, d], and no blobs; raises ``ValueError`` for NaN as emcee does."""
        log_probability = np.asarray(self.log_prob_fn(coords), dtype=float)
        if np.isnan(log_probability).any():
            raise ValueError("log probability is NaN")
        return log_probability, None

    random_state = property(lambda _: None, emcee.EnsembleSampler.random_state.fset)
    """May be set, and reads as None: emcee would copy the generator's state at every step, to resume from it."""


class IndependenceMove(Move):  # type: ignore[misc]
    """Metropolis-Hastings with proposals from a multivariate Student-t, whatever the walker's place.

    They depend on no walker, so those of ``SAMPLING.batch`` steps are drawn and looked at in one call.
    """

    def __init__(self) -> None:
        self._waiting: Iterator[tuple[FloatArray, FloatArray, FloatArray]] = iter(())

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, NDArray[np.bool_]]:
        """The next state of all walkers, and which of them moved."""
        if (ready := next(self._waiting, None)) is None:
            self._waiting = self._batch(model, *state.coords.shape)
            ready = next(self._waiting)
        coords, log_prob, log_uniform = ready
        weight = state.log_prob - log_student(state.coords)
        accepted = log_uniform < log_prob - log_student(coords) - weight
        return self.update(state, emcee.State(coords, log_prob=log_prob), accepted), accepted

    @staticmethod
    def _batch(
        model: emcee.model.Model, walkers: int, dimension: int
    ) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        coords = student(model.random, SAMPLING.batch * walkers, dimension)
        log_prob, _ = model.compute_log_prob_fn(coords)
        shape = (SAMPLING.batch, walkers)
        log_uniform = np.log(model.random.random_sample(shape))
        return zip(coords.reshape(*shape, dimension), log_prob.reshape(shape), log_uniform, strict=True)


def student(random: np.random.RandomState, count: int, dimension: int) -> FloatArray:
    """Draws [count, dimension] of the multivariate Student-t proposal."""
    degrees = SAMPLING.proposal_degrees_of_freedom
    radius = np.sqrt(degrees / random.chisquare(degrees, (count, 1)))
    return np.asarray(random.standard_normal((count, dimension)) * radius)


def log_student(x: FloatArray) -> FloatArray:
    """Its log density [k] at x [k, d], up to a constant."""
    degrees = SAMPLING.proposal_degrees_of_freedom
    return np.asarray(-0.5 * (degrees + x.shape[1]) * np.log1p(np.einsum("ki,ki->k", x, x) / degrees))
