"""What of a sensor no frame changes: how its markers move, and its elements are loaded, by tractions at nodes."""

from dataclasses import dataclass

import numpy as np

from slipcore.forces.inverse.fit import ObservationModel
from slipcore.forces.known import KnownForce
from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrix
from slipcore.frames import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SensorResponse:
    """For tractions in Young's moduli: ``observed`` [m + 3, 3, k], what markers move by along the ``axes`` that are
    seen, m, and the resultant, N; ``elements`` [e, k] N of theirs by tractions at nodes, and ``load`` N, the force by a
    traction of 1 at one node.
    """

    nodes: Nodes
    observed: FloatArray
    elements: FloatArray
    load: float
    axes: tuple[int, ...]

    @classmethod
    def of(cls, position: FloatArray, element_area: float, gel: Gel, axes: tuple[int, ...]) -> "SensorResponse":
        """With markers at ``position`` [n, m, 3] m."""
        place = position[..., :2].reshape(-1, 2)
        nodes, young, markers = Nodes.around(place, element_area), gel.young_modulus, len(axes) * len(place)
        load = young * nodes.area
        observed = np.empty((markers + 3, 3, len(nodes)))
        response = response_matrix(gel, nodes, place)[list(axes)]
        np.multiply(young, response.reshape(markers, 3, len(nodes)), out=observed[:markers])
        observed[markers:] = load * np.eye(3)[..., None]
        return cls(nodes, observed, young * nodes.over_elements(place), load, axes)

    @property
    def response(self) -> FloatArray:
        """Of markers alone, [m, 3, k] m."""
        return self.observed[:-3]

    @property
    def sees_depth(self) -> bool:
        """Whether its markers also show how deep they are pressed."""
        return len(self.axes) == 3

    def observation(self, spread: FloatArray, known: KnownForce) -> ObservationModel:
        """Of a frame whose displacements have the standard deviations ``spread`` [m] m, and what is known of it."""
        return ObservationModel(self.observed, np.concatenate((spread, known.noise)))

    def depth_seen(self, observation: ObservationModel) -> BoolArray:
        """Whose markers' z was seen in a frame, [e]."""
        count = len(self.elements)
        if not self.sees_depth:
            return np.zeros(count, dtype=bool)
        return np.asarray(np.isfinite(observation.noise[2 * count : 3 * count]))

    @staticmethod
    def data(displacement: FloatArray, known: KnownForce) -> FloatArray:
        """What it measures [m + 3]."""
        return np.concatenate((displacement, np.nan_to_num(known.force)))
