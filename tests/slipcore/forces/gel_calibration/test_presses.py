"""What presses bound before a gel is sought: its thickness, and where the body is."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput
from slipcore.forces import Gel, calibrate_gel
from slipcore.forces.gel_calibration.calibrate import _thinnest
from slipcore.forces.gel_calibration.likelihood import Presses, _within
from slipcore.forces.operator.nodes import Nodes
from slipcore.forces.operator.response import response_matrix
from slipcore.forces.operator.uneven import UnevenLayer
from slipcore.forces.recording import OUTWARD


def test_no_gel_is_sought_that_is_not_a_pitch_thicker_than_its_markers_lie_deep() -> None:
    nodes = SimpleNamespace(grid=SimpleNamespace(pitch=(5e-4, 2e-4)))
    for uneven, least in ((None, 1.5e-3), (((0.5, 1.0), (1.0, 1.2)), 3e-3)):
        presses = SimpleNamespace(marker_depth=1e-3, nodes=nodes, relative_thickness=uneven)
        assert _thinnest(cast("Presses", presses)) == pytest.approx(least, rel=1e-12)


def test_a_body_is_looked_for_within_the_circle_on_which_markers_move_most() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    rim = 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1) + [0.5, 0.0]
    still = np.stack(np.meshgrid(np.linspace(-6.0, 6.0, 12), np.linspace(-6.0, 6.0, 12)), axis=-1).reshape(-1, 2)
    moved = np.concatenate([np.ones(len(rim)), np.zeros(len(still))])
    press = SimpleNamespace(data=np.stack([moved, 0.0 * moved]).ravel(), error=np.ones(2 * len(moved)))
    places = np.stack(np.meshgrid(np.arange(-4.0, 5.0), np.arange(-4.0, 5.0)), axis=-1).reshape(-1, 2)
    nodes = SimpleNamespace(places=lambda: places, grid=SimpleNamespace(shape=(9, 9)))
    presses = SimpleNamespace(position=np.concatenate([rim, still]), each=(press,), nodes=nodes)
    (inside,) = _within(cast("Presses", presses))
    np.testing.assert_array_equal(inside.ravel(), np.hypot(*(places - [0.5, 0.0]).T) <= 2.0)


def wedge_press() -> tuple[GraspLog, list[list[float]]]:
    """Of 3 N on a disk where a wedge of 4 mm, ν 0.49 and 1 MPa is thin, and its map."""
    line = 1e-3 * (np.arange(10) - 4.5)
    position = np.stack((*np.meshgrid(line, line, indexing="ij"), np.zeros((10, 10))), axis=-1)
    relative = 1.0 + 0.2 * position[..., 0] / 4.5e-3
    gel = Gel(1e6, 0.49, 4e-3, relative_thickness=tuple(map(tuple, relative.tolist())))
    place = position[..., :2].reshape(-1, 2)
    nodes = Nodes.around(place, 1e-6)
    away = np.hypot(*(nodes.places() - [-1.6e-3, 0.2e-3]).T) / 2.6e-3
    pressure = np.sqrt(np.maximum(1.0 - away**2, 0.0))
    pressure *= 3.0 / (nodes.area * pressure.sum())
    response = response_matrix(gel, nodes, place, UnevenLayer.of(gel, position))
    moved = (response[:, :, 2] @ pressure).T.reshape(position.shape) * OUTWARD
    shown = moved + 1e-6 * np.random.default_rng(9).standard_normal((2, *moved.shape))
    return GraspLog(np.array([0.0, 0.1]), position, shown, 1e-6), relative.tolist()


@pytest.mark.long
def test_a_map_of_thickness_counts_in_the_modulus() -> None:
    log, relative = wedge_press()
    by_map, alike = (
        calibrate_gel([log], [3.0], None, 0.49, 4e-3, noise=1e-6, relative_thickness=each) for each in (relative, None)
    )
    assert by_map.gel.young_modulus == pytest.approx(1e6, rel=0.005)
    assert abs(alike.gel.young_modulus / 1e6 - 1.0) > 0.05
    assert by_map.gel.relative_thickness == tuple(map(tuple, relative))
    assert alike.gel.relative_thickness is None


@pytest.mark.long
def test_the_thickness_that_a_map_refers_to_is_found() -> None:
    log, relative = wedge_press()
    found = calibrate_gel([log], [3.0], 1e6, 0.49, noise=1e-6, relative_thickness=relative)
    thickness = found.estimates[2]
    assert thickness.low < 4e-3 < thickness.high
    assert thickness.value == pytest.approx(4e-3, rel=0.02)
    assert thickness.note == ""


def test_a_map_that_no_gel_has_is_refused_by_name() -> None:
    log, relative = wedge_press()
    steep = [[1.0 + 0.35 * (k - 4.5) / 4.5] * 10 for k in range(10)]
    for given, thickness, name in (
        (relative[1:], None, "relative_thickness"),
        (relative, np.inf, "thickness"),
        (steep, 8e-3, "relative_thickness"),
        ([[0.3] * 10 if k < 5 else [3.0] * 10 for k in range(10)], None, "relative_thickness"),
    ):
        with pytest.raises(InvalidInput, match=name):
            calibrate_gel([log], [3.0], 1e6, 0.49, thickness, noise=1e-6, relative_thickness=given)
