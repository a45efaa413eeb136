"""Forces of one frame, and how well they are known."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from slipcore.forces.inverse.fit import ObservationModel, TractionFit, TractionPrior, fit
from slipcore.forces.inverse.prior import usual
from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking.frame_forces import FrameForces, Reader, _touching
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key
from slipcore.forces.tracking.unresolved import Unresolved
from slipcore.frames import FloatArray

PITCH = 1e-3
LINE = PITCH * (np.arange(9) - 4.0)
POSITION = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((9, 9))), axis=-1)


def test_contacts_that_are_as_probable_widen_what_is_said_by_how_much_forces_differ() -> None:
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1))
    observation = sensor.observation(np.full(len(sensor.response), 3e-6), KnownForce.of(None, None, 1)[0])

    def on(radius: float) -> TractionFit:
        disk = np.hypot(*sensor.nodes.places().T) < radius
        return fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.1))

    narrow, wide = on(2.1e-3), on(3.1e-3)
    data = observation.response[:, 2, wide.support].sum(axis=1) * 0.05
    alone = Key(observation, data, narrow)
    by_one = Reader.of(sensor, alone).read(data, (9, 9))
    by_both = Reader.of(sensor, replace(alone, others=((0.3, wide),))).read(data, (9, 9))
    np.testing.assert_array_equal(by_both.force, by_one.force)
    apart = sensor.load * (wide.mean(data).sum(axis=1) - narrow.mean(data).sum(axis=1))
    added = by_both.resultant_deviation**2 - by_one.resultant_deviation**2
    np.testing.assert_allclose(added, 0.3 * apart**2, rtol=1e-6, atol=1e-12)
    assert by_both.resultant_deviation[2] > 1.1 * by_one.resultant_deviation[2]
    elements = sensor.elements[:, wide.support] @ wide.mean(data).T - sensor.elements[:, narrow.support] @ (
        narrow.mean(data).T
    )
    added = by_both.deviation**2 - by_one.deviation**2
    np.testing.assert_allclose(added.reshape(-1, 3), 0.3 * elements**2, rtol=1e-6, atol=1e-12)
    moved_on = Reader.of(sensor, alone).read(data, (9, 9), wider=wide)
    np.testing.assert_array_equal(moved_on.force, by_one.force)
    added = moved_on.resultant_deviation**2 - by_one.resultant_deviation**2
    np.testing.assert_allclose(added, apart**2, rtol=1e-6, atol=1e-12)


def test_an_element_touches_whose_force_is_beyond_noise_and_not_little_beside_others() -> None:
    """Of a largest of 1: 0.06 is the least far from it, 0.15 beside it, and twice the deviation anywhere."""
    normal = np.array([[1.0, 0.16, 0.0], [0.14, 0.0, 0.0], [0.0, 0.05, 0.07]])
    deviation = np.full((3, 3), 0.03)
    touching = _touching(normal, deviation)
    assert np.argwhere(touching).tolist() == [[0, 0], [0, 1], [2, 2]]
    deviation[2, 2], deviation[0, 1] = 0.036, 0.079
    assert np.argwhere(_touching(normal, deviation)).tolist() == [[0, 0], [0, 1]]


def test_of_a_frame_that_shows_nothing_the_known_force_is_taken_by_its_share_of_the_variance() -> None:
    """Up to 3 N would not be noticed; 10 N to 4 N are known along z, and nothing along x and y."""
    known = KnownForce(np.array([np.nan, np.nan, 10.0]), np.full(3, 4.0))
    found = FrameForces.unnoticed((2, 1), np.array([1.0, 2.0, 3.0]), 0.4, known)
    np.testing.assert_allclose(found.resultant, [0.0, 0.0, -10.0 * 9.0 / 25.0])
    np.testing.assert_allclose(found.resultant_deviation, [1.0, 2.0, 3.0 * 4.0 / 5.0])
    np.testing.assert_array_equal(found.deviation, [[[1.0, 2.0, 3.0]]] * 2)
    assert (found.moment, found.moment_deviation) == (0.0, 0.4)
    assert not found.force.any()
    assert not found.contact.any()


def test_a_fit_holds_while_data_move_by_little_more_than_the_noise_of_both() -> None:
    """A tenth of (60, 80) over the noise is 10; of two data twice their noise adds 4: 10² + 4."""
    observation = ObservationModel(np.zeros((3, 3, 1)), np.array([2.0, 2.0, np.inf]))
    key = Key(observation, np.array([120.0, 160.0, 0.0]), cast("TractionFit", None))
    for change, holds in ((2.0 * np.sqrt(103.9), True), (2.0 * np.sqrt(104.1), False)):
        assert key.holds(observation, np.add(key.data, [change, 0.0, 0.0])) == holds
    assert not key.holds(ObservationModel(np.zeros((3, 3, 1)), np.array([2.0, np.inf, np.inf])), key.data)
    assert not key.holds(observation, key.data[:2])


def test_a_resultant_is_as_sure_as_noise_and_the_change_between_nodes_leave_it() -> None:
    """Of a press without shear to 1e-4 along the surface: no share of it is unsure by itself."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49), (0, 1, 2))
    observation = sensor.observation(np.full(len(sensor.response), 1e-7), KnownForce.of(None, None, 1)[0])
    away = np.hypot(*sensor.nodes.places().T) / 3.6e-3
    fitted = fit(observation, sensor.nodes, away < 1.0, TractionPrior(usual(), 0.1))
    pressure = 0.05 * (1.0 - away[away < 1.0] ** 2)
    data = observation.response[:, 2, fitted.support] @ pressure
    found = Reader.of(sensor, Key(observation, data, fitted)).read(data, (9, 9))
    total = sensor.load * pressure.sum()
    assert abs(found.resultant[2] + total) < found.resultant_deviation[2] < 3e-3 * total
    assert (found.resultant_deviation[:2] < 2e-4 * total).all()


