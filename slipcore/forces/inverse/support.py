"""Where the object touches: nodes without which the displacement cannot be explained.

Each node has a variance, shared by its three tractions, and all of them are raised to what makes the displacement most
probable (automatic relevance determination; MacKay, Neural Comput. 4 (1992) 415; Tipping, J. Mach. Learn. Res. 1 (2001)
211). Nodes that the data do not need fall to zero and are left out. A contact is no scatter of single nodes, so each
node's variance is estimated with its neighbours' (Fang et al., IEEE Trans. Signal Process. 63 (2015) 360). Only *where*
is found so; how much comes from a fit on that support.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, binary_erosion, convolve1d, generate_binary_structure

from slipcore.forces.defaults import STRENGTH, SUPPORT
from slipcore.forces.inverse.covariance import covariance_root, solve_root
from slipcore.forces.inverse.fit import ObservationModel, TractionPrior, condensed, log_evidence, mean_traction
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import BoolArray, FloatArray

STEPS: tuple[Callable[[BoolArray], BoolArray], ...] = (binary_dilation, binary_erosion, binary_closing)
"""How a contact may change: by one row of nodes at its rim, or over a gap."""


class SupportCandidate(NamedTuple):
    """A ``support`` [ny, nx], the log probability of data by it, and the prior of tractions that makes it largest."""

    support: BoolArray
    log_probability: float
    prior: TractionPrior


def relevant_nodes(observation: ObservationModel, data: FloatArray, candidates: BoolArray) -> BoolArray:
    """Nodes [ny, nx] among ``candidates`` that displacement ``data`` [m] m needs."""
    chosen = np.flatnonzero(candidates)
    scale = np.array([SUPPORT.shear, SUPPORT.shear, 1.0])[:, None]
    used = observation.response[:, :, chosen] * (scale / observation.noise[:, None, None])
    data = data / observation.noise
    variance = np.full(len(chosen), float(data @ data) / float(np.sum(used**2)))
    for _ in range(SUPPORT.rounds):
        used, data = condensed(used, data)
        gain, freedom = node_relevance(used, data, np.sqrt(variance))
        new = _pooled(variance * gain, chosen, candidates.shape)
        new /= np.maximum(_pooled(freedom, chosen, candidates.shape), SUPPORT.least_freedom)
        new = np.minimum(new, STRENGTH.largest**2)
        kept = new > SUPPORT.least_share * new.max()
        change = float(np.abs(np.log(new[kept] / variance[kept])).mean())
        chosen, used, variance = chosen[kept], used[:, :, kept], new[kept]
        if change < SUPPORT.settled:
            break
    support = np.zeros(candidates.shape, dtype=bool)
    support.flat[chosen] = True
    return support


def better_support(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, first: SupportCandidate
) -> list[SupportCandidate]:
    """Supports that explain data [m] best, the most probable first and none much less probable than it, under priors
    of the shape that suits the ``first``: among those that grow, shrink or close row by row from that, and those whose
    rim is then cut where pressures are.

    Behind the best the same supports stand again with pressure that falls to zero at their rim, if that is as
    probable: on a wide support a pressure that is as likely there as in the middle makes forces too large.
    """
    judged, best = {first.support.tobytes(): first}, first
    near = _Near.to(best, observation, data, nodes)
    for _ in range(SUPPORT.steps):
        for other in (change(best.support) for change in STEPS):
            if other.any() and other.tobytes() not in judged:
                judged[other.tobytes()] = near.judged(other, best.prior)
        before, best = best, max(judged.values(), key=_probability)
        if best is before:
            break
        near = _Near.to(best, observation, data, nodes)
    wide = np.asarray(binary_dilation(best.support))
    for other in near.cut(best.support, judged.get(wide.tobytes()) or near.judged(wide, best.prior)):
        if other.tobytes() not in judged:
            judged[other.tobytes()] = near.judged(other, best.prior, _least(best))
            best = max(best, judged[other.tobytes()], key=_probability)
    likely = _likely(judged.values())
    falling = [near.judged(each.support, _falling(each.prior), _least(best)) for each in likely]
    return [likely[0], *(each for each in _likely([*likely, *falling]) if each is not likely[0])]


@dataclass(frozen=True, slots=True, eq=False)
class _Near:
    """What is to be explained, in no more data than nodes up to a row beside some support have tractions."""

    observation: ObservationModel
    data: FloatArray
    nodes: Nodes

    @classmethod
    def to(cls, best: SupportCandidate, observation: ObservationModel, data: FloatArray, nodes: Nodes) -> "_Near":
        return cls(*observation.within(binary_dilation(best.support).ravel(), data), nodes)

    def judged(self, support: BoolArray, near: TractionPrior, worth: float = -np.inf) -> SupportCandidate:
        """A support under the prior of the shape of one that is ``near``."""
        shape = near.smoothness
        found = log_evidence(self.observation, self.data, self.nodes, support.ravel(), shape, near, worth)
        return SupportCandidate(support, *found)

    def cut(self, support: BoolArray, widest: SupportCandidate) -> Iterator[BoolArray]:
        """Supports [ny, nx] between one without its outermost row and the ``widest``, with a row more, by how strongly
        their nodes are pressed in a fit on that: contacts end between nodes, and not alike on all sides.
        """
        least, wide = binary_erosion(support), widest.support
        pressure = np.full(wide.shape, -np.inf)
        pressure[wide] = mean_traction(self.observation, self.data, self.nodes, wide.ravel(), widest.prior)[2]
        rim = np.flatnonzero(wide & ~least)
        strongest = rim[np.argsort(-pressure.flat[rim], kind="stable")]
        for count in np.unique(np.linspace(0, len(rim), SUPPORT.levels + 2)[1:-1].round().astype(int)):
            other = least.copy()
            other.flat[strongest[:count]] = True
            if other.any():
                yield other


def _falling(prior: TractionPrior) -> TractionPrior:
    return replace(prior, smoothness=prior.smoothness._replace(falls=True))


def _likely(candidates: Iterable[SupportCandidate]) -> list[SupportCandidate]:
    """Those that are not much less probable than the most probable one, which comes first."""
    found = sorted(candidates, key=_probability, reverse=True)
    return [each for each in found if each.log_probability >= _least(found[0])]


def _least(best: SupportCandidate) -> float:
    """Log probability of what counts beside the best."""
    return best.log_probability + float(np.log(SUPPORT.least_probability))


def _probability(candidate: SupportCandidate) -> float:
    return candidate.log_probability


def widened(nodes: BoolArray, by: int) -> BoolArray:
    """Nodes [ny, nx], and those within so many rows and columns of them."""
    return np.asarray(binary_dilation(nodes, generate_binary_structure(2, 2), iterations=by), dtype=bool)


def _pooled(
    values: FloatArray, chosen: np.ndarray[tuple[int], np.dtype[np.intp]], shape: tuple[int, ...]
) -> FloatArray:
    """Sums of values of the chosen nodes with their neighbours', weighted by ``SUPPORT.coupling``."""
    field = np.zeros(shape)
    field.flat[chosen] = values
    for axis in (0, 1):
        field = convolve1d(field, (SUPPORT.coupling, 1.0, SUPPORT.coupling), axis=axis, mode="constant")
    return np.asarray(field.flat[chosen])


def node_relevance(response: FloatArray, data: FloatArray, deviation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of each node: squared posterior mean, and how many of its values the data determine, both in prior variances.

    With W [m, 3 k] the response in prior deviations, the mean is Wᵀ(1 + W Wᵀ)⁻¹d, and of a value with the column w the
    data determine wᵀ(1 + W Wᵀ)⁻¹w.
    """
    m, _, k = response.shape
    weighted = (response * deviation).reshape(m, 3 * k)
    root, both = covariance_root(weighted), np.column_stack((data, weighted))
    seen = solve_root(root, both, transposed=True)
    mean, share = seen[:, 1:].T @ seen[:, 0], np.sum(seen[:, 1:] ** 2, axis=0)
    return np.sum(mean.reshape(3, k) ** 2, axis=0), np.sum(share.reshape(3, k), axis=0)
