import math

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.estimators.scatter import CONTACT, TRUTH, Kind
from benchmarks.planner.planned_force import Case, Step, load_of, nested_row, row, slips, steps


def test_who_knows_all_slips_as_often_as_asked() -> None:
    kind = Kind(0.07, 0.02, 0.03)
    for asked in (1e-2, 1e-3):
        assert slips(kind, load_of(kind, 4.0, asked), 4.0) == pytest.approx(asked, rel=1e-6)


def test_where_grasps_without_friction_are_more_frequent_than_asked_no_load_is_held() -> None:
    """The factor 1 + 0.39 z is below 0 in 5 of 1000 grasps."""
    kind = Kind(0.39, 0.02, 0.03, normal=True)
    assert load_of(kind, 4.0, 1e-3) == 0.0
    assert load_of(kind, 4.0, 1e-2) > 0.0


def test_without_scatter_between_grasps_slip_is_normal() -> None:
    kind = Kind(0.0, 0.02, 0.03)
    mean = float(TRUTH @ [1.0, 0.0, 4.0 / CONTACT])
    deviation = math.hypot(0.02, 0.03) / math.sqrt(CONTACT)
    assert slips(kind, 4.0 * (mean - deviation), 4.0) == pytest.approx(float(norm.cdf(-1.0)), rel=1e-9)


def test_a_row_counts_what_was_not_answered() -> None:
    found = [Case(0, 3, 1e-2, force, slip) for force, slip in ((1.0, 1.0), (1.4, 0.5), (2.0, 0.0), (np.inf, np.nan))]
    assert row(found)[:6] == [0, 3, "0.01", "75.0", "50.0", pytest.approx(1.4)]
    assert row(found)[-1] == pytest.approx(0.5)


def test_steps_that_lose_answers_are_counted_with_what_was_named() -> None:
    came = [
        Step(2, 20, 0, 0, 0.0, fell=False, named=False, newest=False),
        Step(3, 20, 5, 2, 12.0, fell=True, named=True, newest=True),
        Step(4, 10, 1, 1, 3.0, fell=False, named=False, newest=False),
        Step(5, 20, 20, 9, 9.0, fell=True, named=True, newest=True),
    ]
    told = ["2 to 4", 3, "12.00", "3 of 6", "2.5", "66.67", "1 of 2", "33.33", "1 of 1", 1]
    assert nested_row(2, 4, came) == told


@pytest.mark.long
def test_a_material_is_followed_log_by_log() -> None:
    found = steps(0, 0.05)
    assert [each.logs for each in found] == list(range(1, 20))
    assert all(each.light <= each.vanished <= each.answered <= 20 for each in found)
