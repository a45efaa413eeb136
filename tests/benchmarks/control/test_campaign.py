import dataclasses
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from benchmarks.control import __main__ as control
from benchmarks.control.__main__ import campaign, episode
from benchmarks.control.episodes import FRAME, START, Episode, Task, least_force, run, world_of
from benchmarks.control.outcomes import SIGNATURES, outcome_of, scores
from benchmarks.control.strategies import (
    CONTROLLERS,
    EXPLORED_SLIP,
    Controlled,
    Fixed,
    Reflex,
    exploration,
    model_of,
    settings_of,
)
from benchmarks.control.tasks import ALL, LIFT, LIFTS, PAPER, STEP, TASKS, lift, on_table, rise
from slipcore.contact import reduced
from slipcore.contact.reduced import GRAVITY, Load
from stiction_client import Contact, GraspController, Observation

TASK = LIFTS[4]
CAMPAIGN = ("control", "control tasks", "control controller", "control signatures")


def test_the_least_force_is_the_limit_surface_s() -> None:
    world = dataclasses.replace(world_of(TASK, 0), friction=np.full((1, 20, 20), 0.45))
    assert least_force(world, Load(0.1)) == pytest.approx(0.981 / 0.45, rel=1e-3)
    force = least_force(world, Load(0.1, moment=2e-3))
    arm = float(Contact.round(math.pi * world.contact(5.0).contact_radius ** 2, at_force=5.0).arm(force))
    assert math.hypot(0.981, 2e-3 / arm) == pytest.approx(0.45 * force, rel=1e-3)


@pytest.mark.parametrize("name", ["known", "unknown"])
def test_an_object_that_is_free_to_tilt_is_held_beside_its_centre(name: str) -> None:
    """Two fingers, 4 cm apart, lift 200 g whose centre is 5 mm nearer to one of them, and are pushed at from there."""

    def load(time: float) -> Load:
        table = on_table(time)
        push = 0.3 * rise(time, 3.0, 0.5)
        return Load(0.2, table, moment=1e-3 * (1.0 - table), across=push, tilting=(0.0, 5e-3 * 0.2 * GRAVITY))

    task = Task("beside its centre", (0.45, 0.45), 4.5, load)
    world = dataclasses.replace(world_of(task, 3), width=0.04)
    found = episode(task, name, 3, world)
    assert found.time[-1] == pytest.approx(4.5)
    assert found.slipped.max() < 1e-3
    state = reduced.step(world, reduced.init(world, 5.0), 5.0, load(4.5), 0.5)
    assert abs(state.pose[5]) > 1e-4  # and it does tilt


def test_two_fingers_share_the_load() -> None:
    block = next(task for task in PAPER if len(task.friction) == 2)
    world = dataclasses.replace(
        world_of(block, 0), friction=np.stack([np.full((20, 20), each) for each in block.friction])
    )
    least = [least_force(world, Load(0.2), finger) for finger in (0, 1)]
    assert least == pytest.approx([0.1 * GRAVITY / friction for friction in block.friction])


@pytest.mark.parametrize("name", [*CONTROLLERS, "known, half of slip missed"])
def test_the_controller_holds_a_lift_seen_by_the_real_detector(name: str) -> None:
    score = scores(name, [outcome_of(episode(dataclasses.replace(TASK, seconds=2.5), name, 0), name, 0)])
    assert score["held"] == "1/1"
    assert 1.0 < float(str(score["final"])) < 2.6


@pytest.mark.parametrize(("friction", "name"), [(0.45, "paper"), (0.57, None)])
def test_the_controller_recognises_in_the_reduced_world(friction: float, name: str | None) -> None:
    """Within a second of the load, where its first touch lets some slip; a stranger stays unknown, and is held, too."""
    task = dataclasses.replace(lift(0.05, friction), seconds=1.4)
    world = world_of(task, 1000)
    materials = {"paper": model_of(0.45, world), "rubber": model_of(0.7, world)}
    strategy = Controlled(GraspController.init(settings_of(world), materials=materials))
    lifted = run(task, world, [strategy], 1000)
    assert strategy.state.material == name
    assert lifted.time[-1] < LIFT + 1.0
    assert lifted.slipped[-1, 0] < 1e-5


