"""Arrays of few elements: what they see of a field, and what now holds on them."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.detector import pillars
from benchmarks.detector.coarse import Array, at_rate, coarse, false_slip, measure, overlap
from benchmarks.detector.scenes import Case, observed, phases
from slipcore import GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp


def fine() -> GraspLog:
    log = tangential_ramp(schedule=RampSchedule(0.2, 0.4, 0.1, 0.8, 0.1), points=20, tangential_force=0.9)
    return replace(log, normal=np.broadcast_to([0.0, 0.0, 1.0], log.displacement.shape))


@pytest.mark.parametrize("elements", [3, 6, 20])
def test_elements_share_all_points_evenly(elements: int) -> None:
    share = overlap(20, elements)
    np.testing.assert_allclose(share.sum(axis=0), 1.0, rtol=1e-12)
    np.testing.assert_allclose(share.sum(axis=1), 20.0 / elements, rtol=1e-12)


def test_fewer_elements_bear_the_same_force_and_area() -> None:
    log = fine()
    few = coarse(log, 3)
    np.testing.assert_allclose(few.force.sum(axis=(1, 2)), log.force.sum(axis=(1, 2)), rtol=1e-9, atol=1e-12)
    assert 9 * few.element_area == pytest.approx(400 * log.element_area)
    assert few.truth.contact.any()
    assert few.truth.slip_contact_factor.any()


def test_as_many_elements_as_points_see_what_there_is() -> None:
    log = fine()
    same = coarse(log, 20)
    np.testing.assert_allclose(same.force, log.force, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(same.truth.slip_contact_factor, log.truth.slip_contact_factor & log.truth.contact)


def test_another_frame_rate_runs_through_the_frames_that_there_were() -> None:
    log = coarse(fine(), 3)
    faster = at_rate(Case("ramp", log, phases(log)), 300.0).log
    whole = np.arange(0, len(faster), 10)
    np.testing.assert_allclose(faster.force[whole], log.force[: len(whole)], rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(faster.truth.contact[whole], log.truth.contact[: len(whole)])


def test_pillars_bear_what_bends_them_and_never_more_than_friction() -> None:
    for case in pillars.cases("tuning"):
        log = case.log
        normal, sideways = -log.force[..., 2], np.hypot(log.force[..., 0], log.force[..., 1])
        assert (sideways <= 1.12 * log.truth.friction.coefficients[0] * normal + 1e-9).all()  # friction scatters by 3 %
        assert log.truth.slip_contact_factor[log.truth.slip_kinematic].all()


@pytest.mark.parametrize("elements", [3, 6])
def test_taxels_in_a_ramp_slip_as_the_closed_form_says(elements: int) -> None:
    log = coarse(fine(), elements)
    case = Case("ramp", log, phases(log))
    history = detect_slip(replace(observed(log, 1e-6, 2e-3, "force"), displacement=None))
    found, true = history.slip & log.truth.contact, log.truth.slip_contact_factor & log.truth.contact
    sticking, said = false_slip(case, history)
    assert 2.0 * (found & true).sum() > 0.85 * (found.sum() + true.sum())
    assert said <= 0.05 * sticking


@pytest.mark.long  # ten seconds of frames a millisecond apart
def test_separate_pillars_at_1_khz_do_better_by_forces_than_by_place() -> None:
    array = Array("pillars", None, 1000.0, 5e-6, 1e-2)
    runs = {name: ("force", name) for name in ("filter", "forces_only", "coarse")}
    by_place, forces_only, joined = measure(array, "tuning", runs)
    assert min(forces_only.f1, joined.f1) > max(0.8, by_place.f1)
    assert max(forces_only.false_slip, joined.false_slip) <= 0.05
