"""Forces and places joined, on arrays of separate pillars in closed form (benchmarks/detector/pillars.py)."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.detector.accuracy import count
from benchmarks.detector.coarse import false_slip
from benchmarks.detector.pillars import Grasp
from benchmarks.detector.scenes import observed
from slipcore import detect_slip

CASE = Grasp("ramp", 0.5, (0.0, 0.2, 0.7, 0.9, 2.4), (-1e-4, -1e-4, 1e-3, 1e-3, 1e-3),
             x=(0.0, 0.0, 0.0, 0.0, 2e-3), tilt=(0.02, -0.01), seed=50).log()  # fmt: skip


@pytest.mark.parametrize("inputs", ["force", "motion"])
def test_pillars_with_displacement_and_forces_are_told_apart(inputs: str) -> None:
    truth = CASE.log.truth
    assert truth is not None
    history = detect_slip(observed(CASE.log, 5e-6, 1e-2, inputs), "coarse")
    sticking, said = false_slip(CASE, history)
    assert count(truth.slip_contact_factor & truth.contact, history.slip & truth.contact).f1 > 0.9
    assert said <= 0.05 * sticking


def test_without_forces_it_is_the_filter_on_the_same_contact() -> None:
    log = replace(observed(CASE.log, 5e-6, 1e-2, "displacement"), contact=CASE.log.truth.contact)
    joined, alone = detect_slip(log, "coarse"), detect_slip(log, "filter")
    np.testing.assert_array_equal(joined.contact, alone.contact)
    np.testing.assert_array_equal(joined.slip, alone.slip)
    np.testing.assert_allclose(joined.probability, alone.probability, rtol=0.0, atol=1.3e-4)  # where odds are bounded


def test_without_weight_it_is_the_forces_alone() -> None:
    log = observed(CASE.log, 5e-6, 1e-2, "force")
    np.testing.assert_array_equal(
        detect_slip(log, "coarse", filter_weight=0.0).slip, detect_slip(log, "forces_only").slip
    )
