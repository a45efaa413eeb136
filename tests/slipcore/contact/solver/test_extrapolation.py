"""Stresses extrapolated against the closed form of a moving slip front."""

import numpy as np
import pytest

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.solver.extrapolation import Stress, continuation, extrapolated

GRID = Grid.square(40, 2.2)


def sheared(stick: float, angle: float = 0.3, raised: float = 1.0) -> Stress:
    """Cattaneo–Mindlin for contact radius 1 and a stick radius, μ = 0.5."""
    r = np.hypot(*GRID.points())
    pressure = raised * np.sqrt(np.maximum(1.0 - r**2, 0.0))
    limit = 0.5 * pressure
    size = limit - 0.5 * raised * np.sqrt(np.maximum(stick**2 - r**2, 0.0))
    return Stress(pressure, np.stack((np.cos(angle) * size, np.sin(angle) * size)), limit)


def test_a_front_that_moves_on_evenly_is_extrapolated_to_rounding() -> None:
    before, now, after = (sheared(np.sqrt(square)) for square in (0.75, 0.6, 0.45))
    np.testing.assert_allclose(extrapolated(now, before, 1.0).traction, after.traction, rtol=0.0, atol=1e-12)
    straight = now.traction + (now.traction - before.traction)
    assert np.abs(straight - after.traction).max() > 0.05  # what extrapolating the traction would miss


def test_nothing_goes_on_without_a_share() -> None:
    before, now = sheared(0.9), sheared(0.7, angle=0.5)
    same = extrapolated(now, before, 0.0)
    for field, expected in zip(same, now, strict=True):
        np.testing.assert_allclose(field, expected, rtol=0.0, atol=1e-15)


def test_pressure_and_limits_go_on_and_never_pull() -> None:
    before, now = sheared(0.8), sheared(0.8, raised=0.4)
    coming = extrapolated(now, before, 1.0)
    assert (coming.pressure == 0.0).all()
    assert (coming.limit == 0.0).all()
    np.testing.assert_allclose(
        extrapolated(sheared(0.8, raised=1.2), before, 1.0).pressure, sheared(0.8, raised=1.4).pressure, rtol=1e-12
    )


def test_a_reversed_traction_goes_through_zero() -> None:
    before, now = sheared(0.7), sheared(0.97)
    coming = extrapolated(now, before, 1.0)
    middle = (slice(18, 22), slice(18, 22))
    assert (now.traction[0][middle] > 0.0).all()
    assert (coming.traction[0][middle] < 0.0).all()


@pytest.mark.parametrize(
    ("before", "drive", "share"),
    [
        ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0),
        ([1.0, 0.0, 0.0], [0.5, 3.0, 0.0], 0.5),
        ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.0),
        ([0.1, 0.0, 0.0], [9.0, 0.0, 0.0], 2.0),
        ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.0),
    ],
)
def test_load_goes_on_along_itself_only(before: list[float], drive: list[float], share: float) -> None:
    assert continuation(np.array(before), np.array(drive)) == pytest.approx(share)
