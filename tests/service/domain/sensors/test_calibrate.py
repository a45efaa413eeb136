"""What is learnt of a sensor, as it is stored and read again."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.calibration.presses import Faults, pressed
from service.domain.sensors import calibrate
from slipcore import SensorModel, calibrate_sensor
from stiction_client import container

FAULTS = Faults(offset=0.01, gain=1.1, marker_noise=1e-6, force_noise=2e-3)


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("presses")
    for seed in range(2):
        container.write(FAULTS.put_into(pressed(), seed), folder / f"{seed}.npz")
    return sorted(folder.iterdir())


def stored(paths: list[Path]) -> SensorModel:
    model, offset = calibrate.learn("left", paths, [2.0, 2.0])
    row: Any = SimpleNamespace(new=SimpleNamespace(model=model, offset=offset))
    return calibrate.sensor_model(row)


def test_what_was_learnt_of_a_sensor_comes_back_from_the_store_to_the_last_bit(paths: list[Path]) -> None:
    found = calibrate_sensor([replace(FAULTS.put_into(pressed(), seed), sensor="left") for seed in range(2)], [2.0] * 2)
    again = stored(paths)
    assert found.offset is not None
    assert again.offset is not None
    np.testing.assert_array_equal(again.offset, found.offset)
    assert replace(again, offset=None).to_json() == replace(found, offset=None).to_json()
    np.testing.assert_allclose(again.offset, FAULTS.offsets(found.grid), atol=2e-3)


def test_a_zero_that_is_unknown_stays_so(paths: list[Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipcore.calibration.calibrate._offset", lambda _: None)
    assert stored(paths).offset is None
