"""Faults that were put into presses by hand are found again, and what a press does not tell is said not to be."""

import json
import math
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.calibration.patch_grasps import PIVOT, Setting, grasp
from benchmarks.calibration.presses import Faults, pressed
from slipcore import (
    GraspLog,
    InvalidInput,
    InvalidPress,
    SensorModel,
    SlipHistory,
    UnknownScale,
    calibrate_sensor,
    contact_friction,
    detect_slip,
)
from slipcore.calibration.estimate import PressEstimate, error_of_mean, joined
from slipcore.contact import RampSchedule, tangential_ramp

FAULTS = Faults(
    offset=5e-3,
    drift=(2e-5, 0.0, -1e-4),
    crosstalk=(0.08, -0.05),
    smoothing=1.0,
    gain=1.1,
    marker_noise=3e-6,
    memory=0.9,
    force_noise=2e-3,
)
"""Of every quantity one, at sizes that real sensors have."""
OFFSETS = FAULTS.offsets((20, 20))
TRUE = {
    "force_offset_x": (OFFSETS[..., 0].mean(), 1e-4),
    "force_offset_y": (OFFSETS[..., 1].mean(), 1e-4),
    "force_offset_z": (OFFSETS[..., 2].mean(), 1e-4),
    "force_drift_x": (2e-5, 2.5e-5),
    "force_drift_y": (0.0, 2.5e-5),
    "force_drift_z": (-1e-4, 2.5e-5),
    "crosstalk_x": (0.08, 0.006),
    "crosstalk_y": (-0.05, 0.006),
    "inward_share": (0.0, 0.01),
    "kernel_width": (1e-3, 1.5e-4),
    "marker_noise": (3e-6 * math.sqrt(1.01), 2.5e-7),
    "marker_noise_correlation": (0.9 / 1.01, 0.02),
    "gain": (1.0 / 1.1, 0.02),
}
"""What was put in, and by how much the estimate of a single press may err."""
SEEDS = range(100, 108)
LEAST_COVERED = 5
"""Of these, whose 95 % interval has the truth in it: fewer come in one of 3000 such series."""


@pytest.fixture(scope="module")
def ball() -> GraspLog:
    """A press without fault."""
    return pressed()


@pytest.fixture(scope="module")
def models(ball: GraspLog) -> list[SensorModel]:
    """One a seed, each of one press."""
    return [calibrate_sensor([FAULTS.put_into(ball, seed)], [2.0]) for seed in SEEDS]


@pytest.mark.parametrize("name", TRUE)
def test_a_fault_is_found_with_its_size(models: list[SensorModel], name: str) -> None:
    true, tolerance = TRUE[name]
    found = [model[name] for model in models]
    assert [each.value for each in found] == pytest.approx([true] * len(found), abs=tolerance)
    assert sum(each.low <= true <= each.high for each in found) >= LEAST_COVERED


def test_the_offset_of_each_element_is_found(models: list[SensorModel]) -> None:
    for model in models:
        assert model.offset is not None
        assert np.sqrt(np.mean((model.offset - OFFSETS) ** 2)) < 4e-4  # 2 mN over 60 frames: 0.26 mN


@pytest.mark.parametrize(("width", "low", "high"), [(0.0, 0.0, 0.6e-3), (0.5, 0.3e-3, 0.7e-3), (1.5, 1.3e-3, 1.7e-3)])
def test_narrow_and_wide_kernels_are_told_apart(ball: GraspLog, width: float, low: float, high: float) -> None:
    faults = replace(FAULTS, smoothing=width)
    found = [calibrate_sensor([faults.put_into(ball, seed)])["kernel_width"] for seed in range(200, 204)]
    assert all(low <= each.value <= high for each in found)


def test_more_presses_narrow_what_they_agree_on(ball: GraspLog, models: list[SensorModel]) -> None:
    together = calibrate_sensor([FAULTS.put_into(ball, seed) for seed in SEEDS], [2.0] * len(SEEDS))
    for name in ("crosstalk_x", "kernel_width", "gain", "marker_noise"):
        width = together[name].high - together[name].low
        assert width < 0.7 * np.median([model[name].high - model[name].low for model in models])
        assert together[name].value == pytest.approx(TRUE[name][0], abs=0.5 * TRUE[name][1])


