import math
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Annotated

import numpy as np
import pytest

import estimators.change_alarm
import estimators.defaults
import slipcore.contact.defaults
from benchmarks.sensitivity import of_new_grasps, of_prices, of_samples, of_scenes
from benchmarks.sensitivity.rows import Row, changed, every, neighbours, of_tables, rows, rows_on, table_of
from slipcore.contact.defaults import ACCURACY, CHEAP_TIERS, EXPLAIN
from slipcore.contact.plan.plan import Plan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.scene import explain
from slipcore.contact.tiers import beam_lattice, boundary_elements
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.contact.tiers.price import Size
from slipcore.errors import InvalidInput
from slipcore.frames import GraspLog
from slipcore.options import Option, Options
from stiction_client import Contact, ControlSettings
from stiction_client.controller.settings import gains


@dataclass(frozen=True, slots=True, kw_only=True)
class Table(Options):
    """A table to try with."""

    share: Annotated[float, Option(0.0, 0.6, "-", "a test")] = 0.5
    count: Annotated[int, Option(1, 9, "steps", "a test")] = 2


def test_half_and_one_and_a_half_stay_in_the_range_and_whole() -> None:
    assert list(neighbours(0.5, Option(0.0, 0.6, "-", ""))) == [0.25, 0.6]
    assert list(neighbours(1, Option(1, 9, "-", ""))) == [1, 2]
    assert list(neighbours(7, Option(1, 9, "-", ""))) == [4, 9]


def test_a_changed_table_is_what_it_was_afterwards_even_by_way_of_an_error() -> None:
    table = Table()
    with pytest.raises(InvalidInput, match=r"0\.1"), changed(table, "share", 0.1):
        raise InvalidInput("share", table.share, "0.5")
    assert table == Table()


def test_a_row_tells_each_change_or_what_failed() -> None:
    def measure(name: str, value: float) -> dict[str, float]:
        if name == "count":
            raise InvalidInput("count", value, "2")
        return {"F1": 2.0 * value}

    share, count = rows("table", Table, measure, {"F1": 1.0})
    assert share.changes == {"F1": (-0.5, pytest.approx(0.2))}
    assert share.largest == 0.5
    assert (count.changes, count.failed) == ({}, "3: InvalidInput")
    assert math.isnan(count.largest)


@pytest.mark.filterwarnings("ignore:contradiction_share has no effect:DeprecationWarning")
def test_what_a_controller_must_be_given_has_no_row_and_what_it_refuses_says_so() -> None:
    def measure(name: str, value: float) -> dict[str, float]:
        contact = Contact.flat(1e-4)
        ControlSettings(contact=contact, least_force=1.0, most_force=9.0, **{name: value})  # type: ignore[arg-type]
        return {"held": 1.0}

    found = {row.name: row for row in rows("settings", ControlSettings, measure, {"held": 1.0})}
    assert {*gains()} - {*found} == {"least_force", "most_force"}
    assert found["lead_time"].changes == {"held": (0.0, 0.0)}
    assert found["feel_stick_ratio"].failed == "0.275: InvalidArgument"


def test_the_most_sensitive_comes_first_after_what_fails_and_the_rest_below_the_table() -> None:
    quiet, loud, small = (
        Row("a", name, 1.0, "m", {"F1": (0.0, change)})
        for name, change in (("quiet", 1e-4), ("loud", 0.3), ("small", 0.01))
    )
    broken = Row("a", "broken", 1.0, "m", {}, "0.5: NotConverged")
    lines = table_of([quiet, small, broken, loud]).splitlines()
    assert [line.split("`")[1] for line in lines[2:5]] == ["broken", "loud", "small"]
    assert lines[3] == "| a | `loud` | 1 m | +0.000 | +0.300 |"
    assert lines[-3:] == ["| of | less than 0.001 by either |", "|---|---|", "| a | `quiet` |"]


def test_what_a_page_has_is_read_as_it_was_written_and_what_was_another_is_not() -> None:
    now = every()
    (loud, quiet, broken, moved), kept = [*now][:4], {"F1": (0.25, -0.5), "width": (0.0, 0.125)}
    still = {"F1": (0.0, 0.0), "width": (0.0, 0.0)}
    written = [
        Row(*loud, *now[loud], kept),
        Row(*quiet, *now[quiet], still),
        Row(*broken, *now[broken], {}, "0.5: NotConverged"),
        Row(*moved, 2.0 * now[moved][0] + 1.0, now[moved][1], kept),
    ]
    page = f"<!-- table some part -->\n{table_of(written)}\n<!-- end -->\n"
    assert {(row.table, row.name): (row.changes, row.failed) for row in rows_on(page, "some part")} == {
        loud: (kept, ""),
        quiet: (still, ""),
        broken: ({}, "0.5: NotConverged"),
    }
    assert rows_on(page, "another") == []


def test_tables_of_one_name_are_two_and_what_is_known_is_not_measured_again() -> None:
    module = ModuleType("house.defaults")
    module.LIMITS = Table()  # type: ignore[attr-defined]

    def measure() -> dict[str, float]:
        return {"sum": module.LIMITS.share + module.LIMITS.count}

    (row,) = of_tables(module, ("LIMITS",), measure, frozenset({("house.LIMITS", "count")}))
    assert (row.table, row.name, row.changes) == ("house.LIMITS", "share", {"sum": (-0.25, pytest.approx(0.1))})
    assert [each.name for each in of_tables(module, ("LIMITS.count",), measure)] == ["count"]
    done = frozenset({("house.LIMITS", "count"), ("house.LIMITS", "share")})
    assert of_tables(module, ("LIMITS",), lambda: pytest.fail("measured"), done) == []


