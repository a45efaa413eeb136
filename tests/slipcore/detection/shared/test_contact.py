from dataclasses import replace
from inspect import unwrap

import numpy as np
import pytest

from slipcore import detect_slip
from slipcore.contact import tangential_ramp
from slipcore.defaults import ContactOptions, FilterOptions
from slipcore.detection.detector import touch_thresholds
from slipcore.detection.shared.contact import (
    CURVATURE_NOISE,
    ContactThreshold,
    curvature,
    find_contact,
    is_bonded,
    spatial_noise,
)

OPTIONS = ContactOptions()
AREA = 1e-6


def contact_from_force(
    pressing: np.ndarray, area: float, noise: float, before: np.ndarray | None, options: ContactOptions
) -> np.ndarray:
    return found_contact(pressing, noise, before, touch_thresholds(options, area)[0])


def contact_from_shape(
    pressing: np.ndarray, noise: float, before: np.ndarray | None, options: ContactOptions
) -> np.ndarray:
    return found_contact(pressing, noise, before, touch_thresholds(options, AREA)[1])


def found_contact(pressing: np.ndarray, noise: float, before: np.ndarray | None, touch: np.ndarray) -> np.ndarray:
    contact = np.zeros(pressing.shape, bool)
    find_contact(pressing, noise, contact.copy() if before is None else before, ContactThreshold(*touch), contact)
    return contact


def test_the_threshold_is_the_largest_of_pressure_share_and_noise() -> None:
    pressing = np.array([[1e-1, 9e-3, 7e-3, -1e-1]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, np.nan, None, OPTIONS), [[1, 1, 0, 0]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, 2e-3, None, OPTIONS), [[1, 0, 0, 0]])
    weak = np.array([[6e-4, 4e-4]])  # 500 Pa on 1 mm² is 0.5 mN
    np.testing.assert_array_equal(contact_from_force(weak, AREA, 0.0, None, OPTIONS), [[1, 0]])


def test_an_element_is_released_later_than_it_would_touch() -> None:
    pressing, before = np.array([[4.5e-4, 4.5e-4, 3e-4]]), np.array([[True, False, True]])
    np.testing.assert_array_equal(contact_from_force(pressing, AREA, np.nan, before, OPTIONS), [[1, 0, 0]])


@pytest.mark.parametrize("depth", [2e-4, 1e-3])
def test_the_shape_tells_contact_by_a_share_of_its_depth(depth: float) -> None:
    indentation = depth * np.array([[1.0, 0.4, 0.2, -0.5]])
    np.testing.assert_array_equal(contact_from_shape(indentation, np.nan, None, OPTIONS), [[1, 1, 0, 0]])


def test_a_sensor_at_rest_touches_nothing() -> None:
    assert not contact_from_shape(np.array([[2e-5, 0.0]]), 1e-6, None, OPTIONS).any()


def test_the_noise_of_one_frame_is_told_by_what_seems_to_pull() -> None:
    pressing = 2e-3 * np.random.default_rng(1).standard_normal((40, 40))
    pressing[10:30, 10:30] += 0.1  # the contact itself pushes
    assert spatial_noise(pressing) == pytest.approx(2e-3, rel=0.15)  # 3 standard errors of 600 values
    assert np.isnan(spatial_noise(np.full((5, 5), 0.1)))


def test_a_noisy_first_frame_touches_nothing() -> None:
    log = tangential_ramp(marker_noise=1e-6, force_noise=2e-3)
    history = detect_slip(log)
    assert not history.contact[log.time < 0.4].any()  # the object comes at 0.5 s
    assert len(history.events.release) < 0.2 * len(history.events.touch)


def hertzian(r: np.ndarray) -> np.ndarray:
    """Indentation at r contact radii over the deepest (Hertz): beyond the contact the surface follows it down."""
    outside = np.maximum(r, 1.0)
    beyond = ((2.0 - outside**2) * np.arcsin(1.0 / outside) + np.sqrt(outside**2 - 1.0)) / np.pi
    return np.where(r <= 1.0, 1.0 - r**2 / 2.0, beyond)


def test_beyond_the_rim_the_shape_is_hollow() -> None:
    x, y = np.meshgrid(np.arange(-9.0, 10.0), np.arange(-9.0, 10.0))
    r = np.hypot(x, y) / 5.0
    indentation = hertzian(r)
    found = contact_from_shape(
        1e-3 * indentation, np.nan, None, replace(OPTIONS, contact_depth_share=0.3, rim_curvature=0.008)
    )
    assert np.count_nonzero(found ^ (r <= 1.0)) <= 0.15 * np.count_nonzero(r <= 1.0)
    deeper = contact_from_shape(1e-3 * indentation, np.nan, None, replace(OPTIONS, contact_depth_share=0.3))
    assert np.count_nonzero(deeper) > 1.5 * np.count_nonzero(r <= 1.0)


