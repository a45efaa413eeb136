"""Of what the force found on an element is made: rows of the resolution (averaging) kernel.

What a fit gives is linear in the data, and these in the true traction, so that a row says how much of a force at each
place is taken up in the force found on one element (Backus and Gilbert, Geophys. J. R. Astron. Soc. 16 (1968) 169).
"""

from dataclasses import dataclass

import numpy as np

from slipcore.arguments import whole
from slipcore.forces.inverse.fit import ObservationModel, TractionFit
from slipcore.forces.recording import OUTWARD
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ResolutionKernel:
    """Of the ``fit`` to one ``observation``: ``places`` [k, 2] m of the nodes in contact, and what each
    element bears, ``elements`` [n, m, nodes] N, of the ``load`` N of each node of the lattice.
    """

    fit: TractionFit
    observation: ObservationModel
    places: FloatArray
    elements: FloatArray
    load: float

    def row(self, row: int, column: int) -> FloatArray:
        """How much of a force at each of the ``places``, along each axis (last), is taken up in that found on one
        element along each axis (first): [3, k, 3], z outward. Raises ``InvalidInput`` for an element there is not.

        One product of three vectors with the operator and one with the response; the dense kernel is never made.
        """
        n, m, _ = self.elements.shape
        row, column = whole("row", row, 0, n - 1), whole("column", column, 0, m - 1)
        support, response = self.fit.support, self.observation.response
        borne = self.elements[row, column, support] / self.load
        by_data = np.stack([borne @ of_axis for of_axis in np.split(self.fit.operator, 3)])
        taken = (by_data @ response.reshape(len(response), -1)).reshape(3, 3, -1)[..., support]
        return np.asarray(taken.transpose(0, 2, 1) * OUTWARD[:, None, None] * OUTWARD)
