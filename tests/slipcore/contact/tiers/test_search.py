"""Which fidelity comes next, by hand: prices that go as cells times steps, and errors as given."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.errors import OutOfReach
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import SamplingPlan
from slipcore.contact.tiers import accuracy
from slipcore.contact.tiers.accuracy import (
    Difference,
    _AccuracySearch,
    _enough_cells,
    _even,
    _grid_error,
    _half_the_frames,
    _left_by,
    _sampled,
)
from slipcore.contact.tiers.extrapolation import grid_error, on_finer

NONE = Difference(0.0, 0.0, 0.0)


def error(size: float) -> Difference:
    return Difference(0.0, size, 0.5 * size)


def search(target: float = 0.0, left: float = np.inf, every: bool = False, shows_steps: bool = True) -> Any:
    """A run of so many cells and steps takes as many seconds as cells times steps."""
    made: Any = _AccuracySearch.__new__(_AccuracySearch)
    made.plan, made.rarely, made.target, made.every = "often", "rarely", target, every
    made.limited, made.shows_steps = bool(np.isfinite(left)), shows_steps

    def price(plan: str, fidelity: Any) -> float:
        return float(fidelity.cells * fidelity.substeps) * (0.5 if plan == "rarely" else 1.0)

    made.runs = SimpleNamespace(left=left, budget=left, spent=10.0, price=price)
    return made


@pytest.mark.parametrize(("cells", "even"), [(12.0, 12), (12.1, 14), (13.0, 14), (14.0 + 1e-10, 14), (1.0, 2)])
def test_cells_are_the_even_number_above(cells: float, even: int) -> None:
    assert _even(cells) == even


@pytest.mark.parametrize(
    ("target", "tolerance"), [(0.02, 2e-4), (0.5, 1e-3), (1e-6, 1e-7), (0.0, ACCURACY.timed_tolerance)]
)
def test_a_run_is_solved_a_hundred_times_as_well_as_is_asked(target: float, tolerance: float) -> None:
    made = search(target).at(40, 3)
    assert (made.cells, made.substeps, made.aligned) == (40, 3, False)
    assert made.tolerance == pytest.approx(tolerance)


def test_the_least_runs_are_twelve_cells_and_enough_more_to_compare() -> None:
    one, other = search().least()
    assert (one.cells, one.substeps, other.substeps) == (12, 1, 1)
    assert other.cells == _even(12.0 * ACCURACY.least_growth)
    assert search(left=100.0).cheapest() == 10.0 + one.cells + other.cells


@pytest.mark.parametrize(
    ("grid", "allowed", "cells"), [(None, 0.1, 32), (error(0.1), 0.1, 24), (error(0.2), 0.1, 46), (error(9.0), 0.1, 50)]
)
def test_cells_grow_by_a_guess_then_by_the_error_over_what_is_allowed(
    grid: Difference | None, allowed: float, cells: int
) -> None:
    """From 20: 1.6 times, or 1.15 times the ratio between the least growth and 2.5."""
    found = _enough_cells(20, grid, allowed)
    low = _even(20.0 * ACCURACY.least_growth)
    assert found == max(cells, low)
    assert _enough_cells(690, error(9.0), 0.1) == ACCURACY.finest_cells


def test_the_last_run_ahead_is_the_one_whose_error_should_do() -> None:
    """0.7 of the target is the grid's: an error of 0.14 on 40 cells asks for a quarter of it for 0.05."""
    following = search(0.05).at(60, 1)
    enough = [
        _even(cells * growth ** (1.0 / ACCURACY.usual_ratio_order)) for cells, growth in ((40, 4.0), (12, 0.15 / 0.014))
    ]
    assert [each.cells for each in search(0.05).ahead(following, 40, error(0.14))] == [60, enough[0]]
    assert [each.cells for each in search(0.05).ahead(following, 12, None)] == [60]  # 0.15 on 12: 34
    assert [each.cells for each in search(0.02).ahead(following, 12, None)] == [60, enough[1]]
    assert search(0.0).ahead(following, 12, None) == (following,)


@pytest.mark.parametrize(("seconds", "cells"), [(100.0, 100), (101.9, 100), (3.9, 0), (4.0, 4), (1e9, 700)])
def test_the_finest_grid_within_a_time_is_even(seconds: float, cells: int) -> None:
    assert search().finest_within(seconds, 1) == cells
    assert search().finest_within(2.0 * seconds, 2) == cells


def test_towards_a_target_the_next_grid_is_the_one_that_should_do() -> None:
    """Of 0.1 steps leave 0.01, and 0.09 are allowed to an error of 0.1 on 20 cells."""
    made = search(0.1)
    assert made.following(20, 1, None, NONE) == (32, 1)
    assert made.following(20, 3, error(0.1), error(0.01)) == (_enough_cells(20, error(0.1), 0.09), 3)
    assert made.following(20, 3, error(0.1), error(0.5))[0] == _enough_cells(20, error(0.1), 0.07)  # 0.3 at most
    assert made.following(ACCURACY.finest_cells, 1, error(0.1), NONE) is None


