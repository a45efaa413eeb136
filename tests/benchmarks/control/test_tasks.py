"""What each task of grip control asks of a hand and when, in N and N·m by its description."""

import math

import pytest

from benchmarks.control.tasks import (
    LIFTS,
    PAPER,
    PROTOCOLS,
    RATE,
    block,
    cap,
    cup,
    knife,
    lift,
    on_table,
    rise,
    shell,
    slippery,
    sudden,
)
from slipcore.contact.reduced import GRAVITY, Load


def push(load: Load) -> tuple[float, float, float]:
    """Force and moment beside the weight."""
    return (*load.force, load.moment)


@pytest.mark.parametrize(("time", "share"), [(0.0, 0.0), (2.0, 0.0), (2.25, 0.5), (2.5, 1.0), (9.0, 1.0)])
def test_a_rise_is_even_between_its_ends(time: float, share: float) -> None:
    assert rise(time, 2.0, 0.5) == share


def test_a_table_lets_go_within_a_second() -> None:
    assert [on_table(time) for time in (0.0, 0.5, 0.75, 1.0, 1.5, 4.0)] == [1.0, 1.0, 0.75, 0.5, 0.0, 0.0]


def test_a_lift_ends_with_the_whole_weight_and_is_named_by_it() -> None:
    task = lift(0.1, 0.45)
    assert task.name == "lift, 1.0 N, μ 0.45"
    assert task.friction == (0.45,)
    assert task.load(0.2).resultant() == (0.0, 0.0, 0.0)
    assert task.load(1.0).resultant()[0] == pytest.approx(0.05 * GRAVITY, rel=1e-12)
    assert task.load(task.seconds).resultant() == pytest.approx((0.1 * GRAVITY, 0.0, 0.0), rel=1e-12)


def test_lifts_are_of_every_mass_with_every_friction() -> None:
    told = {(task.friction[0], round(task.load(3.0).mass, 3)) for task in LIFTS}
    assert told == {(friction, mass) for friction in (0.3, 0.45, 0.7) for mass in (0.05, 0.1, 0.15, 0.2)}


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (4.0, (0.0, 0.0, 0.0)),
        (4.075, (0.4, 0.0, 0.5e-3)),
        (4.5, (0.8, 0.0, 1e-3)),
        (5.075, (0.4, 0.0, 0.5e-3)),
        (6.0, (0.0, 0.0, 0.0)),
    ],
)
def test_a_sudden_load_comes_and_goes_with_its_twist(time: float, expected: tuple[float, float, float]) -> None:
    assert push(sudden("", 0.15).load(time)) == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_a_shell_breaks_under_twice_of_what_its_weight_needs() -> None:
    task = shell()
    assert task.limit * task.friction[0] == pytest.approx(2.0 * 0.08 * GRAVITY, rel=1e-12)
    assert [task.load(t).supports for t in (0.5, 0.65, 0.8)] == pytest.approx([1.0, 0.5, 0.0], abs=1e-12)
    assert push(task.load(5.0)) == pytest.approx((0.0, 0.15, 0.0), rel=1e-12)
    assert push(task.load(7.0)) == pytest.approx((0.0, 0.3, 0.0), rel=1e-12)


def test_a_cup_is_filled_within_three_seconds() -> None:
    masses = [cup().load(time).mass for time in (1.0, 2.0, 3.5, 5.0, 6.0)]
    assert masses == pytest.approx([0.05, 0.05, 0.125, 0.2, 0.2], rel=1e-12)


@pytest.mark.parametrize(("time", "moment"), [(1.9, 0.0), (2.2, 1.25e-3), (2.4, 2.5e-3), (3.9, 3.75e-3), (6.0, 5e-3)])
def test_a_caps_torque_rises_fast_and_then_ever_further(time: float, moment: float) -> None:
    load = cap().load(time)
    assert load.moment == pytest.approx(moment, rel=1e-9, abs=1e-15)
    assert load.supports == 1.0


@pytest.mark.parametrize(("time", "pull"), [(1.9, 0.0), (2.15, 0.4), (3.0, 0.8), (4.075, 1.6), (5.0, 2.4)])
def test_a_block_is_pulled_harder_all_at_once(time: float, pull: float) -> None:
    assert push(block().load(time)) == pytest.approx((pull, 0.0, 0.0), rel=1e-9, abs=1e-12)
    assert block().friction == (0.45, 0.6)


@pytest.mark.parametrize(
    ("time", "resists", "supports"),
    [
        (2.9, 0.0, 0.0),
        (3.45, 0.5, 0.0),
        (3.9, 1.0, 0.0),
        (4.2, 0.4, 0.0),
        (5.75, 0.2, 0.35),
        (7.0, 0.0, 0.7),
    ],
)
def test_a_fruit_resists_a_knife_until_its_skin_breaks_and_bears_it_at_last(
    time: float, resists: float, supports: float
) -> None:
    load = knife().load(time)
    assert push(load) == pytest.approx((-2.2 * resists, 0.0, 1.5e-3 * resists), rel=1e-9, abs=1e-12)
    assert load.supports == pytest.approx(supports, abs=1e-12)


def test_each_task_of_the_paper_begins_on_its_table_and_moves_within_its_time() -> None:
    for task in PAPER:
        assert task.load(0.0).resultant() == (0.0, 0.0, 0.0)
        assert task.load(task.seconds - 0.5).resultant() != (0.0, 0.0, 0.0)


def test_a_gripper_that_lifts_adds_its_acceleration_and_takes_it_back() -> None:
    """A smoothstep of 0.3 m within 1 s begins with 6 · 0.3 m/s² and ends with as much the other way."""
    grasp, _ = PROTOCOLS
    for time, acceleration in ((0.75, 0.9), (1.0, 0.0), (1.25, -0.9), (1.5, 0.0), (2.0, 0.0)):
        assert grasp.load(time).force[0] == pytest.approx(0.1 * acceleration, abs=1e-12)
    assert grasp.load(0.575).force[0] == pytest.approx(0.5 * 0.1 * 1.8 * (1.0 - 2.0 * 0.075), rel=1e-9)


def test_shaking_swells_and_fades_in_one_protocol_and_breaks_off_in_the_other() -> None:
    grasp, close = PROTOCOLS
    crest, mass = 0.01 * RATE**2, 0.85 * 0.2
    quarter = 0.5 * math.pi / RATE
    for start, share in ((2.5, 0.5), (3.0, 1.0), (3.5, 1.0)):
        assert grasp.load(start + quarter).force[1] == pytest.approx(0.1 * crest * share, rel=1e-9)
    assert grasp.load(4.1).force[1] == 0.0
    assert close.load(2.5 + quarter).force[0] == pytest.approx(-2.0 * mass * crest, rel=1e-9)
    assert close.load(4.5 - quarter).force[0] == pytest.approx(2.0 * mass * crest, rel=1e-9)
    assert close.load(4.5).force == (0.0, 0.0)


def test_of_a_slippery_object_strategies_are_told_what_is_usual() -> None:
    task = slippery(0.2)
    assert (task.friction, task.told, task.seconds) == ((0.2,), (0.45,), 3.0)
    assert task.load(2.0).resultant() == lift(0.1, 0.45).load(2.0).resultant()
