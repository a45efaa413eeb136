"""What tractions that are bilinear between nodes leave wrong of what is found: the error of discretisation.

What a fit gives for a resultant or an element's force is linear in the data, so it is linear in the true traction: its
averaging kernel (Backus and Gilbert, Geophys. J. R. Astron. Soc. 16 (1968) 169) says how much of a traction anywhere it
takes up. At the nodes that is right, as far as the data determine it; between them, and just outside the contact, it
need not be. True tractions differ there from bilinear ones by no more than these change from node to node: that change,
its sign unknown in each cell, times what the kernel is wrong by there, is the error. Midway a bilinear traction is the
mean of its four nodes', so that one between the least and the largest of these differs from it by half of the change:
so much counts in a resultant where markers in contact show depth beside their motion along the surface. Else, as in the
plane alone, where the same data are to show the contact, and in an element's force all of it counts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipcore.forces.inverse.fit import TractionFit
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Unresolved:
    """Errors of one fit by tractions [3, c] midway between nodes, squared: of the ``wrench`` [4, 3 c], N² and (N m)²,
    and of the ``near`` [f] elements [3, f, 3 c] N²; no others are touched by these. ``corners`` [4, c] of each place:
    numbers of nodes of the fit, one beyond the last for those that it leaves out.
    """

    corners: NDArray[np.intp]
    near: NDArray[np.intp]
    wrench: FloatArray
    elements: FloatArray

    @classmethod
    def of(cls, sensor: SensorResponse, fit: TractionFit, all_shown: bool) -> "Unresolved":
        """Of a fit on a sensor whose markers in contact are all seen along all axes, or not."""
        count = int(fit.support.sum())
        number = np.full(fit.support.shape, count)
        number[fit.support] = np.arange(count)
        grid = number.reshape(sensor.nodes.grid.shape)
        corners = np.stack([part.ravel() for part in (grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:])])
        places = np.flatnonzero((corners < count).any(axis=0))
        over = sensor.elements_between[:, places]
        near = np.flatnonzero(over.any(axis=1))
        response = sensor.observed_between[:, :, places].reshape(len(sensor.observed), -1)
        operator = fit.operator.reshape(3, count, -1)
        whole = np.einsum("iac,acm->im", sensor.wrench()[..., fit.support], operator) @ response
        of_elements = sensor.elements[np.ix_(near, fit.support)] @ operator @ response
        for axis in range(3):
            own = slice(axis * len(places), (axis + 1) * len(places))
            whole[:, own] -= sensor.wrench(between=True)[:, axis, places]
            of_elements[axis, :, own] -= over[near]
        if all_shown:
            whole *= 0.5  # the most by which a traction between nodes differs from their mean, of their change
        return cls(corners[:, places], near, whole**2, of_elements**2)

    def deviations(self, traction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of near elements' forces [3, f] N and of the wrench [4], N and N m, by ``traction``
        [3, j].
        """
        padded = np.concatenate((traction, np.zeros((3, 1))), axis=1)
        squared = np.ptp(padded[:, self.corners], axis=1).ravel() ** 2
        return np.sqrt(self.elements @ squared), np.sqrt(self.wrench @ squared)
