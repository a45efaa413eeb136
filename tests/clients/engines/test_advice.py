"""What is advised of a pair of geoms, without a simulation of it."""

from dataclasses import replace

import pytest

from stiction_client.exports.mujoco import HOLDING_OPTION
from stiction_client.mujoco_scene import advice as module
from stiction_client.mujoco_scene.advice import LARGEST, Written, advice, speed
from stiction_client.mujoco_scene.holding import Held

FINE = Written(("finger", "box"), (0.5, 0.5), "max", 4, (0.5, 0.5, 0.01, 1e-4, 1e-4), 1.0)
NOW, THEN = Held(0.5, 1e-3), Held(0.5, 1e-6)


def told(written: Written = FINE, now: Held = NOW, then: Held | None = THEN, wanted: float | None = None) -> list[str]:
    return list(advice(written, now, then, wanted))


def test_a_pair_that_holds_what_is_written_needs_nothing() -> None:
    assert told() == []
    assert told(now=Held(0.49, 1e-3)) == []  # closer than 2 %
    assert told(now=Held(0.1, 1.0), then=None) == []  # the scene has the option


@pytest.mark.parametrize("now", [Held(0.489, 1e-3), Held(0.5, 1.01e-3)])
def test_a_solver_by_which_less_is_held_or_more_creeps_is_mended(now: Held) -> None:
    (line,) = told(now=now)
    assert line.startswith(f"put {HOLDING_OPTION} into the model: it then holds 0.5 instead of {now.friction:.3g}; ")
    assert line.endswith(f"it creeps less than 0.001 mm/s, now it creeps {1e3 * now.creep:.2g} mm/s")


def test_an_option_that_changes_little_is_not_advised() -> None:
    assert told(now=Held(0.4, 2e-3), then=Held(0.407, 1.1e-3)) == []
    assert len(told(now=Held(0.4, 2e-3), then=Held(0.409, 2e-3))) == 1
    assert len(told(now=Held(0.4, 2e-3), then=Held(0.4, 0.9e-3))) == 1


@pytest.mark.parametrize(
    ("changes", "begin"),
    [
        ({"dimension": 1}, 'condim="1" has no friction at all'),
        ({"dimension": 3}, "one point of contact with condim"),
        ({"friction": (5.1, 5.1, 0.0, 0.0, 0.0)}, "no material has a friction of 5.1; "),
        ({"rule": "override"}, "o_friction stands above everything"),
    ],
)
def test_what_is_odd_about_the_geoms_is_named(changes: dict[str, object], begin: str) -> None:
    (line,) = told(replace(FINE, **changes), Held(9.0, 0.0))  # type: ignore[arg-type]
    assert line.startswith(begin)


def test_two_points_hold_as_a_soft_finger_does_and_the_largest_friction_may_be() -> None:
    assert told(replace(FINE, dimension=3, points=2.0)) == []
    assert told(replace(FINE, friction=(LARGEST, LARGEST, 0.0, 0.0, 0.0)), Held(LARGEST, 0.0)) == []
    assert replace(FINE, friction=(0.7, 0.6, 0.0, 0.0, 0.0)).sliding == 0.6
    assert replace(FINE, dimension=1).sliding == 0.0


@pytest.mark.parametrize(("wanted", "lines"), [(0.5, 0), (0.491, 0), (0.489, 2), (0.512, 2)])
def test_friction_that_is_to_be_another_comes_as_a_pair(wanted: float, lines: int) -> None:
    said = told(wanted=wanted)
    assert len(said) == lines
    if said:
        assert said[0] == f"its friction is to be {wanted:.3g}, and is 0.5"
        assert f'condim="4" friction="{wanted} {wanted} 0.01 0.0001 0.0001"/>' in said[1]


def test_geoms_that_differ_are_safe_as_a_pair_alone_of_the_smaller_friction() -> None:
    unlike = replace(FINE, each=(0.5, 0.3), names=("", "box"), dimension=3, points=2.0)
    (line,) = told(unlike)
    assert '<pair geom1="NAME IT" geom2="box" condim="3" friction="0.3 0.3 0.01' in line
    assert told(replace(unlike, rule="pair")) == []
    assert len(told(replace(unlike, rule="priority"))) == 1


def test_speeds_are_told_in_words() -> None:
    assert speed(Held(0.5, float("inf"))) == "slips"
    assert speed(Held(0.5, 1e-6)) == "creeps less than 0.001 mm/s"
    assert speed(Held(0.5, 1.23e-4)) == "creeps 0.12 mm/s"
    assert (module.TOLERANCE, module.LARGEST) == (0.02, 5.0)