@pytest.mark.parametrize(("lost", "wider"), [(0, False), (40, True)])
def test_a_marker_in_contact_whose_depth_is_not_seen_leaves_the_contact_less_sure(lost: int, wider: bool) -> None:
    """Of 9 × 9 markers the first lies in a corner, the one numbered 40 in the middle of the contact."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1, 2))
    noise = np.full(len(sensor.response), 1e-6)
    noise[2 * 81 + lost] = np.inf
    observation = sensor.observation(noise, KnownForce.of(None, None, 1)[0])
    disk = np.hypot(*sensor.nodes.places().T) < 2.1e-3
    key = Key(observation, np.zeros(len(noise) + 3), fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.1)))
    found, shown = Reader.of(sensor, key).unresolved, Unresolved.of(sensor, key.fit, all_shown=True)
    np.testing.assert_allclose(found.wrench, (4.0 if wider else 1.0) * shown.wrench, rtol=1e-12)


def test_depth_alone_leaves_a_resultant_as_unsure_as_the_whole_change_between_nodes() -> None:
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 2e-3), (2,))
    observation = sensor.observation(np.full(len(sensor.response), 1e-6), KnownForce.of(None, None, 1)[0])
    disk = np.hypot(*sensor.nodes.places().T) < 2.1e-3
    key = Key(observation, np.zeros(84), fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.1)))
    whole = Unresolved.of(sensor, key.fit, all_shown=False)
    np.testing.assert_allclose(Reader.of(sensor, key).unresolved.wrench, whole.wrench, rtol=1e-12)


def test_forces_averaged_alike_show_the_friction_with_which_all_slips_up_to_the_rim() -> None:
    """Shear and pressure of one shape, by noise that smooths them unlike each other."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1, 2))
    observation = sensor.observation(np.full(len(sensor.response), 20e-6), KnownForce.of(None, None, 1)[0])
    radius = np.hypot(*sensor.nodes.places().T) / 3.2e-3
    touching = radius < 1.0
    pressure = 0.05 * np.sqrt(1.0 - radius[touching] ** 2)
    shear = 0.4 * np.multiply.outer([0.6, -0.8], pressure)
    data = observation.response[:, :, touching].reshape(len(observation.noise), -1) @ np.append(shear, pressure)
    key = Key(observation, data, fit(observation, sensor.nodes, touching, TractionPrior(usual(), 0.03)))
    found = Reader.of(sensor, key).read(data, (9, 9))

    rim = found.contact & (np.hypot(POSITION[..., 0], POSITION[..., 1]) > 2.1e-3)

    def friction(force: FloatArray) -> float:
        return float(np.mean(np.hypot(force[rim, 0], force[rim, 1]) / -force[rim, 2]))

    assert friction(found.force) < 0.4 * 0.97
    assert friction(found.alike) == pytest.approx(0.4, rel=0.005)
    total, alike = (np.abs(force[..., 2]).sum() for force in (found.force, found.alike))
    assert alike == pytest.approx(total, rel=0.05)


