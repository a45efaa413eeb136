"""What of a sensor no frame changes: how its markers move, and its elements are loaded, by tractions at nodes."""

from dataclasses import dataclass

from slipcore.forces.gel import Gel
from slipcore.forces.nodes import Nodes
from slipcore.forces.response import response_matrix
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """For tractions in Young's moduli: the ``response`` [m, 3, k] m of markers along the ``axes`` that are seen,
    ``elements`` [e, k] N of theirs by tractions at nodes, and ``load`` N, the force by a traction of 1 at one node.
    """

    nodes: Nodes
    response: FloatArray
    elements: FloatArray
    load: float
    axes: tuple[int, ...]

    @classmethod
    def of(cls, position: FloatArray, element_area: float, gel: Gel, axes: tuple[int, ...]) -> "Sensor":
        """With markers at ``position`` [n, m, 3] m."""
        place = position[..., :2].reshape(-1, 2)
        nodes = Nodes.around(place, element_area)
        response = response_matrix(gel, nodes, place)[list(axes)].reshape(len(axes) * len(place), 3, len(nodes))
        young = gel.young_modulus
        return cls(nodes, young * response, young * nodes.over_elements(place), young * nodes.area, axes)

    @property
    def sees_depth(self) -> bool:
        """Whether its markers also tell how deep they are pressed."""
        return len(self.axes) == 3
