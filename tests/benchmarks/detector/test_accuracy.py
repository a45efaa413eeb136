"""The scores of detectors, on masks small enough to count by hand."""

import numpy as np
import pytest

from benchmarks.detector.accuracy import (
    AHEAD,
    INPUTS,
    NOISES,
    ONSET_REACH,
    PHASES,
    Count,
    Score,
    count,
    draw,
    mean_known,
    onset_error,
    summarise,
    table,
    tables_of_unseen,
)
from benchmarks.detector.conditions import CHANGES, drift, outliers, retimed
from benchmarks.detector.markers import f1
from benchmarks.end_to_end.known_truth import Finding
from slipcore.contact import RampSchedule, tangential_ramp

TRUE = np.array([True, True, True, False, False])
FOUND = np.array([True, False, False, True, False])


def mask(*slipping: tuple[int, int], frames: int = 30) -> np.ndarray:
    """One element that slips from each first frame until before each last one."""
    found = np.zeros((frames, 1, 1), bool)
    for first, last in slipping:
        found[first:last] = True
    return found


def score(scene: str, f1: float, count: Count, onset: float = 1.0) -> Score:
    return Score(scene, f1, 0.5 * f1, 0.1, 0.02, onset, dict.fromkeys(PHASES, count))


def test_f1_is_the_harmonic_mean_of_precision_and_recall() -> None:
    precision, recall = 1 / 2, 1 / 3
    expected = 2 * precision * recall / (precision + recall)
    assert count(TRUE, FOUND) == Count(true=3, found=2, both=1)
    assert count(TRUE, FOUND).f1 == pytest.approx(expected)
    assert f1(TRUE, FOUND) == pytest.approx(expected)


def test_f1_is_not_known_where_nothing_slips_and_nothing_was_found() -> None:
    assert np.isnan(count(~TRUE & TRUE, ~TRUE & TRUE).f1)
    assert np.isnan(f1(~TRUE & TRUE, ~TRUE & TRUE))
    assert count(TRUE, ~TRUE & TRUE).f1 == 0.0


def test_the_onset_is_as_wrong_as_the_nearest_one_found() -> None:
    assert onset_error(mask((10, 14)), mask((12, 14))) == 2.0
    assert onset_error(mask((10, 14)), mask((9, 20))) == 1.0
    assert onset_error(mask((5, 7), (20, 22)), mask((5, 7), (23, 24))) == 1.5


def test_an_onset_without_any_near_is_left_out() -> None:
    far = 10 + ONSET_REACH + 1
    assert np.isnan(onset_error(mask((10, 12)), mask((far, far + 2))))
    assert onset_error(mask((10, 12)), mask((far - 1, far + 2))) == ONSET_REACH
    assert np.isnan(onset_error(mask((10, 12)), mask()))


def test_phases_are_pooled_over_scenes_that_slip_and_false_slip_counts_in_all() -> None:
    scores = [
        score("pull", 0.8, Count(10, 10, 8), onset=float("nan")),
        score("swing", 0.4, Count(30, 10, 2), onset=3.0),
        score("press", float("nan"), Count(0, 40, 0)),
    ]
    found = summarise("scoring", "force", 1e-6, "filter", scores)
    assert (found.f1, found.worst, found.worst_scene) == (pytest.approx(0.6), 0.4, "swing")
    assert found.phases == dict.fromkeys(PHASES, pytest.approx(2 * 10 / 60))
    assert (found.onset_error, found.false_slip) == (3.0, pytest.approx(0.02))
    assert "| scoring | force | 1 | filter | 0.600 | 0.40 (swing) | 0.300 |" in table([found])
    assert len(draw([found]).axes) == 3


def test_the_page_has_unseen_scenes_alone_each_score_in_its_place() -> None:
    every = [
        summarise(scenes, inputs, noise, method, [score("pull", f1, Count(4, 4, 2))])
        for scenes, f1 in (("scoring", 0.75), ("reference", 0.25))
        for inputs in INPUTS
        for noise in NOISES
        for method in ("filter", AHEAD, "strain_rate, best")
    ]
    made = tables_of_unseen(every)
    assert "0.25" not in made["accuracy"]
    assert made["accuracy"].splitlines()[2] == "| filter; forces |" + " 0.750 / 0.100 (0.75) |" * len(NOISES)
    assert len(made["accuracy"].splitlines()) == 2 + 7
    assert made["methods"].splitlines()[2].startswith("| filter | 0.750 | 0.75 | 0.50 |")
    assert len(made["methods"].splitlines()) == 2 + 3


def test_a_mean_leaves_out_what_is_not_known() -> None:
    assert mean_known([1.0, float("nan"), 3.0]) == 2.0
    assert np.isnan(mean_known([float("nan")]))


def test_conditions_change_what_they_say_and_nothing_else() -> None:
    log = tangential_ramp(points=4, schedule=RampSchedule(rest=0.2, press=0.4, settle=0.2, shear=1.0, hold=0.2))
    rng = np.random.default_rng(1)
    dropped = CHANGES["a tenth of the frames dropped"](log, rng)
    assert len(dropped) == round(0.9 * len(log))
    assert (np.diff(dropped.time) > 0.0).all()
    assert dropped.truth is not None
    assert dropped.truth.contact.shape == dropped.displacement.shape[:3]
    kept = log.take(np.array([3, 7]))
    np.testing.assert_array_equal(kept.displacement, log.displacement[[3, 7]])
    moved = drift(log, rng).displacement - log.displacement
    np.testing.assert_allclose(moved[-1, 2, 1], [1e-5 * log.time[-1], 0.0, 0.0], atol=1e-18)
    np.testing.assert_allclose(retimed(10.0)(log, rng).time, log.time / 10.0)
    wild = (outliers(log, rng).displacement != log.displacement).any(axis=-1)
    assert 0.003 < wild.mean() < 0.02


def test_an_interval_covers_where_it_holds_the_truth() -> None:
    held = Finding("filter", "ols", 0.3, 0, 50, 0.33, 0.29, 0.4)
    missed = Finding("filter", "ols", 0.3, 0, 50, 0.24, 0.2, 0.29)
    refused = Finding("filter", "ols", 0.3, 0, 3, None, None, None)
    assert (held.covered, missed.covered, refused.covered) == (True, False, False)
    assert held.relative_error == pytest.approx(0.1)
    assert missed.relative_error == pytest.approx(-0.2)
