"""Loads, their sharing and the densities of what elements take, by hand."""

import numpy as np
import pytest
from scipy import stats

from slipcore.defaults import NUMERICS, ForcesOnlyOptions
from slipcore.detection.forces_only.sharing import (
    Loads,
    Sharing,
    compare,
    evenly,
    log_density,
    ratios,
    sideways,
    slip_density,
    stick_density,
)
from slipcore.detection.forces_only.tuning import considered, forces_tuning

OPTIONS = forces_tuning(considered(ForcesOnlyOptions()).settings)


def two(*along: float) -> Loads:
    """Two elements of 1 N and 3 N, 4 mm apart: their centre is 3 mm from the first."""
    tangential = np.zeros((2, 3))
    tangential[:, 0] = along
    return Loads(np.array([[0.0, 0.0], [4e-3, 0.0]]), np.array([1.0, 3.0]), tangential)


def test_a_ratio_is_that_of_the_length_of_the_force_and_finite_without_pressure() -> None:
    tangential = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]])
    ratio = ratios(Loads(np.zeros((3, 2)), np.array([10.0, 4.0, 0.0]), tangential))
    np.testing.assert_allclose(ratio[:2], [0.5, 0.5], rtol=1e-12)
    assert ratio[2] == pytest.approx(1.0 / NUMERICS.least_element_force, rel=1e-12)


def test_a_force_across_the_arm_turns_and_one_along_it_does_not() -> None:
    np.testing.assert_allclose(evenly(two(0.4, 0.4)), [[0.2, 0.0, 0.0], [0.2, 0.0, 0.0]], rtol=1e-12, atol=1e-15)
    across = two(0.0, 0.0)._replace(tangential=np.array([[0.0, 0.5, 0.1], [0.0, 0.7, 0.3]]))
    # Σr × f = −3 mm · 0.5 N + 1 mm · 0.7 N over Σp r² = (9 + 3) N mm²
    turn = -0.8e-3 / 12e-6
    expected = [[0.0, 0.3 + turn * -3e-3, 0.1], [0.0, 0.3 + turn * 1e-3, 0.1]]
    np.testing.assert_allclose(evenly(across), expected, rtol=1e-6)


def test_a_change_counts_by_its_sum_and_by_its_moment_over_the_radius_of_gyration() -> None:
    before, gyration = two(0.1, 0.2), np.sqrt(12e-6 / 4.0)
    for change, size in (
        ([[0.0, 0.5, 0.0], [0.0, 0.7, 0.0]], np.hypot(1.2, 0.8e-3 / gyration)),
        ([[0.3, 0.0, 0.0], [0.1, 0.0, 0.3]], 0.5),
    ):
        now = before._replace(tangential=before.tangential + change)
        assert sideways(before, now) == pytest.approx(size, rel=1e-6)


def test_what_elements_take_is_told_over_what_they_should_with_its_noise() -> None:
    """The first bears twice its even share, the second two thirds; the load grows by a tenth, to the second alone."""
    before, now = two(0.4, 0.4), two(0.4, 0.48)
    seen = compare(before, now, 0.01, OPTIONS)
    np.testing.assert_allclose(seen.ratio, [0.4, 0.16], rtol=1e-12)
    np.testing.assert_allclose(seen.expected, [0.02, 0.02], rtol=1e-9)
    share = np.array([0.4, 0.16]) / 0.22
    np.testing.assert_allclose(seen.part, [0.0, (0.16 - 0.4 / 3.0) / (0.02 * share[1])], rtol=1e-9, atol=1e-12)
    deviation = 0.01 * np.sqrt(1.0 + np.array([0.16, 0.0256])) / [1.0, 3.0]
    np.testing.assert_allclose(seen.deviation, deviation, rtol=1e-12)
    np.testing.assert_allclose(seen.part_deviation, np.sqrt(2.0) * deviation / (0.02 * share), rtol=1e-9)
    assert seen.falls.tolist() == [False, False]
    assert compare(now, before, 0.0, OPTIONS).falls.tolist() == [False, True]
    assert (compare(now, before, 0.0, OPTIONS).expected < 0.0).all()


def test_shares_and_changes_that_are_too_small_are_bounded() -> None:
    """At a share of the least kind the change is divided by that; nothing changes by less than the least change."""
    before, now = two(1e-6, 0.8), two(1e-6, 0.88)
    seen = compare(before, now, 0.0, OPTIONS)
    assert seen.expected[0] == pytest.approx(0.02, rel=1e-3)
    assert seen.part[1] == pytest.approx(0.08 / 3.0 / (0.02 * (0.88 / 3.0) / 0.22), rel=1e-3)
    still = compare(before, two(1e-6 + 1e-4, 0.8), 0.0, OPTIONS)
    assert still.part[0] == pytest.approx(1e-4 / OPTIONS.least_change, rel=1e-6)


def test_a_density_is_the_normals_up_to_a_constant() -> None:
    x, mean, deviation = np.array([0.3, -1.0, 2.0]), np.array([0.0, 1.0, 2.0]), np.array([0.5, 2.0, 1.0])
    exact = stats.norm(mean, deviation).logpdf(x) + 0.5 * np.log(2.0 * np.pi)
    found = [log_density(*each) for each in zip(x, mean, deviation, strict=True)]
    np.testing.assert_allclose(found, exact, rtol=1e-12, atol=1e-15)


def seen(part: list[float], ratio: list[float], noise: float = 0.3) -> Sharing:
    count = len(part)
    deviations = np.full(count, noise)
    zeros = np.zeros(count)
    return Sharing(np.array(ratio), deviations, np.array(part), deviations, zeros, np.zeros(count, bool))


def normal(x: np.ndarray, mean: np.ndarray | float, spread: float) -> np.ndarray:
    return np.asarray(np.sqrt(2.0 * np.pi) * stats.norm(mean, np.hypot(spread, 0.3)).pdf(x))


def test_sticking_elements_take_as_before_or_more_or_anything() -> None:
    part = np.array([0.0, 1.0, OPTIONS.overload, 7.0])
    mixed = (1.0 - OPTIONS.overload_share) * normal(part, 1.0, OPTIONS.part_spread)
    mixed += OPTIONS.overload_share * normal(part, OPTIONS.overload, OPTIONS.overload_spread)
    expected = (1.0 - OPTIONS.outlier_share) * mixed + OPTIONS.outlier_share * normal(part, 1.0, 1.0)
    found = stick_density(seen(part.tolist(), [0.1] * 4), OPTIONS)
    np.testing.assert_allclose(found, np.log(expected), rtol=1e-9)


def test_slipping_elements_take_less_the_nearer_they_are_to_friction_and_nothing_beyond() -> None:
    part, ratio, friction = np.array([0.2, 0.2, 0.2]), np.array([0.2, 0.36, 0.5]), np.array([0.4, 0.8])
    left = np.maximum(1.0 - ratio / friction[:, None], 0.0)
    np.testing.assert_allclose(left[0], [0.5, 0.1, 0.0], rtol=1e-12, atol=1e-15)
    taken = normal(part, OPTIONS.slip_part * left**OPTIONS.slip_exponent, OPTIONS.slip_part_spread)
    expected = (1.0 - OPTIONS.outlier_share) * taken + OPTIONS.outlier_share * normal(part, 1.0, 1.0)
    found = slip_density(seen(part.tolist(), ratio.tolist()), friction, OPTIONS)
    np.testing.assert_allclose(found, np.log(expected), rtol=1e-9)