def test_in_equal_growth_grids_go_on_as_long_as_they_fit() -> None:
    assert search(every=True, left=40.0).following(20, 1, error(0.1), NONE) == (32, 1)
    assert search(every=True, left=31.0).following(20, 1, error(0.1), NONE) is None
    assert search(every=True, left=31.0).following(20, 1, None, NONE) == (32, 1)  # there is a first one


def test_what_is_left_goes_to_cells_or_steps_whichever_errs_less() -> None:
    """Of 100 s 92 are spent: on 92 cells in a step, or on 46 in two where steps err more."""
    made = search(left=100.0)
    assert made.affordable(40, 1, error(1e-4), error(1.0)) == (46, 2)
    assert made.affordable(40, 1, error(1.0), error(1e-4)) == (92, 1)
    assert made.affordable(90, 1, error(1.0), error(1e-4)) is None  # hardly more cells
    far = search(left=1000.0).affordable(40, 1, error(1.0), NONE)
    assert far == (100, 1)  # 2.5 times at most, if a fifth of what is left holds as many


def test_a_budget_without_an_estimate_is_refused_with_its_price() -> None:
    with pytest.raises(OutOfReach) as refused:
        search(left=13.0).affordable(12, 1, None, NONE)
    assert refused.value.asked == 13.0
    assert search(left=100.0).too_short(4.0).least == max(search(left=100.0).cheapest(), 5.0 * 4.0)
    search(left=1e3).refuse_the_too_short()
    search(left=13.0, every=True).refuse_the_too_short()
    with pytest.raises(OutOfReach):
        search(left=13.0).refuse_the_too_short()


def test_an_accuracy_beyond_the_finest_grid_and_shortest_steps_is_refused() -> None:
    """Of 0.7 on 70 cells a tenth of the cell size leaves 0.7/10^1.5 = 0.022; of 0.64 in one step 64 leave 0.64/512."""
    made = search(0.02)
    with pytest.raises(OutOfReach):
        made.refuse_the_unreachable(made.at(70, 1), error(0.7), NONE)
    made.refuse_the_unreachable(made.at(70, 1), error(0.6), NONE)
    made.refuse_the_unreachable(made.at(700, 1), error(0.0), error(0.64))
    with pytest.raises(OutOfReach):
        search(0.001).refuse_the_unreachable(made.at(700, 1), NONE, error(0.64))
    search(0.02, left=9.0).refuse_the_unreachable(made.at(70, 1), error(0.7), NONE)


def test_a_grids_error_is_by_the_next_two_that_are_coarser_by_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy, "difference", lambda log, _finest: error(float(log)))
    made: Any = [(10, "9.0"), (20, "0.4"), (30, "0.2"), (58, "0.05"), (60, "")]
    expected = grid_error([(3.0, error(0.4)), (2.0, error(0.2))])
    assert _grid_error(made).largest == pytest.approx(expected.largest, rel=1e-12)


def test_an_error_falls_with_the_power_of_the_cell_size() -> None:
    """By 2^1.5 = 2.83: what halving changes is 1.83 of what is left, with a margin of a quarter."""
    change = Difference(0.3, 0.2, 0.1)
    found = grid_error([(2.0, change)])
    assert found.displacement == pytest.approx(1.25 * 0.2 / (2.0**1.5 - 1.0))
    assert found.stick_ratio == pytest.approx(1.25 * 0.3 / (2.0**1.4 - 1.0))
    left = on_finer(change, 4.0)
    assert (left.stick_ratio, left.force) == (pytest.approx(0.3 / 4.0**1.4), pytest.approx(0.1 / 8.0))


def test_steps_in_half_as_many_leave_twice_what_they_differ_by(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accuracy, "difference", lambda _log, _shorter: Difference(0.1, 0.2, 0.3))
    made: Any = "log"
    assert _left_by(made, made) == Difference(0.2, 0.4, 0.6)


def test_without_a_sensor_points_cover_the_contact_and_frames_the_duration() -> None:
    plan = SceneDescription("press", duration=3.0).plan()
    found = _sampled(plan, 5e-3).sampling
    assert found is not None
    assert found.points == (32, 32)
    assert found.pitch == pytest.approx(2.0 * accuracy.PROBE.room * 5e-3 / 32.0)
    assert found.frame_rate == pytest.approx(20.0)
    rarely = _half_the_frames(_sampled(plan, 5e-3)).sampling
    assert rarely is not None
    assert rarely.frame_rate == pytest.approx(10.0)
    own = SamplingPlan((3, 4), 1e-3, 25.0)
    assert _sampled(replace(plan, sampling=own), 5e-3).sampling is own
