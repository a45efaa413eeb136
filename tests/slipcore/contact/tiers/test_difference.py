"""How far two logs are apart, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import FrictionLaw, GraspLog
from slipcore.contact.tiers.difference import Difference, difference
from slipcore.errors import InvalidInput
from slipcore.frames import GroundTruth


def log(scale: float, ratios: list[float]) -> GraspLog:
    """Two frames of 2 × 2 elements, of which one moves and bears; (3, 4, 0) has the length 5."""
    rest = np.stack([*np.meshgrid(*[1e-3 * np.arange(2.0)] * 2, indexing="ij"), np.zeros((2, 2))], axis=-1)
    moved = np.zeros((2, 2, 2, 3))
    moved[1, 0, 0] = [3e-6, 4e-6, 0.0]
    nothing = np.zeros((2, 2, 2), bool)
    truth = GroundTruth(nothing, nothing, nothing, np.array(ratios), FrictionLaw((0.5, 0.0, 0.0)))
    return GraspLog(np.array([0.0, 0.1]), rest, scale * moved, 1e-6, scale**2 * 1e4 * moved, truth=truth)


def test_a_log_is_as_far_from_a_reference_as_it_differs_relative_to_that() -> None:
    found = difference(log(1.1, [1.0, 0.7]), log(1.0, [1.0, 0.9]))
    assert found.stick_ratio == pytest.approx(0.2, rel=1e-12)
    assert found.displacement == pytest.approx(0.1, rel=1e-9)
    assert found.force == pytest.approx(0.21, rel=1e-9)
    assert found.largest == pytest.approx(0.21, rel=1e-9)
    assert difference(log(1.0, [1.0, 0.9]), log(1.1, [1.0, 0.7])).displacement == pytest.approx(0.1 / 1.1, rel=1e-9)


def test_frames_without_contact_have_no_stick_ratio_to_compare() -> None:
    assert difference(log(1.0, [np.nan, 0.5]), log(1.0, [np.nan, 0.75])).stick_ratio == 0.25
    assert difference(log(1.0, [np.nan, np.nan]), log(1.0, [1.0, np.nan])).stick_ratio == 0.0


def test_nothing_is_no_difference_from_nothing() -> None:
    assert difference(log(0.0, [1.0, 1.0]), log(0.0, [1.0, 1.0])) == Difference(0.0, 0.0, 0.0)


def test_differences_are_added_and_multiplied_part_by_part() -> None:
    one, other = Difference(0.1, 0.2, 0.3), Difference(0.4, 0.1, 0.05)
    assert one.plus(other) == Difference(0.1 + 0.4, 0.2 + 0.1, 0.3 + 0.05)
    assert one.times(2.0) == Difference(0.2, 0.4, 0.6)
    assert [each.largest for each in (one, other, Difference(0.0, 0.5, 0.1))] == [0.3, 0.4, 0.5]


@pytest.mark.parametrize("missing", ["truth", "force"])
@pytest.mark.parametrize("of_reference", [False, True])
def test_logs_without_truth_or_forces_are_not_compared(missing: str, of_reference: bool) -> None:
    whole = log(1.0, [1.0, 1.0])
    pair = [replace(whole, **{missing: None}), whole]
    with pytest.raises(InvalidInput, match="log is without truth or forces; allowed: a simulated log"):
        difference(*(pair[::-1] if of_reference else pair))
