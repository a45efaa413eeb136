"""What the grip controller makes of a load that changes, frame by frame."""

import math
from dataclasses import replace

import pytest

from stiction_client import Contact, ControlSettings, InvalidArgument, Observation
from stiction_client.controller.load import LoadEstimate, size_of

SETTINGS = ControlSettings(
    contact=Contact(6e-5),
    least_force=0.5,
    most_force=40.0,
    rate_time=0.03,
    trend_time=0.15,
    rate_floor=0.8,
    trend_floor=0.2,
    lead_time=0.1,
    steady_share=0.05,
    dropout_time=0.1,
)


def seen(time: float, tangential: float, torque: float = 0.0) -> Observation:
    return Observation(time, 5.0, tangential, torque)


def test_a_rate_is_filtered_over_its_time_and_the_trend_over_a_longer_one() -> None:
    load = LoadEstimate(1.0, rate=2.0, trend=1.0).step(seen(3.0, 1.1), 0.02, SETTINGS)
    assert load.size == 1.1
    assert load.rate == pytest.approx(2.0 + (0.1 - 2.0 * 0.02) / 0.05)
    assert load.trend == pytest.approx(1.0 + (0.1 - 1.0 * 0.02) / 0.17)


def test_a_gap_as_long_as_a_dropout_may_be_is_none_and_a_longer_one_forgets_the_rate() -> None:
    before = LoadEstimate(1.0, rate=2.0, trend=1.0)
    assert before.step(seen(3.0, 1.2), 0.1, SETTINGS).rate == pytest.approx(2.0)
    assert before.step(seen(3.0, 1.2), 0.1001, SETTINGS) == LoadEstimate(1.2, steady=3.0)
    assert before.step(seen(3.0, 1.2), math.inf, SETTINGS) == LoadEstimate(1.2, steady=3.0)
    assert before.step(seen(3.0, 1.2), math.nan, SETTINGS) == LoadEstimate(1.2, steady=3.0)


@pytest.mark.parametrize(
    ("rate", "trend", "lead"),
    [
        (0.8, 0.2, 2.0),
        (1.8, 0.2, 2.0 + 0.1 * 1.0),
        (0.8, 0.7, 2.0 + 0.1 * 0.5),
        (1.8, 0.7, 2.0 + 0.1 * 1.0),
        (1.0, 0.7, 2.0 + 0.1 * 0.5),
        (-5.0, -5.0, 2.0),
    ],
)
def test_a_load_leads_by_the_faster_of_rate_and_trend_above_their_noise(rate: float, trend: float, lead: float) -> None:
    load = LoadEstimate(2.0, rate, trend)
    assert load.lead(SETTINGS) == pytest.approx(lead)
    assert load.growth(SETTINGS) == pytest.approx(lead / 2.0)


def test_a_load_goes_on_growing_as_it_does() -> None:
    load = LoadEstimate(2.0, rate=1.8, trend=0.7)
    assert load.after(0.0, SETTINGS) == 2.0
    assert load.after(0.7, SETTINGS) == pytest.approx(2.7)
    assert load.after(SETTINGS.lead_time, SETTINGS) == load.lead(SETTINGS)


def test_nothing_does_not_grow_by_any_factor() -> None:
    assert LoadEstimate(0.0, 5.0, 5.0).growth(SETTINGS) == 1.0
    assert LoadEstimate(0.0, 5.0, 5.0).lead(SETTINGS) == pytest.approx(0.48)


def test_a_load_is_steady_since_the_first_frame_from_which_on_it_changed_little() -> None:
    """The trend, 5 N/s after the first frame, loses a quarter in each: from the eighth on it adds less than 5 %."""
    load, since = LoadEstimate(), []
    for frame in range(11):
        load = load.step(seen(0.05 * frame, 1.0), 0.05, SETTINGS)
        since.append(load.steady)
    assert since == [math.inf] * 7 + [0.05 * 7] * 4
    assert load.step(seen(0.55, 1.5), 0.05, SETTINGS).steady == math.inf


@pytest.mark.parametrize(("rate", "steady"), [(1.79, 7.0), (1.81, math.inf)])
def test_what_changes_within_the_lead_by_its_share_beyond_noise_is_not_steady(rate: float, steady: float) -> None:
    unfiltered = replace(SETTINGS, rate_time=0.0, trend_time=10.0, trend_floor=1.0)
    before = LoadEstimate(1.0 - 0.04 * rate, noise=math.sqrt((60.0 * 0.02**2 - 0.5 * (0.04 * rate) ** 2) / 59.0))
    found = before.step(seen(7.0, 1.0), 0.04, unfiltered)
    assert found.noise == pytest.approx(0.02, rel=1e-2)
    assert found.steady == steady


def test_no_load_is_not_steady() -> None:
    assert LoadEstimate(steady=1.0).step(seen(2.0, 0.0), 0.02, SETTINGS).steady == math.inf


def test_torque_adds_by_its_arm_as_root_of_squares() -> None:
    round_contact = replace(SETTINGS, contact=Contact.round(6e-5, at_force=5.0))
    arm = float(round_contact.contact.arm(5.0))
    assert size_of(seen(0.0, 3.0, 4.0 * arm), round_contact) == pytest.approx(5.0)
    assert size_of(seen(0.0, 3.0), SETTINGS) == 3.0
    with pytest.raises(InvalidArgument, match=r"torque is 0\.5; allowed: 0 where the contact has no torque_arm"):
        size_of(seen(0.0, 3.0, 0.5), SETTINGS)


def test_noise_is_what_changes_beside_the_trend() -> None:
    load = LoadEstimate(1.0, noise=0.02).step(seen(3.0, 1.04), 0.02, SETTINGS)
    beside = 0.04 - load.trend * 0.02
    assert load.noise == pytest.approx(math.sqrt(0.02**2 + (0.5 * beside**2 - 0.02**2) / 60.0))
    assert load.step(seen(9.0, 1.0), 6.0, SETTINGS).noise == load.noise
