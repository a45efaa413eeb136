"""Limits of what friction may depend on, on either side of each, and the numbers that are told."""

import numpy as np
import pytest

from slipcore import FrictionSamples
from slipcore.checks import friction
from slipcore.patch_record import ContactFriction
from tests.slipcore.checks.by_hand import RATE, log, subject, told

PRESSED = log(0.0, [0.0, 0.0, -0.1])
BOUND = ContactFriction(0.3, 0.25, np.inf, is_bound=True, reason="")


def samples(
    coefficient: np.ndarray, normal_force: np.ndarray | None = None, element: np.ndarray | None = None, repeats: int = 1
) -> FrictionSamples:
    """Of frames on end, ``repeats`` an element."""
    count = len(coefficient)
    normal = np.full(count, 0.1) if normal_force is None else normal_force
    return FrictionSamples(
        friction_coefficient=coefficient,
        tangential_velocity=np.full(count, 1e-3),
        normal_force=normal,
        tangential_force=coefficient * normal,
        time=np.arange(count) % repeats / RATE,
        element=np.arange(count) // repeats if element is None else element,
        weight=np.ones(count),
        element_area=1e-6,
    )


@pytest.mark.parametrize(("least", "said"), [(0.92, "no more than 8% of the contact slips"), (0.89, "")])
def test_less_than_a_tenth_of_slip_while_the_contact_is_held_is_none(least: float, said: str) -> None:
    stick_ratio = np.ones(20)
    stick_ratio[7] = least
    seen = subject(PRESSED, friction=BOUND, stick_ratio=stick_ratio)
    found = told(friction.no_slip(seen))
    assert found.startswith(said)
    assert ("friction is at least 0.25" in found) == bool(said)
    slid = ContactFriction(0.3, 0.25, 0.35, is_bound=False, reason="")
    assert not any(friction.no_slip(subject(PRESSED, friction=slid, stick_ratio=stick_ratio)))
    assert not any(friction.no_slip(subject(log(), friction=BOUND)))


@pytest.mark.parametrize(
    ("coefficient", "said"), [(0.04, "friction is 0.04;"), (0.06, ""), (2.9, ""), (3.2, "friction is 3.2;")]
)
def test_friction_that_no_skin_shows_is_odd_by_samples_or_the_whole_contact(coefficient: float, said: str) -> None:
    contact = ContactFriction(coefficient, 0.5 * coefficient, 2.0 * coefficient, is_bound=False, reason="")
    usual = ContactFriction(0.5, 0.4, 0.6, is_bound=False, reason="")
    few, enough = samples(np.full(39, coefficient)), samples(np.full(40, coefficient))
    for seen in (subject(PRESSED, samples=enough, friction=usual), subject(PRESSED, friction=contact)):
        assert told(friction.friction_of_surfaces(seen)).startswith(said)
        assert bool(said) == any(friction.friction_of_surfaces(seen))
    assert not any(friction.friction_of_surfaces(subject(PRESSED, samples=few, friction=usual)))
    assert not any(friction.friction_of_surfaces(subject(PRESSED, samples=few)))


def test_a_bound_of_friction_may_be_low_and_not_high() -> None:
    for low, is_odd in ((0.01, False), (3.5, True)):
        bound = ContactFriction(9.0, low, np.inf, is_bound=True, reason="")
        assert any(friction.friction_of_surfaces(subject(PRESSED, friction=bound))) == is_odd


@pytest.mark.parametrize(("strongly", "is_found"), [(0.36, False), (0.34, True), (0.64, False), (0.66, True)])
def test_friction_follows_force_if_it_differs_by_three_tenths_between_the_outer_quarters(
    strongly: float, is_found: bool
) -> None:
    """Quarters of 40 samples with 0.5 in the middle, of which the weakest have 0.5."""
    coefficient = np.concatenate([np.full(30, 0.5), np.full(10, strongly)])
    force = np.linspace(0.1, 0.2, 40)
    for order in (np.arange(40), np.arange(40)[::-1]):
        seen = subject(PRESSED, samples=samples(coefficient[order], force[order]))
        said = f"friction is 0.50 where elements press least and {strongly:.2f} where they press most"
        assert told(friction.friction_by_force(seen)) == (said if is_found else "")
    assert not any(friction.friction_by_force(subject(PRESSED, samples=samples(coefficient[1:], force[1:]))))


