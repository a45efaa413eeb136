from collections.abc import Callable

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.contact.reference import CattaneoMindlin, HertzContact, half_space

REST, PRESS, SETTLE, SHEAR = 15, 30, 15, 90  # frames of the default schedule at 30 frames a second


@pytest.fixture(scope="module")
def log() -> GraspLog:
    return tangential_ramp(points=40, pitch=0.375e-3)


@pytest.fixture(scope="module")
def final() -> CattaneoMindlin:
    return CattaneoMindlin(HertzContact(15e-3, 10.0, half_space(1e6, 0.49)), 0.4, 0.95 * 4.0)


def test_phases_follow_one_another_in_time(log: GraspLog) -> None:
    np.testing.assert_allclose(np.diff(log.time), 1 / 30, rtol=1e-12)
    assert log.time[-1] == pytest.approx(5.5, rel=1e-12, abs=0.0)
    assert not log.truth.contact[: REST + 1].any()
    assert log.truth.contact[REST + 3 :].any(axis=(1, 2)).all()
    contact = log.truth.contact.sum(axis=(1, 2))
    assert (np.diff(contact) >= 0).all()
    assert np.isnan(log.truth.stick_ratio[: REST + 1]).all()
    shear = log.truth.stick_ratio[REST + PRESS + SETTLE : REST + PRESS + SETTLE + SHEAR + 1]
    assert shear[0] == 1.0
    assert (np.diff(shear) < 0.0).all()


