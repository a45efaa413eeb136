import numpy as np
import pytest

from benchmarks.calibration import FAULTS, PRESSED_WITH, grasps, outcome
from benchmarks.presses import pressed
from slipcore import GraspLog, calibrate_sensor


@pytest.fixture(scope="module")
def clean() -> list[GraspLog]:
    return grasps()[::2]


@pytest.mark.parametrize("fault", ["offset of 5 mN", "drift of 1 mN/s", "crosstalk of 8, −5 %"])
def test_friction_of_a_sensor_that_errs_comes_out_right_once_it_is_calibrated(
    fault: str, clean: list[GraspLog]
) -> None:
    faults = FAULTS[fault]
    model = calibrate_sensor([faults.put_into(pressed(PRESSED_WITH), seed) for seed in range(40, 43)])
    logs = [faults.put_into(log, 50 + number) for number, log in enumerate(clean)]
    before, after = (outcome(logs, each) for each in (None, model))
    assert abs(before[0]) > 0.02
    assert abs(after[0]) < 0.01
    assert np.isfinite(after).all()
