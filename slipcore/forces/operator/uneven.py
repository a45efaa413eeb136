"""Gels that are not alike thick everywhere: locally, a layer that is, between the slopes of surface and base.

A marker is moved by a node as on a layer as thick as the gel is in the mean of both places, and that leans as a plane
between surface and base does there: in the mean of both, so that Maxwell's and Betti's reciprocity holds. What a
pressure pushes aside flows to where the gel is thicker, and it is this lean that says so: to first order in the slope,
exactly so where the layer is thin and the plane lies midway (lubrication theory).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from slipcore.errors import InvalidInput
from slipcore.forces.defaults import GEL, RESPONSE
from slipcore.forces.operator.gel import Gel
from slipcore.frames import FloatArray
from slipcore.surface.strain import Lattice, lattice_steps


@dataclass(frozen=True, slots=True, eq=False)
class UnevenLayer:
    """Of markers at ``place`` [j, 2] m: the logarithm of the ``thickness`` [j] (in m) under them, and the ``slope`` [j,
    2] of the plane in the gel by which they are framed, along x and y.
    """

    place: FloatArray
    thickness: FloatArray
    slope: FloatArray

    @classmethod
    def of(cls, gel: Gel, position: FloatArray) -> "UnevenLayer | None":
        """Of markers at rest at ``position`` [n, m, 3] m; None of a gel that is alike everywhere.

        Raises ``InvalidInput`` for another lattice than the gel's map has, and for one that is too steep there.
        """
        if gel.relative_thickness is None:
            return None
        thickness = gel.thickness * _of_lattice(gel.relative_thickness, position)
        surface, below = (_slope(position, height) for height in (position[..., 2], thickness))
        steepest = _steepest(below)
        if steepest > GEL.slope:
            allowed = f"one that changes the thickness by at most {GEL.slope:g} m a m"
            raise InvalidInput("relative_thickness", f"one that changes it by {steepest:.2g} m a m", allowed)
        place = position[..., :2].reshape(-1, 2)
        return cls(place, np.log(thickness).ravel(), surface - RESPONSE.plane * below)

    def responses(
        self, gel: Gel, nodes: Sequence[FloatArray], of_a_layer: Callable[[Gel], list[FloatArray]]
    ) -> list[FloatArray]:
        """Displacement [3, j, 3, k] of markers by several sets of ``nodes`` [k, 2] m, from that ``of_a_layer`` which is
        alike everywhere.

        Between layers it is interpolated by a polynomial of the logarithm of the thickness, by Chebyshev's points.
        """
        low, high = self.thickness.min(), self.thickness.max()
        points = np.cos(np.pi * (np.arange(RESPONSE.thicknesses) + 0.5) / RESPONSE.thicknesses)
        middle, half = 0.5 * (low + high), max(0.5 * (high - low), RESPONSE.least_change)
        at_nodes = [self._at(each) for each in nodes]
        weights = [_lagrange(points, (self._between(each[0]) - middle) / half) for each in at_nodes]
        found = [np.zeros((3, len(self.place), 3, len(each))) for each in nodes]
        for index, point in enumerate(points):
            alike = replace(gel, thickness=float(np.exp(middle + half * point)), relative_thickness=None)
            for total, weight, part in zip(found, weights, of_a_layer(alike), strict=True):
                part *= weight[index][:, None]
                total += part
        own = _frames(self.slope)
        return [_turned(own, each, _frames(slope)) for each, (_, slope) in zip(found, at_nodes, strict=True)]

    def _between(self, at_nodes: FloatArray) -> FloatArray:
        """Logarithm [j, k] of the mean thickness at markers and at nodes [k]."""
        return np.asarray(np.logaddexp(self.thickness[:, None], at_nodes) - np.log(2.0))

    def _at(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Logarithm of the thickness [k], and slope [k, 2], at places [k, 2] m: the mean of the nearest markers by one
        over squared distance, so that of the marker that is there, or of the rim beyond it.
        """
        near = min(RESPONSE.neighbours, len(self.place))
        distance, which = KDTree(self.place).query(places, k=[*range(1, near + 1)])
        apart = np.asarray(distance)
        weight = 1.0 / np.maximum(apart / apart.max(), RESPONSE.least_distance) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        return np.sum(weight * self.thickness[which], axis=1), np.einsum("kn,knd->kd", weight, self.slope[which])


def thickest(relative: ArrayLike, position: FloatArray) -> float:
    """Thickness (m) up to which a map [n, m] of it is not too steep over a lattice [n, m, 3] m; inf of a flat one.

    Raises ``InvalidInput`` for a map of another lattice.
    """
    steepest = _steepest(_slope(position, _of_lattice(relative, position)))
    return GEL.slope / steepest if steepest > 0.0 else np.inf


def _of_lattice(relative: ArrayLike, position: FloatArray) -> FloatArray:
    shape, lattice = list(np.shape(relative)), list(position.shape[:2])
    if shape != lattice:
        raise InvalidInput("relative_thickness", f"of shape {shape}", f"{lattice}, as the lattice")
    return np.asarray(relative, dtype=np.float64)


def _steepest(slope: FloatArray) -> float:
    return float(np.linalg.norm(slope, axis=1).max())


def _slope(position: FloatArray, height: FloatArray) -> FloatArray:
    """Along x and y [j, 2] of a height [n, m] m over a lattice [n, m, 3] m."""
    raised = np.zeros_like(position)
    raised[..., 2] = height
    rows, columns = Lattice.at_rest(position).inverse_jacobian
    along_rows, along_columns = lattice_steps(raised)[:, 2]
    return np.asarray((along_rows * rows + along_columns * columns).reshape(2, -1).T)


def _frames(slope: FloatArray) -> FloatArray:
    """Rotations [j, 3, 3] that take the direction into a flat gel to that across planes of this slope [j, 2]; x, y and
    into the gel.
    """
    across = np.concatenate((slope, np.ones((len(slope), 1))), axis=1)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turn = np.zeros((len(slope), 3, 3))
    turn[:, :, 2] += across
    turn[:, 2] -= across
    return np.asarray(np.eye(3) + turn + turn @ turn / (1.0 + across[:, 2, None, None]))


def _turned(own: FloatArray, response: FloatArray, of_nodes: FloatArray) -> FloatArray:
    """The mean of a response [3, j, 3, k] in frames of markers [j, 3, 3] and of nodes [k, 3, 3], in the sensor's."""
    by_marker = np.einsum("jda,ajbk,jcb->djck", own, response, own, optimize=True)
    by_node = np.einsum("kda,ajbk,kcb->djck", of_nodes, response, of_nodes, optimize=True)
    return np.asarray(0.5 * (by_marker + by_node))


def _lagrange(points: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange's polynomials of the points [h] at values [...]: [h, ...]."""
    found = np.ones((len(points), *at.shape))
    for index, point in enumerate(points):
        for other in np.delete(points, index):
            found[index] *= (at - other) / (point - other)
    return found
