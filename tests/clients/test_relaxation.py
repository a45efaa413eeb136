"""What a grip that is being relaxed bears, and what it no longer does once it slides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stiction_client import Contact, ControlSettings
from stiction_client.controller.load import LoadEstimate
from stiction_client.controller.relaxation import Relaxation

SETTINGS = ControlSettings(contact=Contact(6e-5), least_force=0.5, most_force=40.0, slide_deviations=8.0)
NOISE = 0.02
HELD = Relaxation(since=1.0, load=1.0, frames=100, bore=0.4, bears=0.45)


def at_rest(size: float, noise: float = NOISE) -> LoadEstimate:
    return LoadEstimate(size, steady=1.0, noise=noise)


def after(*sizes: float, relaxed: bool = True, normal: float = 2.0) -> Relaxation:
    found = HELD
    for size in sizes:
        found = found.step(at_rest(size), normal, relaxed)
    return found


def test_the_load_is_the_mean_since_it_is_at_rest() -> None:
    found = Relaxation()
    for size in (1.0, 1.2, 0.8):
        found = found.step(at_rest(size), 2.0, relaxed=False)
    assert found == Relaxation(1.0, pytest.approx(1.0), 3)


@pytest.mark.parametrize("steady", [math.inf, 2.0], ids=["changes", "is at rest anew"])
def test_a_load_that_changes_is_forgotten(steady: float) -> None:
    found = HELD.step(LoadEstimate(0.5, steady=steady, noise=NOISE), 2.0, relaxed=True)
    assert found == (Relaxation() if math.isinf(steady) else Relaxation(2.0, 0.5, 1))


def test_what_is_lost_adds_up_less_the_noise_of_each_frame() -> None:
    assert after(0.96, 0.95).lost == pytest.approx(0.04 + 0.05 - 2 * NOISE)
    assert after(0.96, 1.2).lost == 0.0
    assert after(0.96, 0.95, relaxed=False).lost == 0.0
    assert after(0.96, 0.95, normal=0.0).lost == 0.0


def test_what_was_lost_does_not_lower_the_load_that_was_borne() -> None:
    assert after(0.9, 0.9, 0.9).load == 1.0


def test_what_a_contact_bears_is_its_load_over_its_force() -> None:
    found = Relaxation(1.0, 1.0, 100).step(at_rest(0.95), 2.5, relaxed=True)
    assert (found.bore, found.bears) == pytest.approx((0.4, 0.38))
    assert found.step(at_rest(0.95), 2.0, relaxed=True).bore == found.bore


def test_a_contact_slides_once_more_is_lost_than_noise_explains() -> None:
    lost = SETTINGS.slide_deviations * NOISE
    assert not replace(HELD, lost=lost).slides(at_rest(0.9), SETTINGS)
    assert replace(HELD, lost=lost + 1e-9).slides(at_rest(0.9), SETTINGS)


def test_what_a_load_at_rest_may_change_by_is_no_slide_however_little_it_scatters() -> None:
    assert not replace(HELD, lost=SETTINGS.steady_share).slides(at_rest(0.99, 1e-6), SETTINGS)
    assert replace(HELD, lost=SETTINGS.steady_share + 1e-9).slides(at_rest(0.99, 1e-6), SETTINGS)


def test_a_load_that_is_taken_away_is_no_slide() -> None:
    """It leaves the contact with less to bear of its force than it bore before."""
    assert not replace(HELD, lost=1.0, bears=0.39).slides(at_rest(0.9), SETTINGS)
    assert after(0.7) == Relaxation()


def test_a_grip_relaxed_by_half_a_second_s_rate_is_seen_to_slide_within_150_ms() -> None:
    """A load of 1 N on a contact that slides: it bears 1/120 less in each frame."""
    found, frames = HELD, 0
    while not found.slides(at_rest(1.0), SETTINGS):
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
            found = found.step(at_rest(size), 2.0 - frame / 140.0, relaxed=frame >= 20)
            assert not found.slides(at_rest(1.0), SETTINGS)
