"""Creep of a Maxwell branch, ẇ = (c e − w)/τ, against its solution where e is held or grows evenly."""

import math

import numpy as np
import pytest

from slipcore.contact.solver.creep import creep_compliance, creep_recalled, creep_step
from slipcore.contact.solver.problem import MaxwellBranch
from slipcore.errors import InvalidInput

BRANCH = MaxwellBranch(strength=0.6, time=2.0)
FAST = MaxwellBranch(strength=0.3, time=0.1)


def field(value: float) -> np.ndarray:
    return np.full((3, 1, 2), value)


@pytest.mark.parametrize("duration", [1e-3, 0.5, 2.0, 50.0])
def test_under_what_is_held_a_branch_nears_its_share_of_it_exponentially(duration: float) -> None:
    (after,) = creep_step([BRANCH], [field(0.1)], field(1.0), field(1.0), duration)
    left = math.exp(-duration / 2.0)
    np.testing.assert_allclose(after, 0.6 + (0.1 - 0.6) * left, rtol=1e-12)


@pytest.mark.parametrize("duration", [0.05, 2.0, 9.0])
def test_under_what_grows_evenly_a_branch_lags(duration: float) -> None:
    """w = c k (t − τ (1 − e^(−t/τ))), from rest."""
    (after,) = creep_step([BRANCH], [field(0.0)], field(0.0), field(3.0 * duration), duration)
    expected = 0.6 * 3.0 * (duration - 2.0 * -math.expm1(-duration / 2.0))
    np.testing.assert_allclose(after, expected, rtol=1e-9)  # short steps: small differences of the weights


def test_a_step_is_as_two_halves_of_it() -> None:
    middle = creep_step([BRANCH, FAST], [field(0.2), field(0.05)], field(1.0), field(1.5), 0.4)
    halves = creep_step([BRANCH, FAST], middle, field(1.5), field(2.0), 0.4)
    whole = creep_step([BRANCH, FAST], [field(0.2), field(0.05)], field(1.0), field(2.0), 0.8)
    for one, other in zip(halves, whole, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_what_is_recalled_and_what_is_softer_add_up_to_the_step() -> None:
    """At its end the surface has moved by e + Σ w: by what is recalled, and by the compliance times e."""
    branches, creep = [BRANCH, FAST], [field(0.2), field(0.05)]
    recalled = creep_recalled(branches, creep, field(1.5), 0.3)
    assert recalled is not None
    after = creep_step(branches, creep, field(1.5), field(4.0), 0.3)
    np.testing.assert_allclose(recalled + 4.0 * creep_compliance(branches, 0.3), 4.0 + after[0] + after[1], rtol=1e-12)


def test_without_branches_nothing_creeps() -> None:
    assert creep_recalled([], [], field(1.0), 0.1) is None
    assert creep_compliance([], 0.1) == 1.0
    assert creep_step([], [], field(1.0), field(2.0), 0.1) == ()


def test_a_finger_is_as_hard_as_at_once_in_short_steps_and_as_soft_as_at_last_in_long_ones() -> None:
    assert creep_compliance([BRANCH, FAST], 1e-6) == pytest.approx(1.0, abs=1e-5)
    assert creep_compliance([BRANCH, FAST], 1e9) == pytest.approx(1.9, rel=1e-8)


@pytest.mark.parametrize(
    ("strength", "time"), [(-0.1, 1.0), (math.inf, 1.0), (math.nan, 1.0), (0.1, 0.0), (0.1, math.inf), (0.1, -1.0)]
)
def test_an_impossible_branch_is_refused(strength: float, time: float) -> None:
    with pytest.raises(InvalidInput, match=r"Maxwell branch is .*; allowed: strength at least 0, time above 0 s"):
        MaxwellBranch(strength, time)


def test_a_branch_may_be_without_strength() -> None:
    assert creep_compliance([MaxwellBranch(0.0, 1.0)], 3.0) == 1.0
