import math

import numpy as np
import pytest
from scipy.stats import norm

from benchmarks.planned_force import Case, load_of, row, slips
from benchmarks.scatter import CONTACT, TRUTH, Kind


def test_who_knows_all_slips_as_often_as_asked() -> None:
    kind = Kind(0.07, 0.02, 0.03)
    for asked in (1e-2, 1e-3):
        assert slips(kind, load_of(kind, 4.0, asked), 4.0) == pytest.approx(asked, rel=1e-6)


def test_without_scatter_between_grasps_slip_is_normal() -> None:
    kind = Kind(0.0, 0.02, 0.03)
    mean = float(TRUTH @ [1.0, 0.0, 4.0 / CONTACT])
    deviation = math.hypot(0.02, 0.03) / math.sqrt(CONTACT)
    assert slips(kind, 4.0 * (mean - deviation), 4.0) == pytest.approx(float(norm.cdf(-1.0)), rel=1e-9)


def test_a_row_counts_what_was_not_answered() -> None:
    found = [Case(0, 3, 1e-2, force, slip) for force, slip in ((1.0, 1.0), (1.4, 0.5), (2.0, 0.0), (np.inf, np.nan))]
    assert row(found)[:6] == [0, 3, "0.01", "75.0", "50.0", pytest.approx(1.4)]
    assert row(found)[-1] == pytest.approx(0.5)
