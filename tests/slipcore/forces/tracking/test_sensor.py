"""What of a sensor no frame changes, by hand."""

from functools import cache

import numpy as np
import pytest

from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse, _least_motion, _observed

X, Y = np.meshgrid(1e-3 * np.arange(4), 1e-3 * np.arange(3), indexing="ij")


@cache
def sensor() -> SensorResponse:
    return SensorResponse.of(np.stack([X, Y, 0.0 * X], axis=-1), 1e-6, Gel(2e6, 0.45, 5e-3, 0.5e-3), (0, 1, 2))


def test_below_the_markers_stands_the_resultant_of_each_axis() -> None:
    response = np.arange(18.0).reshape(1, 2, 3, 3)
    found = _observed(response, 7.0)
    assert found.shape == (5, 3, 3)
    np.testing.assert_array_equal(found[1], response[0, 1])
    np.testing.assert_array_equal(found[2:, :, 1], 7.0 * np.eye(3))


def test_a_load_moves_markers_least_on_the_worst_node_or_on_all_alike() -> None:
    """Two markers and two nodes: 4 N on one, or 2 N on each."""
    response = np.zeros((2, 3, 2))
    response[:, 0] = [[3.0, 1.0], [4.0, 0.0]]  # on the second node 4 · 1
    response[:, 1] = [[3.0, -3.0], [0.0, 1.0]]  # on both 2 · (0, 1)
    response[:, 2] = [[1.0, 1.0], [0.0, 0.0]]
    np.testing.assert_allclose(_least_motion(response, 4.0), np.array([4.0, 2.0, 4.0]) / np.sqrt(2.0))


def test_forces_at_nodes_are_in_newtons_of_this_gel() -> None:
    """A traction of one Young's modulus on a node of 1 mm² is 2 N, all of which is observed as the resultant."""
    assert sensor().load == pytest.approx(2.0)
    np.testing.assert_allclose(sensor().observed[-1, 2], 2.0)
    assert not sensor().observed[-1, :2].any()
    assert sensor().observed.shape[0] == 3 * 12 + 3
    assert sensor().response.shape[0] == 36
    inside = sensor().elements.sum(axis=1)
    np.testing.assert_allclose(inside, 2.0)  # hats of equal height fill each element
    np.testing.assert_allclose(sensor().elements_between.sum(axis=1), 2.0)


def test_what_markers_do_not_show_is_up_to_the_noise_of_as_many_and_no_more_than_the_gel_bears() -> None:
    """36 coordinates: 5 √(2/36) of the noise's square."""
    level = np.sqrt(5.0 * np.sqrt(2.0 / 36.0))
    np.testing.assert_allclose(sensor().unnoticed(1e-9), sensor().most * 1e-9 * level / sensor().motion, rtol=1e-9)
    np.testing.assert_array_equal(sensor().unnoticed(1e3), np.full(3, sensor().most))


def test_data_end_with_what_is_known_of_the_resultant() -> None:
    known = KnownForce(np.array([np.nan, 2.0, 3.0]), np.array([1.0, 0.1, 0.2]))
    assert SensorResponse.data(np.array([5.0, 6.0]), known).tolist() == [5.0, 6.0, 0.0, 2.0, 3.0]
    observation = sensor().observation(np.full(36, 0.5), known)
    assert observation.noise[-4:].tolist() == [0.5, np.inf, 0.1, 0.2]


def test_depth_is_seen_of_markers_whose_z_is() -> None:
    noise = np.full(36, 1e-6)
    noise[24 + 5] = noise[3] = np.inf
    seen = sensor().depth_seen(sensor().observation(noise, KnownForce.of(None, None, 1)[0]))
    assert np.flatnonzero(~seen).tolist() == [5]
    assert sensor().sees_depth