def test_presses_that_disagree_widen_the_interval() -> None:
    alike = joined("x", "-", [PressEstimate(1.0, 0.1)] * 4)
    apart = joined("x", "-", [PressEstimate(value, 0.1) for value in (0.0, 1.0, 2.0, 1.0)])
    assert (alike.value, alike.high) == pytest.approx((1.0, 1.0 + 1.959964 * 0.05), rel=1e-6)
    deviation = np.std([0.0, 1.0, 2.0, 1.0], ddof=1)
    assert apart.high - apart.value == pytest.approx(3.182446 * deviation / 2.0, rel=1e-6)


def test_the_error_of_a_mean_grows_with_memory() -> None:
    """Exactly: the mean of AR(1) has a variance (1 + φ)/(1 − φ) times that of white noise, in the long run."""
    rng = np.random.default_rng(5)
    series = rng.standard_normal(20_000)
    for k in range(1, len(series)):
        series[k] = 0.8 * series[k - 1] + 0.6 * series[k]
    assert error_of_mean(series - series.mean()) == pytest.approx(3.0 / math.sqrt(20_000), rel=0.1)


def sideways(log: GraspLog) -> GraspLog:
    """Load along the surface grows during the hold."""
    assert log.force is not None
    load = np.clip(np.linspace(-1.0, 1.0, len(log)), 0.0, 0.2)[:, None, None]
    return replace(log, force=log.force + np.stack([-load * log.force[..., 2], *([0.0 * log.force[..., 2]] * 2)], -1))


def dragged(log: GraspLog) -> GraspLog:
    """Markers go sideways with the body, while its forces tell nothing of it."""
    return replace(log, displacement=log.displacement - 0.3 * log.displacement[..., [2, 0, 1]] * [1.0, 0.0, 0.0])


def turned(log: GraspLog) -> GraspLog:
    """Markers turn with the body."""
    depth = -log.displacement[..., 2:].min(axis=(1, 2), keepdims=True)
    across = np.stack([-log.position[..., 1], log.position[..., 0], 0.0 * log.position[..., 0]], -1)
    return replace(log, displacement=log.displacement + 100.0 * depth * across)


IMPURE: dict[str, tuple[Callable[[GraspLog], GraspLog], str]] = {
    "sideways": (sideways, "load sideways changes by"),
    "dragged": (dragged, r"markers go \S+ µm sideways while they are pressed"),
    "turned": (turned, "markers turn by"),
    "untouched": (lambda log: log.take(slice(0, 20)), "nothing presses"),
}


@pytest.mark.parametrize("fault", IMPURE)
def test_a_press_that_is_not_pure_is_refused_with_what_was_seen(ball: GraspLog, fault: str) -> None:
    change, seen = IMPURE[fault]
    with pytest.raises(InvalidPress, match=f"log 2: .*{seen}") as refusal:
        calibrate_sensor([FAULTS.put_into(ball, 1), FAULTS.put_into(change(ball), 2)])
    assert list(refusal.value.evidence) == [1]
    assert str(pickle.loads(pickle.dumps(refusal.value))) == str(refusal.value)


