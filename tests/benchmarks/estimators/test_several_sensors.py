"""What the campaign of several sensors makes and counts."""

import numpy as np
import pytest

import estimators
from benchmarks.estimators.several_sensors import LAW, cell, material, outcomes


def test_each_grasp_is_of_its_sensor_and_shows_its_gain() -> None:
    parts = [material(3, spread, 2, np.random.default_rng(4)) for spread in (0.0, 0.2)]
    names = [[part.grasps[0].sensor for part in grasps] for grasps in parts]
    assert names[0] == names[1] == [f"sensor {k}" for k in (0, 0, 1, 1, 2, 2)]
    ratio = np.array([float(b.factor.mean[2] / a.factor.mean[2]) for a, b in zip(*parts, strict=True)])
    gains = 1.0 + 0.2 * np.random.default_rng(4).standard_normal(3)
    np.testing.assert_allclose(ratio, np.repeat(gains, 2), rtol=1e-6)  # of moments that are summed


def test_what_contacts_show_is_counted_against_the_models_quantiles() -> None:
    model = estimators.fit(material(2, 0.0, 2, np.random.default_rng(0)), method="hierarchical")
    held, contacts, slips, width = outcomes(model, np.array([LAW, LAW, 0.0, 10.0 * LAW]))
    assert held == 1.0
    assert contacts == 0.5
    assert slips == pytest.approx(25.0)
    assert 0.0 < width < 1.0


def test_a_row_says_what_was_told_of_the_gains() -> None:
    assert "one 100 %" in cell((1, 0.0, 2), 2)
    assert "one" not in cell((2, 0.0, 2), 2)
