"""What presses bound before a gel is sought: its thickness, and where the body is."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from slipcore.forces.gel_calibration.calibrate import _thinnest
from slipcore.forces.gel_calibration.likelihood import Presses, _within


def test_no_gel_is_sought_that_is_not_a_pitch_thicker_than_its_markers_lie_deep() -> None:
    presses = SimpleNamespace(marker_depth=1e-3, nodes=SimpleNamespace(grid=SimpleNamespace(pitch=(5e-4, 2e-4))))
    assert _thinnest(cast("Presses", presses)) == pytest.approx(1.5e-3, rel=1e-12)


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
