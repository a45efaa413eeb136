"""What a grip that is being relaxed bears, and what it no longer does once it slides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stiction_client import Contact, ControlSettings
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.relaxation import Relaxation
from stiction_client.controller.stick_ratio import StickRatioEstimate
from stiction_client.defaults import FALL, FALLING, LEAST_NOISE

SETTINGS = ControlSettings(contact=Contact(6e-5), least_force=0.5, most_force=40.0, slide_deviations=5.0)
NOISE = 0.02
HELD = Relaxation(since=1.0, load=1.0, frames=100, start=2.5)
BORE = StickRatioEstimate(bore=0.4)


def at_rest(size: float, noise: float = NOISE) -> LoadEstimate:
    return LoadEstimate(size, steady=1.0, noise=noise)


def after(*frames: tuple[float, float], relaxed: bool = True, noise: float = NOISE) -> Relaxation:
    """What is found after frames of so much load under so much force, N."""
    found = HELD
    for size, normal in frames:
        found = found.step(at_rest(size, noise), normal, relaxed)
    return found


def test_the_load_is_the_mean_since_it_is_at_rest() -> None:
    found = Relaxation()
    for size in (1.0, 1.02, 0.98):
        found = found.step(at_rest(size), 2.0, relaxed=False)
    assert found == Relaxation(1.0, pytest.approx(1.0), 3)


@pytest.mark.parametrize("steady", [math.inf, 2.0], ids=["changes", "is at rest anew"])
def test_a_load_that_changes_is_forgotten(steady: float) -> None:
    found = HELD.step(LoadEstimate(0.5, steady=steady, noise=NOISE), 2.0, relaxed=True)
    assert found == (Relaxation() if math.isinf(steady) else Relaxation(2.0, 0.5, 1))


def test_frames_count_while_a_slide_explains_their_loads_better_than_a_hold() -> None:
    found = after((0.96, 2.4), (0.92, 2.3))
    assert (found.sliding, found.start, found.load) == (2, 2.5, 1.0)
    assert found.bears == pytest.approx(0.4)
    assert found.expected == pytest.approx(0.04**2 + 0.08**2)
    assert found.lost == pytest.approx(found.expected)


def test_frames_that_hold_the_load_add_to_its_mean_and_begin_anew() -> None:
    assert after((0.97, 2.4)).sliding == 1
    found = after((0.97, 2.4), (1.0, 2.3))
    assert (found.sliding, found.start, found.frames) == (0, 2.3, 102)
    assert found.load == pytest.approx(1.0 + (0.985 - 1.0) * 2.0 / 20.0)


def test_of_a_grip_that_is_not_relaxed_nothing_is_lost() -> None:
    assert after((0.95, 2.4), relaxed=False).sliding == 0
    assert after((0.95, 2.4), (0.9, 2.3), relaxed=False).start == 0.0


def test_a_load_that_is_known_from_a_few_frames_is_not_lost_yet() -> None:
    found = replace(HELD, frames=8)
    assert found.step(at_rest(0.95), 2.4, relaxed=True).sliding == 0
    assert replace(found, frames=10).step(at_rest(0.95), 2.4, relaxed=True).sliding == 1


def test_a_contact_slides_once_noise_does_not_explain_what_is_lost() -> None:
    evidence = 0.5 * (SETTINGS.slide_deviations * NOISE) ** 2
    found = replace(HELD, sliding=3, bore=2.7, pressed=6.7, expected=2.0 * evidence, lost=2.0 * evidence)
    assert not found.slides(at_rest(0.9), BORE, SETTINGS)
    assert replace(found, lost=2.0 * evidence + 1e-9).slides(at_rest(0.9), BORE, SETTINGS)


def test_what_is_little_of_the_load_is_no_slide_however_little_that_scatters() -> None:
    evidence = 0.5 * (SETTINGS.slide_deviations * LEAST_NOISE) ** 2
    found = replace(HELD, sliding=3, bore=2.7, pressed=6.7, expected=2.0 * evidence, lost=2.0 * evidence)
    assert not found.slides(at_rest(0.9, 1e-6), BORE, SETTINGS)
    assert replace(found, lost=2.0 * evidence + 1e-9).slides(at_rest(0.9, 1e-6), BORE, SETTINGS)


@pytest.mark.parametrize(("fallen", "slides"), [(0.0, False), (FALL, False), (1.01 * FALL, True)])
def test_less_is_enough_while_the_stick_ratio_falls_at_once(fallen: float, slides: bool) -> None:
    evidence = 0.5 * (FALLING * SETTINGS.slide_deviations * NOISE) ** 2
    found = replace(HELD, sliding=3, bore=2.7, pressed=6.7, expected=2.0 * evidence, lost=2.0 * evidence + 1e-9)
    falls = replace(BORE, stick_ratio=0.5, used=(0.0, 0.0, fallen))
    assert found.slides(at_rest(0.9), falls, SETTINGS) is slides
    assert not replace(found, lost=2.0 * evidence).slides(at_rest(0.9), falls, SETTINGS)


def test_a_load_that_is_taken_away_is_no_slide() -> None:
    """It falls by more than its grip, or by as much, but then the contact bears less of its force than before."""
    assert after((0.6, 2.4)) == Relaxation(1.0, 0.6, 1)
    evidence = 1.01 * (SETTINGS.slide_deviations * NOISE) ** 2
    found = replace(HELD, sliding=3, bore=2.7, pressed=6.7, expected=evidence, lost=evidence)
    assert found.slides(at_rest(0.9), replace(BORE, bore=0.50), SETTINGS)
    assert not found.slides(at_rest(0.9), replace(BORE, bore=0.51), SETTINGS)
    assert not replace(found, lost=2.1 * evidence).slides(at_rest(0.9), replace(BORE, bore=0.5), SETTINGS)


def test_a_grip_relaxed_by_half_a_second_s_rate_is_seen_to_slide_within_150_ms() -> None:
    """A load of 1 N on a contact that slides: it bears 1/120 less in each frame."""
    found, frames = replace(HELD, start=1.0 / 0.45), 0
    while not found.sliding or not found.slides(at_rest(1.0), replace(BORE, bore=0.45), SETTINGS):
        frames += 1
        force = 1.0 - frames / 120.0
        found = found.step(at_rest(force), force / 0.45, relaxed=True)
    assert frames / 60.0 <= 0.15
    assert found.bears == pytest.approx(0.45)


def test_noise_alone_is_not_taken_for_sliding() -> None:
    """Of 40 grips that are each relaxed for 2 s, none."""
    generator = np.random.default_rng(0)
    for _ in range(40):
        found = Relaxation()
        for frame in range(140):
            size = 1.0 + NOISE * generator.standard_normal()
            found = found.step(at_rest(size), 4.0 * 0.9917 ** max(frame - 12, 0), relaxed=frame >= 12)
            assert not found.sliding or not found.slides(at_rest(1.0), StickRatioEstimate(), SETTINGS)


def test_a_grip_that_is_pressed_again_after_it_slipped_is_not_taken_for_one_that_slides() -> None:
    """As after an alarm: then it bears less of its force than before, under the same load."""
    generator, found = np.random.default_rng(1), replace(HELD, start=2.5)
    for frame in range(90):
        normal = 5.0 - frame / 60.0
        found = found.step(at_rest(1.0 + NOISE * generator.standard_normal()), normal, relaxed=frame >= 12)
        assert not found.sliding or not found.slides(at_rest(1.0), BORE, SETTINGS)
