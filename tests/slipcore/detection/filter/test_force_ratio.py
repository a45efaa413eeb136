"""What force ratios say, by hand and against scipy, as plain Python."""

import math
from inspect import unwrap

import numpy as np
import pytest
from scipy import stats

from slipcore.defaults import FilterOptions
from slipcore.detection.filter.force_ratio import (
    ForceEvidence,
    count_by_motion,
    find_ratio_log_odds,
    follow_forces,
    keep_ratios,
    learn_ratios,
    weigh_forces,
)
from slipcore.detection.filter.loading import low_pass
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.state import (
    COMMON,
    FRICTION,
    NORMAL,
    OPPOSED,
    PROBABILITY,
    RATIO,
    RATIO_WEIGHT,
    ROWS,
    TANGENTIAL,
)
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import Surface

PLACES = np.array([[0, 0], [0, 1], [1, 0]])
TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    ratio_slip=0.8,
    ratio_slip_of_element=0.9,
    ratio_variance=0.01,
    ratio_variance_of_element=0.04,
    ratio_difference=0.5,
    ratio_spread=0.1,
)


def log_odds(ratio: float, noise: float, own: float, known: float, friction: float, gain: float) -> float:
    evidence = ForceEvidence(*np.array([[np.nan], [noise], [ratio], [own], [known]]))
    unwrap(find_ratio_log_odds)(evidence, friction, gain, TUNING)
    return float(evidence.log_odds[0])


def test_a_ratio_tells_of_slip_by_the_ratio_of_two_densities() -> None:
    """In slip normal about the limit; in stick uniform up to it and as blurred. Of an element that was never seen to
    slip the limit is that of all, as wide as elements differ.
    """
    friction, noise, gain = 0.4, 1e-4, 0.02
    deviation = np.sqrt(noise + (0.1 * friction) ** 2 + 0.25 * (0.5 * friction) ** 2)
    for ratio in (0.1, 0.3, 0.39):
        slip = stats.norm(friction, deviation).pdf(ratio)
        stick = stats.norm.cdf((friction - ratio) / deviation) / friction
        found = log_odds(ratio, noise, 0.0, 0.0, friction, gain)
        assert found == pytest.approx(np.log(slip / stick), rel=1e-9)
    at, above = (log_odds(each, noise, 0.0, 0.0, friction, gain) for each in (0.4, 0.7))
    assert above == pytest.approx(at, rel=1e-9)


def test_the_ratio_at_which_an_element_slips_moves_its_limit_from_that_of_all() -> None:
    """Known as well as beforehand, 0.6 and 0.4 make 0.5, with half of the variance."""
    gain = 0.02
    prior = 2.0 * gain / 0.2**2
    found = log_odds(0.45, 0.0, 0.6 * prior, prior, 0.4, gain)
    deviation = np.sqrt(0.04**2 + 0.25 * 0.2**2 / 2.0)
    slip, stick = stats.norm(0.5, deviation).pdf(0.45), stats.norm.cdf(0.05 / deviation) / 0.5
    assert found == pytest.approx(np.log(slip / stick), rel=1e-9)


def no_evidence() -> ForceEvidence:
    """Room for what the forces on three elements say."""
    return ForceEvidence(*np.full((5, 3), 9.0))


def elements(**rows: float) -> np.ndarray:
    """State of 2 × 2 elements."""
    made = np.zeros((ROWS, 2, 2))
    for name, value in rows.items():
        made[globals()[name]] = value
    return made


