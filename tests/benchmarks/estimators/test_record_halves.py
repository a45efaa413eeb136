"""Halves of a record: blocks of time, each of which is fitted or predicted, and how much lies below a quantile."""

from itertools import pairwise

import numpy as np
import pytest

from benchmarks.estimators.friction_records import DATA, bench, samples_of
from benchmarks.estimators.record_halves import (
    QUANTILES,
    below,
    beside,
    blocks_of,
    factors,
    left_out_scores,
    right_normal,
    strokes_of,
)


def test_the_quantiles_of_a_record_of_independent_errors_hold_what_they_say() -> None:
    rng, count = np.random.default_rng(0), 8000
    v, f_n = rng.uniform(0.0, 5e-3, count), rng.uniform(4.0, 6.0, count)
    mu = 0.5 + 4.0 * v - 0.01 * f_n + 0.02 * rng.standard_normal(count)
    parts = blocks_of(samples_of(np.arange(count) / 200.0, v, f_n, mu), 40)
    assert [len(part) for part in parts] == [200] * 40
    assert all(before.time.max() < after.time.min() for before, after in pairwise(parts))
    chosen = rng.permutation(40) < 20
    for method in ("auto", "ols"):
        assert below(parts, chosen, method) == pytest.approx(QUANTILES, abs=0.015)
    assert right_normal(parts) == pytest.approx(QUANTILES, abs=0.015)
    assert beside(parts, chosen) == pytest.approx(QUANTILES, abs=0.015)


def test_of_friction_that_wanders_over_the_record_the_blocks_beside_in_time_tell() -> None:
    rng, count = np.random.default_rng(0), 8000
    v, f_n, time = rng.uniform(0.0, 5e-3, count), rng.uniform(4.0, 6.0, count), np.arange(count) / 200.0
    mu = 0.5 + 4.0 * v - 0.01 * f_n + 0.1 * np.exp(-(((time - 17.0) / 6.0) ** 2)) + 0.01 * rng.standard_normal(count)
    parts = blocks_of(samples_of(time, v, f_n, mu), 40)
    chosen = [rng.permutation(40) < 20 for _ in range(5)]
    assert np.mean([beside(parts, each) for each in chosen], axis=0) == pytest.approx(QUANTILES, abs=0.03)
    assert right_normal(parts)[0] < 0.02  # a hump is not normal


@pytest.mark.skipif(not DATA.is_dir(), reason="the public records are not at hand")
def test_the_second_half_of_a_stroke_has_left_the_ramp() -> None:
    whole, part = bench().friction_coefficient, bench(from_middle=True).friction_coefficient
    assert 0.35 * len(whole) < len(part) < 0.55 * len(whole)
    assert np.quantile(whole, 0.05) < 0.1
    assert np.quantile(part, 0.05) > 0.42


def test_strokes_end_where_samples_are_left_out_and_have_a_factor_each() -> None:
    rng, time = np.random.default_rng(0), np.concatenate([start + np.arange(50) / 200.0 for start in range(4)])
    v, f_n, scale = rng.uniform(1e-3, 2e-3, 200), rng.uniform(4.0, 6.0, 200), np.repeat([0.9, 1.0, 1.1, 1.0], 50)
    record = samples_of(time, v, f_n, 0.5 * scale)
    assert [len(part) for part in strokes_of(record)] == [50] * 4
    assert len(strokes_of(record.take(time < 3.1))) == 3  # 20 samples are a part of a stroke
    assert factors(strokes_of(record)) == pytest.approx([0.9, 1.0, 1.1, 1.0], abs=0.03)


def test_a_score_left_out_is_of_the_others_alone() -> None:
    values = np.append(np.random.default_rng(0).standard_normal(50), 8.0)
    scores = left_out_scores(values)
    assert scores[-1] == scores.min() < -20.0
    assert np.median(scores) == pytest.approx(-1.2, abs=0.3)  # of a normal density ln √(2πe) less a half, about
