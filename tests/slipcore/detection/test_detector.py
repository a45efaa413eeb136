import pickle
import resource
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput, SlipDetector, SlipHistory, collect_history, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.detector import DetectorState, init, step

Score = Callable[[GraspLog, SlipHistory], float]
Same = Callable[[SlipHistory, SlipHistory], None]
Scene = Callable[..., GraspLog]

QUIET = {"displacement": np.zeros((4, 5, 3)), "force": np.zeros((4, 5, 3))}


def lattice() -> np.ndarray:
    i, j = np.meshgrid(np.arange(4.0), np.arange(5.0), indexing="ij")
    return 1e-3 * np.stack([i, j, 0 * i], axis=-1)


RAMPS = {
    "paper's Condition 1": {},
    "rough": {"friction": 0.8},
    "heavy": {"normal_force": 20.0, "friction": 0.3},
    "fast": {"schedule": RampSchedule(rest=0.3, press=0.7, settle=0.3, shear=1.5, hold=0.3)},
    "slow": {"schedule": RampSchedule(rest=0.3, press=1.0, settle=0.3, shear=6.0, hold=0.3)},
}


def test_a_running_detector_goes_on_with_other_options(short_ramp: GraspLog) -> None:
    """As what is known of its forces changes: those not named stay, as does what it has seen."""
    detector = SlipDetector(short_ramp.position, short_ramp.element_area, contact_reach=0.9)
    assert short_ramp.force is not None
    for k in range(3):
        detector.step(short_ramp.time[k], short_ramp.displacement[k], short_ramp.force[k])
    before = detector.state
    detector.set_options(force_floor=0.02)
    opened_so = SlipDetector(short_ramp.position, short_ramp.element_area, contact_reach=0.9, force_floor=0.02).state
    assert detector.state.setup.options == opened_so.setup.options
    np.testing.assert_array_equal(detector.state.setup.sensor.settings, opened_so.setup.sensor.settings)
    np.testing.assert_array_equal(detector.state.setup.sensor.touch_by_force, opened_so.setup.sensor.touch_by_force)
    assert detector.state.memory is before.memory
    with pytest.raises(InvalidInput, match="force_floor"):
        detector.set_options(force_floor=-1.0)
    detector.step(short_ramp.time[3], short_ramp.displacement[3], short_ramp.force[3])


@pytest.mark.parametrize("name", RAMPS)
def test_on_ramps_of_known_truth_the_corrected_method_is_good_and_beats_the_printed_one(
    name: str, f1_score: Score, stick_ratio_error: Score
) -> None:
    log = tangential_ramp(**RAMPS[name], marker_noise=1e-6, force_noise=2e-3, seed=12)
    corrected, literal = detect_slip(log, "strain_rate"), detect_slip(log, "strain_rate_literal")
    assert f1_score(log, corrected) > 0.8
    assert stick_ratio_error(log, corrected) < 0.18
    assert f1_score(log, corrected) > f1_score(log, literal) + 0.1
    assert stick_ratio_error(log, corrected) < stick_ratio_error(log, literal)


@pytest.mark.parametrize(("name", "least"), [("cond1", 0.75), ("cond4", 0.65), ("ring", 0.5), ("cond1_layer5c", 0.55)])
def test_on_scenes_of_an_independent_solver_the_corrected_method_beats_the_printed_one(
    name: str, least: float, scene: Scene, f1_score: Score
) -> None:
    log = scene(name, marker_noise=1e-6, force_noise=2e-3)
    found = f1_score(log, detect_slip(log, "strain_rate"))
    assert found > least  # found when written: .87, .79, .62, .66; nothing was chosen on these scenes
    assert found > f1_score(log, detect_slip(log, "strain_rate_literal"))


def test_marker_noise_is_reported() -> None:
    for sigma in (1e-6, 1e-5):
        assert detect_slip(tangential_ramp(marker_noise=sigma)).noise == pytest.approx(sigma, rel=0.05)


@pytest.mark.parametrize("marker_noise", [0.0, 1e-6, 1e-5])
def test_pressing_alone_is_not_slip(marker_noise: float) -> None:
    schedule = RampSchedule(rest=0.5, press=2.0, settle=1.0, shear=0.0, hold=1.0)
    log = tangential_ramp(tangential_force=0.0, schedule=schedule, marker_noise=marker_noise, force_noise=2e-3)
    history = detect_slip(log)
    assert np.count_nonzero(history.slip) <= 0.01 * np.count_nonzero(history.contact)
    assert len(history.events.touch) > 50


