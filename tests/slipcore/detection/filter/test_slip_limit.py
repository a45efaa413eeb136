"""How far the object moves over elements before they slip, by how deep they were pressed in, as plain Python."""

import math
from collections.abc import Iterable
from inspect import unwrap

import numpy as np
import pytest

from slipcore.defaults import FilterOptions
from slipcore.detection.filter import slip_limit
from slipcore.detection.filter.pose import AnchorMotion
from slipcore.detection.filter.state import (
    COMMON,
    EXPECTED,
    LIMIT_LIKELIHOODS,
    PROBABILITY,
    ROWS,
    SPRING_X,
    SPRING_Y,
    TOUCH_DEPTH,
)
from slipcore.detection.filter.tuning import Tuning, settings_of
from slipcore.detection.shared.records import Memory
from slipcore.frames import BoolArray, FloatArray
from tests.slipcore.plain_kernels import as_plain_python

TUNING = Tuning(*settings_of(FilterOptions()))._replace(
    slip_limit_least=0.1, slip_limit_largest=3.0, slip_limit_usual=0.5, slip_limit_spread=1.0, slip_limit_doubt=0.2,
    slip_limit_width=0.2, slip_limit_lag=0.3, slip_limit_trust=0.9, slip_limit_evidence=20.0, slip_limit_memory=10.0,
    slip_limit_depth=3.0, slip_limit_odds=2.0, threshold=0.4,
)  # fmt: skip
NOISE = 1e-6
DEPTHS = 1e-3 * np.linspace(0.1, 0.6, 11)
NONE = LIMIT_LIKELIHOODS + slip_limit.COUNT


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    as_plain_python(monkeypatch, slip_limit)


class Contact:
    """A row of elements that have been pressed in by so much, m, since they touched."""

    def __init__(self, depths: FloatArray, tuning: Tuning = TUNING, noise: float = NOISE) -> None:
        self.depths, self.tuning, self.noise = depths, tuning, noise
        self.elements, self.common = np.zeros((ROWS, 1, len(depths))), np.zeros(COMMON)
        self.truth = np.zeros(len(depths))

    def step(
        self, way: float, slips: BoolArray | None = None, *, held: bool = False, has_force: bool = False
    ) -> FloatArray:
        """The log-odds expected after the object moved on by ``way`` m, where markers show that those slip."""
        count, after = len(self.depths), np.full_like(self.elements, 0.7)
        after[PROBABILITY] = 0.01 if slips is None else np.where(slips, 0.99, 0.01)
        field, touch = np.zeros((1, count, 3)), np.ones((1, count), bool)
        field[0, :, 2] = -self.depths
        motion = AnchorMotion(np.full(count, 0.6 * way), np.full(count, 0.8 * way), np.zeros(count))
        places = np.array([[0, j] for j in range(count)], np.int64).reshape(count, 2)
        rows = np.zeros((slip_limit.SCRATCH_ROWS, count)), np.zeros((2, 64))
        memory = Memory(touch, touch, np.zeros((1, count)), np.zeros(1), after, self.common)
        unwrap(slip_limit.step_limits)(
            self.elements, places, motion, (field, field, touch, touch), (self.noise, held, has_force), self.tuning,
            rows, memory,
        )  # fmt: skip
        self.elements = after
        return np.asarray(after[EXPECTED, 0])

    def weights(self) -> tuple[FloatArray, float]:
        """How probable each limit is and, last, that there is none; and the mean of the limits."""
        weights = np.zeros(slip_limit.COUNT + 1)
        limit = unwrap(slip_limit.weigh_limits)(self.common[LIMIT_LIKELIHOODS : NONE + 1], self.tuning, weights)
        return weights, limit

    def spring(self) -> FloatArray:
        """What elements have taken up, m, along the way."""
        return np.asarray(0.6 * self.elements[SPRING_X, 0] + 0.8 * self.elements[SPRING_Y, 0])


def ruled(contact: Contact, limit: float, ways: Iterable[float]) -> FloatArray:
    """Let the object go these ways, m, over elements that do slip by this limit; what was expected last."""
    expected, most = np.zeros(0), limit * contact.depths
    for way in ways:
        slips = np.abs(contact.truth + way) >= most
        contact.truth = np.clip(contact.truth + way, -most, most)
        expected = contact.step(way, slips)
    return expected


@pytest.mark.parametrize("limit", [0.4, 0.8, 1.2])
def test_the_limit_is_found_from_how_far_elements_of_different_depth_stick(limit: float) -> None:
    contact = Contact(DEPTHS)
    expected = ruled(contact, limit, [10e-6] * round(0.6 * limit * DEPTHS.max() / 10e-6))
    weights, found = contact.weights()
    assert found == pytest.approx(limit, rel=0.25)  # a step of the row is 0.49 of a logarithm
    assert weights[-1] < TUNING.slip_limit_doubt
    assert expected[0] > 1.0  # the shallow slip, the deep not yet
    assert expected[-1] < -0.3


def test_after_a_turn_back_an_element_slips_after_twice_the_way() -> None:
    contact, way = Contact(DEPTHS), 2.0 * 0.5 * DEPTHS[2]
    ruled(contact, 0.5, [10e-6] * 20)
    assert ruled(contact, 0.5, [-0.1 * way] * 7)[2] < -1.0
    expected = ruled(contact, 0.5, [-0.1 * way] * 5)
    assert expected[2] > 1.0
    assert (expected[5:] < -1.0).all()


