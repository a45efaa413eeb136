"""What tractions that are bilinear between nodes leave wrong."""

import numpy as np
import pytest

from slipcore.forces.inverse.fit import TractionFit, TractionPrior, fit
from slipcore.forces.inverse.prior import usual
from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.unresolved import Unresolved

PITCH = 1e-3
LINE = PITCH * (np.arange(9) - 4.0)
POSITION = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((9, 9))), axis=-1)


def contact(sensor: SensorResponse, radius: float = 2.6e-3) -> TractionFit:
    """A fit on a disk, of markers with 1 µm of noise."""
    unknown = KnownForce.of(None, None, 1)[0]
    observation = sensor.observation(np.full(len(sensor.response), 1e-6), unknown)
    disk = np.hypot(*sensor.nodes.places().T) < radius
    return fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.1))


def sensor(thickness: float, axes: tuple[int, ...] = (0, 1, 2)) -> SensorResponse:
    return SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, thickness), axes)


def test_errors_are_those_of_forces_found_from_what_tractions_between_nodes_move() -> None:
    seen = sensor(3e-3)
    found = contact(seen)
    errors = Unresolved.of(seen, found, all_shown=True)
    midway, touching = seen.nodes.between.places(), seen.nodes.places()[found.support]
    beside = np.flatnonzero((np.abs(midway[:, None] - touching).max(axis=2) < PITCH).any(axis=1))
    for axis, place in ((0, [0.5e-3, 0.5e-3]), (2, [0.5e-3, -1.5e-3]), (2, [2.5e-3, 0.5e-3])):
        at = int(np.argmin(np.hypot(*(midway - place).T)))
        traction = found.operator @ seen.observed_between[:, axis, at]
        x, y = touching.T
        wrench = seen.load * np.append(traction.reshape(3, -1).sum(axis=1), 0.0)
        wrench[axis] -= seen.load
        wrench[3] = seen.load * (np.concatenate((-y, x, 0.0 * x)) @ traction)
        wrench[3] -= seen.load * (-midway[at, 1], midway[at, 0], 0.0)[axis]
        elements = traction.reshape(3, -1) @ seen.elements[:, found.support].T
        elements[axis] -= seen.elements_between[:, at]
        column = axis * len(beside) + int(np.flatnonzero(beside == at)[0])
        half = 0.5 * np.abs(wrench)
        np.testing.assert_allclose(np.sqrt(errors.wrench[:, column]), half, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(
            np.sqrt(errors.elements[:, :, column]), np.abs(elements[:, errors.near]), rtol=1e-6, atol=1e-9
        )


def test_a_traction_that_is_the_same_everywhere_is_resolved_but_for_the_rim() -> None:
    seen = sensor(3e-3)
    found = contact(seen)
    errors = Unresolved.of(seen, found, all_shown=True)
    flat = np.zeros((3, int(found.support.sum())))
    flat[2] = 0.01
    rim = (errors.corners == flat.shape[1]).any(axis=0)
    expected = 0.01 * np.sqrt(errors.wrench[2].reshape(3, -1)[2, rim].sum())
    assert errors.deviations(flat)[1][2] == pytest.approx(expected)
    assert 0 < rim.sum() < rim.size
    assert not errors.deviations(0.0 * flat)[1].any()


def test_coarse_markers_beside_the_thickness_leave_more_of_a_force_open() -> None:
    shares = []
    for thickness in (2e-3, 5e-3, np.inf):
        seen = sensor(thickness)
        found = contact(seen)
        away = np.hypot(*seen.nodes.places()[found.support].T) / 3e-3
        traction = np.zeros((3, len(away)))
        traction[2] = 0.05 * np.sqrt(1.0 - away**2)
        shares.append(
            Unresolved.of(seen, found, all_shown=True).deviations(traction)[1][2] / (seen.load * traction[2].sum())
        )
    assert shares[0] > 2.0 * shares[1] > 4.0 * shares[2]


def test_where_all_is_seen_a_resultant_is_wrong_by_half_of_what_it_could_be_else() -> None:
    seen = sensor(3e-3)
    found = contact(seen)
    flat = np.full((3, int(found.support.sum())), 0.01)
    shown, hidden = (Unresolved.of(seen, found, all_shown=each).deviations(flat) for each in (True, False))
    np.testing.assert_allclose(shown[1], 0.5 * hidden[1], rtol=1e-12)
    np.testing.assert_array_equal(shown[0], hidden[0])
