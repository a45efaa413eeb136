"""What is counted of an episode, by hand."""

import math
from typing import Any

import numpy as np
import pytest

from benchmarks.control.episodes import FRAME, Episode
from benchmarks.control.outcomes import ASKED, HELD, SIGNATURES, Outcome, median, outcome_of, scores


def episode(normal: list[list[float]], least: list[list[float]], **changed: Any) -> Episode:
    force = np.array(normal)
    nothing = np.zeros_like(force)
    columns: dict[str, Any] = {"slipped": nothing, "limit": math.inf} | changed
    time = FRAME * np.arange(1, len(force) + 1)
    return Episode("task", columns["limit"], time, force, force, np.array(least), nothing, nothing, columns["slipped"])


def outcome(**changed: Any) -> Outcome:
    plain: dict[str, Any] = {
        "strategy": "x",
        "task": "task",
        "seed": 0,
        "slipped": 0.0,
        "crushed": None,
        "peak": 2.0,
        "final": 1.2,
        "late": 0.0,
        "signature": math.nan,
        "seconds": 0.1,
    }
    return Outcome(**plain | changed)


def test_forces_of_two_fingers_count_together_over_what_both_need() -> None:
    found = outcome_of(episode([[1.0, 2.0], [4.0, 5.0], [2.0, 2.5]], [[1.0, 1.0], [1.0, 2.0], [1.0, 2.0]]), "x", 7)
    assert (found.strategy, found.task, found.seed, found.seconds) == ("x", "task", 7, 0.0)
    assert found.peak == 9.0 / 3.0
    assert found.final == 4.5 / 3.0
    assert found.late == 0.0


def test_the_longest_of_the_times_below_the_least_counts() -> None:
    force = [0.9, 1.1, 0.9, 0.9, 0.9, 1.0, 0.9, 0.9]
    found = outcome_of(episode([[each] for each in force], [[1.0]] * 8), "x", 0)
    assert found.late == pytest.approx(3 * FRAME, rel=1e-12)
    assert outcome_of(episode([[0.5]] * 4, [[1.0]] * 4), "x", 0).late == pytest.approx(4 * FRAME, rel=1e-12)


def test_the_finger_that_slipped_most_at_the_end_counts() -> None:
    slipped = np.array([[0.0, 0.0], [1e-3, 2.9e-3]])
    found = outcome_of(episode([[2.0, 2.0]] * 2, [[1.0, 1.0]] * 2, slipped=slipped), "x", 0)
    assert found.slipped == 2.9e-3
    assert found.held
    assert not outcome(slipped=HELD).held


@pytest.mark.parametrize(("limit", "crushed"), [(math.inf, None), (5.0, False), (4.9, True)])
def test_an_object_that_cannot_break_is_neither_crushed_nor_whole(limit: float, crushed: bool | None) -> None:
    assert outcome_of(episode([[1.0], [5.0], [2.0]], [[1.0]] * 3, limit=limit), "x", 0).crushed is crushed


def test_scores_count_what_breaks_apart_from_what_is_held() -> None:
    found = scores(
        "mine",
        [
            outcome(crushed=False, final=1.1, peak=1.5, late=0.02),
            outcome(crushed=True, final=ASKED, peak=2.5),
            outcome(slipped=HELD, final=9.0, peak=9.0, late=0.05),
            outcome(final=ASKED + 0.01, peak=3.0),
        ],
    )
    assert found["strategy"] == "mine"
    assert (found["held"], found["crushed"]) == ("3/4", "1/2")
    assert (found["peak"], found["final"]) == (2.5, ASKED)
    assert found["as_asked"] == pytest.approx(200.0 / 3.0, rel=1e-12)
    assert found["final_worst"] == ASKED + 0.01
    assert (found["slip_mm"], found["reaction_ms"]) == pytest.approx((3.0, 50.0), rel=1e-12)


def test_of_nothing_held_there_are_no_forces() -> None:
    found = scores("lost", [outcome(slipped=5e-3)])
    assert (found["held"], found["crushed"]) == ("0/1", "0/0")
    for name in ("peak", "final", "as_asked", "final_worst"):
        value = found[name]
        assert isinstance(value, float)
        assert math.isnan(value)
    assert math.isnan(median([]))


def test_a_signature_is_met_strictly_within_its_bounds() -> None:
    knife = SIGNATURES[1]
    assert (knife.low, knife.high) == (0.0, 1.0)
    assert knife.tell([0.5, 1.0, 0.9, 0.0]) == "0.70, 2/4"
    assert knife.tell([]) == "nan, 0/0"


def test_a_cap_whose_force_never_rises_late_has_no_ratio_of_rates() -> None:
    cap = SIGNATURES[0]
    frames = round(7.0 / FRAME)
    force = [[1.0 + min(k * FRAME, 2.5)] for k in range(frames)]
    assert cap.ratio(episode(force, [[1.0]] * frames)) == 0.0
