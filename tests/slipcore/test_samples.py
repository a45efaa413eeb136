from dataclasses import replace

import numpy as np
import pytest

from service.slip_benchmark.faults import correlated
from slipcore import (
    FrictionSamples,
    GraspLog,
    InvalidInput,
    NoForces,
    SlipHistory,
    UnknownScale,
    detect_slip,
)
from slipcore.contact import RampSchedule, Scene, simulate, tangential_ramp
from slipcore.samples import _as_friction_averages, _ForceNoise, _ratio, element_samples


@pytest.fixture(scope="module")
def ramp() -> tuple[GraspLog, SlipHistory]:
    log = tangential_ramp(marker_noise=1e-6, force_noise=2e-3, seed=20)
    return log, detect_slip(log)


@pytest.mark.parametrize("known_motion", [True, False])
@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6, 0.8])
def test_friction_of_a_ramp_is_found_within_two_percent_from_detected_slip(friction: float, known_motion: bool) -> None:
    log = tangential_ramp(friction=friction, marker_noise=1e-6, force_noise=2e-3, seed=21)
    log = log if known_motion else replace(log, object_pose=None)
    samples = element_samples(log, detect_slip(log))
    assert len(samples) > 100
    found = np.average(samples.friction_coefficient, weights=samples.weight)
    assert found == pytest.approx(friction, rel=0.02)


def test_noise_that_lasts_counts_by_what_of_it_changes_over_a_motion() -> None:
    """The velocity of a sensor that low-passes is far better than its places are."""
    size, memory = 5e-6, 0.9
    log = tangential_ramp(friction=0.5, force_noise=2e-3, seed=20)
    noisy = correlated(size, memory)(log, np.random.default_rng(8))
    history = detect_slip(noisy)
    assert "lasting noise" in {finding.name for finding in history.findings}
    samples = element_samples(noisy, history)
    two_frames = log.time[2] - log.time[0]
    assert samples.velocity_noise == pytest.approx(size * np.sqrt(2.0 * (1.0 - memory**2)) / two_frames, rel=0.15)
    assert history.noise > 2.0 * samples.velocity_noise * two_frames / np.sqrt(2.0)
    assert len(samples) > 100
    assert np.average(samples.friction_coefficient, weights=samples.weight) == pytest.approx(0.5, rel=0.03)


def test_friction_of_a_ramp_without_noise_is_exact() -> None:
    log = tangential_ramp(friction=0.5)
    samples = element_samples(log, detect_slip(log))
    assert len(samples) > 500
    # What slips by 10 µm/s is at the Coulomb limit; the median leaves out the frame in which the front passes.
    # A smooth force looks like 0.1 µN of noise, which is taken off.
    np.testing.assert_allclose(np.median(samples.friction_coefficient), 0.5, rtol=1e-6)
    assert samples.friction_coefficient.max() <= 0.5 * (1.0 + 1e-9)


def test_elements_that_slip_in_part_do_not_lower_friction() -> None:
    log = simulate(Scene.from_toml("fig10_normal_force_rises"), seed=1)  # elements of 3 × 3 cells
    samples = element_samples(log, detect_slip(log))
    assert len(samples) > 100
    np.testing.assert_allclose(samples.friction_coefficient, 0.4, rtol=0, atol=5e-4)  # with those in part 0.3966