@pytest.mark.parametrize(("half", "is_found"), [(0.07, False), (0.08, True)])
def test_friction_differs_by_place_beyond_15_per_cent(half: float, is_found: bool) -> None:
    """Eight elements with 0.5 ± half, alternately, whose deviation is half · √(8/7), that is 15 and 17 % of 0.5."""
    places = 0.5 + half * np.where(np.arange(8) % 2, 1.0, -1.0)
    seen = subject(PRESSED, samples=samples(np.repeat(places, 5), repeats=5))
    said = "friction differs by 17% from element to element, and stays so"
    assert told(friction.friction_by_place(seen)) == (said if is_found else "")


def test_what_samples_of_an_element_scatter_by_is_taken_off_what_elements_differ_by() -> None:
    """Five samples of ± 0.2 about an element's mean, whose own variance is 0.2² · 4/5 · 5/4 / 5: as much as 0.09²."""
    scatter = 0.2 * np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    places = 0.5 + 0.08 * np.where(np.arange(8) % 2, 1.0, -1.0)
    coefficient = (places[:, None] + scatter).ravel()
    assert not any(friction.friction_by_place(subject(PRESSED, samples=samples(coefficient, repeats=5))))


def test_elements_are_compared_from_four_with_five_samples_each() -> None:
    """Three elements with five samples and the others with four are too few."""
    counts = np.array([5, 5, 5, 4, 4, 4, 4, 4, 4, 4])
    places = np.where(np.arange(10) % 2, 0.8, 0.2)
    element = np.repeat(np.arange(10), counts)
    assert not any(friction.friction_by_place(subject(PRESSED, samples=samples(places[element], element=element))))
    counts[3] = 5
    element = np.repeat(np.arange(10), counts)
    assert any(friction.friction_by_place(subject(PRESSED, samples=samples(places[element], element=element))))


def scattered(between: float, within: float) -> FrictionSamples:
    """Of 14 elements with three frames each: 0.5 ± between by element, ± within from one frame to the next."""
    elements = between * np.where(np.arange(14) % 2, 1.0, -1.0)
    frames = within * np.array([1.0, -1.0, 1.0])
    return samples(0.5 + (elements[:, None] + frames).ravel(), repeats=3)


@pytest.mark.parametrize(
    ("between", "within", "is_found"), [(0.1, 0.001, True), (0.07, 0.001, False), (0.1, 0.02, True), (0.1, 0.03, False)]
)
def test_scatter_is_beyond_noise_above_15_per_cent_and_three_times_what_readings_repeat_to(
    between: float, within: float, is_found: bool
) -> None:
    """Readings differ by twice ``within``, so that each has √2 times that."""
    found = told(friction.scatter_beyond_noise(subject(PRESSED, samples=scattered(between, within))))
    assert bool(found) == is_found
    if found:
        scatter = np.sqrt(between**2 + within**2 * 8.0 / 9.0)  # ± within, of which a third is its mean
        assert found.startswith(f"friction scatters by {scatter / (0.5 + within / 3.0):.0%} about any law")
        assert f"repeat to {np.sqrt(2.0) * within / 0.5:.0%} from frame" in found


def test_a_law_of_speed_and_force_is_no_scatter() -> None:
    force = np.linspace(0.05, 0.2, 42)
    lawful = samples(0.9 - 3.0 * force, force, repeats=3)
    assert not any(friction.scatter_beyond_noise(subject(PRESSED, samples=lawful)))
    np.testing.assert_allclose(friction._left_by_law(lawful), 0.0, atol=1e-12, err_msg="rounding")


def test_readings_repeat_in_frames_on_end_of_one_element_alone() -> None:
    """21 elements with two frames each have 21 pairs; with a frame between them none, nor with 19."""
    coefficient = np.repeat(np.where(np.arange(21) % 2, 0.7, 0.3), 2)
    on_end = samples(coefficient, repeats=2)
    assert any(friction.scatter_beyond_noise(subject(PRESSED, samples=on_end)))
    apart = samples(coefficient, repeats=2)
    apart.time[:] *= 2.0
    assert not any(friction.scatter_beyond_noise(subject(PRESSED, samples=apart)))
    assert not any(
        friction.scatter_beyond_noise(subject(PRESSED, samples=on_end.take(np.arange(42) < 40), least_repeats=21))
    )
