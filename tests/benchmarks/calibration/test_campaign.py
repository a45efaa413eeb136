import numpy as np
import pytest

from benchmarks.calibration.__main__ import FAULTS, PRESSED_WITH, _over_seeds, grasps, outcome
from benchmarks.calibration.presses import pressed
from slipcore import GraspLog, calibrate_sensor


@pytest.fixture(scope="module")
def clean() -> list[GraspLog]:
    return grasps()[::2]


@pytest.mark.parametrize(
    "fault",
    [
        "offset of 5 mN",
        *(pytest.param(each, marks=pytest.mark.long) for each in ("drift of 1 mN/s", "crosstalk of 8, −5 %")),
    ],
)
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


def test_grasps_in_which_too_little_slips_for_a_fit_have_a_score_and_no_error(clean: list[GraspLog]) -> None:
    error, slope, f1 = outcome([log.take(slice(0, 60)) for log in clean], None)
    assert np.isnan([error, slope]).all()
    assert 0.0 < f1 <= 1.0
    some = np.array([[error, slope, f1], [0.3, -0.4, 0.5], [0.1, 0.2, 0.6]])
    assert _over_seeds(some).friction == pytest.approx(np.sqrt(0.05))
    assert np.isnan(_over_seeds(some[:1]).slope)