def bonded(depth: float = 4e-4) -> tuple[np.ndarray, np.ndarray]:
    """Indentation by a ball, m, of a layer so thin that it sinks in under the object and nowhere else, and r."""
    x, y = np.meshgrid(np.arange(-9.0, 10.0), np.arange(-9.0, 10.0))
    r = np.hypot(x, y) / 6.0
    return depth * np.maximum(1.0 - r**2, 0.0), r


@pytest.mark.parametrize("noise", [0.0, 1e-6, 2e-5])
def test_on_a_bonded_gel_the_contact_reaches_far_under_half_of_the_depth(noise: float) -> None:
    indentation, r = bonded()
    seen = indentation + noise * np.random.default_rng(0).standard_normal(indentation.shape)
    found = contact_from_shape(seen, noise, None, FilterOptions())
    assert np.count_nonzero(found & (r < 1.0)) > 0.75 * np.count_nonzero(r < 1.0)
    assert not found[r >= 1.1].any()


def test_rounding_hides_no_rim_of_a_contact_on_a_bonded_gel() -> None:
    """The shape bends by less from one element to the next than rounding to 20 µm feigns."""
    indentation, r = bonded()
    found = contact_from_shape(indentation, 1e-6, None, FilterOptions())
    rounded = contact_from_shape(2e-5 * np.round(indentation / 2e-5), 8e-6, None, FilterOptions())
    assert np.count_nonzero(found ^ rounded) <= 0.05 * np.count_nonzero(r < 1.0)


def test_a_gel_is_bonded_if_the_surface_falls_fast_beside_the_contact() -> None:
    """Where the contact comes to the edge of half of the lattice that cannot be told, nor where nothing is pressed."""
    touch = ContactThreshold(*touch_thresholds(FilterOptions(), AREA)[1])
    indentation, _ = bonded()
    assert is_bonded(indentation, indentation.max(), touch)
    assert not is_bonded(indentation[6:13, 6:13], indentation.max(), touch)
    x, y = np.meshgrid(np.arange(-30.0, 31.0), np.arange(-30.0, 31.0))
    for radius in (2.0, 4.0, 8.0, 16.0, 24.0):  # of which the lattice holds all that matters, or only a part
        assert not is_bonded(1e-3 * hertzian(np.hypot(x, y) / radius), 1e-3, touch), radius
    assert not is_bonded(np.zeros((9, 9)), 0.0, touch)


@pytest.mark.parametrize("radius", [4.0, 8.0, 10.0, 12.0])
def test_a_wide_contact_on_a_half_space_ends_at_its_rim(radius: float) -> None:
    """The wider, the less does the shape bend from one element to the next: the rim has gaps."""
    x, y = np.meshgrid(np.arange(-15.0, 16.0), np.arange(-15.0, 16.0))
    r = np.hypot(x, y) / radius
    found = contact_from_shape(1e-3 * hertzian(r), np.nan, None, FilterOptions())
    assert np.count_nonzero(found ^ (r <= 1.0)) <= 0.25 * np.count_nonzero(r <= 1.0)


def test_the_noise_of_the_curvature_is_that_of_its_stencil() -> None:
    impulse = np.zeros((9, 9))
    impulse[4, 4] = 1.0
    assert np.sqrt((curvature(impulse) ** 2).sum()) == pytest.approx(CURVATURE_NOISE, rel=2e-3)


@pytest.mark.parametrize("along", [0, 1])
def test_what_is_straight_does_not_bend_up_to_the_last_element(along: int) -> None:
    """As plain Python, which refuses what lies beyond the field; a parabola bends by 2, and not across its edges."""
    i, j = np.indices((7, 8)).astype(float)
    plain = unwrap(curvature)
    np.testing.assert_allclose(plain(3.0 + 2.0 * i - j + 0.5 * i * j), 0.0, rtol=0.0, atol=1e-12)
    bend = np.moveaxis(plain((i, j)[along] ** 2), along, 0)
    np.testing.assert_allclose(bend[2:-2], 2.0, rtol=1e-12)
    np.testing.assert_allclose(bend[[0, -1]], 0.0, rtol=0.0, atol=1e-12)


def test_an_element_touches_that_is_pressed_by_more_than_the_threshold() -> None:
    """By exactly as much it does not, where the rim is not looked at; released it is under a share of that."""
    touch = ContactThreshold(1e-3, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0)
    pressing = np.array([[1e-3, np.nextafter(1e-3, 1.0)], [5e-4, np.nextafter(5e-4, 1.0)]])
    for before, wanted in ((False, [[False, True], [False, False]]), (True, [[True, True], [False, True]])):
        contact = np.zeros((2, 2), bool)
        find_contact(pressing, 0.0, np.full((2, 2), before), touch, contact)
        np.testing.assert_array_equal(contact, wanted)
