from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest
from scipy.spatial import cKDTree

import estimators
from db.records import SamplesOfLog, Signature
from service.domain.logs import same_grasp
from service.domain.logs.same_grasp import (
    OF_FORCE,
    PROJECTIONS,
    Grasps,
    ProjectedFrames,
    find_alike,
    fingerprint,
    signature,
    with_copies,
)
from slipcore import GraspLog
from slipcore.samples import FrictionSamples
from stiction_client.support import notes


def single(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)


def test_times_places_names_and_precision_leave_the_fingerprint_as_it_is(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert ramp.force is not None
    own = fingerprint(ramp)
    others = (
        replace(ramp, time=ramp.time + 1000.0),
        replace(ramp, position=2.0 * ramp.position, displacement=1.1 * ramp.displacement),  # another pitch and rest
        replace(ramp, sensor="other", metadata={"run": "2"}, truth=None),
        replace(ramp, displacement=single(ramp.displacement), force=single(ramp.force)),
        replace(ramp, force=np.where(ramp.force == 0.0, -0.0, ramp.force)),
    )
    assert {fingerprint(other) for other in others} == {own}
    monkeypatch.setattr(same_grasp, "FRAMES_AT_ONCE", 7)
    assert fingerprint(ramp) == own


def test_noise_an_element_and_a_frame_make_another_fingerprint(ramp: GraspLog) -> None:
    assert ramp.force is not None
    noise = np.random.default_rng(1).normal(0.0, 1e-6, ramp.force.shape)
    turned = replace(ramp, force=ramp.force.swapaxes(1, 2))
    others = (replace(ramp, force=ramp.force + noise), ramp.take(slice(-1)), turned)
    assert len({fingerprint(ramp), *map(fingerprint, others)}) == 4


def test_without_forces_displacements_are_compared(ramp: GraspLog) -> None:
    bare = replace(ramp, force=None)
    assert fingerprint(replace(bare, time=ramp.time + 1.0)) == fingerprint(bare) != fingerprint(ramp)
    assert fingerprint(replace(bare, displacement=1.001 * ramp.displacement)) != fingerprint(bare)


def noisy(ramp: GraspLog, seed: int, noise: float = 1e-3) -> GraspLog:
    """The same grasp as another recording of it would show it, with noise of so many N."""
    assert ramp.force is not None
    return replace(ramp, force=ramp.force + np.random.default_rng(seed).normal(0.0, noise, ramp.force.shape))


def alike(one: GraspLog, other: GraspLog) -> bool:
    found = ProjectedFrames(signature(one)).are_alike(ProjectedFrames(signature(other)))
    assert ProjectedFrames(signature(other)).are_alike(ProjectedFrames(signature(one))) == found
    return found


CHANGES: dict[str, Callable[[GraspLog], GraspLog]] = {
    "without its last frame": lambda log: log.take(slice(-1)),
    "without its first frame": lambda log: log.take(slice(1, None)),
    "its first half": lambda log: log.take(slice(len(log) // 2)),
    "every second frame": lambda log: log.take(slice(None, None, 2)),
    "with fewer digits": lambda log: replace(log, force=np.round(np.asarray(log.force), 4)),
    "in half precision": lambda log: replace(log, force=np.asarray(log.force).astype(np.float16)),
    "scaled by a little": lambda log: replace(log, force=1.00005 * np.asarray(log.force)),
    "with little noise": lambda log: noisy(log, 9, 1e-6),
    "later": lambda log: replace(log, time=log.time + 100.0),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_log_that_was_cut_or_rounded_is_of_the_same_grasp(ramp: GraspLog, change: str) -> None:
    log = noisy(ramp, 1)
    assert alike(log, CHANGES[change](log))


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2])
def test_the_same_grasp_once_more_is_another(ramp: GraspLog, noise: float) -> None:
    """Noise alone tells them apart."""
    assert not alike(noisy(ramp, 1, noise), noisy(ramp, 2, noise))


def test_without_forces_displacements_are_looked_for(ramp: GraspLog) -> None:
    bare = replace(ramp, force=None)
    assert alike(bare, bare.take(slice(3, -3)))
    assert not alike(bare, ramp)


@pytest.mark.parametrize("frames", [2, 5])
def test_frames_without_any_load_are_no_grasp(ramp: GraspLog, frames: int) -> None:
    rest = replace(ramp, force=0.0 * np.asarray(ramp.force)).take(slice(frames))
    assert not alike(rest, rest)
    assert not alike(rest, ramp)


def test_no_more_frames_are_compared_than_a_second_allows(ramp: GraspLog, monkeypatch: pytest.MonkeyPatch) -> None:
    own = signature(ramp)
    known = [Signature("a", signature(noisy(ramp, 1))), Signature("b", own)]
    assert find_alike(own, known) == ["b"]
    monkeypatch.setattr(same_grasp, "MOST_COMPARED", 2 * len(ramp) - 1)
    assert find_alike(own, known) == []


def told(grasps: Grasps, log: GraspLog) -> str:
    """The grasp that a log is of, as told at once."""
    return grasps.of(grasps.see(log, is_touched=True))


def coarse(ramp: GraspLog, seed: int) -> GraspLog:
    """Nine elements whose forces come in steps of .1 N, ten times their noise, of a grasp with its own force."""
    generator = np.random.default_rng(seed)
    load = np.interp(np.arange(len(ramp)), [0, 30, 60], [0.0, 1.0, 1.0])[:, None, None, None]
    force = load * generator.normal(1.0, 0.01) * np.array([0.2, 0.1, -0.6]) * np.ones((3, 3, 1))
    force = np.round((force + generator.normal(0.0, 0.01, force.shape)) / 0.1) * 0.1
    shown = ramp.displacement[:, 2:5, 2:5]
    return GraspLog(ramp.time, ramp.position[2:5, 2:5], shown, ramp.element_area, force=force)


def test_grasps_of_few_elements_in_coarse_steps_are_not_taken_for_one(ramp: GraspLog) -> None:
    """Of eight grasps in steps of .1 N one had counted."""
    logs = [coarse(ramp, seed) for seed in range(4)]
    assert not any(alike(one, other) for one, other in pairwise(logs))
    grasps = Grasps()
    assert len({told(grasps, log) for log in logs}) == 4
    assert told(grasps, replace(logs[1], time=ramp.time + 1.0)) == fingerprint(logs[1])


def test_the_frames_of_a_log_are_ordered_once_for_all_comparisons(
    ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of a log of 20,000 frames had been for each of them: 9 s beside 1,000 logs."""
    ordered: list[int] = []

    def noted(frames: np.ndarray) -> cKDTree:
        ordered.append(len(frames))
        return cKDTree(frames)

    monkeypatch.setattr("scipy.spatial.cKDTree", noted)
    own, others = noisy(ramp, 0).take(slice(-1)), [noisy(ramp, seed) for seed in range(1, 6)]
    assert find_alike(signature(own), [Signature("a", signature(other)) for other in others]) == []
    assert sorted(ordered) == [len(own)] + [len(ramp)] * 5


def test_grasps_of_files_are_told_apart_by_the_last_of_them(ramp: GraspLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(same_grasp, "MOST_LOGS", 2)
    grasps = Grasps()
    logs = [noisy(ramp, seed) for seed in range(3)]
    marks = [fingerprint(log) for log in logs]
    cut = logs[0].take(slice(-1))
    assert [told(grasps, log) for log in (*logs[:2], cut, cut, logs[2])] == [
        *marks[:2],
        *marks[:1] * 2,
        marks[2],
    ]
    assert told(grasps, logs[1].take(slice(-1))) != marks[1]  # two came since
    assert told(grasps, logs[1]) == marks[1]
    untouched = logs[2].take(slice(-1))
    assert grasps.of(grasps.see(untouched, is_touched=False)) == fingerprint(untouched)


@pytest.mark.parametrize("first", [slice(35), slice(0, None, 2)])
@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_parts_of_a_grasp_and_the_whole_are_one_in_any_order(
    ramp: GraspLog, first: slice, order: tuple[int, ...]
) -> None:
    """Where the whole came after both parts, the first part had counted beside it."""
    whole, other = noisy(ramp, 1), noisy(ramp, 2)
    rest = np.setdiff1d(np.arange(len(whole)), np.arange(len(whole))[first])
    second = slice(int(rest[0]), None, int(rest[1] - rest[0]))
    logs = [whole.take(first), whole.take(second), whole]
    assert not alike(*logs[:2])
    grasps = Grasps()
    seen = [grasps.see(each, is_touched=True) for each in (other, *(logs[place] for place in order), other)]
    assert [grasps.of(each) for each in seen] == [seen[0], *[seen[1]] * 3, seen[0]]


def test_a_quiet_hold_whose_frames_are_all_near_is_known_again_in_its_half() -> None:
    """Thousands of frames lie within rounding of each other; of each a few are looked at."""
    steady = np.linspace(0.1, 1.0, PROJECTIONS) + 1e-5 * np.random.default_rng(4).standard_normal((5_000, PROJECTIONS))
    whole, half, heavier = (
        ProjectedFrames(OF_FORCE + each.astype("<f4").tobytes()) for each in (steady, steady[::2], 1.01 * steady)
    )
    assert whole.are_alike(half)
    assert half.are_alike(whole)
    assert not whole.are_alike(heavier)


def test_a_note_names_the_copies_and_what_to_do() -> None:
    v, f_n, mu = (np.random.default_rng(2).uniform(0.1, 1.0, 50) for _ in range(3))
    samples = FrictionSamples(mu, v, f_n, mu * f_n, v, np.arange(50) % 9, np.ones(50), 1e-6)
    model = estimators.fit([samples], method="ols")
    alone = SamplesOfLog("a", "blob", None)
    assert with_copies(model, [alone]) is model
    (told,) = notes(with_copies(model, [alone, replace(alone, copies=("b",))]).diagnostics)
    assert told == "1 log repeats the measurements of another log: counted once (b of a); " + same_grasp.REMEDY
    (told,) = notes(with_copies(model, [replace(alone, copies=tuple("bcdefgh"))]).diagnostics)
    assert told.startswith("7 logs repeat ")
    assert "f of a, 2 more)" in told


@pytest.mark.parametrize("reading", [2e-4, 20.0, 9999.0])
def test_a_reading_that_is_odd_makes_no_grasp_like_another(ramp: GraspLog, reading: float) -> None:
    """Of a log that nothing touches but for it, or of a sound one: all later logs of the material were copies of it."""
    one, other = noisy(ramp, 1), noisy(ramp, 2)
    assert one.force is not None
    empty, odd = np.zeros(one.force.shape), one.force.copy()
    empty[20:60:3, 5, 5, 2] = odd[40, 3, 3, 2] = reading
    assert not alike(replace(one, force=empty), other)
    assert not alike(replace(one, force=odd), other)
    assert alike(replace(one, force=odd), one)


def test_forces_are_never_like_displacements(ramp: GraspLog) -> None:
    assert not alike(ramp, replace(ramp, force=None))
