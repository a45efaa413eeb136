"""Limits of what was recorded, on either side of each, and the numbers that are told."""

import numpy as np
import pytest

from slipcore.checks import recording
from tests.slipcore.checks.by_hand import PITCH, log, over_time, subject, told

FORWARD = over_time(np.linspace(0.0, 1e-4, 20), 0)


@pytest.mark.parametrize(("interval", "said"), [(1.0, ""), (1.25, "frames lie 1.25 s apart")])
def test_frames_are_slow_above_a_second_in_the_median(interval: float, said: str) -> None:
    steps = np.full(19, interval)
    steps[:9] *= 1.5  # fewer than half
    time = np.concatenate([[0.0], np.cumsum(steps)])
    assert told(recording.time_unit(subject(log(time=time)))).startswith(said)
    assert bool(said) == any(recording.time_unit(subject(log(time=time))))


@pytest.mark.parametrize(("interval", "said"), [(2e-4, ""), (1e-4 / 3.0, "29,997 frames a second; no tactile sensor")])
def test_frames_are_faster_than_any_sensor_under_a_fifth_of_a_millisecond(interval: float, said: str) -> None:
    time = np.concatenate([[0.0], np.cumsum(np.full(19, 1.0001 * interval))])
    assert told(recording.time_unit(subject(log(time=time)))).startswith(said)
    assert bool(said) == any(recording.time_unit(subject(log(time=time))))


def test_what_touches_in_the_first_frame_by_noise_alone_is_no_touch_before_it() -> None:
    """Until noise is known, after three frames, other elements of a small array may seem to touch in each frame."""
    contact = np.zeros((20, 4, 3), bool)
    contact[0, 0] = contact[1:6, 1] = True
    assert not any(recording.rest_in_contact(subject(log(), contact)))
    contact[1:4, 0, 0] = True
    assert told(recording.rest_in_contact(subject(log(), contact))) == "3 elements touch in the first frame"


def test_markers_are_still_that_stay_where_they_are_though_not_at_zero() -> None:
    assert told(recording.still_markers(subject(log(1e-4)))) == "no marker ever moves"
    assert not any(recording.still_markers(subject(log(FORWARD))))
    assert not any(recording.still_markers(subject(log(None, 0.1))))


@pytest.mark.parametrize(("along", "across", "said"), [(0.6, 0.7, "60%"), (0.49, 0.7, ""), (0.7, 0.49, "")])
def test_a_lattice_that_stretches_in_all_directions_has_places_for_displacement(
    along: float, across: float, said: str
) -> None:
    at_rest = log()
    stretched = at_rest.position * [along, across, 0.0] - [1e-3, 0.0, 0.0]
    seen = subject(log(stretched))
    assert said in told(recording.places_for_displacement(seen))
    assert bool(said) == any(recording.places_for_displacement(seen))


@pytest.mark.parametrize("grid", [(2, 3), (3, 2)])
@pytest.mark.parametrize(("factor", "is_found"), [(4.4, False), (4.6, True), (1.0 / 4.4, False), (1.0 / 4.6, True)])
def test_an_area_is_doubted_beyond_four_and_a_half_cells_either_way(
    grid: tuple[int, int], factor: float, is_found: bool
) -> None:
    found = told(recording.element_area(subject(log(grid=grid, element_area=factor * PITCH**2))))
    area = f"elements of {factor:.3g} mm² lie on a lattice of 1 mm² an element"
    assert found == (area if is_found else "")


def test_a_row_of_elements_has_no_cell() -> None:
    assert not any(recording.element_area(subject(log(grid=(1, 4), element_area=50.0 * PITCH**2))))


def test_more_than_a_twentieth_of_copied_frames_is_told_in_per_cent() -> None:
    path = np.linspace(0.0, 1e-4, 21)
    path[8] = path[7]  # one of twenty
    assert not any(recording.repeated_frames(subject(log(over_time(path, 0), frames=21))))
    path[12] = path[11]
    found = told(recording.repeated_frames(subject(log(over_time(path, 0), frames=21))))
    assert found == "10% of the frames are copies of the one before"


def test_a_frame_is_a_copy_if_all_that_is_measured_is() -> None:
    copied = over_time([0.0, 1e-4, 1e-4], 0)
    growing = over_time([-0.1, -0.2, -0.3], 2)
    assert told(recording.repeated_frames(subject(log(copied, frames=3)))).startswith("50%")
    assert not any(recording.repeated_frames(subject(log(copied, growing, frames=3))))
    assert any(recording.repeated_frames(subject(log(0.0, -growing[[0, 1, 1]], frames=3))))  # no marker, forces alone
    assert not any(recording.repeated_frames(subject(log(1e-4, frames=2))))


@pytest.mark.parametrize(("pressure", "said"), [(4.99e6, ""), (7e6, "7 MPa on an element")])
def test_a_pressure_above_five_megapascal_is_none(pressure: float, said: str) -> None:
    force = np.zeros((20, 4, 3, 3))
    force[3, 1, 2, 2] = -pressure * PITCH**2
    assert told(recording.force_unit(subject(log(0.0, force)))) == said
    assert not any(recording.force_unit(subject(log())))


def test_the_sign_of_forces_is_that_where_they_are_largest() -> None:
    """All twelve elements alike: they press in one frame, and pull more in another."""
    force = over_time(np.zeros(20), 2)
    force[4, ..., 2], force[9, ..., 2] = -0.2, 0.25
    assert told(recording.force_sign(subject(log(0.0, force)))) == "the object pulls with 3 N where forces are largest"
    assert not any(recording.force_sign(subject(log(0.0, -force))))
    assert not any(recording.force_sign(subject(log(0.0, 0.0))))


def pressed_into_its_range(elements: int, grid: tuple[int, int]) -> np.ndarray:
    """Forces that grow differently on each element and stay at 1 N along x and -y on the first ones."""
    rng = np.random.default_rng(1)
    force = (
        rng.uniform([0.0, -0.9, -0.9], [0.9, 0.0, 0.0], (20, *grid, 3)) * np.linspace(0.1, 1.0, 20)[:, None, None, None]
    )
    force.reshape(20, -1, 3)[10:, :elements] = [1.0, -1.0, -0.5]
    return force


@pytest.mark.parametrize(("elements", "is_found"), [(4, False), (5, True)])
def test_more_than_four_elements_at_the_end_of_their_range_are_told_with_their_axes(
    elements: int, is_found: bool
) -> None:
    seen = subject(log(0.0, pressed_into_its_range(elements, (4, 3))), contact=True)
    said = f"{elements} of the 12 elements that touch reach the largest force along x and y"
    assert told(recording.saturation(seen)) == (said if is_found else "")
    reconstructed = log(0.0, seen.log.force, metadata={"force": "reconstructed"})
    assert not any(recording.saturation(subject(reconstructed, contact=True)))


def test_of_many_elements_a_twentieth_may_be_at_the_end_of_their_range() -> None:
    for elements, is_found in ((6, False), (7, True)):  # of 120
        seen = subject(log(0.0, pressed_into_its_range(elements, (12, 10)), grid=(12, 10)), contact=True)
        assert any(recording.saturation(seen)) == is_found


def test_elements_that_touch_in_the_first_frame_are_counted() -> None:
    contact = np.zeros((20, 4, 3), bool)
    contact[1:] = True
    assert not any(recording.rest_in_contact(subject(log(), contact)))
    contact[0, 1, :2] = True
    assert told(recording.rest_in_contact(subject(log(), contact))) == "2 elements touch in the first frame"
