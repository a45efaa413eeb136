"""Where the object touches: nodes without which the displacement cannot be explained.

Each node has a variance, shared by its three tractions, and all of them are raised to what makes the displacement most
probable (automatic relevance determination; MacKay, Neural Comput. 4 (1992) 415; Tipping, J. Mach. Learn. Res. 1 (2001)
211). Nodes that the data do not need fall to zero and are left out. A contact is no scatter of single nodes, so each
node's variance is estimated with its neighbours' (Fang et al., IEEE Trans. Signal Process. 63 (2015) 360). Only *where*
is found so; how much comes from a fit on that support.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, binary_erosion, convolve1d, generate_binary_structure

from slipcore.forces.defaults import STRENGTH, SUPPORT
from slipcore.forces.inverse.covariance import covariance_root, solve_root
from slipcore.forces.inverse.fit import ObservationModel, TractionPrior, condensed, fit, log_evidence
from slipcore.forces.inverse.prior import Smoothness
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
    observation: ObservationModel, data: FloatArray, nodes: Nodes, support: BoolArray, shape: Smoothness
) -> list[SupportCandidate]:
    """Supports that explain data [m] best, the most probable first and none much less probable than it, under priors
    of this shape: among those that grow, shrink or close row by row from one, and those whose rim is then cut
    where pressures are.

    Behind the first the same supports stand again with pressure that falls to zero at their rim, if that is as
    probable: on a wide support a pressure that is as likely there as in the middle makes forces too large.
    """
    near = observation.within(binary_dilation(support).ravel(), data)
    judged = _judged([support], *near, nodes, shape)
    best = judged[0]
    for _ in range(SUPPORT.steps):
        changed = [change(best.support) for change in STEPS]
        others = [other for other in changed if other.any() and (other != best.support).any()]
        judged += _judged(others, *near, nodes, shape)
        before, best = best, max(judged, key=_probability)
        if best is before:
            break
        near = observation.within(binary_dilation(best.support).ravel(), data)
    judged += _judged([*cut(*near, nodes, best.support, shape)], *near, nodes, shape)
    different = {each.support.tobytes(): each for each in judged}.values()
    likely = _likely(different)
    falling = _judged([each.support for each in likely], *near, nodes, shape._replace(falls=True))
    return [likely[0], *(each for each in _likely([*likely, *falling]) if each is not likely[0])]


def _likely(candidates: Iterable[SupportCandidate]) -> list[SupportCandidate]:
    """Those that are not much less probable than the most probable one, which comes first."""
    found = sorted(candidates, key=_probability, reverse=True)
    least = found[0].log_probability + np.log(SUPPORT.least_probability)
    return [each for each in found if each.log_probability >= least]


def _judged(
    supports: list[BoolArray], observation: ObservationModel, data: FloatArray, nodes: Nodes, shape: Smoothness
) -> list[SupportCandidate]:
    return [SupportCandidate(each, *log_evidence(observation, data, nodes, each.ravel(), shape)) for each in supports]


def _probability(candidate: SupportCandidate) -> float:
    return candidate.log_probability


def cut(
    observation: ObservationModel, data: FloatArray, nodes: Nodes, support: BoolArray, shape: Smoothness
) -> Iterator[BoolArray]:
    """Supports [ny, nx] between one without its outermost row and one with a row more, by how strongly their nodes are
    pressed in a fit on the widest: contacts end between nodes, and not alike on all sides.
    """
    least, wide = binary_erosion(support), binary_dilation(support)
    of_wide = fit(observation, nodes, wide.ravel(), log_evidence(observation, data, nodes, wide.ravel(), shape)[1])
    pressure = np.full(support.shape, -np.inf)
    pressure[wide] = of_wide.mean(data)[2]
    rim = np.flatnonzero(wide & ~least)
    strongest = rim[np.argsort(-pressure.flat[rim], kind="stable")]
    for count in np.unique(np.linspace(0, len(rim), SUPPORT.levels + 2)[1:-1].round().astype(int)):
        other = least.copy()
        other.flat[strongest[:count]] = True
        if other.any():
            yield other


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
