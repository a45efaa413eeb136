"""A material whose grasps come from several sensors, each with a gain of its own."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators import Moments
from estimators.change_alarm import watched
from estimators.defaults import GRID
from estimators.linear import posterior_grid as grids
from slipcore.samples import FrictionSamples
from stiction_client.linear_friction import Scales
from stiction_client.support import SENSOR_GAIN

TRUTH = np.array([0.45, 8.0, -0.8])
AT = (2e-3, 0.12)
"""A velocity, m/s, and an element's normal force, N, in the middle of the data."""


def grasp(seed: int, gain: float = 0.0, sensor: str = "", tau: float = 0.05) -> Moments:
    """One grasp of 120 samples as a sensor of this gain shows it."""
    rng = np.random.default_rng([seed, 29])
    place = np.arange(120) % 12
    v, f_n = rng.uniform(1e-4, 5e-3, 120), rng.uniform(0.05, 0.2, 12)[place] * rng.uniform(0.8, 1.2, 120)
    law = (TRUTH @ [np.ones(120), v, f_n]) * (1.0 + gain) * (1.0 + tau * rng.standard_normal())
    mu = law + 0.02 * rng.standard_normal(12)[place] + 0.03 * rng.standard_normal(120)
    return Moments.from_samples(
        FrictionSamples(mu, v, f_n, mu * f_n, np.arange(120) * 0.01, place, np.ones(120), 1e-6, sensor=sensor)
    )


def material(gains: dict[str, float], each: int, seed: int = 0, tau: float = 0.05) -> list[Moments]:
    """So many grasps of each sensor."""
    pairs = [(name, gain) for name, gain in gains.items() for _ in range(each)]
    return [grasp(1000 * seed + k, gain, name, tau) for k, (name, gain) in enumerate(pairs)]


def test_grasps_of_one_sensor_are_fitted_as_if_nobody_knew_whose_they_are() -> None:
    grasps = material({"left": 0.0}, 3)
    known, unknown = (
        estimators.fit(parts, method="hierarchical") for parts in (grasps, [part.of_sensor("") for part in grasps])
    )
    assert known.coefficients.tolist() == unknown.coefficients.tolist()
    assert known.covariance.tolist() == unknown.covariance.tolist()
    assert known.scales == unknown.scales
    assert known.notes == ()
    assert known.of_sensor("left") is known


def test_gains_are_separated_where_grasps_scatter_less() -> None:
    model = estimators.fit(material({"left": 0.0, "right": 0.3}, 6, tau=0.02), method="hierarchical")
    assert model.scales is not None
    assert model.scales.between_sensors is not None
    sensors = model.scales.between_sensors.sensors
    known = sensors["right"].gain - sensors["left"].gain
    assert known == pytest.approx(0.3 / 1.15, abs=0.05)  # as a part of the average of both
    assert model.diagnostics[SENSOR_GAIN] == model.notes[0]
    assert model.notes[0].startswith("sensor 'right' shows")
    for name, gain in (("left", 0.0), ("right", 0.3)):
        own = model.of_sensor(name)
        expected = float(TRUTH @ [1.0, *AT]) * (1.0 + gain)
        assert float(own.predict(*AT)) == pytest.approx(expected, rel=0.05)
        assert float(own.predict(*AT, 0.01, "contact", 60)) > 0.85 * expected
    low = [float(each.predict(*AT, 0.01, "contact", 60)) for each in (model, model.of_sensor("left"))]
    assert low[0] < low[1]  # a new sensor's gain may be any


@pytest.mark.parametrize("method", ["hierarchical", "auto"])
def test_a_sensor_is_answered_for_its_own_element(method: str) -> None:
    """Of one whose elements are four times as large: the same pressure has the same friction."""
    parts = material({"fine": 0.0, "coarse": 0.0}, 3, tau=0.02)
    large = [part.at_element_area(4e-6) if part.grasps[0].sensor == "coarse" else part for part in parts]
    model, alike = (estimators.fit(each, method=method) for each in (large, parts))
    assert (model.element_area, model.on_sensor("coarse").element_area) == (1e-6, 4e-6)
    assert model.on_sensor("fine").element_area == model.on_sensor("nobody's").element_area == 1e-6
    v, f_n = AT
    expected = alike.of_sensor("coarse").predict(v, f_n, 0.05, "contact", 60)
    assert model.on_sensor("coarse").predict(v, 4.0 * f_n, 0.05, "contact", 15) == pytest.approx(expected, rel=1e-9)
    assert alike.on_sensor("coarse").coefficients.tolist() == alike.of_sensor("coarse").coefficients.tolist()


