"""Which friction samples are believed: of elements, of whole contacts, or none."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.calibration.patch_grasps import PIVOT, SLIDE, Setting, grasp
from slipcore import GraspLog, check_log, collect_friction, collect_samples, detect_slip
from slipcore.samples import element_samples
from tests.slipcore.conftest import RECORDINGS, read_recording

NOISE = {"marker_noise": 1e-6, "force_noise": 2e-3}


def law(speed: np.ndarray, normal_force: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 + 20.0 * speed + 0.8 * normal_force)


def test_a_sliding_contact_has_the_friction_of_its_law_at_its_mean_elements() -> None:
    log = grasp(SLIDE, law)
    samples = collect_samples(log, detect_slip(log))
    contact = samples.take(samples.kind == "contact")
    told = law(contact.tangential_velocity, contact.normal_force)
    assert len(contact) > 30
    assert np.median(contact.friction_coefficient) == pytest.approx(told[0], rel=0.01)
    assert np.unique(contact.element).tolist() == [400]  # beyond the lattice


def test_elements_under_smoothed_forces_are_left_out_and_the_contact_is_believed() -> None:
    log = grasp(PIVOT, 0.7, Setting(smoothing=1.0, crosstalk=0.3, **NOISE))
    history = detect_slip(log, lookahead=2)
    everywhere = replace(history, slip=history.contact.copy(), probability=history.contact.astype(float))
    found = collect_friction(log, everywhere, velocity_to_noise=0.0, least_velocity=0.0)
    if found.elements_left_out is None:
        pytest.fail(f"{len(found.elements)} elements are believed")
    assert set(found.samples.kind) == {"contact"}
    assert found.samples.friction_coefficient.mean() == pytest.approx(0.7, rel=0.1)
    assert "contact contradicts elements" in {finding.name for finding in check_log(log, history, found.elements)}


def test_elements_that_agree_are_kept(short_ramp: GraspLog) -> None:
    history = detect_slip(short_ramp)
    found = collect_friction(short_ramp, history)
    assert found.elements_left_out is None
    elements = element_samples(short_ramp, history)
    chosen = found.samples.kind == "element"
    np.testing.assert_array_equal(found.samples.friction_coefficient[chosen], elements.friction_coefficient)


def test_a_rolling_contact_gives_no_sample_but_a_bound() -> None:
    log = read_recording(RECORDINGS / "example_1" / "AD2-0065L")
    found = collect_friction(log, detect_slip(log, lookahead=2))
    assert len(found.elements) > 100
    assert len(found.samples) == 0
    assert found.contact is not None
    assert found.contact.is_bound
    assert "rolls" in str(found.elements_left_out)


def test_a_grasp_of_a_pivoting_rod_gives_one_friction_without_a_slope() -> None:
    log = read_recording(RECORDINGS / "example_2" / "HDL1-GWH0021")
    samples = collect_samples(log, detect_slip(log, lookahead=2))
    assert set(samples.kind) == {"contact"}
    assert samples.friction_coefficient.mean() == pytest.approx(0.775, abs=0.03)
    assert np.ptp(samples.normal_force) == 0.0