def test_last_frame_is_the_closed_form_in_the_contract_s_frame(log: GraspLog, final: CattaneoMindlin) -> None:
    x, y = log.position[..., 0], log.position[..., 1]
    r = np.hypot(x, y)
    np.testing.assert_allclose(log.displacement[-1, ..., :2], final.displacement(x, y), rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(log.displacement[-1, ..., 2], -final.contact.normal_displacement(r), rtol=1e-12)
    np.testing.assert_allclose(log.force[-1, ..., 0], final.traction(r) * log.element_area, rtol=1e-11)
    np.testing.assert_allclose(log.force[-1, ..., 2], -final.contact.pressure(r) * log.element_area, rtol=1e-12)
    assert log.truth.stick_ratio[-1] == pytest.approx(0.05 ** (2 / 3), rel=1e-12, abs=0.0)
    np.testing.assert_allclose(log.object_pose[-1], [final.rigid_displacement, 0.0, 0.0], rtol=1e-12)


def test_forces_sum_to_the_load_on_the_sensor(log: GraspLog) -> None:
    # midpoint rule on cells of a twelfth of the contact radius: the square root at the edge leaves about 1 %
    np.testing.assert_allclose(log.force[-1].sum(axis=(0, 1)), [3.8, 0.0, -10.0], rtol=0.01, atol=1e-12)


def test_pressing_moves_points_along_the_normal_only(log: GraspLog) -> None:
    pressing = slice(0, REST + PRESS + SETTLE + 1)
    assert (log.displacement[pressing, ..., :2] == 0.0).all()
    assert (log.displacement[REST + 1 : REST + PRESS, ..., 2] < 0.0).all()
    assert not log.truth.slip_kinematic[pressing].any()
    assert not log.truth.slip_contact_factor[pressing].any()


def test_truth_at_a_point_is_its_place_outside_the_stick_circle(log: GraspLog, final: CattaneoMindlin) -> None:
    r = np.hypot(log.position[..., 0], log.position[..., 1])
    slipping = (r > final.stick_radius) & (r < final.contact.contact_radius)
    np.testing.assert_array_equal(log.truth.slip_contact_factor[-1], slipping)
    end_of_shear = REST + PRESS + SETTLE + SHEAR
    np.testing.assert_array_equal(log.truth.slip_kinematic[end_of_shear], slipping)


def test_slipping_points_move_against_the_object_and_stuck_points_with_it(log: GraspLog) -> None:
    k = REST + PRESS + SETTLE + SHEAR // 2
    relative = np.diff(log.displacement[k - 1 : k + 1, ..., 0], axis=0)[0] - np.diff(log.object_pose[k - 1 : k + 1, 0])
    np.testing.assert_array_equal(
        np.abs(relative[log.truth.contact[k]]) > 1e-15, log.truth.slip_kinematic[k][log.truth.contact[k]]
    )
    assert (relative[log.truth.slip_kinematic[k]] < 0.0).all()


def test_in_the_hold_points_stay_at_the_limit_without_moving(log: GraspLog) -> None:
    assert not log.truth.slip_kinematic[-1].any()
    assert log.truth.slip_contact_factor[-1].any()


def test_friction_at_the_limit_is_the_truth(log: GraspLog) -> None:
    slipping = log.truth.slip_contact_factor
    f_t, f_n = np.hypot(log.force[..., 0], log.force[..., 1]), -log.force[..., 2]
    np.testing.assert_allclose(f_t[slipping] / f_n[slipping], log.truth.friction.coefficients[0], rtol=2e-9)
    assert log.truth.friction.coefficients == (0.4, 0.0, 0.0)
    assert log.truth.friction.scale == 0.0


def test_full_tangential_force_ends_in_sliding_of_the_whole_contact() -> None:
    log = tangential_ramp(tangential_force=1.0, points=10, pitch=1.5e-3)
    assert log.truth.stick_ratio[-1] == 0.0
    np.testing.assert_array_equal(log.truth.slip_contact_factor[-1], log.truth.contact[-1])


def test_noise_comes_from_the_seed_alone_and_leaves_the_truth() -> None:
    def noisy(seed: int | np.random.Generator) -> GraspLog:
        return tangential_ramp(points=10, pitch=1.5e-3, marker_noise=2e-6, force_noise=1e-3, seed=seed)

    np.random.seed(1)  # noqa: NPY002 - the global state must not matter
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    one, same, other = noisy(7), noisy(np.random.default_rng(7)), noisy(8)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
    clean = tangential_ramp(points=10, pitch=1.5e-3)
    np.testing.assert_array_equal(one.displacement, same.displacement)
    assert (one.displacement != other.displacement).any()
    error = one.displacement - clean.displacement
    # standard error of a standard deviation over n draws: 1/√(2n)
    assert error.std() == pytest.approx(2e-6, rel=4 / np.sqrt(2 * error.size), abs=0.0)
    assert (one.force - clean.force).std() == pytest.approx(1e-3, rel=4 / np.sqrt(2 * error.size), abs=0.0)
    np.testing.assert_array_equal(one.truth.slip_kinematic, clean.truth.slip_kinematic)
    np.testing.assert_array_equal(one.object_pose, clean.object_pose)


def test_frame_rate_changes_the_sampling_not_the_scene() -> None:
    slow, fast = (tangential_ramp(points=8, pitch=1.5e-3, frame_rate=rate) for rate in (30.0, 60.0))
    np.testing.assert_allclose(fast.displacement[::2], slow.displacement, rtol=1e-9, atol=1e-16)


def test_a_phase_of_no_duration_is_left_out() -> None:
    log = tangential_ramp(points=8, schedule=RampSchedule(rest=0.0, press=0.0, settle=0.0, shear=1.0, hold=0.0))
    assert len(log) == 31
    assert log.truth.contact.any(axis=(1, 2)).all()


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"friction": 0.0}, "friction"),
        ({"normal_force": 0.0}, "normal_force"),
        ({"tangential_force": 1.01}, "tangential_force"),
        ({"tangential_force": -0.1}, "tangential_force"),
        ({"marker_noise": -1e-6}, "marker_noise"),
        ({"force_noise": np.nan}, "force_noise"),
        ({"points": 1}, "points"),
        ({"pitch": 0.0}, "pitch"),
        ({"frame_rate": 0.0}, "frame_rate"),
        ({"young_modulus": -1.0}, "young_modulus"),
        ({"sphere_radius": 0.0}, "sphere_radius"),
        ({"schedule": RampSchedule(press=-1.0)}, "schedule.press"),
        ({"schedule": RampSchedule(0.0, 0.0, 0.0, 0.0, 0.0)}, "time"),
    ],
)
def test_bad_options_are_refused_by_name(options: dict[str, object], name: str) -> None:
    with pytest.raises(InvalidInput, match=name):
        tangential_ramp(**options)


@pytest.mark.parametrize("draw", [lambda log: log.displacement, lambda log: log.force])
def test_fields_are_symmetric_about_the_direction_of_the_load(
    log: GraspLog, draw: Callable[[GraspLog], np.ndarray]
) -> None:
    field = draw(log)[-1]
    mirrored = field[:, ::-1] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(field, mirrored, rtol=1e-11, atol=1e-17)
