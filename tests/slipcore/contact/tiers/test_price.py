"""What runs cost by their steps and cells, and what is told of the pace from those that were made."""

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from slipcore.contact.defaults import ACCURACY
from slipcore.contact.effects import LoadPath, NormalTangentialCoupling, SensorSampling
from slipcore.contact.scene import Press, Scene
from slipcore.contact.tiers import choice, requests
from slipcore.contact.tiers.boundary_elements import Fidelity, step_growth
from slipcore.contact.tiers.load_steps import LoadSteps
from slipcore.contact.tiers.price import Pace, Size, Sizes
from slipcore.contact.tiers.probe import ContactProbe, probe
from slipcore.contact.tiers.requests import OutOfTime, Runs
from slipcore.contact.tiers.sampling import frame_times
from slipcore.errors import InvalidInput

ORDER, USUAL, SPREAD = ACCURACY.cost_order, ACCURACY.overhead_cells, ACCURACY.overhead_spread


def test_work_goes_by_steps_and_a_little_more_than_by_cells() -> None:
    assert Size(7, 400).work(0.0) == pytest.approx(7 * 400**ORDER, rel=1e-12)
    assert Size(7, 400).work(100.0) == pytest.approx(7 * (400**ORDER + 100**ORDER), rel=1e-12)


def test_before_the_first_run_nothing_is_known_and_after_it_the_usual() -> None:
    pace = Pace()
    assert pace.seconds(Size(10, 1000)) == 0.0
    pace.learn(Size(10, 1000), 3.0)
    assert pace.overhead == USUAL
    assert pace.seconds(Size(20, 1000)) == pytest.approx(6.0, rel=1e-12)
    larger = Size(10, 4000)
    expected = 3.0 * larger.work(USUAL) / Size(10, 1000).work(USUAL)
    assert pace.seconds(larger) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("substeps", [1, 2, 8])
def test_sizes_count_the_load_steps_of_a_run(substeps: int) -> None:
    """Of a press that shears, and of two pulls close to sliding; but for rounding, and without in one step a frame."""
    path = LoadPath((0.5, 1.1, 1.7), force_x=(0.0, 3.4, -3.4))
    effects = (path, NormalTangentialCoupling(), SensorSampling((12, 12), 1e-3, 10.0))
    plan = Scene("loop", effects, press=Press(10.0, 0.5), duration=1.7).plan()
    contact, fidelity = probe(plan), Fidelity(48, substeps)
    steps, frames = LoadSteps(plan, contact), pairwise(map(float, frame_times(plan)))
    made = sum(len(steps.between(*ends, substeps, step_growth(fidelity))) - 1 for ends in frames)
    assert Sizes(plan, contact).of(fidelity).steps == pytest.approx(made, rel=0.0 if substeps == 1 else 0.03)


def told(small: tuple[int, float], large: tuple[int, float]) -> float:
    """Overhead by two runs of ten steps: their cells and seconds a step; the order in which they came is no matter."""
    found = set()
    for runs in ((small, large), (large, small)):
        pace = Pace()
        for cells, seconds in runs:
            pace.learn(Size(10, cells), 10 * seconds)
        found.add(pace.overhead)
    assert len(found) == 1
    return found.pop()


@pytest.mark.parametrize("beside", [USUAL / 2.0, USUAL, USUAL * 3.0])
def test_the_overhead_is_what_does_not_grow_with_cells(beside: float) -> None:
    first, last = (1e-6 * (cells**ORDER + beside**ORDER) for cells in (1000, 10_000))
    assert told((1000, first), (10_000, last)) == pytest.approx(beside, rel=1e-9)


@pytest.mark.parametrize(
    ("first", "last", "overhead"),
    [
        (1e-3, 1e-3, USUAL * SPREAD),  # cells cost nothing
        (2e-3, 1e-3, USUAL * SPREAD),
        (1e-9, 1e-3, USUAL / SPREAD),  # all but cells costs nothing
        (1.0, 1.0 + 1e-6, USUAL * SPREAD),
    ],
)
def test_the_overhead_lies_within_a_factor_of_the_usual(first: float, last: float, overhead: float) -> None:
    assert told((1000, first), (10_000, last)) == pytest.approx(overhead, rel=1e-9)


def test_grids_that_are_nearly_alike_tell_no_overhead() -> None:
    growth = ACCURACY.telling_growth
    assert told((1000, 1e-3), (int(1000 * growth) - 1, 1e-3)) == USUAL
    assert told((1000, 1e-3), (int(1000 * growth) + 1, 1e-3)) == USUAL * SPREAD


def test_the_run_with_the_most_work_tells_the_pace() -> None:
    pace = Pace()
    pace.learn(Size(10, 1200), 4.0)
    pace.learn(Size(30, 1000), 9.0)
    assert pace.overhead == USUAL  # 1.2 is no telling growth
    assert pace.seconds(Size(30, 1000)) == pytest.approx(9.0, rel=1e-12)


class Clock:
    """Seconds that stand still until they are set."""

    now = 100.0

    def perf_counter(self) -> float:
        return self.now