@pytest.mark.parametrize("seed", [32, 34])
def test_under_a_twist_the_detector_finds_what_sticks(seed: int) -> None:
    """Frames have the normals that forces refer to: by those of the shape, pressure leans and counts as shear."""
    twisted = next(task for task in PAPER if "twisted" in task.name)

    def harder(seen: Observation) -> float:
        return 3.0 + 1.2 * seen.time

    done = run(twisted, world_of(twisted, seed), [harder], seed)
    assert done.stick_ratio[-1, 0] > 0.8
    assert np.sqrt(np.nanmean((done.told - done.stick_ratio) ** 2)) < 0.12


def test_a_detector_that_misses_all_slip_tells_that_all_sticks() -> None:
    task = dataclasses.replace(TASK, seconds=1.0)
    world = world_of(task, 0)

    class Still:
        def __call__(self, seen: Observation) -> float:  # noqa: ARG002 - whatever is seen
            return START

    told = {missed: run(task, world, [Still()], 0, missed).told for missed in (0.0, 1.0)}
    assert np.nanmin(told[1.0]) == 1.0
    assert np.nanmin(told[0.0]) < 0.9


def test_an_exploration_finds_the_friction_of_its_world() -> None:
    world = world_of(TASK, 3)
    found, seconds = exploration(world, 0)
    assert found == pytest.approx(world.friction.mean(), rel=0.05)
    assert 0.5 < seconds < 2.0
    assert EXPLORED_SLIP < 3e-3


def test_a_reflex_presses_harder_only_while_it_sees_slip() -> None:
    reflex, ratios = Reflex(), [1.0, 0.6, 0.5, 0.0, 1.0, math.nan]
    forces = [reflex(Observation(count * FRAME, 1.0, 0.5, 0.0, ratio)) for count, ratio in enumerate(ratios)]
    assert forces == [1.0, 1.0, 1.5, 2.0, 2.0, 2.0]


def test_a_fixed_friction_presses_by_the_load() -> None:
    strategy = Fixed(settings_of(world_of(TASK, 0)), 0.25)
    forces = [strategy(Observation(count * FRAME, 1.0, 0.5)) for count in range(1, 300)]
    assert forces[-1] == pytest.approx(2.0)  # after the lead for the load that came at once


def made(normal: list[float], **changed: Any) -> Episode:
    """One finger, a frame every half second, of which 1 N would always do."""
    force = np.array(normal)[:, None]
    ones = np.ones_like(force)
    time = 0.5 * np.arange(1, len(normal) + 1)
    plain = Episode("task", math.inf, time, force, force, ones, ones, ones, 0.0 * ones)
    return dataclasses.replace(plain, **changed)


def test_scores_are_of_what_was_held() -> None:
    lost = np.array([[0.0], [0.0], [9e-3]])
    made_ = [made([2.0, 3.0, 1.5]), made([2.0, 0.5, 0.5], slipped=lost), made([3.0, 1.2, 1.2], limit=2.7)]
    score = scores("x", [outcome_of(each, "x", seed) for seed, each in enumerate(made_)])
    assert score["held"] == "2/3"
    assert score["crushed"] == "1/1"
    assert score["peak"] == 3.0
    assert score["final"] == pytest.approx(1.35)
    assert score["as_asked"] == 50.0
    assert score["final_worst"] == 1.5
    assert score["slip_mm"] == pytest.approx(9.0)
    assert score["reaction_ms"] == pytest.approx(2e3 * FRAME)


