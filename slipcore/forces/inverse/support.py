"""Where the object touches: nodes without which the displacement cannot be explained.

Each node has a variance, shared by its three tractions, and all of them are raised to what makes the displacement most
probable (automatic relevance determination; MacKay, Neural Comput. 4 (1992) 415; Tipping, J. Mach. Learn. Res. 1 (2001)
211). Nodes that the data do not need fall to zero and are left out. A contact is no scatter of single nodes, so each
node's variance is estimated with its neighbours' (Fang et al., IEEE Trans. Signal Process. 63 (2015) 360). Only *where*
is found so; how much comes from a fit on that support.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg
from scipy.ndimage import binary_closing, binary_dilation, binary_erosion, convolve1d, generate_binary_structure

from slipcore.forces.defaults import STRENGTH, SUPPORT
from slipcore.forces.inverse.covariance import covariance_root, solve_root
from slipcore.forces.inverse.fit import ObservationModel, TractionPrior, log_evidence
from slipcore.forces.operator.nodes import Nodes
from slipcore.frames import BoolArray, FloatArray

STEPS: tuple[Callable[[BoolArray], BoolArray], ...] = (binary_dilation, binary_erosion, binary_closing)
"""How a contact may change: by one row of nodes at its rim, or over a gap."""


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
    observation: ObservationModel, data: FloatArray, nodes: Nodes, support: BoolArray, prior: TractionPrior
) -> BoolArray:
    """The support [ny, nx] that explains data [m] best among those that grow, shrink or close step by step from one."""

    def evidence(of: BoolArray) -> float:
        return log_evidence(observation, data, nodes, of.ravel(), prior)

    best, most = support, evidence(support)
    for _ in range(SUPPORT.steps):
        others = [change(best) for change in STEPS]
        judged = [(evidence(other), i) for i, other in enumerate(others) if other.any() and (other != best).any()]
        found, which = max(judged, default=(-np.inf, 0))
        if found <= most:
            break
        best, most = others[which], found
    return best


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


def condensed(response: FloatArray, data: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same problem in no more data than it has unknowns, by QR: without the part of the data that none reaches."""
    m, _, k = response.shape
    if m <= 3 * k:
        return response, data
    both = np.column_stack((response.reshape(m, 3 * k), data))
    upper = scipy.linalg.qr(both, mode="r", overwrite_a=True, check_finite=False)[0][: 3 * k]
    return np.asarray(upper[:, :-1].reshape(3 * k, 3, k)), np.asarray(upper[:, -1])


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