def test_the_same_motion_gives_the_same_decisions_at_any_frame_rate() -> None:
    def slip(fps: float) -> np.ndarray:
        log = tangential_ramp(frame_rate=fps)
        return detect_slip(log).slip[:: round(fps / 30.0)] & log.truth.contact[:: round(fps / 30.0)]

    at_30, at_60, at_120 = slip(30.0), slip(60.0), slip(120.0)
    size = np.count_nonzero(at_120)
    assert size > 2000
    # One frame at 30 fps is worth 1 % of the ramp, in which the front moves past that share of the elements.
    assert np.count_nonzero(at_30 ^ at_120) < 0.05 * size
    assert np.count_nonzero(at_60 ^ at_120) < 0.03 * size


def test_the_printed_method_depends_on_the_frame_rate(f1_score: Score) -> None:
    scores = [
        f1_score(log, detect_slip(log, "strain_rate_literal"))
        for log in (tangential_ramp(frame_rate=fps) for fps in (30.0, 120.0))
    ]
    assert abs(scores[1] - scores[0]) > 0.1


def test_dropped_frames_change_little() -> None:
    log = tangential_ramp(marker_noise=1e-6, force_noise=2e-3)
    kept = np.sort(np.random.default_rng(13).choice(len(log), round(0.7 * len(log)), replace=False))
    whole, gappy = detect_slip(log), detect_slip(log.take(kept))
    both = whole.contact[kept] & gappy.contact
    different = (whole.slip[kept] ^ gappy.slip) & both
    assert np.count_nonzero(different) < 0.05 * np.count_nonzero(both)


def test_a_pull_is_not_a_contact() -> None:
    force = np.zeros((5, 4, 5, 3))
    force[..., 2] = 0.1
    log = GraspLog(np.arange(5) / 30.0, lattice(), np.zeros_like(force), 1e-6, force)
    assert not detect_slip(log).contact.any()


def test_where_none_sticks_and_the_motion_is_unknown_the_velocity_is_unobservable() -> None:
    log = tangential_ramp(tangential_force=1.0, schedule=RampSchedule(0.2, 0.5, 0.2, 1.5, 0.5))
    blind = replace(log, object_pose=None)
    history, seeing = (detect_slip(seen, "strain_rate", rate_floor=1e-4) for seen in (blind, log))
    none_sticks = history.macro_slip & (history.stick_ratio == 0.0)
    assert none_sticks.any()
    assert np.isnan(history.velocity[none_sticks]).all()
    moving = seeing.contact[1:] & seeing.contact[:-1] & seeing.macro_slip[1:, None, None]
    assert np.isfinite(seeing.velocity[1:][moving]).all()


def test_velocity_of_sticking_elements_is_zero_and_of_slipping_ones_is_the_slip_rate() -> None:
    log = tangential_ramp()
    assert log.truth is not None
    for known in (log, replace(log, object_pose=None)):
        history = detect_slip(known, "strain_rate")
        speed = np.linalg.norm(history.velocity[1:], axis=-1)
        moves = log.truth.slip_kinematic[1:] & np.isfinite(speed)
        rests = log.truth.contact[1:] & ~log.truth.slip_kinematic[1:] & np.isfinite(speed)
        assert speed[rests].max() < 1e-9  # m/s; a rigid object carries every sticking point along exactly
        assert np.median(speed[moves]) > 1e-5


def test_velocity_by_the_filter_errs_little_where_the_front_passes() -> None:
    log = tangential_ramp()
    assert log.truth is not None
    for known in (log, replace(log, object_pose=None)):
        speed = np.linalg.norm(detect_slip(known, "filter").velocity[1:], axis=-1)
        rests = log.truth.contact[1:] & ~log.truth.slip_kinematic[1:] & np.isfinite(speed)
        assert np.quantile(speed[rests], 0.99) < 2e-5  # m/s; the object moves at 3e-4


def test_contact_comes_from_the_shape_where_there_are_no_forces() -> None:
    log = tangential_ramp()
    assert log.truth is not None
    history = detect_slip(replace(log, force=None), contact_depth_share=0.5)
    agree = np.count_nonzero(history.contact & log.truth.contact)
    assert agree > 0.97 * np.count_nonzero(history.contact | log.truth.contact)  # Hertz: half the depth at the edge