def test_forces_are_low_passed_where_contact_stays_and_begin_anew_elsewhere() -> None:
    """Of 1 and 3 N before, and 2 and 5 N now; what pulls presses by nothing."""
    old, new = elements(NORMAL=1.0, TANGENTIAL=3.0), elements(NORMAL=9.0, RATIO=7.0, RATIO_WEIGHT=7.0)
    pressing, stays = np.full((2, 2), 2.0), np.array([[True, False], [True, True]])
    pressing[1, 0] = -4.0
    old[NORMAL, 1, 1] = 0.0  # no force before
    surface = Surface(np.zeros((2, 2, 3)), pressing, np.full((2, 2), 5.0), stays, np.zeros(4))
    unwrap(follow_forces)(old, surface, True, 0.25, new)
    np.testing.assert_allclose(new[NORMAL], [[1.25, 2.0], [0.75, 2.0]])
    np.testing.assert_allclose(new[TANGENTIAL], [[3.5, 5.0], [3.5, 5.0]])
    assert not new[RATIO].any()
    assert not new[RATIO_WEIGHT].any()
    unwrap(follow_forces)(old, surface, False, 0.25, new)
    assert not new[[NORMAL, TANGENTIAL]].any()


def test_while_nothing_happens_ratios_stay() -> None:
    old, new, evidence = elements(RATIO=0.3, RATIO_WEIGHT=2.0), elements(), np.ones(3)
    unwrap(keep_ratios)(old, PLACES, new, evidence)
    assert not evidence.any()
    assert new[RATIO].tolist() == [[0.3, 0.3], [0.3, 0.0]]
    assert new[RATIO_WEIGHT].tolist() == [[2.0, 2.0], [2.0, 0.0]]


def test_ratios_are_learnt_from_what_likely_slips_under_enough_force() -> None:
    """Probabilities of 0.95, 0.85 and 0.95, of which the last bears too little; ratios of 0.5, 0.3 and 0.9."""
    old, new, evidence = elements(RATIO=1.0, RATIO_WEIGHT=2.0), elements(), no_evidence()
    old[PROBABILITY] = [[0.95, 0.85], [0.95, 0.0]]
    new[NORMAL], new[TANGENTIAL] = [[1.0, 1.0], [0.1, 0.0]], [[0.5, 0.3], [0.09, 0.0]]
    total, weight = unwrap(learn_ratios)(old, PLACES, 0.01, 0.1, 0.25, TUNING, new, evidence)
    variance = 0.01 * np.array([1.25, 1.09, 0.0])
    np.testing.assert_allclose(evidence.variance, variance)
    assert evidence.ratio.tolist() == [0.5, 0.3, 0.0]
    of_all = np.array([0.95**2, 0.85**2]) / (0.01 + variance[:2])
    assert total == pytest.approx(of_all @ [0.5, 0.3])
    assert weight == pytest.approx(of_all.sum())
    own = 0.25 / (0.04 + variance[0])
    np.testing.assert_allclose(new[RATIO], [[0.75 + 0.5 * own, 0.75], [0.75, 0.0]])
    np.testing.assert_allclose(new[RATIO_WEIGHT], [[1.5 + own, 1.5], [1.5, 0.0]])
    for kept, row in ((evidence.seen, RATIO), (evidence.weight, RATIO_WEIGHT)):
        assert kept.tolist() == [new[row, i, j] for i, j in PLACES]


def test_ratios_count_above_so_many_deviations_of_a_low_passed_force() -> None:
    """Ten of 0.3 N, of which a low-pass that keeps one half per step leaves √(1/3): 1.73 N. In a second a third of what
    is known is replaced, and the log-odds of an element count by the newest half.
    """
    tuning = TUNING._replace(
        force_smoothing=1.0 / math.log(2.0), ratio_memory=1.0 / math.log(1.5), force_to_noise=10.0,
        ratio_least_force=0.1, ratio_limit=6.0, ratio_weight=0.8,
    )  # fmt: skip
    for normal, counts in ((1.72, False), (1.75, True)):
        old, new, common, evidence = elements(), elements(), np.zeros(COMMON), no_evidence()
        new[NORMAL, 0, 0], new[TANGENTIAL, 0, 0] = normal, 0.5 * normal
        common[FRICTION : FRICTION + 2] = 40.0, 100.0
        unwrap(weigh_forces)(old, PLACES, 0.3, 1.0, tuning, new, common, evidence)
        variance = 0.09 / 3.0 * 1.25 / normal**2
        assert evidence.variance.tolist() == [pytest.approx(variance) if counts else 0.0, 0.0, 0.0]
        expected = log_odds(0.5, variance, 0.0, 0.0, 0.4, 1.0 / 3.0)
        assert evidence.log_odds[0] == (pytest.approx(0.8 * 0.5 * expected) if counts else 0.0)
        np.testing.assert_allclose(common[FRICTION : FRICTION + 2], [80.0 / 3.0, 200.0 / 3.0])