def evenly_sliding(friction: np.ndarray, slope: tuple[float, float]) -> tuple[GraspLog, SlipHistory]:
    """Ten frames of 8 × 8 elements that all slide; the mean normal force falls by ``slope`` N an element each way, and
    ``friction`` (β₀, β₂) acts on the pressure at each point of an element.
    """
    row, column = np.mgrid[:8, :8]
    normal = 0.1 + slope[0] * (row - 3.5) + slope[1] * (column - 3.5)
    square = normal**2 + (slope[0] ** 2 + slope[1] ** 2) / 12.0  # mean of the square of linear pressure over a square
    time = np.arange(10) / 30.0
    force = np.zeros((10, 8, 8, 3))
    force[..., 0], force[..., 2] = friction[0] * normal + friction[1] * square, -normal
    moved = np.zeros((10, 8, 8, 3))
    log = GraspLog(
        time=time,
        position=1e-3 * np.stack([column, row, np.zeros((8, 8))], axis=-1),
        displacement=moved,
        normal=np.broadcast_to([0.0, 0.0, 1.0], moved.shape).copy(),
        element_area=1e-6,
        force=force,
        object_pose=np.zeros((10, 3)),
    )
    everywhere = np.ones((10, 8, 8), bool)
    history = replace(
        detect_slip(log),
        contact=everywhere,
        slip=everywhere,
        probability=everywhere.astype(float),
        velocity=np.full((10, 8, 8, 2), 1e-3),
        noise=0.0,
    )
    return log, history


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.02, 0.0), (0.012, -0.009)])
def test_friction_is_that_of_the_pressure_that_an_element_averages(slope: tuple[float, float]) -> None:
    friction = np.array([0.45, -0.8])
    log, history = evenly_sliding(friction, slope)
    samples = element_samples(log, history, force_noise=0.0)
    inside = (samples.element // 8 % 7 > 0) & (samples.element % 8 % 7 > 0)
    assert inside.sum() == 8 * 36
    expected = friction[0] + friction[1] * samples.normal_force
    np.testing.assert_allclose(samples.friction_coefficient[inside], expected[inside], rtol=1e-12)  # rounding


def test_noise_of_forces_is_no_slope_of_pressure() -> None:
    force = 1.0 + 0.1 * np.random.default_rng(0).standard_normal((400, 8, 8))
    inside = np.zeros(force.shape, bool)
    inside[:, 1:-1, 1:-1] = True
    added = _as_friction_averages(force, inside, 0.1) - force[inside]
    assert abs(added.mean()) < 0.1 * 0.1**2 / 12.0  # a tenth of what noise would add if it were not taken off


def check_samples(samples: FrictionSamples, log: GraspLog, history: SlipHistory) -> None:
    assert (samples.kind == "element").all()
    assert (samples.velocity_is_relative == (log.object_pose is None)).all()
    for name in sorted(set(samples.arrays()) - {"kind", "velocity_is_relative"}):
        values = getattr(samples, name)
        assert values.shape == (len(samples),)
        assert values.dtype == (np.int64 if name == "element" else np.float64)
        assert np.isfinite(values).all()
    assert (samples.normal_force > 0.0).all()
    assert (samples.tangential_force >= 0.0).all()
    assert (samples.tangential_velocity > 0.0).all()
    assert ((samples.weight > 0.0) & (samples.weight <= 1.0)).all()
    ratio = samples.tangential_force / samples.normal_force
    np.testing.assert_allclose(samples.friction_coefficient, ratio, rtol=1e-14)  # two roundings
    assert (np.diff(samples.time) >= 0.0).all()
    frame = np.searchsorted(log.time, samples.time)
    row, column = np.divmod(samples.element, log.grid[1])
    assert history.slip[frame - 1, row, column].all()  # chosen by the frame before: its noise is independent
    assert history.contact[frame, row, column].all()
    assert samples.element_area == log.element_area
    for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        beside = np.clip(row + i, 0, log.grid[0] - 1), np.clip(column + j, 0, log.grid[1] - 1)
        assert history.contact[frame, *beside].all()
        assert history.slip[frame - 1, *beside].all()  # the front has passed: none of the element still sticks


def test_samples_keep_their_invariants_on_a_ramp(ramp: tuple[GraspLog, SlipHistory]) -> None:
    samples = element_samples(*ramp)
    assert len(samples) > 500
    check_samples(samples, *ramp)


def test_samples_keep_their_invariants_on_real_recordings(recording: GraspLog) -> None:
    history = detect_slip(recording)
    check_samples(element_samples(recording, history), recording, history)


def test_samples_lie_above_the_velocity_and_force_that_noise_makes(ramp: tuple[GraspLog, SlipHistory]) -> None:
    samples = element_samples(*ramp)
    interval = 2 / 30  # from the frame before to the next
    assert samples.tangential_velocity.min() > 2.8 * np.sqrt(2.0) * 1e-6 / interval
    assert samples.normal_force.min() > 19 * 2e-3


def test_the_noise_that_a_log_tells_of_reconstructed_forces_is_taken(ramp: tuple[GraspLog, SlipHistory]) -> None:
    """As after a log that ``Reconstruction.apply`` gave was stored and read again."""
    log, history = ramp
    told = {"force": "reconstructed", "force_noise": "0.02", "force_to_noise": "6"}
    reread = replace(log, metadata=told)
    found, given = element_samples(reread, history), element_samples(log, history, force_noise=0.02, force_to_noise=6.0)
    assert found.normal_force_noise == given.normal_force_noise == pytest.approx(0.02 / np.sqrt(2.0))
    np.testing.assert_array_equal(found.friction_coefficient, given.friction_coefficient)
    assert element_samples(reread, history, force_noise=1e-3).normal_force_noise == pytest.approx(1e-3 / np.sqrt(2.0))


def test_a_given_force_noise_takes_the_place_of_the_estimate(ramp: tuple[GraspLog, SlipHistory]) -> None:
    assert element_samples(*ramp).normal_force.min() < 0.1
    assert element_samples(*ramp, force_noise=20e-3).normal_force.min() > 0.1  # five times as much


def test_without_noise_in_mind_slow_points_drag_the_friction_down(ramp: tuple[GraspLog, SlipHistory]) -> None:
    log, history = ramp
    everywhere = replace(history, slip=history.contact, probability=history.contact.astype(float))
    careless = element_samples(log, everywhere, velocity_to_noise=0.0, least_velocity=0.0, least_force_share=0.0)
    careful = element_samples(log, everywhere)
    assert careless.friction_coefficient.mean() < 0.3
    assert careful.friction_coefficient.mean() > 0.36


def test_noise_does_not_lengthen_small_tangential_forces() -> None:
    log = tangential_ramp(friction=0.2, normal_force=3.0, force_noise=2e-3, seed=22)
    history = detect_slip(log)
    corrected = element_samples(log, history)
    plain = element_samples(log, history, force_noise=1e-9, force_to_noise=0.0)
    assert plain.friction_coefficient.mean() > 0.2 * 1.01
    assert corrected.friction_coefficient.mean() == pytest.approx(0.2, rel=0.006)


def test_noise_of_the_normal_force_makes_no_slope_of_friction_over_it() -> None:
    slopes = []
    for seed in range(4):
        log = tangential_ramp(friction=0.8, force_noise=4e-3, marker_noise=1e-6, seed=30 + seed)
        samples = element_samples(log, detect_slip(log), force_to_noise=8.0)
        slopes.append(np.polyfit(samples.normal_force, samples.friction_coefficient, 1)[0])
        raw = log.force[np.searchsorted(log.time, samples.time), samples.element // 20, samples.element % 20, 2]
        careless = np.polyfit(-raw, samples.friction_coefficient, 1)[0]
        assert careless < slopes[-1] - 0.2  # 1/N; noise of f_n in both the quotient and the regressor
    assert abs(np.mean(slopes)) < 0.15


def test_samples_tell_the_noise_of_their_velocities() -> None:
    """Against the same frames without noise, of elements that slide."""
    quiet = tangential_ramp(seed=33)
    rng = np.random.default_rng(33)
    noisy = replace(quiet, displacement=quiet.displacement + 1e-6 * rng.standard_normal(quiet.displacement.shape))
    history = detect_slip(noisy)
    samples = element_samples(noisy, history)
    true = detect_slip(quiet).velocity
    at = np.searchsorted(noisy.time, samples.time), samples.element // 20, samples.element % 20
    steady = 0.5 * (true[at] + true[at[0] + 1, at[1], at[2]])  # frames are evenly spaced
    error = samples.tangential_velocity - np.hypot(*steady.T)
    assert samples.velocity_noise == pytest.approx(error.std(), rel=0.2)  # of neighbouring frames it is shared


def test_no_slip_gives_an_empty_set_of_samples() -> None:
    schedule = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=0.0, hold=0.5)
    log = tangential_ramp(tangential_force=0.0, schedule=schedule)
    samples = element_samples(log, detect_slip(log))
    assert len(samples) == 0
    check_samples(samples, log, detect_slip(log))


def test_unobservable_velocity_gives_no_sample() -> None:
    log = tangential_ramp()
    history = detect_slip(log)
    blind = replace(history, velocity=np.full_like(history.velocity, np.nan))
    assert len(element_samples(log, blind)) == 0


def test_the_probability_of_slip_is_the_weight_and_unlikely_slip_is_left_out(
    ramp: tuple[GraspLog, SlipHistory],
) -> None:
    log, history = ramp
    likely = replace(history, probability=0.7 * history.slip)
    np.testing.assert_allclose(element_samples(log, likely).weight, 0.7, rtol=1e-15)
    assert len(element_samples(log, likely, least_weight=0.8)) == 0


def test_a_log_of_unknown_scale_is_refused() -> None:
    log = replace(tangential_ramp(), metadata={"scale": "unknown"})
    with pytest.raises(UnknownScale, match="velocities in m/s"):
        element_samples(log, detect_slip(log))


def test_a_log_without_forces_is_refused() -> None:
    log = replace(tangential_ramp(), force=None)
    with pytest.raises(NoForces, match="force"):
        element_samples(log, detect_slip(log))


def test_a_history_of_another_log_is_refused(ramp: tuple[GraspLog, SlipHistory], short_ramp: GraspLog) -> None:
    log, history = ramp
    with pytest.raises(InvalidInput, match="history is of shape"):
        element_samples(short_ramp, history)
    with pytest.raises(InvalidInput, match="history is at other times"):
        element_samples(log, replace(history, time=history.time + 1.0))


def test_an_unknown_option_is_refused(ramp: tuple[GraspLog, SlipHistory]) -> None:
    with pytest.raises(InvalidInput, match=r"option is least_speed; allowed: .*least_velocity"):
        element_samples(*ramp, least_speed=1.0)


def test_samples_join_as_the_same_pressures_on_the_smallest_elements(ramp: tuple[GraspLog, SlipHistory]) -> None:
    samples = element_samples(*ramp)
    area = samples.element_area
    both = FrictionSamples.concatenate([samples, samples.at_element_area(2.0 * area)])
    assert both.element_area == area
    for name in ("normal_force", "tangential_force", "friction_coefficient", "element"):
        np.testing.assert_array_equal(getattr(both, name), np.tile(getattr(samples, name), 2))  # a factor of 2 is exact
    np.testing.assert_array_equal(samples.at_element_area(2.0 * area).normal_force, 2.0 * samples.normal_force)
    with pytest.raises(InvalidInput, match="parts is none"):
        FrictionSamples.concatenate([])
    with pytest.raises(InvalidInput, match="weight is of shape"):
        replace(samples, weight=samples.weight[1:])


def test_joined_samples_carry_the_noise_of_all() -> None:
    one, none = np.ones(1), np.zeros(1, dtype=np.int64)
    noises = ((3e-3, 6e-5), (4e-3, 8e-5))
    first, second = (FrictionSamples(one, one, one, one, one, none, one, 1e-6, *noise) for noise in noises)
    joined = FrictionSamples.concatenate([first, second])
    assert joined.normal_force_noise == pytest.approx(np.sqrt(12.5) * 1e-3)
    assert joined.velocity_noise == pytest.approx(np.sqrt(50.0) * 1e-5)
    assert joined.at_element_area(2e-6).velocity_noise == joined.velocity_noise
    assert joined.at_element_area(2e-6).normal_force_noise == pytest.approx(2.0 * joined.normal_force_noise)


def test_without_the_object_s_motion_velocities_are_relative(ramp: tuple[GraspLog, SlipHistory]) -> None:
    log = replace(ramp[0], object_pose=None)
    unposed = element_samples(log, detect_slip(log))
    assert len(unposed) > 0
    assert unposed.velocity_is_relative.all()
    posed = element_samples(*ramp)
    both = FrictionSamples.concatenate([unposed, posed])
    assert both.velocity_is_relative.tolist() == [True] * len(unposed) + [False] * len(posed)
    assert both.take(both.velocity_is_relative).velocity_is_relative.all()


def test_noise_of_forces_leaves_friction_as_it_is_on_average() -> None:
    """The next terms, of (σ/f)⁴ = 1e-4, are below what is asked."""
    rng, count, noise = np.random.default_rng(3), 10**6, _ForceNoise(0.1, 0.04)
    tangential = np.hypot(
        0.4 + noise.tangential * rng.standard_normal(count), noise.tangential * rng.standard_normal(count)
    )
    normal = 1.0 + noise.normal * rng.standard_normal(count)
    assert _ratio(tangential, normal, noise).mean() == pytest.approx(0.4, rel=3e-3)