@pytest.mark.parametrize("part", of_new_grasps.MEASURES)
def test_a_measure_of_new_grasps_is_the_same_each_time(part: str) -> None:
    _, measure = of_new_grasps.MEASURES[part]
    one = measure()
    assert all(math.isfinite(value) for value in one.values())
    assert measure() == one


def test_a_number_that_a_module_reads_once_is_changed_there_too() -> None:
    expected, kind = len(estimators.change_alarm.TAUS), estimators.change_alarm.ChangeAlarm
    with changed(estimators.defaults.ALARM, "nodes", 7):
        assert len(estimators.change_alarm.TAUS) == 7
    assert len(estimators.change_alarm.TAUS) == expected
    assert estimators.change_alarm.ChangeAlarm is kind  # what others hold of it can be stored still


def test_coarse_runs_and_beams_have_the_cells_of_a_changed_table() -> None:
    with changed(slipcore.contact.defaults.EXPLAIN, "cells", 7):
        assert explain.COARSE_RUNS.cells == 7
    with changed(slipcore.contact.defaults.CHEAP_TIERS, "beam_cells", 6):
        assert beam_lattice.ONE_CELL_AN_ELEMENT.cells == 6
    assert (explain.COARSE_RUNS.cells, beam_lattice.ONE_CELL_AN_ELEMENT.cells) == (10, 4)


def test_a_promise_is_looked_at_beside_the_error_and_explanations_that_are_refused_are_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told, twice = of_scenes.cheaply(), replace(CHEAP_TIERS, beam_error=2.0 * CHEAP_TIERS.beam_error)
    monkeypatch.setattr(beam_lattice, "CHEAP_TIERS", twice)
    changed_by = {name: value - told[name] for name, value in of_scenes.cheaply().items()}
    assert changed_by.pop("beams promise") == pytest.approx(math.log(2.0))
    assert set(changed_by.values()) == {0.0}
    monkeypatch.setattr(of_scenes, "EXPLAINED", of_scenes.EXPLAINED[:2])
    assert of_scenes.explained()["given"] == 1.0
    monkeypatch.setattr(explain, "EXPLAIN", replace(EXPLAIN, most_runs=1))
    assert of_scenes.explained()["given"] == 0.0


def test_smeared_forces_are_told_from_forces_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(of_samples, "SETTINGS", of_samples.SETTINGS[:1])
    monkeypatch.setattr(of_samples, "MATERIALS", of_samples.MATERIALS[:1])
    of_samples.slipping.cache_clear()
    assert of_samples.trusted() == pytest.approx({"true left out": 0.0, "smeared left out": 5 / 12})
    of_samples.slipping.cache_clear()


def test_a_range_that_ends_and_a_kernel_are_found_in_fields_that_have_them(monkeypatch: pytest.MonkeyPatch) -> None:
    x = np.linspace(-1.0, 1.0, 16)
    bump = np.exp(-30.0 * (x[:, None] ** 2 + x**2))[None, :, :, None] * np.array([0.3, 0.2, 1.0])
    field = 1e-4 * np.concatenate([np.linspace(0.0, 1.0, 30), np.ones(10)])[:, None, None, None] * bump
    monkeypatch.setattr(of_samples, "pressed", lambda: [field])
    ended, smoothed = of_samples.ended(), of_samples.smoothed()
    assert ended["falsely"] == 0.0
    assert ended["found"] >= 0.5
    assert smoothed["width"] < 0.1
    assert smoothed["field"] < np.log(0.7)  # a third of what smoothing did is undone; noise remains


def test_prices_that_come_true_have_no_error_and_another_power_of_the_cells_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sizes = [Size(20, cells**2) for cells in of_prices.CELLS]
    took = tuple((size, 1e-6 * size.work(ACCURACY.overhead_cells)) for size in sizes)
    monkeypatch.setattr(of_prices, "ladder", lambda _: took)
    assert of_prices.price_error() == pytest.approx(0.0, abs=1e-9)
    with changed(ACCURACY, "cost_order", 1.5):
        assert of_prices.price_error() > 0.05


def test_times_left_are_told_of_runs_that_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Fidelity] = []

    def counted(plan: Plan, fidelity: Fidelity, progress: Progress = no_progress) -> GraspLog:
        made.append(fidelity)
        return boundary_elements.run(plan, fidelity, progress)

    monkeypatch.setattr(of_prices, "run", counted)
    monkeypatch.setattr(of_prices, "SCENES", {"shear": of_prices.SCENES["shear"]})
    monkeypatch.setattr(of_prices, "ASKED", 0.1)
    monkeypatch.setattr(of_prices, "CLOCK", of_prices.Replayed())
    usual, count = of_prices.left_error(), len(made)
    assert 0.0 < usual < np.log(5.0)
    with changed(ACCURACY, "more_ahead", 5.0):
        assert of_prices.left_error() > usual
    assert of_prices.left_error() == usual
    assert len(made) == count > 2
