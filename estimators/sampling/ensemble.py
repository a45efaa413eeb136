"""emcee's ensemble sampler over a log probability that takes many points at once, and a move that gives it many."""

from collections.abc import Iterator

import emcee
import numpy as np
from emcee.moves import DEMove, Move
from numpy.typing import NDArray

from estimators.defaults import SAMPLING
from estimators.sampling.proposal import StudentMixture

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


class EvolutionMove(DEMove):  # type: ignore[misc]
    """Differential evolution to the last bit as emcee's, which decides walker by walker in Python.

    Nelson et al. (2014), https://doi.org/10.1088/0067-0049/210/1/11, with two halves drawn anew in each step.
    """

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, NDArray[np.bool_]]:
        """The next state of all walkers, and which of them moved."""
        self.setup(state.coords)
        half, accepted = np.arange(len(state.coords)) % 2, np.zeros(len(state.coords), dtype=bool)
        model.random.shuffle(half)
        for moving in (half == 0, half == 1):
            coords, _ = self.get_proposal(state.coords[moving], [state.coords[~moving]], model.random)
            log_prob, _ = model.compute_log_prob_fn(coords)
            accepted[moving] = log_prob - state.log_prob[moving] > np.log(model.random.random_sample(len(coords)))
            state = self.update(state, emcee.State(coords, log_prob=log_prob), accepted, moving)
        return state, accepted


class IndependenceMove(Move):  # type: ignore[misc]
    """Metropolis-Hastings with proposals that depend on no walker's place.

    Those of ``SAMPLING.batch`` steps are drawn and looked at in one call.
    """

    def __init__(self, proposal: StudentMixture) -> None:
        self._proposal = proposal
        self._waiting: Iterator[tuple[FloatArray, FloatArray, FloatArray]] = iter(())

    def propose(self, model: emcee.model.Model, state: emcee.State) -> tuple[emcee.State, NDArray[np.bool_]]:
        """The next state of all walkers, and which of them moved."""
        if (ready := next(self._waiting, None)) is None:
            self._waiting = self._batch(model, *state.coords.shape)
            ready = next(self._waiting)
        coords, log_prob, log_weight = ready
        accepted = log_weight > state.log_prob - self._proposal.log_density(state.coords)
        return self.update(state, emcee.State(coords, log_prob=log_prob), accepted), accepted

    def _batch(
        self, model: emcee.model.Model, walkers: int, dimension: int
    ) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        """Positions, log probability and log weight of a walker that they just replace, a step after another."""
        shape = (SAMPLING.batch, walkers)
        coords = self._proposal.draw(model.random, SAMPLING.batch * walkers)
        log_prob, _ = model.compute_log_prob_fn(coords)
        log_uniform = np.log(model.random.random_sample(log_prob.shape))
        log_weight = log_prob - self._proposal.log_density(coords) - log_uniform
        return zip(coords.reshape(*shape, dimension), log_prob.reshape(shape), log_weight.reshape(shape), strict=True)
