"""Forces that are late, leak sideways or stand still are found by what markers do, and no worse than none."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.formats import tac3d
from slipcore import GraspLog, SlipDetector, SlipHistory, check_log, detect_slip
from slipcore.contact import Press, Scene, simulate
from slipcore.contact.effects import FiniteLayer, ForceNoise, MarkerNoise, SensorSampling, TangentialLoad
from slipcore.detection.contradicting_forces import agreeing, changes_of, crosstalk_of, lag_of_forces

MakeScene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]
SCENES = ("cond1", "cond4", "reversal", "ring", "cond1_layer5c")
RECORDINGS = Path(__file__).parents[3] / ".cache/tac3d/PyTac3D/example_data"


def late(log: GraspLog, lag: float) -> GraspLog:
    """With forces of ``lag`` seconds before; early ones, if that is negative."""
    assert log.force is not None
    return replace(log, force=log.force[np.clip(np.arange(len(log)) - round(30.0 * lag), 0, len(log) - 1)])


def leaking(log: GraspLog, x: float, y: float) -> GraspLog:
    """With those shares of each normal force along x and y, too."""
    assert log.force is not None
    pressing = -log.force[..., 2]
    return replace(log, force=log.force + np.stack([x * pressing, y * pressing, 0.0 * pressing], axis=-1))


def standing(log: GraspLog) -> GraspLog:
    """With forces that stay as they are from half of the time on."""
    assert log.force is not None
    return replace(log, force=log.force[np.minimum(np.arange(len(log)), len(log) // 2)])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_sound_forces_stay_as_they_are(scene: MakeScene, name: str, noise: float) -> None:
    log = scene(name, marker_noise=noise, force_noise=2e-3)
    assert agreeing(log)[0] is log


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-6, 1e-5, 4e-5])
def test_forces_of_a_press_at_a_slant_stay_as_they_are(noise: float) -> None:
    """They rise together, so that crosstalk would explain the little that no stiffness does exactly."""
    scene = Scene(
        name="slant",
        friction=0.6,
        press=Press(force=6.0, duration=1.5),
        duration=2.0,
        effects=(
            TangentialLoad(force=(2.0, 0.0), start=0.0, duration=1.5),
            FiniteLayer(thickness=3e-3),
            SensorSampling(points=(14, 14), pitch=1e-3, frame_rate=30.0),
            MarkerNoise(scale=noise),
            ForceNoise(scale=min(10.0 * noise, 2e-4)),
        ),
    )
    log = simulate(scene, seed=1)
    assert agreeing(log)[0] is log


@pytest.mark.parametrize("delay", [2, 3])
def test_no_lag_is_taken_under_a_load_that_comes_again_and_again(scene: MakeScene, delay: int) -> None:
    """Markers that are a little late go with the forces of the period before as well."""
    log = scene("cond1", marker_noise=1e-6, force_noise=2e-3)
    assert log.force is not None
    middle, frames = len(log) // 2, np.arange(240)
    swing = np.sin(2.0 * np.pi * 2.0 * frames / 30.0)
    displacement, force = (
        field[middle] * (1.0 + 0.3 * part[:, None, None, None])
        for field, part in ((log.displacement, np.roll(swing, delay)), (log.force, swing))
    )
    none = {"normal": None, "object_pose": None, "truth": None}
    swung = GraspLog(frames / 30.0, log.position, displacement, log.element_area, force=force, **none)
    assert lag_of_forces(changes_of(swung)) == 0.0


def test_depth_alone_says_nothing_of_forces_along_the_surface(scene: MakeScene) -> None:
    log = scene("cond1", marker_noise=1e-6, force_noise=2e-3)
    assert agreeing(leaking(replace(log, displacement=log.displacement * [0.0, 0.0, 1.0]), 0.3, 0.0))[1] == ()


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("lag", [-0.1, 0.1, 0.5])
def test_a_lag_is_found_to_a_frame(scene: MakeScene, name: str, lag: float) -> None:
    log = late(scene(name, marker_noise=1e-5, force_noise=2e-3), lag)
    assert lag_of_forces(changes_of(log)) == pytest.approx(lag, abs=1.01 / 30.0)


@pytest.mark.parametrize("name", sorted({*SCENES} - {"cond4"}))  # which only turns: no sum along the surface shows it
def test_crosstalk_is_found_to_a_hundredth_beside_a_lag(scene: MakeScene, name: str) -> None:
    log = leaking(scene(name, marker_noise=1e-5, force_noise=2e-3), 0.3, -0.1)
    np.testing.assert_allclose(crosstalk_of(changes_of(log)), [0.3, -0.1], rtol=0.0, atol=0.012)
    assert [finding.name for finding in agreeing(late(log, 0.3))[1]] == ["late forces", "crosstalk"]


@pytest.mark.parametrize(
    "fault",
    [lambda log: late(log, 0.5), lambda log: late(log, -0.1), lambda log: leaking(log, -0.3, 0.0), standing],
)
@pytest.mark.parametrize("noise", [1e-6, 1e-5])
def test_such_forces_are_no_worse_than_none(
    scene: MakeScene, f1_score: Score, fault: Callable[[GraspLog], GraspLog], noise: float
) -> None:
    logs = [scene(name, marker_noise=noise, force_noise=2e-3) for name in ("cond1", "reversal", "ring")]
    alone = [f1_score(log, detect_slip(replace(log, force=None))) for log in logs]
    assert np.mean([f1_score(log, detect_slip(fault(log))) for log in logs]) > np.mean(alone) - 0.01


def test_early_forces_are_told_from_late_ones(scene: MakeScene) -> None:
    log = late(scene("ring", marker_noise=1e-6, force_noise=2e-3), -0.1)
    (finding,) = agreeing(log)[1]
    assert (finding.name, finding.severity) == ("early forces", "warning")
    assert "forces come 0.10 s before the displacement" in finding.evidence


def test_it_is_said_and_warned_of(scene: MakeScene) -> None:
    log = leaking(scene("ring", marker_noise=1e-6, force_noise=2e-3), 0.3, 0.0)
    history = detect_slip(log)
    assert [(finding.name, finding.severity) for finding in history.findings] == [("crosstalk", "warning")]
    assert "crosstalk" in {finding.name for finding in check_log(log, history)}
    assert [finding.name for finding in detect_slip(log, "coarse").findings] == ["crosstalk"]
    assert [finding.name for finding in detect_slip(standing(log), "strain_rate").findings] == ["crosstalk"]


def test_a_stream_sees_that_forces_stand_still(scene: MakeScene) -> None:
    log = standing(scene("ring", marker_noise=1e-6, force_noise=2e-3))
    detector = SlipDetector(log.position, log.element_area)
    slip = [
        detector.step(frame.time, frame.displacement, frame.force, frame.object_pose, frame.normal).slip
        for frame in log.frames()
    ]
    np.testing.assert_array_equal(slip, detect_slip(log).slip)
    assert [finding.name for finding in detector.findings] == ["forces not believed"]


def test_forces_without_noise_may_stand_still(scene: MakeScene) -> None:
    log = scene("ring", marker_noise=1e-6)
    held = replace(log, force=np.broadcast_to(np.asarray(log.force)[-1], log.displacement.shape))
    assert detect_slip(held).findings == ()


def test_forces_of_a_slower_sensor_are_believed_while_they_repeat(scene: MakeScene) -> None:
    log = scene("ring", marker_noise=1e-6, force_noise=2e-3)
    assert log.force is not None
    held = replace(log, force=log.force[3 * (np.arange(len(log)) // 3)])
    assert "forces not believed" not in {finding.name for finding in detect_slip(held).findings}


def test_a_log_of_few_frames_or_mostly_gaps_is_left_alone(scene: MakeScene) -> None:
    log = late(scene("ring"), 0.5)
    assert agreeing(log.take(np.arange(11)))[1] == ()
    apart = replace(log, time=np.r_[log.time[:-1], 1e6])
    assert agreeing(apart)[0] is apart


@pytest.mark.parametrize("name", ["example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022"])
def test_real_recordings_have_sound_forces(name: str) -> None:
    if not (RECORDINGS / name).is_dir():
        pytest.skip("the recordings are not there")
    assert agreeing(tac3d.read(RECORDINGS / name))[1] == ()
