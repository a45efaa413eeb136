"""What of a sensor no frame changes: how its markers move, and its elements are loaded, by tractions at nodes."""

from dataclasses import dataclass

import numpy as np

from slipcore.forces.defaults import RECONSTRUCTION, STRENGTH
from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.inverse.prior import Smoothness, of_depth_alone, usual
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrices
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.forces.recording import least_power
from slipcore.forces.tracking.known import KnownForce
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SensorResponse:
    """For tractions in Young's moduli: ``observed`` [m + 3, 3, k], what markers move by along the ``axes`` that are
    seen, m, and the resultant, N; ``elements`` [e, k] N of theirs by tractions at nodes, and ``load`` N, the force by a
    traction of 1 at one node. ``observed_between`` [m + 3, 3, l] and ``elements_between`` [e, l]: the same of tractions
    that are largest midway between nodes. ``motion`` [3] m: by how much, in root mean square, markers move at
    least where the gel bears a ``most`` N of load along each axis, on one element or on all alike. ``shows_pressure``:
    whether they show where it presses. ``arm`` [2] m: markers' largest distances from the sensor's z along x and y.
    """

    nodes: Nodes
    observed: FloatArray
    elements: FloatArray
    load: float
    axes: tuple[int, ...]
    observed_between: FloatArray
    elements_between: FloatArray
    motion: FloatArray
    most: float
    shows_pressure: bool
    arm: FloatArray

    @classmethod
    def of(cls, position: FloatArray, element_area: float, gel: Gel, axes: tuple[int, ...]) -> "SensorResponse":
        """With markers at ``position`` [n, m, 3] m."""
        place = position[..., :2].reshape(-1, 2)
        nodes, young = Nodes.around(place, element_area), gel.young_modulus
        load, between = young * nodes.area, nodes.between
        sources, uneven = (nodes.places(), between.places()), UnevenLayer.of(gel, position)
        at_nodes, midway = (
            _observed(young * response, load)
            for response in response_matrices(gel, nodes.grid.pitch[0], sources, place, axes, uneven)
        )
        elements = young * nodes.over_elements(place)
        under = at_nodes[:-3, :, elements.any(axis=0)]
        most = STRENGTH.largest * load * under.shape[-1]
        over_between = young * between.over_elements(place)
        least = _least_motion(under, most / load)
        shown = 2 in axes or _shows_pressure(at_nodes[:-3])
        return cls(
            nodes, at_nodes, elements, load, axes, midway, over_between, least, most, shown, np.abs(place).max(axis=0)
        )

    def unnoticed(self, noise: float) -> FloatArray:
        """The largest resultant [3] N along each axis that moves markers by no more than their ``noise`` m; at most
        what the gel bears.
        """
        level = noise * np.sqrt(least_power(len(self.response)))
        seen = self.motion > level
        return self.most * np.where(seen, level / np.where(seen, self.motion, 1.0), 1.0)

    def unnoticed_moment(self, noise: float) -> float:
        """The moment about the sensor's z, N m, of such resultants at markers' largest x and y."""
        return float(np.hypot(*(self.unnoticed(noise)[:2] * self.arm[::-1])))

    def wrench(self, between: bool = False) -> FloatArray:
        """Resultant along x, y and into the gel, N, and moment about the sensor's z, N m, by tractions of 1 at each
        node, or of those that are largest ``between`` nodes: [4, 3, k].
        """
        nodes = self.nodes.between if between else self.nodes
        x, y = nodes.places().T
        moment = np.stack((-y, x, np.zeros_like(x)))
        straight = np.broadcast_to(np.eye(3)[..., None], (3, 3, len(x)))
        return np.asarray(self.load * np.concatenate((straight, moment[None])))

    @property
    def response(self) -> FloatArray:
        """Of markers alone, [m, 3, k] m."""
        return self.observed[:-3]

    @property
    def sees_depth(self) -> bool:
        """Whether its markers also show how deep they are pressed."""
        return 2 in self.axes

    @property
    def sees_along_surface(self) -> bool:
        """Whether they also show how they are moved sideways."""
        return self.axes != (2,)

    @property
    def first_shape(self) -> Smoothness:
        """Of the prior, from which its choice begins."""
        return usual() if self.sees_along_surface else of_depth_alone()

    def observation(self, spread: FloatArray, known: KnownForce) -> ObservationModel:
        """Of a frame whose displacements have the standard deviations ``spread`` [m] m, and what is known of it."""
        return ObservationModel(self.observed, np.concatenate((spread, known.noise)))

    def depth_seen(self, observation: ObservationModel) -> BoolArray:
        """Whose markers' z was seen in a frame, [e]."""
        count = len(self.elements)
        if not self.sees_depth:
            return np.zeros(count, dtype=bool)
        before = count * self.axes.index(2)
        return np.asarray(np.isfinite(observation.noise[before : before + count]))

    @staticmethod
    def data(displacement: FloatArray, known: KnownForce) -> FloatArray:
        """What it measures [m + 3]."""
        return np.concatenate((displacement, np.nan_to_num(known.force)))


def _shows_pressure(response: FloatArray) -> bool:
    """Whether pressure moves markers in the plane by more than a small share of what shear does, by a ``response``
    [m, 3, k] m.
    """
    motion = np.linalg.norm(response, axis=0)
    return bool(np.median(motion[2] / motion[0]) > RECONSTRUCTION.least_coupling)


def _least_motion(response: FloatArray, total: float) -> FloatArray:
    """Root mean square [3] m of a ``response`` [m, 3, k] m to tractions of this ``total``, on the one node or on all
    alike that moves markers least.
    """
    alone = total * np.linalg.norm(response, axis=0).min(axis=1)
    together = total / response.shape[-1] * np.linalg.norm(response.sum(axis=2), axis=0)
    return np.asarray(np.minimum(alone, together) / np.sqrt(len(response)))


def _observed(response: FloatArray, load: float) -> FloatArray:
    """Response [d, j, 3, k] m of markers, and below it that of the resultant, N: [m + 3, 3, k]."""
    markers, k = response.shape[0] * response.shape[1], response.shape[-1]
    resultant = np.broadcast_to(load * np.eye(3)[..., None], (3, 3, k))
    return np.concatenate((response.reshape(markers, 3, k), resultant))
