"""What the stick ratio alone says of friction."""

import math

import pytest

from stiction_client import ControlSettings, Observation
from stiction_client.contacts import Contact
from stiction_client.controller.friction import utilisation
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.stick_ratio import StickRatioEstimate
from stiction_client.defaults import FALL_FRAMES

SETTINGS = ControlSettings(contact=Contact.flat(1e-4), least_force=0.5, most_force=30.0)
NOTHING = StickRatioEstimate()


def step(known: StickRatioEstimate, ratio: float, size: float = 1.0, normal: float = 4.0) -> StickRatioEstimate:
    """After a frame under a load that is at rest."""
    load = LoadEstimate(size, steady=1.0, noise=0.02)
    return known.step(Observation(3.0, normal, size, stick_ratio=ratio), load, SETTINGS)


def test_friction_is_the_load_over_what_the_sticking_part_leaves() -> None:
    found = step(NOTHING, 0.25)
    assert found.friction == pytest.approx(1.0 / (4.0 * (1.0 - 0.25**1.5)))
    assert (found.time, found.stick_ratio, found.slipping) == (3.0, 0.25, 0)
    assert found.required(2.0, 0.25) == pytest.approx(8.0)
    assert found.required(1.0, 0.0) == pytest.approx(1.0 / found.friction)
    assert (utilisation(0.0), utilisation(1.0)) == (1.0, 0.0)


@pytest.mark.parametrize(("size", "normal"), [(0.0, 4.0), (1.0, 0.0)])
def test_what_bears_nothing_shows_no_friction_and_leaves_what_was_found(size: float, normal: float) -> None:
    known = step(NOTHING, 0.25)
    assert step(known, 0.25, size, normal).friction == known.friction
    assert math.isnan(step(NOTHING, 0.25, size, normal).friction)


def test_a_contact_that_sticks_as_a_whole_shows_none_either() -> None:
    told = SETTINGS.told_stick_ratio
    assert math.isnan(step(NOTHING, told).friction)
    assert step(NOTHING, math.nextafter(told, 0.0)).friction > 0.0


def test_without_a_ratio_the_time_of_the_last_one_stands_and_no_slip_is_counted() -> None:
    known = step(NOTHING, 0.0)
    lost = known.step(Observation(9.0, 4.0, 1.0), LoadEstimate(1.0), SETTINGS)
    assert (lost.time, lost.friction, lost.slipping) == (3.0, known.friction, 0)
    assert math.isnan(lost.stick_ratio)


def test_it_falls_where_more_is_used_than_a_few_frames_before() -> None:
    """By what the contact can bear: from 0.95 to 0.55 0.52 of it, and from 0.3 to 0 only 0.16. Above
    ``feel_stick_ratio`` a ring comes back as soon that slipped before the grip was pressed again.
    """
    known = step(NOTHING, 0.95)
    for _ in range(FALL_FRAMES - 1):
        known = step(known, 0.95)
        assert not known.falls(SETTINGS)
    assert step(known, 0.55).falls(SETTINGS)
    assert not step(known, 0.56).falls(SETTINGS)
    assert not step(step(known, math.nan), 0.55).falls(SETTINGS)
    assert not step(known, math.nan).falls(SETTINGS)
    for ratio in (0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.3, 0.3, 0.3, 0.3, 0.3):
        known = step(known, ratio)
    assert not known.falls(SETTINGS)
    assert not step(known, 0.0).falls(SETTINGS)


def test_slip_is_that_of_frames_in_a_row_up_to_the_reflex_ratio() -> None:
    known = NOTHING
    for count in range(SETTINGS.reflex_frames):
        assert not known.slips(SETTINGS)
        known = step(known, SETTINGS.reflex_stick_ratio)
        assert known.slipping == count + 1
    assert known.slips(SETTINGS)
    assert step(known, math.nextafter(SETTINGS.reflex_stick_ratio, 1.0)).slipping == 0


def test_nothing_is_required_of_what_bears_nothing_or_was_never_felt() -> None:
    assert NOTHING.required(1.0, 0.5) == 0.0
    assert step(NOTHING, 0.25).required(0.0, 0.5) == 0.0
    assert StickRatioEstimate(0.0, 0.5, 0.0).required(1.0, 0.5) == math.inf
    assert StickRatioEstimate(0.0, 0.5, 0.0).required(0.0, 0.5) == 0.0


def test_a_contact_that_is_pressed_harder_under_its_load_shows_no_slip() -> None:
    """All of it sticks then, whatever a detector goes on seeing; and shows slip again as it bears as much as before."""
    known = step(NOTHING, 0.25)
    pressed = step(known, 0.25, normal=4.4)
    assert (pressed.shows, pressed.friction) == (False, known.friction)
    assert step(pressed, 0.25, normal=4.2).shows
    assert step(pressed, 0.25, normal=3.8).friction > known.friction


@pytest.mark.parametrize(
    "load", [LoadEstimate(1.0, noise=0.02), LoadEstimate(0.5, steady=1.0, noise=0.02)], ids=["grows", "fell"]
)
def test_under_another_load_slip_shows_however_much_it_is_pressed(load: LoadEstimate) -> None:
    seen = Observation(4.0, 8.0, load.size, stick_ratio=0.25)
    assert step(NOTHING, 0.25).step(seen, load, SETTINGS).shows


def test_friction_is_no_less_than_what_was_borne_but_for_noise() -> None:
    known = step(step(NOTHING, 1.0, normal=2.0), 1.0, normal=8.0)
    assert known.bore == pytest.approx((1.0 - 0.02) / 2.0)
    assert known.least(SETTINGS) == pytest.approx(0.8 * 0.49)
    assert step(NOTHING, 1.0, normal=8.0).least(SETTINGS) == SETTINGS.unknown_friction


def test_what_was_borne_is_forgotten_without_a_load_and_where_it_slips() -> None:
    known = step(NOTHING, 1.0, normal=2.0)
    assert step(known, 1.0, size=0.05).bore == 0.0
    assert step(known, 1.0, normal=0.0).bore == 0.0
    for _ in range(SETTINGS.reflex_frames + 1):
        known = step(known, 0.0, normal=8.0)
    assert known.bore == pytest.approx(1.0 / 8.0)
