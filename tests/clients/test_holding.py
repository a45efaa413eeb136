"""Normal forces that hold a contact, against closed forms and the inequality itself."""

import math

import numpy as np
import pytest

from stiction_client.holding import LoadedContact
from stiction_client.quantile import FrictionQuantile

SURE = FrictionQuantile(0.5, 0.0, 0.0, 0.0, 0.0)
"""Friction of 0.5 at any force."""
UNSURE = FrictionQuantile(0.6, -1.0, 0.02, -0.05, 1.2)
"""Falls with force, and is best known in the middle."""


def test_a_flat_contact_of_known_friction_holds_from_load_over_friction_on() -> None:
    low, high, found = LoadedContact(SURE, 3.0, 4.0, 0.01, 1).interval(1e9)
    assert (low, high, bool(found)) == (pytest.approx(5.0 / 0.5), 1e9, True)


@pytest.mark.parametrize("load", [0.5, 2.0])
def test_a_round_contact_that_only_pulls_needs_as_much(load: float) -> None:
    contact = LoadedContact(SURE, load, 0.0, 0.01, 3)
    low, _, _ = contact.interval(1e3)
    assert contact.force(low) == pytest.approx(load / 0.5)
    assert contact.root(contact.force(low)) == pytest.approx(low)


def test_torque_on_a_round_contact_is_borne_by_its_growing_area() -> None:
    low, _, _ = LoadedContact(SURE, 0.0, 2.0, 0.01, 3).interval(1e3)
    assert float(low) ** 4 == pytest.approx(2.0 / 0.5)


@pytest.mark.parametrize("power", [1, 3])
@pytest.mark.parametrize(("load", "moment"), [(0.5, 0.0), (0.0, 0.4), (0.4, 0.3)])
def test_the_interval_is_where_the_inequality_holds(power: int, load: float, moment: float) -> None:
    contact = LoadedContact(UNSURE, load, moment, 0.02, power)
    low, high, found = contact.interval(1e3)
    assert found
    inside, outside = np.linspace(low, high, 200)[1:-1], np.array([0.5 * low, 0.999 * low, 1.001 * high, 2.0 * high])
    assert (contact.surplus(inside)[0] > 0.0).all()
    assert (contact.surplus(outside)[0] < 0.0).all()
    value, slope = contact.surplus(np.array([low, high]))
    np.testing.assert_allclose(value, 0.0, atol=1e-12)
    step = 1e-6 * inside
    numeric = (contact.surplus(inside + step)[0] - contact.surplus(inside - step)[0]) / (2.0 * step)
    np.testing.assert_allclose(contact.surplus(inside)[1], numeric, rtol=1e-5, atol=1e-8)
    assert slope[0] > 0.0 > slope[1]


@pytest.mark.parametrize("power", [1, 3])
def test_arrays_and_floats_hold_alike(power: int) -> None:
    loads = np.array([0.0, 0.2, 0.5, 1e6])
    many = LoadedContact(UNSURE, loads, 0.1 * loads, 0.02, power).interval(np.full(4, 1e3))
    each = [LoadedContact(UNSURE, load, 0.1 * load, 0.02, power).interval(1e3) for load in loads.tolist()]
    np.testing.assert_array_equal(many[2], [bool(found) for *_, found in each])
    assert many[2].tolist() == [True, True, True, False]
    np.testing.assert_allclose(many[0][:3], [low for low, *_ in each][:3], rtol=1e-12)


@pytest.mark.parametrize("power", [1, 3])
def test_the_least_alone_is_that_of_the_interval(power: int) -> None:
    for load in (0.0, 0.2, 1e6):
        contact = LoadedContact(UNSURE, load, 0.1 * load, 0.02, power)
        low, _, holds = contact.interval(1e3)
        assert contact.lowest(1e3) == (low, holds)


def test_what_bears_no_load_holds_from_0_on_or_not_at_all_where_friction_is_not_sure() -> None:
    assert LoadedContact(SURE, 0.0, 0.0, 0.01, 1).interval(7.0)[:2] == (0.0, 7.0)
    doubtful = FrictionQuantile(0.01, 0.0, 0.02, 0.0, 0.0)
    low, high, found = LoadedContact(doubtful, 0.0, 0.0, 0.01, 1).interval(7.0)
    assert (low, high, bool(found)) == (0.0, 0.0, True)


def test_the_limit_itself_holds_and_nothing_does_below_what_is_needed() -> None:
    contact = LoadedContact(SURE, 1.0, 0.0, 0.01, 1)
    assert contact.interval(2.0)[2]
    assert not contact.interval(1.999)[2]


@pytest.mark.parametrize("power", [1, 3])
@pytest.mark.parametrize(("load", "moment"), [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
def test_the_best_force_holds_more_than_any_other(power: int, load: float, moment: float) -> None:
    contact = LoadedContact(UNSURE, load, moment, 0.02, power)
    best = contact.best(1e3)
    most = max(contact.held(x, 1.0) for x in np.geomspace(1e-3 * best, 50.0, 4000))
    assert contact.held(best, 1.0) >= most * (1.0 - 1e-9)
    growth, bend = contact._growth(best)
    assert growth == pytest.approx(0.0, abs=1e-7)
    step = 1e-5 * best
    numeric = (contact._growth(best + step)[0] - contact._growth(best - step)[0]) / (2.0 * step)
    assert bend == pytest.approx(numeric, rel=1e-4)
    assert contact.best(0.5 * best) == 0.5 * best  # it grows until there


def test_there_is_no_best_where_friction_does_not_end_and_none_where_it_never_begins() -> None:
    assert LoadedContact(SURE, 1.0, 0.0, 0.01, 1).best(math.inf) == math.inf
    assert LoadedContact(FrictionQuantile(-0.1, 0.0, 0.02, 0.0, 0.0), 1.0, 0.0, 0.01, 1).best(1e3) == 0.0


@pytest.mark.parametrize(("power", "held"), [(1, 0.5 * 8.0 / 5.0), (3, 0.5 * 8.0**3 / math.hypot(3.0, 4.0 / 8.0))])
def test_how_many_times_the_load_is_held(power: int, held: float) -> None:
    assert LoadedContact(SURE, 3.0, 4.0, 0.01, power).held(8.0, 1.0) == pytest.approx(held)
    tiny = LoadedContact(SURE, 3e-300, 4e-300, 0.01, power)  # whose squares are 0
    assert tiny.held(8.0, 1e-300) == pytest.approx(held)
    assert LoadedContact(SURE, 0.0, 0.0, 0.01, power).held(8.0, 1.0) == pytest.approx(0.5 * 8.0**power)


def test_were_nothing_uncertain_the_mean_would_hold() -> None:
    expected = LoadedContact(UNSURE, 0.5, 0.0, 0.02, 1).expected()
    low, _, _ = expected.interval(1e3)
    assert (0.6 - 0.02 * low) * low == pytest.approx(0.5)
