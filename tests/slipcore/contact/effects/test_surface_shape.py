"""The gap that each surface of an object adds, m, against its formula by hand."""

import re
from collections.abc import Callable
from dataclasses import replace
from math import inf, nan, pi, sqrt

import numpy as np
import pytest

from slipcore.contact.effects import (
    CylinderSurface,
    FlatSurface,
    MeasuredSurface,
    RingSurface,
    SphereSurface,
    WavySurface,
)
from slipcore.contact.plan.plan import Effect
from slipcore.contact.scene import Scene
from slipcore.errors import InvalidInput

MAP = ((0.0, 1e-6, 4e-6), (2e-6, 5e-6, 6e-6))
"""Rows along y, so that x is 2 mm from end to end at a pitch of 1 mm, and y 1 mm."""


def gap(effect: Effect, x: float, y: float) -> float:
    """What the effect adds to the gap at a place."""
    height = effect.extend(Scene("flat").plan()).problem.heights[-1]
    return float(height(np.array([x]), np.array([y]))[0])


@pytest.mark.parametrize(
    ("effect", "x", "y", "expected"),
    [
        (SphereSurface(50.0), 3e-3, 4e-3, 0.5 * 50.0 * 25e-6),
        (SphereSurface(-50.0), 3e-3, 4e-3, -0.5 * 50.0 * 25e-6),
        (CylinderSurface(50.0), 3e-3, 4e-3, 0.5 * 50.0 * 16e-6),
        (CylinderSurface(50.0, pi / 2), 3e-3, 4e-3, 0.5 * 50.0 * 9e-6),
        (CylinderSurface(50.0, pi / 4), 3e-3, 3e-3, 0.0),
        (CylinderSurface(50.0, pi / 4), 3e-3, -3e-3, 0.5 * 50.0 * 18e-6),
        (RingSurface(4e-3, 2e-3), 0.0, 4e-3, 0.0),
        (RingSurface(4e-3, 2e-3), 0.0, 0.0, 0.5 / 2e-3 * 16e-6),
        (RingSurface(4e-3, 2e-3), 3e-3, 4e-3, 0.5 / 2e-3 * 1e-6),
        (WavySurface(2e-6, 3e-3), 0.5e-3, 7e-3, 2e-6 * (1.0 - 0.5)),
        (WavySurface(2e-6, 3e-3, pi / 2), 7e-3, 1.5e-3, 4e-6),
        (WavySurface(2e-6, 3e-3, pi / 4), 1.5e-3 / sqrt(2.0), 1.5e-3 / sqrt(2.0), 4e-6),
    ],
    ids=repr,
)
def test_a_gap_is_that_of_its_formula(effect: Effect, x: float, y: float, expected: float) -> None:
    assert gap(effect, x, y) == pytest.approx(expected, rel=1e-12, abs=1e-20)


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [
        (3e-3, 4e-3, True),  # the corner itself
        (-1e-3, 0.0, True),
        (3.001e-3, 1e-3, False),
        (-1.001e-3, 1e-3, False),
        (1e-3, 4.001e-3, False),
        (1e-3, -0.001e-3, False),
    ],
)
def test_a_face_about_its_centre_ends_at_its_edges(x: float, y: float, inside: bool) -> None:
    assert gap(FlatSurface((4e-3, 4e-3), centre=(1e-3, 2e-3)), x, y) == (0.0 if inside else inf)


def test_a_face_may_be_endless_one_way() -> None:
    strip = FlatSurface((inf, 2e-3))
    assert not strip.absent
    assert gap(strip, 1.0, 1e-3) == 0.0
    assert gap(strip, 0.0, 1.001e-3) == inf


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (-1e-3, -0.5e-3, 0.0),
        (1e-3, -0.5e-3, 4e-6),
        (-1e-3, 0.5e-3, 2e-6),
        (0.0, 0.5e-3, 5e-6),
        (0.0, 0.0, 3e-6),  # of 1 and 5
        (-0.75e-3, -0.25e-3, 0.75 * 0.25e-6 + 0.25 * (0.75 * 2e-6 + 0.25 * 5e-6)),
        (1.001e-3, 0.0, inf),
        (0.0, -0.501e-3, inf),
    ],
)
def test_a_map_is_bilinear_about_its_centre_with_nothing_beyond(x: float, y: float, expected: float) -> None:
    assert gap(MeasuredSurface(MAP, 1e-3), x, y) == pytest.approx(expected, rel=1e-9, abs=1e-18)


@pytest.mark.parametrize("effect", [SphereSurface(20.0), CylinderSurface(20.0, 0.3), MeasuredSurface(MAP, 1e-3)])
def test_a_surface_is_added_to_those_before_and_changes_nothing_else(effect: Effect) -> None:
    plan = Scene("flat").plan()
    extended = effect.extend(plan)
    assert extended.problem.heights[:-1] == plan.problem.heights
    assert replace(extended, problem=plan.problem) == plan
    assert len(plan.problem.heights) == 1


@pytest.mark.parametrize(
    ("effect", "absent"),
    [
        (SphereSurface(0.0), True),
        (SphereSurface(-1e-9), False),
        (CylinderSurface(0.0, 1.0), True),
        (CylinderSurface(1e-9), False),
        (FlatSurface((inf, inf)), True),
        (FlatSurface((1.0, inf)), False),
        (RingSurface(1.0, inf), True),
        (RingSurface(1.0, 1e9), False),
        (WavySurface(0.0, 1.0), True),
        (WavySurface(-1e-9, 1.0), False),
        (MeasuredSurface(((0.0, 0.0), (0.0, 0.0)), 1e-3), False),
    ],
    ids=repr,
)
def test_only_what_adds_no_gap_anywhere_is_absent(effect: Effect, absent: bool) -> None:
    assert effect.absent is absent


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FlatSurface((1e-3, 0.0)), "width of the face is (0.001, 0.0); allowed: above 0 m"),
        (lambda: FlatSurface((-1e-3, 1.0)), "width of the face is (-0.001, 1.0)"),
        (lambda: FlatSurface((nan, 1.0)), "width of the face is (nan, 1.0)"),
        (lambda: RingSurface(0.0, 1e-3), "radii above 0 m"),
        (lambda: RingSurface(1e-3, 0.0), "radii above 0 m"),
        (lambda: WavySurface(1e-6, -1e-3), "wavelength is -0.001; allowed: above 0 m"),
        (lambda: MeasuredSurface(((0.0, 0.0),), 1e-3), "a rectangle of at least 2 × 2"),
        (lambda: MeasuredSurface(((0.0,), (0.0,)), 1e-3), "a rectangle of at least 2 × 2"),
        (
            lambda: MeasuredSurface(((0.0, 0.0), (0.0, 0.0, 0.0)), 1e-3),
            "heights of MeasuredSurface is 3 long in row 1",
        ),
        (lambda: MeasuredSurface(((0.0, inf), (0.0, 0.0)), 1e-3), "finite heights, m"),
        (lambda: MeasuredSurface(MAP, 0.0), "pitch of the map is 0.0; allowed: above 0 m"),
    ],
)
def test_an_impossible_surface_is_refused_by_name_and_value(make: Callable[[], Effect], message: str) -> None:
    with pytest.raises(InvalidInput, match=re.escape(message)):
        make()
