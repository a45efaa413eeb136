"""What a fit says of itself in words."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimators.methods import reporting


def test_the_sensors_that_are_named_differ_by_most_of_what_is_known_of_their_difference(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mean, covariance = np.array([0.0, 3.0, 1.2]), np.array([[1.0, -0.5, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 0.1]])
    gains = SimpleNamespace(names=("left", "right", "third"), moments=lambda *_: (mean, covariance))
    nodes: Any = SimpleNamespace(weight=np.ones(1), gains=gains)
    monkeypatch.setattr(reporting, "_compared", lambda *_: np.arange(3))
    monkeypatch.setattr(
        reporting, "_difference", lambda _w, _g, first, second: (0.1 * mean[first] - 0.1 * mean[second],) * 2
    )
    (told,) = reporting.sensor_gain(nodes).values()
    deviations = {"right": 3.0 / np.sqrt(3.0), "third": 1.2 / np.sqrt(1.1)}  # of the difference from the first
    assert deviations["right"] > deviations["third"]
    assert str(told).startswith("sensor 'right' shows 30.0% to 30.0% more friction than 'left'")
