from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import log_ndtr

from slipcore import FilterOptions, GraspLog, SlipHistory, detect_slip
from slipcore import kernels_filter as kernels
from slipcore.contact import RampSchedule, tangential_ramp

Scene = Callable[..., GraspLog]
Score = Callable[[GraspLog, SlipHistory], float]
TUNING = kernels.Tuning(*(float(getattr(FilterOptions(), name)) for name in kernels.Tuning._fields))


@pytest.mark.parametrize(
    ("name", "least"), [("cond1", 0.93), ("cond4", 0.93), ("reversal", 0.88), ("ring", 0.88), ("cond1_layer5c", 0.92)]
)
def test_on_scenes_of_an_independent_solver_the_filter_is_far_above_the_strain_rate(
    name: str, least: float, scene: Scene, f1_score: Score
) -> None:
    log = scene(name, marker_noise=1e-6, force_noise=2e-3)
    found = f1_score(log, detect_slip(log, "filter"))
    assert found > least  # found when written: .97, .98, .93, .93, .97; nothing was chosen on these scenes
    assert found > f1_score(log, detect_slip(log, "strain_rate")) + 0.08


def test_from_displacement_alone_the_filter_still_tells_slip(scene: Scene, f1_score: Score) -> None:
    log = replace(scene("reversal", marker_noise=1e-6), force=None, normal=None)
    assert f1_score(log, detect_slip(log, "filter")) > 0.85


@pytest.mark.parametrize("marker_noise", [0.0, 1e-6, 1e-5])
def test_pressing_alone_is_less_than_half_a_percent_of_false_slip(marker_noise: float) -> None:
    schedule = RampSchedule(rest=0.5, press=2.0, settle=1.0, shear=0.0, hold=1.0)
    log = tangential_ramp(tangential_force=0.0, schedule=schedule, marker_noise=marker_noise, force_noise=2e-3)
    for seen in (log, replace(log, force=None, normal=None)):
        history = detect_slip(seen, "filter")
        assert np.count_nonzero(history.slip) <= 0.005 * np.count_nonzero(history.contact)


def test_slip_holds_while_nothing_moves() -> None:
    log = tangential_ramp(schedule=RampSchedule(0.3, 0.7, 0.2, 1.5, 2.0), marker_noise=1e-6, force_noise=2e-3)
    history = detect_slip(log, "filter")
    at_stop, at_end = history.slip[-60], history.slip[-1]
    assert np.count_nonzero(at_stop) > 40
    assert np.count_nonzero(at_stop ^ at_end) < 0.1 * np.count_nonzero(at_stop)


def test_the_probability_is_one_half_at_the_decision() -> None:
    history = detect_slip(tangential_ramp(marker_noise=3e-6, force_noise=2e-3), "filter")
    np.testing.assert_array_equal(history.slip, history.probability > 0.5)


def test_a_pose_carries_points_to_and_fro() -> None:
    pose = kernels.Pose(1e-3, -2e-3, 0.4, 1.01)
    x, y = kernels.place_of_object(pose, *kernels.place_on_object(pose, 3e-3, 5e-3))
    np.testing.assert_allclose([x, y], [3e-3, 5e-3], rtol=0.0, atol=1e-17)


def anchored(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    elements = np.zeros((kernels.ROWS, *x.shape))
    elements[kernels.STICK_X], elements[kernels.STICK_Y] = x, y
    return elements


def test_a_fitted_pose_is_the_motion_of_what_sticks_though_a_third_slips() -> None:
    x, y = np.meshgrid(1e-3 * np.arange(6.0), 1e-3 * np.arange(6.0), indexing="ij")
    elements = anchored(x, y)
    true = kernels.Pose(2e-4, -1e-4, 0.02, 1.0)
    moved = np.array([[kernels.place_of_object(true, *p) for p in row] for row in np.stack([x, y], -1)])
    moved[:2] = np.stack([x, y], -1)[:2]  # these stand still
    before = kernels.Pose(0.0, 0.0, 0.0, 1.0)
    everywhere, nothing = np.ones(x.shape, bool), np.zeros(3)
    fitted, doubt = kernels.find_pose(
        elements, moved[..., 0].copy(), moved[..., 1].copy(), everywhere, before, nothing, False, 1e-14, TUNING
    )
    np.testing.assert_allclose(fitted[:3], true[:3], rtol=0.0, atol=1e-5)  # 5 % of the motion
    assert doubt.place > 0.0


def test_the_log_of_the_normal_distribution_holds_far_out() -> None:
    z = np.array([-40.0, -8.5, -7.5, -1.0, 0.0, 3.0])
    found = [kernels.log_normal_cdf(value) for value in z]
    np.testing.assert_allclose(found, log_ndtr(z), rtol=3e-3, atol=1e-12)  # the asymptote errs by 1/z² at −8


def test_evidence_of_a_force_ratio_rises_to_the_one_that_slips() -> None:
    evidence = [kernels.ratio_evidence(r, 1e-4, 0.0, 0.0, 0.4, 0.03, TUNING) for r in (0.1, 0.25, 0.4, 0.5)]
    assert evidence[0] < evidence[1] < 0.0 < evidence[2] <= evidence[3]


def element(p: float = 0.01) -> np.ndarray:
    column = np.zeros(kernels.ROWS)
    column[kernels.PROBABILITY] = p
    column[kernels.STICK_VARIANCE] = column[kernels.SLIP_VARIANCE] = 1e-12
    return column


def moved_element(share: float, p: float = 0.01, home: bool = False) -> float:
    """Slip probability after the object went 20 µm and the element came along but for that share of it."""
    motion, new = 20e-6, element()
    kernels.update_element(
        element(p), new, motion, 0.0, 0.0, 0.5, home, 0.0, -share * motion, 0.0, 1e-12, 1.0 / 30.0, TUNING
    )
    return float(new[kernels.PROBABILITY])


def test_what_comes_along_sticks_and_what_stays_behind_slips() -> None:
    assert moved_element(0.0) < 0.1
    assert moved_element(0.4) > 0.99
    assert moved_element(0.0, p=0.99) < 0.5


def test_pressing_home_ends_slip_without_motion() -> None:
    new = element()
    for home, least, most in ((False, 0.95, 1.0), (True, 0.0, 0.1)):
        kernels.update_element(element(0.99), new, 0.0, 0.0, 0.0, 0.5, home, 0.0, 0.0, 0.0, 1e-12, 1.0 / 30.0, TUNING)
        assert least <= new[kernels.PROBABILITY] <= most


def test_a_kernel_in_python_says_the_same_as_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    log = tangential_ramp(
        points=6, pitch=2e-3, schedule=RampSchedule(0.1, 0.2, 0.1, 0.5, 0.1), marker_noise=1e-6, force_noise=2e-3
    )
    compiled = detect_slip(log, "filter")
    for name, member in vars(kernels).copy().items():
        if hasattr(member, "py_func"):
            monkeypatch.setattr(kernels, name, member.py_func)
    monkeypatch.setattr("slipcore.methods.filter.step_filter", kernels.step_filter)
    interpreted = detect_slip(log, "filter")
    np.testing.assert_allclose(
        interpreted.probability, compiled.probability, rtol=1e-9, atol=1e-12
    )  # fused multiply-adds
    np.testing.assert_array_equal(interpreted.slip, compiled.slip)