def test_nothing_unnoticed_turns_by_more_than_the_largest_arm_of_what_is_unnoticed() -> None:
    moved = POSITION + np.array([2e-3, -1e-3, 0.0])
    sensor = SensorResponse.of(moved, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1))
    along_x, along_y, _ = sensor.unnoticed(1e-6)
    assert sensor.unnoticed_moment(1e-6) == pytest.approx(np.hypot(5e-3 * along_x, 6e-3 * along_y))


@pytest.mark.parametrize(
    ("axes", "thickness", "touches"), [((0, 1), 5e-3, True), ((0, 1), np.inf, True), ((0, 1, 2), 5e-3, False)]
)
def test_in_the_plane_what_bears_shear_touches_whatever_its_pressure(
    axes: tuple[int, ...], thickness: float, touches: bool
) -> None:
    """Shear alone, on a disk; with depth seen, pressure is known that well itself."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, thickness), axes)
    observation = sensor.observation(np.full(len(sensor.response), 1e-6), KnownForce.of(None, None, 1)[0])
    disk = np.hypot(*sensor.nodes.places().T) < 2.6e-3
    data = observation.response[:, 0, disk].sum(axis=1) * 0.02
    key = Key(observation, data, fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.02)))
    found = Reader.of(sensor, key).read(data, (9, 9))
    distance = np.hypot(POSITION[..., 0], POSITION[..., 1])
    assert found.contact[distance < 2.1e-3].all() == touches
    assert not found.contact[distance > 3.7e-3].any()
    assert found.contact.any() == touches


@pytest.mark.parametrize(("of_shear", "of_pressure", "beside"), [(0.01, 0.5, False), (0.1, 0.01, True)])
def test_the_contact_in_the_plane_is_by_what_is_surer_of_shear_and_pressure(
    of_shear: float, of_pressure: float, beside: bool
) -> None:
    """Nine elements are pressed, the middle one of which bears no shear, as where an object turns; and one aside."""
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1))
    observation = sensor.observation(np.full(len(sensor.response), 1e-6), KnownForce.of(None, None, 1)[0])
    disk = np.hypot(*sensor.nodes.places().T) < 3.7e-3
    key = Key(observation, np.zeros(165), fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.02)))
    force, expected = np.zeros((9, 9, 3)), np.zeros((9, 9), dtype=bool)
    force[3:6, 3:6] = [0.1, 0.0, -1.0]
    force[4, 4, 0] = 0.0
    force[4, 7, 2] = -1.0
    expected[3:6, 3:6] = True
    expected[4, 7] = beside
    deviation = np.broadcast_to([of_shear, of_shear, of_pressure], force.shape)
    nothing = np.zeros((3, 9, 9))
    np.testing.assert_array_equal(Reader.of(sensor, key)._contact(force, deviation, nothing), expected)