@pytest.mark.parametrize(
    ("method", "options", "message"),
    [
        ("magic", {}, "method is magic; allowed: filter, strain_rate, strain_rate_literal"),
        (None, {}, "method is None"),
        ("strain_rate", {"lag": 3}, "option is lag; allowed: .*memory_time.*threshold"),
        ("strain_rate", {"threshold": 0.0}, "threshold is 0.0; allowed: 0.5 to 100 standard deviations"),
        ("strain_rate", {"smoothing_time": np.nan}, "smoothing_time is nan"),
        ("strain_rate", {"influence": "much"}, "influence is much"),
        ("strain_rate_literal", {"lag": 2.5}, "lag is 2.5; allowed: a whole number, 2 to 1000 frames"),
        ("strain_rate_literal", {"lag": True}, "lag is True"),
    ],
)
def test_an_unknown_method_or_option_is_refused_by_name(
    method: str, options: dict[str, float], message: str, short_ramp: GraspLog
) -> None:
    with pytest.raises(InvalidInput, match=message):
        detect_slip(short_ramp, method, **options)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": 0.0}, "time is 0 s after 0 s; allowed: strictly increasing"),
        ({"time": np.nan}, "time is nan"),
        ({"displacement": np.zeros((4, 4, 3))}, "displacement is of shape"),
        ({"displacement": np.full((4, 5, 3), np.nan)}, "displacement is nan"),
        ({"displacement": np.full((4, 5, 3), 2.0)}, "displacement is 2 m"),
        ({"force": None}, "force is missing; allowed: in every frame or in none"),
        ({"force": np.full((4, 5, 3), np.inf)}, "force is inf"),
        ({"object_pose": np.zeros(2)}, "object_pose is of shape"),
        ({"object_pose": np.array([5.0, 0.0, 0.0])}, "object_pose x, y is 5"),
        ({"object_pose": np.array([0.0, 0.0, np.nan])}, "object_pose is nan"),
        ({"normal": np.ones((4, 5, 3))}, "normal is of length"),
        ({"normal": np.full((4, 5, 3), [0.0, 0.0, -1.0])}, "normal is z component -1"),
    ],
)
def test_a_bad_frame_is_refused_by_name_and_leaves_the_detector_as_it_was(
    change: dict[str, object], message: str
) -> None:
    detector = SlipDetector(lattice(), 1e-6)
    detector.step(0.0, **QUIET)
    before = detector.state
    with pytest.raises(InvalidInput, match=message):
        detector.step(**{"time": 0.1, **QUIET, **change})
    assert detector.state is before
    detector.step(0.1, **QUIET)


def test_normals_and_poses_may_come_as_lists_and_are_copied() -> None:
    one, other = SlipDetector(lattice(), 1e-6), SlipDetector(lattice(), 1e-6)
    normal, pose = np.full((4, 5, 3), [0.0, 0.6, 0.8]), np.array([1e-3, 0.0, 0.1])
    one.step(0.0, **QUIET, normal=normal, object_pose=pose)
    other.step(0.0, **QUIET, normal=normal.tolist(), object_pose=pose.tolist())
    kept = normal.copy(), pose.copy()
    normal[:], pose[:] = np.nan, np.nan
    for detector in (one, other):
        np.testing.assert_array_equal(detector.state.frame.normal, kept[0])
        np.testing.assert_array_equal(detector.state.frame.object_pose, kept[1])


def test_a_lattice_without_strain_and_an_absurd_area_are_refused() -> None:
    with pytest.raises(InvalidInput, match="at least 2 × 2 markers"):
        SlipDetector(lattice()[:1], 1e-6)
    with pytest.raises(InvalidInput, match="element_area"):
        SlipDetector(lattice(), 1.0)


def test_a_history_of_nothing_is_refused() -> None:
    with pytest.raises(InvalidInput, match="slip_states is empty"):
        collect_history([], init(lattice(), 1e-6))


def test_inputs_are_never_written_to_and_answers_cannot_change_the_detector() -> None:
    detector = SlipDetector(lattice(), 1e-6)
    displacement, force = np.zeros((4, 5, 3)), np.zeros((4, 5, 3))
    force[..., 2] = -0.1
    copies = displacement.copy(), force.copy()
    answer = detector.step(0.0, displacement, force)
    np.testing.assert_array_equal(displacement, copies[0])
    np.testing.assert_array_equal(force, copies[1])
    with pytest.raises(ValueError, match="read-only"):
        answer.contact[0, 0] = False


def test_a_step_leaves_its_state_alone(short_ramp: GraspLog) -> None:
    frames = list(short_ramp.frames())
    state: DetectorState = init(short_ramp.position, short_ramp.element_area)
    for frame in frames[:30]:
        state, _ = step(state, frame)
    stored = pickle.dumps(state)
    for frame in frames[30:]:
        step(state, frame)
    assert pickle.dumps(state) == stored


@pytest.mark.long
def test_a_million_frames_leave_memory_as_it_was(short_ramp: GraspLog) -> None:
    detector = SlipDetector(short_ramp.position, short_ramp.element_area)
    frames, before = list(short_ramp.frames()), 0
    for k in range(1_000_000):
        frame = frames[k % len(frames)]
        detector.step(k / 30.0, frame.displacement, frame.force)
        if k == 10_000:
            before = resident()
    assert resident() - before < 2**20


def resident() -> int:
    """Bytes of memory that this process holds now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize()