def made(monkeypatch: pytest.MonkeyPatch, budget: float, parts: list[tuple[float, float]], **options: bool) -> Any:
    """Runs whose solver tells these parts at these seconds; and what is reported."""
    clock, reported = Clock(), list[float]()
    monkeypatch.setattr(requests, "time", clock)

    def run(_: Any, __: Any, heard: Any) -> str:
        for part, seconds in parts:
            clock.now = 100.0 + seconds
            heard(part)
        return "log"

    monkeypatch.setattr(requests, "run", run)
    monkeypatch.setattr(requests, "Sizes", lambda *_: SimpleNamespace(of=lambda size: size))
    return Runs(ContactProbe(5e-3), budget, reported.append, **options), reported, clock


PLAN: Any = SimpleNamespace(sampling=SimpleNamespace(frame_rate=30.0))


def test_a_run_is_learnt_from_and_its_part_of_the_budget_told(monkeypatch: pytest.MonkeyPatch) -> None:
    runs, reported, clock = made(monkeypatch, 10.0, [(0.25, 1.0), (0.75, 0.5), (1.0, 4.0)])
    assert runs.price(PLAN, Size(10, 1000)) == 0.0
    assert runs.run(PLAN, Size(10, 1000)) == "log"
    assert reported == [0.1, 0.1, 0.4]  # never less than before
    assert (runs.spent, runs.left) == (4.0, 6.0)
    assert runs.price(PLAN, Size(20, 1000)) == pytest.approx(8.0, rel=1e-12)
    clock.now += 100.0
    assert runs.left == -94.0


def test_without_a_budget_the_part_of_what_is_to_come_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two runs alike, and a quarter more ahead than is expected."""
    runs, reported, _ = made(monkeypatch, math.inf, [(0.5, 1.0), (1.0, 2.0)])
    runs.expect(PLAN, [Size(10, 1000)] * 2)
    runs.run(PLAN, Size(10, 1000))
    whole = ACCURACY.more_ahead * 2.0
    assert reported == pytest.approx([0.5 / whole, 1.0 / whole], rel=1e-12)
    runs.run(PLAN, Size(10, 1000))
    assert reported[2:] == pytest.approx([1.5 / (1.0 + whole / 2.0), 2.0 / (1.0 + whole / 2.0)], rel=1e-12)


@pytest.mark.parametrize(
    ("part", "seconds", "ends"),
    [
        (ACCURACY.telling_part, 0.99 * ACCURACY.overdrawn * ACCURACY.telling_part * 10.0, False),
        (ACCURACY.telling_part, 1.01 * ACCURACY.overdrawn * ACCURACY.telling_part * 10.0, True),
        (0.9 * ACCURACY.telling_part, 9.0, False),  # too early to say
        (0.01, 1.01 * ACCURACY.overdrawn * 10.0, True),
        (1.0, 20.0, False),  # it is over
    ],
)
def test_a_run_that_proves_to_overdraw_the_budget_is_ended(
    part: float, seconds: float, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, _, _ = made(monkeypatch, 10.0, [(part, seconds)])
    if not ends:
        assert runs.run(PLAN, Size(10, 1000)) == "log"
        return
    with pytest.raises(OutOfTime) as ended:
        runs.run(PLAN, Size(10, 1000))
    assert ended.value.seconds == pytest.approx(seconds / max(part, ACCURACY.least_part), rel=1e-9)
    loose, _, _ = made(monkeypatch, 10.0, [(part, seconds)], strict=False)
    assert loose.run(PLAN, Size(10, 1000)) == "log"


def tiers(**accuracies: float | None) -> Any:
    return tuple(
        SimpleNamespace(NAME=name, accuracy=lambda *_, reached=reached: reached) for name, reached in accuracies.items()
    )


def test_the_first_tier_that_is_as_accurate_as_asked_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    found = tiers(unknown=None, coarse=0.1, fine=0.01)
    monkeypatch.setattr(choice, "TIERS", found)
    scene: Any = SimpleNamespace(name="press")
    asked = {accuracy: choice.cheapest(scene, PLAN, accuracy) for accuracy in (0.2, 0.1, 0.05, 0.01, 0.001)}
    assert list(asked.values()) == [found[1], found[1], found[2], found[2], None]


def test_a_tier_is_taken_by_name_where_it_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    found = tiers(unknown=None, coarse=0.1)
    monkeypatch.setattr(choice, "TIERS", found)
    scene: Any = SimpleNamespace(name="press")
    assert choice.named("coarse", scene, PLAN) is found[1]
    assert choice.named("coarse", scene, PLAN, 0.1) is found[1]
    assert choice.named(choice.BOUNDARY_ELEMENTS, scene, PLAN, 1e-9) is None
    with pytest.raises(InvalidInput, match=r"tier is coarse; allowed: .*scene press to 0\.05 \(this one to 0\.1\)"):
        choice.named("coarse", scene, PLAN, 0.05)
    with pytest.raises(InvalidInput, match="tier is unknown; allowed: one that holds for scene press, as boundary"):
        choice.named("unknown", scene, PLAN)
    with pytest.raises(InvalidInput, match="tier is none; allowed: unknown, coarse, boundary elements"):
        choice.named("none", scene, PLAN)
