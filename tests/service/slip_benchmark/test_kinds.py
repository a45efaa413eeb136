"""What is wrong with each sensor of the benchmark is as strong as its name says, and in its order."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from service.slip_benchmark.kinds import KINDS, SensorFault, faults_of, in_plane, kinds_named, pairing
from slipcore import FrictionLaw, GraspLog
from slipcore.errors import InvalidInput
from slipcore.frames import GroundTruth

FRAMES, SIDE = 200, 10
LATTICE, PILLARS, FLAT, DEPTH = KINDS.values()


@pytest.fixture(scope="module")
def log() -> GraspLog:
    """Nothing moves, and each element bears 1 N and half of that along x; one row of elements does not touch."""
    shape = (FRAMES, SIDE, SIDE)
    x, y = 1e-3 * np.mgrid[:SIDE, :SIDE]
    contact, none = np.ones(shape, bool), np.zeros(shape, bool)
    contact[:, 0] = False
    truth = GroundTruth(contact, none, none, np.ones(FRAMES), FrictionLaw((0.5, 0.0, 0.0)))
    force = np.broadcast_to([0.5, 0.0, -1.0], (*shape, 3)).copy()
    position = np.stack([x, y, np.zeros_like(x)], axis=-1)
    return GraspLog(
        np.arange(FRAMES) / 100.0, position, np.zeros((*shape, 3)), 1e-6, force=force, truth=truth,
        object_pose=np.zeros((FRAMES, 3)), normal=np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy(),
    )  # fmt: skip


def seen(log: GraspLog, fault: str, kind: Any = LATTICE) -> GraspLog:
    (found,) = (each for each in faults_of(kind) if each.name == fault)
    return found.seen(kind, log, np.random.default_rng(1))


@pytest.mark.parametrize(
    ("fault", "deviation"), [("no noise", 0.0), ("noise 1 µm", 1e-6), ("noise 3 µm", 3e-6), ("noise 10 µm", 1e-5)]
)
def test_markers_are_as_noisy_as_is_said(log: GraspLog, fault: str, deviation: float) -> None:
    told = seen(log, fault)
    assert told.displacement.std() == pytest.approx(deviation, rel=0.02)
    assert told.force is not None
    assert told.force[..., 1].std() == pytest.approx(2e-3 if deviation else 0.0, rel=0.02)
    assert (told.object_pose, told.normal) == (None, None)


def test_each_other_fault_comes_with_noise_of_1_um(log: GraspLog) -> None:
    shaken = seen(log, "common shake 5 µm").displacement
    assert shaken.mean(axis=(1, 2))[:, :2].std() == pytest.approx(5e-6, rel=0.1)
    assert (shaken - shaken.mean(axis=(1, 2), keepdims=True)).std() == pytest.approx(1e-6, rel=0.02)
    wandering = seen(log, "correlated noise (0.9) 3 µm").displacement
    assert wandering.std() == pytest.approx(np.hypot(3e-6, 1e-6), rel=0.05)
    assert (wandering[1:] * wandering[:-1]).mean() == pytest.approx(0.9 * 9e-12, rel=0.1)
    one_step = log.displacement.copy()
    one_step[100:] = 2e-5
    stays = seen(replace(log, displacement=one_step), "hysteresis 5 µm").displacement
    assert stays[100:].mean() == pytest.approx(1.5e-5, rel=0.01)


def test_as_many_markers_and_frames_are_lost_as_is_said(log: GraspLog) -> None:
    observed = seen(log, "10 % of markers lost").observed
    assert observed is not None
    assert 0.03 < 1.0 - observed.mean() < 0.2
    assert len(seen(log, "10 % of frames dropped")) == 180
    crossed = seen(log, "crosstalk 10 %").force
    assert crossed is not None
    assert crossed[..., 0].mean() == pytest.approx(0.4, rel=0.01)
    steady = 2e-5 * np.arange(FRAMES)[:, None, None, None]
    moving = replace(log, displacement=np.broadcast_to(steady, log.displacement.shape))
    told = seen(moving, "5 % of markers freeze", DEPTH).displacement
    assert 0.0 < (told[-1, ..., 0] < 3e-3).mean() < 0.12


def test_a_camera_sees_no_forces_and_without_depth_what_touches(log: GraspLog) -> None:
    flat, deep = seen(log, "noise 1 µm", FLAT), seen(log, "noise 1 µm", DEPTH)
    assert (flat.force, deep.force, deep.contact) == (None, None, None)
    assert not flat.displacement[..., 2].any()
    assert flat.displacement[..., 1].std() == pytest.approx(1e-6, rel=0.02)
    assert deep.displacement[..., 2].std() == pytest.approx(1e-6, rel=0.02)
    assert log.truth is not None
    assert np.array_equal(np.asarray(flat.contact), log.truth.contact)
    moved = in_plane(replace(log, displacement=log.displacement + 1e-3))
    assert moved.displacement[0, 0, 0].tolist() == [1e-3, 1e-3, 0.0]


def test_sensors_differ_in_what_they_measure() -> None:
    told = {each.name: (each.points, each.frame_rate, each.force_noise, each.in_plane) for each in KINDS.values()}
    assert told == {
        "lattice 20x20": ((20, 20), 30.0, 2e-3, False),
        "pillars 3x3": ((3, 3), 1000.0, 1e-2, False),
        "markers 10x7": ((10, 7), 25.0, None, True),
        "markers 30x30": ((30, 30), 30.0, None, False),
    }
    assert [each.name for each in KINDS.values() if each.are_pillars] == ["pillars 3x3"]
    assert [round(each.pitch * each.points[0], 6) for each in (LATTICE, FLAT, DEPTH)] == [0.015] * 3  # one gel


def test_scenes_have_each_kind_in_turn_and_then_the_next_fault() -> None:
    pairs = pairing((LATTICE, FLAT))
    assert len(pairs) == 20
    assert [(kind.name, fault.name) for kind, fault in pairs[:4]] == [
        ("lattice 20x20", "no noise"),
        ("markers 10x7", "no noise"),
        ("lattice 20x20", "noise 1 µm"),
        ("markers 10x7", "noise 1 µm"),
    ]
    assert [fault.name for _, fault in pairs[-2:]] == ["crosstalk 10 %", "5 % of markers freeze"]


def test_kinds_are_named_once_and_keep_their_own_order() -> None:
    assert kinds_named(()) == tuple(KINDS.values())
    assert kinds_named(["markers 10x7", "lattice 20x20"]) == (LATTICE, FLAT)
    for names in (["pillars 3x3"] * 2, ["lattice 20x20", "other"]):
        with pytest.raises(
            InvalidInput, match=f"kind is {names[-1]}; allowed: each once of lattice 20x20, pillars 3x3"
        ):
            kinds_named(names)


def test_a_fault_is_put_in_before_noise() -> None:
    """Whose own is not rounded or smoothed by it."""

    def nothing_moves(log: GraspLog, _: np.random.Generator) -> GraspLog:
        return replace(log, displacement=np.zeros_like(log.displacement))

    fault = SensorFault("mine", 1e-6, nothing_moves)
    log = GraspLog(np.arange(2.0), np.zeros((1, 1, 3)), np.zeros((2, 1, 1, 3)), 1e-6, force=np.ones((2, 1, 1, 3)))
    assert fault.seen(LATTICE, log, np.random.default_rng(0)).displacement.all()