def test_a_log_that_breaks_the_rule_makes_it_say_nothing() -> None:
    contact, rng = Contact(DEPTHS), np.random.default_rng(1)
    for _ in range(60):
        expected = contact.step(10e-6, rng.uniform(0.1e-3, 0.6e-3) < DEPTHS)  # the deep slip first
    assert contact.weights()[0][-1] > 0.98
    np.testing.assert_allclose(expected, 0.0, atol=0.05)


def test_elements_of_one_depth_are_expected_to_slip_together() -> None:
    contact = Contact(np.full(9, 0.3e-3))
    expected = ruled(contact, 0.5, [10e-6] * 10)
    np.testing.assert_allclose(expected, expected[0], rtol=1e-12)
    assert expected[0] < -0.5
    assert ruled(contact, 0.5, [10e-6] * 10)[0] > 0.3


def test_one_element_alone_is_no_error() -> None:
    assert ruled(Contact(DEPTHS[:1]), 0.5, [10e-6] * 40) > 0.0


def test_without_elements_nothing_is_learnt() -> None:
    contact = Contact(DEPTHS[:0])
    assert contact.step(10e-6).size == 0
    assert not contact.common.any()


def test_without_motion_nothing_is_learnt_and_held_elements_stay_as_they_are() -> None:
    contact = Contact(DEPTHS)
    ruled(contact, 0.5, [10e-6] * 20)
    known, spring = contact.common.copy(), contact.spring()
    expected = contact.step(0.0, DEPTHS > 0.0)
    np.testing.assert_allclose(contact.common, known, atol=1e-12)
    np.testing.assert_allclose(contact.step(0.0, DEPTHS > 0.0, held=True), expected, rtol=1e-12)
    np.testing.assert_allclose(contact.spring(), spring, rtol=0.2)


def test_with_forces_nothing_is_expected_but_motion_is_taken_up() -> None:
    contact = Contact(DEPTHS)
    for _ in range(5):
        expected = contact.step(10e-6, DEPTHS < 0.4e-3, has_force=True)
    assert not expected.any()
    assert not contact.common.any()
    np.testing.assert_allclose(contact.spring(), np.minimum(50e-6, TUNING.slip_limit_usual * DEPTHS), rtol=0.1)
    assert contact.step(0.5e-3)[0] > 0.0


@pytest.mark.parametrize("depth", [0.0, 2.9e-6])
def test_depth_within_noise_says_nothing(depth: float) -> None:
    """As of markers that are seen in the plane alone."""
    contact = Contact(np.full(9, depth))
    assert not contact.step(1e-4, np.ones(9, bool)).any()
    assert not contact.common[LIMIT_LIKELIHOODS : NONE + 1].any()


def test_what_noise_does_to_a_depth_makes_the_rule_less_sure() -> None:
    sure, unsure = Contact(DEPTHS), Contact(DEPTHS, noise=float(DEPTHS[0]))
    assert 0.7 * sure.step(0.02e-3)[0] < unsure.step(0.02e-3)[0] < 0.0


def test_before_anything_is_seen_the_usual_limit_holds_but_for_the_doubt() -> None:
    weights, limit = Contact(DEPTHS, TUNING._replace(slip_limit_usual=math.sqrt(0.1 * 3.0))).weights()
    assert limit == pytest.approx(math.sqrt(0.1 * 3.0))  # the middle of the row
    assert weights.sum() == pytest.approx(1.0)
    assert weights[-1] == pytest.approx(0.2)


def test_evidence_of_any_size_leaves_weights_finite() -> None:
    contact = Contact(DEPTHS)
    contact.common[LIMIT_LIKELIHOODS : NONE + 1] = -1e6
    contact.common[NONE] = 0.0
    weights, limit = contact.weights()
    assert weights.tolist() == [0.0] * slip_limit.COUNT + [1.0]
    assert limit == TUNING.slip_limit_usual
    assert np.isfinite(contact.step(1e-3, np.ones(len(DEPTHS), bool))).all()


def test_what_has_just_touched_begins_at_the_depth_before_and_what_does_not_has_none() -> None:
    after, last, now = np.full((ROWS, 1, 3), 0.7), np.zeros((1, 3, 3)), np.zeros((1, 3, 3))
    last[0, :, 2], now[0, :, 2] = -3e-4, -5e-4
    contact, stays = np.array([[True, True, False]]), np.array([[True, False, False]])
    elements, motion = np.full((ROWS, 1, 3), 1e-4), AnchorMotion(np.zeros(1), np.zeros(1), np.zeros(1))
    depth, moved = unwrap(slip_limit.follow_springs)(
        elements,
        np.array([[0, 0]]),
        motion,
        (last, now, contact, stays),
        NOISE,
        10.0,
        after,
        np.zeros((slip_limit.SCRATCH_ROWS, 1)),
    )
    assert after[TOUCH_DEPTH, 0].tolist() == [1e-4, 3e-4, 0.0]
    assert after[SPRING_X, 0].tolist() == [1e-4, 0.0, 0.0]
    assert after[EXPECTED, 0, 1:].tolist() == [0.0, 0.0]
    assert (depth, moved) == (pytest.approx(4e-4), 0.0)
