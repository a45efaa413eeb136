"""Forces that do not go with displacement lose weight, and the history says so; sound ones are believed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark.faults import Fault, changed_forces, crosstalk, late, stuck, tilted
from slipcore import GraspLog, SlipDetector, SlipHistory, detect_slip

Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]

SCENES = ("cond1", "cond4", "reversal", "ring", "cond1_layer5c")
FROZEN = changed_forces(stuck)


def seen(log: GraspLog, fault: Fault) -> GraspLog:
    return fault(log, np.random.default_rng(3))


@pytest.mark.parametrize("noise", [1e-6, 1e-5])
@pytest.mark.parametrize(
    ("fault", "most"), [(crosstalk(0.3), 0.01), (late(0.5), 0.025), (FROZEN, 0.01)], ids=["crosstalk", "late", "frozen"]
)
def test_contradicting_forces_are_hardly_worse_than_none(
    scene: Scene, f1_score: Score, fault: Fault, most: float, noise: float
) -> None:
    """Forces that are late cost what slips before they show the first touch."""
    logs = [seen(scene(name, marker_noise=noise, force_noise=2e-3), fault) for name in SCENES]
    alone = np.mean([f1_score(log, detect_slip(replace(log, force=None))) for log in logs])
    assert np.mean([f1_score(log, detect_slip(log)) for log in logs]) > alone - most


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (late(0.5), "forces not believed"),
        (FROZEN, "forces not believed"),
        (crosstalk(0.3), "crosstalk"),
        (tilted(15.0), "crosstalk"),
    ],
    ids=["late", "frozen", "crosstalk", "tilted"],
)
def test_what_contradicts_is_told(scene: Scene, fault: Fault, name: str) -> None:
    log = seen(scene("cond1", marker_noise=1e-6, force_noise=2e-3), fault)
    assert name in {finding.name for finding in detect_slip(log).findings}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-5])
def test_sound_forces_are_believed(scene: Scene, name: str, noise: float) -> None:
    log = scene(name, marker_noise=noise, force_noise=2e-3 if noise else 0.0)
    assert detect_slip(log).findings == ()


def test_forces_beside_markers_in_the_plane_are_believed(scene: Scene) -> None:
    """Without depth nothing says how forces and displacement go together."""
    log = scene("cond1", marker_noise=1e-6, force_noise=2e-3)
    flat = replace(log, displacement=log.displacement * [1.0, 1.0, 0.0], normal=log.normal)
    assert detect_slip(flat).findings == ()


def test_an_offset_that_was_there_at_rest_contradicts_nothing(scene: Scene) -> None:
    log = scene("cond1", marker_noise=1e-6, force_noise=2e-3)
    assert detect_slip(replace(log, force=log.force + np.array([1e-3, -1e-3, -1e-3]))).findings == ()


def test_a_stream_doubts_as_the_whole_log_does(scene: Scene) -> None:
    log = seen(scene("cond1", marker_noise=1e-6, force_noise=2e-3), FROZEN)
    detector = SlipDetector(log.position, log.element_area)
    slip = [
        detector.step(frame.time, frame.displacement, frame.force, frame.object_pose, frame.normal).slip
        for frame in log.frames()
    ]
    history = detect_slip(log)
    np.testing.assert_array_equal(slip, history.slip)
    assert detector.findings == history.findings != ()