UNKNOWN: dict[str, tuple[Callable[[GraspLog], GraspLog], str]] = {
    "force_offset_x": (lambda log: log.take(slice(30, 130)), "begin before the touch"),
    "marker_noise": (lambda log: log.take(slice(30, 130)), "begin before the touch"),
    "force_drift_x": (lambda log: log.take(slice(0, 80)), "lift the body"),
    "crosstalk_y": (lambda log: replace(log, displacement=log.displacement * [1.0, 1.0, 0.0]), "a load that leans"),
    "crosstalk_x": (lambda log: replace(log, force=None, normal=None), "no forces"),
    "force_offset_y": (lambda log: replace(log, force=None, normal=None), "no forces"),
    "inward_share": (lambda log: log.take(slice(30, 130)), "begin before the touch"),
    "gain": (lambda log: log, "no total force is given"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_what_a_press_does_not_tell_is_said_not_to_be_identified(ball: GraspLog, name: str) -> None:
    change, reason = UNKNOWN[name]
    found = calibrate_sensor([change(FAULTS.put_into(ball, 1))])[name]
    assert found.not_identified is not None
    assert reason in found.not_identified
    assert not found.is_significant
    assert math.isnan(found.value)


def test_the_noise_of_a_single_element_is_no_load_sideways(ball: GraspLog) -> None:
    middle = np.s_[:, 10:11, 10:11]
    fields = {name: getattr(ball, name)[middle] for name in ("displacement", "force", "normal")}
    element = replace(ball, position=ball.position[middle[1:]], **fields)
    for seed in range(300, 310):
        model = calibrate_sensor([Faults(marker_noise=1e-6, force_noise=2e-3).put_into(element, seed)])
        np.testing.assert_allclose(model.offset, 0.0, rtol=0.0, atol=2e-3)  # the noise of one frame
        assert str(model["marker_noise"].not_identified).startswith("1 elements; 16 are needed")


def test_a_flat_body_tells_no_kernel(ball: GraspLog) -> None:
    assert ball.force is not None
    shape = ball.force[len(ball) // 2] / ball.force[len(ball) // 2, ..., 2].sum()
    flat = replace(ball, force=ball.force[..., 2].sum(axis=(1, 2))[:, None, None, None] * shape)
    found = calibrate_sensor([replace(FAULTS, crosstalk=(0.0, 0.0)).put_into(flat, 1)])["kernel_width"]
    assert found.not_identified is not None
    assert "press with a ball" in found.not_identified


def test_a_sensor_without_fault_is_left_as_it_is(ball: GraspLog) -> None:
    model = calibrate_sensor([ball])
    np.testing.assert_allclose(model.apply(ball).log.force, ball.force, rtol=0.0, atol=1e-9)
    assert "rounded, or held back" in str(model["marker_noise"].not_identified)


def test_a_later_log_is_freed_of_the_faults(ball: GraspLog) -> None:
    """The forces of another press, which the model was not made of, come out as they would without the faults."""
    model = calibrate_sensor([FAULTS.put_into(ball, seed) for seed in SEEDS], [2.0] * len(SEEDS))
    later = replace(FAULTS, smoothing=0.0, force_noise=0.0).put_into(ball, 500)
    log, changed, _ = model.apply(later)
    true, before, after = (np.asarray(each.force).sum(axis=(1, 2)) for each in (ball, later, log))
    assert (np.abs(after - true).max(axis=0) < 0.15 * np.abs(before - true).max(axis=0)).all()
    assert [text.split()[0] for text in changed] == ["zero", "drift", "forces", "crosstalk", "noise", "moments"]


def test_only_logs_of_the_same_lattice_are_corrected(ball: GraspLog, models: list[SensorModel]) -> None:
    small = replace(ball, position=ball.position[:10], displacement=ball.displacement[:, :10], force=None, normal=None)
    with pytest.raises(InvalidInput, match="10 × 20; allowed: 20 × 20"):
        models[0].apply(small)
    without = replace(ball, force=None, normal=None)
    assert models[0].apply(without).log is without


def test_a_detection_by_a_sensor_model_is_that_of_the_corrected_log(ball: GraspLog, models: list[SensorModel]) -> None:
    log = FAULTS.put_into(ball, 7)
    corrected, _, options = models[0].apply(log)
    told, expected = detect_slip(log, sensor_model=models[0]), detect_slip(corrected, **options)
    np.testing.assert_array_equal(told.probability, expected.probability)
    assert not np.array_equal(told.contact, detect_slip(log).contact)


def test_a_model_outlives_json(models: list[SensorModel], ball: GraspLog) -> None:
    again = SensorModel.from_json(json.loads(json.dumps(models[0].to_json())))
    assert again.to_json() == models[0].to_json()
    log = FAULTS.put_into(ball, 3)
    np.testing.assert_array_equal(again.apply(log).log.force, models[0].apply(log).log.force)


@pytest.mark.parametrize("change", [{"grid": 3}, {"offset": [[1.0]]}, {"estimates": [{"name": "gain"}]}])
def test_what_is_no_sensor_model_is_refused(models: list[SensorModel], change: dict[str, object]) -> None:
    with pytest.raises(InvalidInput):
        SensorModel.from_json(models[0].to_json() | change)


def test_logs_that_do_not_belong_together_are_refused(ball: GraspLog) -> None:
    with pytest.raises(InvalidInput, match="at least one press"):
        calibrate_sensor([])
    with pytest.raises(InvalidInput, match="one sensor at a time"):
        calibrate_sensor([ball, replace(ball, sensor="another")])
    with pytest.raises(InvalidInput, match="logs is number 2, the same press as number 1; allowed: each press once"):
        calibrate_sensor([ball, replace(ball, metadata={"copy": "yes"})])
    forces_alone = replace(ball, displacement=np.zeros_like(ball.displacement), metadata={"displacement": "none"})
    assert calibrate_sensor([forces_alone, replace(forces_alone, force=1.01 * ball.force)]).presses == 2, "not the same"
    with pytest.raises(InvalidInput, match="one for each of 1 logs"):
        calibrate_sensor([ball], [1.0, 2.0])
    with pytest.raises(InvalidInput, match="1e-06 to 10000 N"):
        calibrate_sensor([ball], [0.0])
    with pytest.raises(InvalidInput, match=r"logs is .*; allowed: a list of logs"):
        calibrate_sensor(ball)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match=r"logs is 'ball'; allowed: GraspLog"):
        calibrate_sensor(["ball"])  # type: ignore[list-item]
    with pytest.raises(InvalidInput, match=r"known_force is 2.0; allowed: a list of one force"):
        calibrate_sensor([ball], 2.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match=r"known_force is '2'; allowed: 1e-06 to 10000 N"):
        calibrate_sensor([ball], ["2"])  # type: ignore[list-item]
    with pytest.raises(UnknownScale):
        calibrate_sensor([replace(ball, metadata={"scale": "unknown"})])


def test_an_unknown_estimate_is_named(models: list[SensorModel]) -> None:
    with pytest.raises(InvalidInput, match="colour"):
        models[0]["colour"]


def test_a_detector_is_told_of_noise_that_it_would_not_see(
    ball: GraspLog, f1_score: Callable[[GraspLog, SlipHistory], float]
) -> None:
    """Correlated noise looks like motion; a detector finds most of it itself, white noise all of it."""
    schedule = RampSchedule(rest=0.5, press=0.7, settle=0.3, shear=3.0, hold=0.5)
    clean = tangential_ramp(points=20, pitch=1e-3, schedule=schedule, normal_force=10.0, sphere_radius=40e-3)
    for memory, least, told in ((0.9, 0.93, {"displacement_floor"}), (0.0, 0.96, set())):
        faults = Faults(marker_noise=1e-5 if memory else 1e-6, memory=memory, force_noise=2e-3)
        model = calibrate_sensor([faults.put_into(ball, seed) for seed in range(3)])
        log = faults.put_into(clean, 9)
        assert set(model.apply(log).options) == told
        assert model.apply(log, "strain_rate").options == {}
        assert model.apply(replace(log, displacement=None)).options == {}  # forces alone have no markers
        with_model = f1_score(log, detect_slip(log, lookahead=2, sensor_model=model))
        assert with_model > least
        assert not told or with_model > f1_score(log, detect_slip(log, lookahead=2))


def test_the_friction_of_a_pivot_is_freed_of_the_forces_smoothing() -> None:
    """A rigid body of known friction pivots on a sensor that smooths; the forces' arms seem too long."""
    for width in (1.0, 2.0):
        faults = Faults(smoothing=width, force_noise=2e-3, marker_noise=1e-6)
        model = calibrate_sensor([faults.put_into(pressed(5.0), seed) for seed in range(3)])
        pivot = grasp(PIVOT, 0.7, Setting(smoothing=width, marker_noise=1e-6, force_noise=2e-3))
        before, after = (
            contact_friction(pivot.time, detect_slip(pivot, lookahead=2, sensor_model=each).patches)
            for each in (None, model)
        )
        assert before is not None
        assert after is not None
        assert before.high < 0.7
        assert after.low < 0.7 < after.high
        assert after.coefficient == pytest.approx(0.7, abs=0.03)
