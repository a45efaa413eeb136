"""An object cannot pull: where it seems to, slip is told from displacement, and the history says so."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slipcore import GraspLog, SlipDetector, SlipHistory, check_log, detect_slip

Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]


def turned(log: GraspLog) -> GraspLog:
    """With the sign of its forces turned."""
    return replace(log, force=-np.asarray(log.force))


def test_forces_of_the_wrong_sign_are_no_worse_than_none(scene: Scene, f1_score: Score) -> None:
    for name in ("ring", "cond1_layer5c"):
        log = scene(name, marker_noise=1e-6, force_noise=2e-3)
        alone = f1_score(log, detect_slip(replace(log, force=None)))
        assert f1_score(log, detect_slip(turned(log))) > alone - 0.01  # 0 where contact is by force: there is none


def test_what_was_not_believed_is_said(scene: Scene) -> None:
    log = scene("ring", marker_noise=1e-6, force_noise=2e-3)
    history = detect_slip(turned(log))
    assert [finding.name for finding in history.findings] == ["forces not believed"]
    assert {"forces not believed", "force pulls"} <= {finding.name for finding in check_log(turned(log), history)}
    assert detect_slip(log).findings == detect_slip(replace(log, force=None)).findings == ()


def test_a_stream_finds_what_the_whole_log_does(scene: Scene) -> None:
    log = turned(scene("ring", marker_noise=1e-6, force_noise=2e-3))
    detector = SlipDetector(log.position, log.element_area)
    slip = [
        detector.step(frame.time, frame.displacement, frame.force, frame.object_pose, frame.normal).slip
        for frame in log.frames()
    ]
    history = detect_slip(log)
    np.testing.assert_array_equal(slip, history.slip)
    assert detector.findings == history.findings != ()


def test_a_pull_within_noise_is_none(scene: Scene) -> None:
    """Before the touch sums of noise are as often below 0 as above it."""
    log = scene("ring", marker_noise=1e-6, force_noise=2e-2)
    assert detect_slip(log).findings == ()