def test_a_gain_that_scatter_hides_is_said_to_be_hidden() -> None:
    model = estimators.fit(material({"left": 0.0, "right": 0.0}, 1, tau=0.15), method="hierarchical")
    assert model.notes[0].startswith("a sensor's own gain cannot be separated from scatter between grasps")


def test_sensors_that_agree_are_said_to_agree() -> None:
    model = estimators.fit(material({"left": 0.0, "right": 0.0}, 10, tau=0.01), method="hierarchical")
    assert model.notes[0].startswith("its 2 sensors agree to within")


def test_a_finer_grid_over_gains_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    grasps = material({"left": 0.0, "right": 0.1, "third": -0.05}, 3)
    coarse = estimators.fit(grasps, method="hierarchical")
    monkeypatch.setattr(grids, "GRID", replace(GRID, gain_nodes=24, beside_gains=20))
    fine = estimators.fit(grasps, method="hierarchical")
    np.testing.assert_allclose(coarse.standard_errors, fine.standard_errors, rtol=0.02)  # of quadrature
    for quantile in (1e-2, 1e-3):
        low, other = (float(model.predict(*AT, quantile, "contact", 60)) for model in (coarse, fine))
        assert low == pytest.approx(other, rel=0.02)


def test_sampling_finds_what_the_grid_finds() -> None:
    grasps = material({"left": 0.0, "right": 0.1, "third": -0.05}, 3)
    exact, sampled = (estimators.fit(grasps, method=method) for method in ("hierarchical", "bayes"))
    assert exact.scales is not None
    assert exact.scales.between_sensors is not None
    assert sampled.scales is not None
    assert sampled.scales.between_sensors is not None
    assert sampled.draws is not None
    assert sampled.draws.shape[1] == 7
    away = (sampled.coefficients - exact.coefficients) / exact.standard_errors
    assert (np.abs(away) < 0.2).all()  # four times the accuracy at which sampling stops
    for name, known in exact.scales.between_sensors.sensors.items():
        other = sampled.scales.between_sensors.sensors[name]
        assert other.gain == pytest.approx(known.gain, abs=0.2 * known.standard_error)


@pytest.mark.long
def test_intervals_hold_the_truth_where_sensors_differ() -> None:
    fits, inside = 40, 0
    friction = float(TRUTH @ [1.0, *AT])
    row = np.array([1.0, *AT])
    for seed in range(fits):
        gains = 0.05 * np.random.default_rng(seed).standard_normal(3)
        model = estimators.fit(material(dict(zip("abc", gains, strict=True)), 3, seed + 1), method="hierarchical")
        half = stats.t(model.degrees_of_freedom).ppf(0.975) * np.sqrt(row @ model.covariance @ row)
        inside += abs(float(model.predict(*AT)) - friction) <= half
    assert inside >= stats.binom(fits, 0.95).ppf(1e-3)


def test_another_sensors_gain_is_no_change_of_the_surface() -> None:
    grasps = material({"left": 0.0, "right": 0.25}, 6, tau=0.02)
    model = estimators.fit(grasps, method="hierarchical")
    statistics = [part.grasps[0] for part in grasps]
    assert not watched(model, statistics).changed
    assert watched(model, [replace(part, sensor="") for part in statistics]).changed


def test_scales_survive_json_and_older_ones_are_read() -> None:
    scales = estimators.fit(material({"left": 0.0, "right": 0.1}, 2), method="hierarchical").scales
    assert scales is not None
    assert Scales.from_json(json.loads(json.dumps(scales.to_json()))) == scales
    older = {name: told for name, told in scales.to_json().items() if name != "between_sensors"}
    assert Scales.from_json(older) == replace(scales, between_sensors=None)
