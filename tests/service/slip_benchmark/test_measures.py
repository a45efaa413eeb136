"""Scores of a few frames, by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.slip_benchmark.folder import Prediction, Truth
from service.slip_benchmark.measures import f1, force_error, measure, onsets, stick_ratio_error, whole

SHAPE = (4, 1, 2)
NONE, ALL = np.zeros(SHAPE, bool), np.ones(SHAPE, bool)


def mask(*elements: list[int]) -> np.ndarray:
    """Of two elements, each over four frames."""
    return np.array(elements, bool).T.reshape(SHAPE)


SLIP = mask([0, 0, 1, 1], [0, 1, 1, 1])
TRUTH = Truth(
    np.array([0.0, 0.1, 0.3, 0.6]), ALL, SLIP, SLIP, NONE[:, 0, 0], np.ones(4), np.ones(4), np.ones((*SHAPE, 3)),
    np.ones((*SHAPE, 3)), np.zeros((4, 3)), np.array([0.5, 0.0, 0.0, 0.0]), np.array(0.5),
)  # fmt: skip


@pytest.mark.parametrize(
    ("true", "found", "score"),
    [([1, 1, 0, 0], [1, 0, 0, 0], 2 / 3), ([1, 1, 0, 0], [0, 0, 1, 1], 0.0), ([1, 0, 0, 0], [1, 0, 0, 0], 1.0)],
)
def test_f1_is_twice_what_both_say_over_what_each_says(true: list[int], found: list[int], score: float) -> None:
    assert f1(np.array(true, bool), np.array(found, bool)) == pytest.approx(score)


def test_f1_of_nothing_has_no_meaning() -> None:
    assert np.isnan(f1(NONE, NONE))
    assert f1(NONE, ALL) == f1(ALL, NONE) == 0.0


def test_gross_slip_is_where_all_that_touches_slips_and_something_does() -> None:
    contact = mask([0, 1, 1, 1], [0, 0, 1, 1])
    slip = mask([1, 1, 1, 0], [1, 0, 1, 1])
    assert whole(slip, contact).tolist() == [False, True, True, False]


def test_the_stick_ratio_errs_by_the_shares_of_what_touches() -> None:
    contact = mask([0, 1, 1, 1], [0, 0, 1, 1])
    true, found = mask([0, 1, 1, 1], [0, 0, 1, 0]), mask([0, 0, 1, 0], [0, 0, 0, 0])
    assert stick_ratio_error(contact, true, found) == pytest.approx(np.sqrt((1.0 + 0.25 + 0.25) / 3))
    assert np.isnan(stick_ratio_error(NONE, true, found))


def test_delays_are_in_seconds_of_the_frames_times() -> None:
    delays, missed = onsets(TRUTH.time, SLIP, mask([0, 0, 0, 1], [1, 1, 1, 1]), ALL)
    np.testing.assert_allclose(delays, [0.3, -0.1])
    assert missed == 0.0


def test_only_what_stuck_in_contact_begins_to_slip() -> None:
    contact = mask([1, 0, 1, 1], [1, 1, 1, 1])
    delays, missed = onsets(TRUTH.time, SLIP, NONE, contact)
    assert (len(delays), missed) == (0, 1.0)
    assert np.isnan(onsets(TRUTH.time, ALL, ALL, ALL)[1])


def test_forces_err_by_the_root_of_squares_relative_to_the_true_ones() -> None:
    assert force_error(TRUTH, 1.5 * TRUTH.force) == pytest.approx(0.5)
    assert force_error(TRUTH, TRUTH.force) == 0.0


def test_what_a_method_does_not_say_has_no_score() -> None:
    found = measure(TRUTH, Prediction(SLIP), None)
    assert (found.f1, found.false_slip, found.missed_onsets, found.onset_delay) == (1.0, 0.0, 0.0, 0.0)
    assert found.macro_f1 == 1.0
    assert np.isnan([found.friction_error, found.force_error, found.brier]).all()


def test_where_nothing_slips_false_slip_alone_has_a_meaning() -> None:
    found = measure(replace(TRUTH, slip=NONE), Prediction(mask([0, 0, 0, 1], [0, 0, 0, 0])), None)
    assert found.false_slip == pytest.approx(1 / 8)
    assert found.f1 == 0.0
    assert np.isnan([found.onset_delay, found.missed_onsets]).all()
    assert np.isnan(measure(replace(TRUTH, slip=ALL), Prediction(ALL), None).false_slip)


def test_slip_of_what_does_not_touch_or_was_not_observed_does_not_count() -> None:
    first = mask([1, 1, 1, 1], [0, 0, 0, 0])
    said = mask([0, 0, 1, 1], [1, 0, 0, 1])
    for found in (
        measure(replace(TRUTH, contact=first), Prediction(said), None),
        measure(TRUTH, Prediction(said), first),
    ):
        assert (found.f1, found.false_slip, found.stick_ratio_error) == (1.0, 0.0, 0.0)


def test_gross_slip_that_a_method_says_itself_counts_where_something_touches() -> None:
    told = np.array([True, False, False, True])
    both = replace(TRUTH, contact=mask([0, 1, 1, 1], [0, 1, 1, 1]))
    assert measure(both, Prediction(SLIP, macro_slip=told), None).macro_f1 == pytest.approx(2 * 1 / (2 + 1))
    assert measure(TRUTH, Prediction(SLIP, macro_slip=told), None).macro_f1 == pytest.approx(2 * 1 / (2 + 2))


@pytest.mark.parametrize(("probability", "score"), [(0.5, 0.25), (0.0, 5 / 8), (1.0, 3 / 8)])
def test_brier_s_score_is_the_mean_square_of_probability_less_what_was(probability: float, score: float) -> None:
    assert measure(TRUTH, Prediction(SLIP, np.full(SHAPE, probability)), None).brier == pytest.approx(score)


@pytest.mark.parametrize(("friction", "error"), [(0.4, 0.2), (0.6, 0.2), (0.5, 0.0)])
def test_friction_errs_relative_to_the_true_one_either_way(friction: Any, error: float) -> None:
    assert measure(TRUTH, Prediction(SLIP, friction=friction), None).friction_error == pytest.approx(error)
