"""Forces, places and layers joined, in closed form: separate pillars (benchmarks/detector/pillars.py), and a sphere."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.detector.accuracy import count
from benchmarks.detector.coarse import coarse, false_slip
from benchmarks.detector.pillars import Grasp
from benchmarks.detector.scenes import observed
from service.slip_benchmark.faults import changed_forces, stuck
from slipcore import GraspLog, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.frames import FloatArray

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
    alone = detect_slip(log, "coarse", filter_weight=0.0, layers_weight=0.0, few_odds=0.0, many_elements=1e9)
    np.testing.assert_array_equal(alone.slip, detect_slip(log, "forces_only").slip)


def sphere(elements: int, load: float, hold: float = 0.2, force_noise: float = 2e-3) -> GraspLog:
    """A sphere pressed on a gel and pulled to so much of the sliding load, seen by few elements, with 1 µm of noise."""
    fine = tangential_ramp(schedule=RampSchedule(hold=hold), tangential_force=load, friction=0.4)
    return observed(coarse(fine, elements), 1e-6, force_noise, "force", seed=5)


def f1_of(log: GraspLog, **options: float) -> float:
    assert log.truth is not None
    true = log.truth.slip_contact_factor & log.truth.contact
    return count(true, detect_slip(log, "coarse", **options).slip & log.truth.contact).f1


@pytest.mark.parametrize(("elements", "least"), [(3, 0.93), (6, 0.98)])  # without layers .896 and .942
def test_layers_find_slip_of_a_gels_elements_that_are_as_large_as_the_contact(elements: int, least: float) -> None:
    log = sphere(elements, 0.8)
    assert f1_of(log) > max(least, f1_of(log, layers_weight=0.0) + 0.03)


@pytest.mark.parametrize("force_noise", [2e-3, 1e-2])
def test_a_gel_that_is_held_keeps_what_slips(force_noise: float) -> None:
    log = sphere(6, 0.7, hold=20.0, force_noise=force_noise)
    slip = detect_slip(log, "coarse").slip
    begin = np.searchsorted(log.time, log.time[-1] - 19.0)
    assert np.abs(slip[begin:].sum(axis=(1, 2)) - slip[begin].sum()).max() <= 1


def test_a_gel_that_is_pressed_and_held_does_not_slip() -> None:
    log = sphere(6, 0.0, hold=20.0)
    assert detect_slip(log, "coarse").slip.sum() <= 0.005 * log.truth.contact.sum()


@pytest.mark.parametrize("wrong", [stuck, np.negative])
def test_forces_that_are_not_believed_say_nothing_and_are_told(wrong: Callable[[FloatArray], FloatArray]) -> None:
    log = changed_forces(wrong)(sphere(6, 0.8), np.random.default_rng(0))
    assert f1_of(log) > 0.87  # .936 and .888; from displacement alone .875
    assert "forces not believed" in [finding.name for finding in detect_slip(log, "coarse").findings]


def test_of_many_elements_the_filter_decides_where_the_load_alone_would_not_show_slip() -> None:
    fine = tangential_ramp(schedule=RampSchedule(), tangential_force=0.4, friction=0.25)
    log = observed(fine, 1e-6, 2e-3, "force", seed=5)
    assert f1_of(log) > 0.9
