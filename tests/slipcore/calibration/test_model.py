"""What a sensor model takes out of a log, and what it tells a detector."""

from dataclasses import replace

import numpy as np
import pytest

from slipcore import InvalidInput
from slipcore.calibration.estimate import Estimate, unknown
from slipcore.calibration.model import SensorModel
from tests.slipcore.calibration.straight_press import GRID, STEP, straight


def surely(name: str, value: float, half: float = 0.0) -> Estimate:
    return Estimate(name, "-", value, value - half, value + half)


def model(*known: Estimate, offset: np.ndarray | None = None) -> SensorModel:
    """What is not given is not identified."""
    names = [f"force_drift_{axis}" for axis in "xyz"] + [f"crosstalk_{axis}" for axis in "xy"]
    names += ["kernel_width", "marker_noise", "marker_noise_correlation", "gain"]
    given = {each.name: each for each in known}
    estimates = tuple(given.get(name) or unknown(name, "-", "not seen") for name in names)
    return SensorModel("straight press", GRID, 1e-6, STEP, 1, estimates, offset)


def test_each_fault_is_taken_off_in_the_order_in_which_sensors_make_it() -> None:
    true = straight()
    assert true.force is not None
    offset, drift = 1e-3 * np.random.default_rng(1).standard_normal((*GRID, 3)), np.array([1e-3, 0.0, -2e-3])
    leaked = true.force + np.concatenate([-true.force[..., 2:] * [0.1, -0.05], 0.0 * true.force[..., 2:]], axis=-1)
    told = 1.25 * leaked + offset + (true.time - true.time[0])[:, None, None, None] * drift
    drifts = [surely(f"force_drift_{axis}", value) for axis, value in zip("xyz", drift, strict=True)]
    known = [*drifts, surely("gain", 0.8), surely("crosstalk_x", 0.1), surely("crosstalk_y", -0.05)]
    corrected, changed, options = model(*known, offset=offset).apply(replace(true, force=told))
    np.testing.assert_allclose(corrected.force, true.force, rtol=0.0, atol=1e-14, err_msg="rounding")
    x, y, z = offset.sum(axis=(0, 1))
    assert changed == (
        f"zero of each element taken off, {x:.3g}, {y:.3g}, {z:.3g} N in all",
        "drift of 0.064, 0, -0.128 N/s in all taken off",
        "forces multiplied with 0.8",
        "crosstalk of 0.1, -0.05 of the normal force taken off",
    )
    assert options == {}


def test_crosstalk_on_a_slope_goes_along_the_surface() -> None:
    """Of a pressing force of 1 N, 0.1 N along x: its part along the normal stays."""
    log = straight()
    normal = np.broadcast_to([0.6, 0.0, 0.8], log.displacement.shape)
    log = replace(log, normal=normal, force=-normal)
    force = model(surely("crosstalk_x", 0.1)).apply(log).log.force
    leak = np.array([0.1, 0.0, 0.0])
    expected = -normal[0, 0, 0] - (leak - leak @ normal[0, 0, 0] * normal[0, 0, 0])
    np.testing.assert_allclose(force, np.broadcast_to(expected, log.displacement.shape), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    "unsure", [surely("force_drift_z", 1e-3, 2e-3), surely("crosstalk_x", 0.01, 0.02), surely("gain", 1.1, 0.2)]
)
def test_what_may_be_no_fault_stays(unsure: Estimate) -> None:
    log = straight()
    assert model(unsure).apply(log).log is log


@pytest.mark.parametrize(
    ("noise", "memory", "told"),
    [
        (surely("marker_noise", 2e-6), surely("marker_noise_correlation", 0.3), True),
        (surely("marker_noise", 2e-6), surely("marker_noise_correlation", 0.29), False),
        (surely("marker_noise", 2e-6, 3e-6), surely("marker_noise_correlation", 0.9), False),
    ],
)
def test_a_detector_is_told_of_noise_that_lasts(noise: Estimate, memory: Estimate, told: bool) -> None:
    log = straight()
    _, changed, options = model(noise, memory).apply(log)
    assert options == ({"displacement_floor": 2e-6} if told else {})
    assert changed == (("noise of markers taken for 2 µm, for it is correlated",) if told else ())
    assert model(noise, memory).apply(log, "strain_rate").options == {}


@pytest.mark.parametrize(("width", "told"), [(0.5e-3, True), (0.49e-3, False)])
def test_a_detector_is_told_of_a_kernel_from_half_an_element(width: float, told: bool) -> None:
    for method in ("filter", "strain_rate"):
        _, changed, options = model(surely("kernel_width", width)).apply(straight(), method)
        assert options == ({"kernel_width": width} if told else {})
        assert len(changed) == told
    assert model(surely("kernel_width", width)).apply(replace(straight(), force=None)).options == {}


def test_json_holds_what_is_not_known_as_none() -> None:
    told = model(surely("gain", 0.8), offset=np.ones((*GRID, 3))).to_json()
    assert told["estimates"][0] == {
        "name": "force_drift_x", "unit": "-", "value": None, "low": None, "high": None, "not_identified": "not seen",
    }  # fmt: skip
    again = SensorModel.from_json(told)
    assert again.to_json() == told
    assert again["gain"] == surely("gain", 0.8)
    assert again.presses == 1
    assert again.frame_interval == STEP
    with pytest.raises(InvalidInput, match="shape"):
        replace(again, offset=np.ones((2, 2, 3)))