def test_signatures_tell_the_paper_s_from_others() -> None:
    cap, knife, block = SIGNATURES
    rises = made([1.0] * 4 + [4.0] + [4.5 + 0.2 * count for count in range(9)])
    even = made([1.0 + 0.1 * count for count in range(14)])
    assert cap.tell([cap.ratio(rises), cap.ratio(even)]).endswith("1/2")
    falls, rose = made([1.0] * 4 + [2.0] * 2 + [3.0, 1.5]), made([2.0] * 7 + [2.5])
    assert knife.tell([knife.ratio(falls), knife.ratio(rose)]).endswith("1/2")
    two = np.array([[3.0, 2.0]])
    faces = [dataclasses.replace(made([3.0]), normal=normal) for normal in (two, two[:, ::-1])]
    assert block.tell([block.ratio(each) for each in faces]).endswith("1/2")
    assert outcome_of(dataclasses.replace(made([3.0]), task=block.task.name, normal=two), "x", 0).signature == 1.5
    assert math.isnan(outcome_of(made([3.0]), "x", 0).signature)


def test_a_campaign_goes_on_where_it_was_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, int, list[str]]] = []

    def outcomes(job: tuple[int, int, list[str]]) -> list[control.Outcome]:
        asked.append(job)
        task, seed, names = job
        return [outcome_of(dataclasses.replace(made([2.0]), task=ALL[task].name), name, seed) for name in names]

    monkeypatch.setattr(control, "ProcessPoolExecutor", lambda processes: ThreadPoolExecutor(processes))
    monkeypatch.setattr(control, "_outcomes", outcomes)
    keep = tmp_path / "kept.jsonl"
    first = list(campaign({"known": 2}, 1, keep))
    assert len(first) == len(asked) == 2 * len(ALL)
    asked.clear()
    again = list(campaign({"known": 2, "unknown": 1}, 1, keep))
    assert asked == [(task, 0, ["unknown"]) for task in range(len(ALL))]
    assert [each[:3] for each in again[: len(first)]] == [each[:3] for each in first]
    assert len(list(campaign({"known": 1}, 1, keep))) == len(ALL)


def test_only_some_strategies_leave_the_page_s_figures_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def outcomes(seeds: dict[str, int], *_: object) -> list[control.Outcome]:
        final = 1.25 if len(seeds) == 1 else 2.0
        return [
            outcome_of(dataclasses.replace(made([final] * 16), task=task.name), name, 0)
            for name in seeds
            for task in ALL
        ]

    page, before = tmp_path / "page.md", "".join(f"<!-- table {name} -->\n<!-- end -->\n" for name in CAMPAIGN)
    page.write_text(before, encoding="utf-8")
    for name, value in (("campaign", outcomes), ("draw", Figure), ("microseconds", lambda: 1.0)):
        monkeypatch.setattr(control, name, value)
    monkeypatch.setattr(control, "explorations", lambda _: 0.7)
    command = ["control", "--output", str(tmp_path), "--page", str(page)]
    monkeypatch.setattr("sys.argv", command)
    control.main()
    whole = page.read_text(encoding="utf-8").splitlines()
    monkeypatch.setattr("sys.argv", [*command, "--only", "unknown"])
    control.main()
    changed = [
        (old, new) for old, new in zip(whole, page.read_text(encoding="utf-8").splitlines(), strict=True) if old != new
    ]
    rows, columns = changed[:2], changed[2:]
    assert all(old.startswith("| unknown |") and "1.25" in new for old, new in rows)
    assert len(columns) == len(LIFTS)
    assert all(new.split(" | ")[2].startswith("1/1, 1.25") for _, new in columns)
    assert all(new.split(" | ")[1] == old.split(" | ")[1] for old, new in columns)


def test_there_are_twelve_lifts_and_the_paper_s_six_tasks_by_names_of_their_own() -> None:
    assert (len(LIFTS), len(PAPER)) == (12, 6)
    assert len({task.name for task in ALL}) == 19


def test_a_step_of_load_comes_faster_than_the_paper_s_sudden_load() -> None:
    sudden = next(task for task in PAPER if task.name == "sudden load and twist")
    assert STEP.load(4.03).resultant() == pytest.approx(sudden.load(4.15).resultant())
    assert STEP not in TASKS