def test_a_force_against_the_motion_is_no_friction_of_slip() -> None:
    """After a load is turned back ratios are still those of slip: they speak for stick, and are not learnt."""
    old, new, common, evidence = elements(), elements(NORMAL=1.0, TANGENTIAL=0.4), np.zeros(COMMON), no_evidence()
    old[PROBABILITY] = 0.95
    said = {}
    for opposed in (2.0, 1.25, 1.0):
        new[OPPOSED, 0, 1] = opposed
        common[FRICTION : FRICTION + 2] = 40.0, 100.0
        unwrap(weigh_forces)(old, PLACES, 1e-3, 1.0, TUNING, new, common, evidence)
        along, said[opposed], other = evidence.log_odds
        assert along == other > 0.0
    assert said[2.0] < 0.0 == said[1.0]  # as far as the object moved that way
    assert said[1.25] == pytest.approx(0.25 * said[2.0])
    assert new[RATIO_WEIGHT, 0, 1] == 0.0 < new[RATIO_WEIGHT, 0, 0]
    total, weight = unwrap(learn_ratios)(old, PLACES, 1e-6, 0.1, 1.0, TUNING, new, evidence)
    assert total / weight == pytest.approx(0.4)


def counted(ways: list[float], interval: float, tuning: Tuning) -> np.ndarray:
    """Share of the log-odds of 2 and −2 that count in each step, of which the object moved so far over the elements
    (root mean square), as forces with a memory of 0.1 s forget.
    """
    common, counts = np.zeros(COMMON), []
    for way in ways:
        motion = AnchorMotion(np.array([math.sqrt(2.0) * way, 0.0]), np.zeros(2), np.ones(2))
        log_odds = np.array([2.0, -2.0])
        unwrap(count_by_motion)(motion, interval, low_pass(interval, 0.1), tuning, common, log_odds)
        assert log_odds[0] == -log_odds[1]
        counts.append(0.5 * log_odds[0])
    return np.array(counts)


def test_a_ratio_counts_by_motion_and_fades_with_the_forces_when_that_ends() -> None:
    tuning = TUNING._replace(ratio_motion=2e-7)
    kept = math.exp(-0.3)
    expected = [-math.expm1(-0.5 * kept**step) for step in range(4)]
    assert counted([1e-7, 0.0, 0.0, 0.0], 0.03, tuning) == pytest.approx(expected)
    assert counted([0.0, 1.0], 0.03, tuning) == pytest.approx([0.0, 1.0])
    assert counted([0.0, 1.0], 0.03, TUNING._replace(ratio_motion=0.0)).tolist() == [1.0, 1.0]


@pytest.mark.parametrize("interval", [0.001, 0.01, 0.05])
def test_over_a_slow_motion_it_counts_once_per_length_at_any_frame_rate(interval: float) -> None:
    """Each step counts by the share of what forces remember that it replaces; 10 s at 1 nm/s are 0.05 of 0.2 µm."""
    shares = counted([1e-9 * interval] * round(20.0 / interval), interval, TUNING._replace(ratio_motion=2e-7))
    later = shares[len(shares) // 2 :]
    assert low_pass(interval, 0.1) * later.sum() == pytest.approx(0.05, rel=1e-3)


def test_without_a_known_friction_ratios_say_nothing() -> None:
    new, evidence = elements(NORMAL=1.0, TANGENTIAL=0.5), no_evidence()
    unwrap(weigh_forces)(elements(), PLACES, 0.01, 1.0, TUNING, new, np.zeros(COMMON), evidence)
    assert not evidence.log_odds.any()
