"""Heights of points of the gel, where maps show those of places, to which points have come sideways."""

import numpy as np

from slipcore.forces.operator.gel import Gel
from slipcore.forces.operator.response import response_matrices
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.forces.recording import OUTWARD
from slipcore.frames import FloatArray, GraspLog
from slipcore.surface.strain import Lattice, lattice_steps


def at_points(log: GraspLog, gel: Gel, force: FloatArray) -> FloatArray:
    """Displacements [t, n, m, 3] m, x and y 0, of the points that rest where a log shows its heights, while these
    forces [t, n, m, 3] N press: what is shown where they have come to, to first order.

    A surface that is pressed in swells aside, up its own slope, so that heights of places make a contact look wider.
    Slopes are those that these forces make, which need no neighbour to be seen. What shear moves points by is not
    known, nor how far friction keeps them from swelling under the object.
    """
    place = log.position[..., :2].reshape(-1, 2)
    pitch, uneven = float(np.sqrt(log.element_area)), UnevenLayer.of(gel, log.position)
    (response,) = response_matrices(gel, pitch, [place], place, uneven=uneven)
    pressure = -force[..., 2].reshape(len(log), -1) / log.element_area
    moved = np.einsum("aje,te->tja", response[:, :, 2], pressure).reshape(*force.shape) * OUTWARD
    rows, columns = Lattice.at_rest(log.position).inverse_jacobian
    risen = log.displacement[..., 2].copy()
    for t, frame in enumerate(moved):
        along_rows, along_columns = lattice_steps(frame)[:, 2]
        x, y = along_rows * rows + along_columns * columns
        risen[t] += x * frame[..., 0] + y * frame[..., 1]
    return np.asarray(risen[..., None] * [0.0, 0.0, 1.0])
