"""Where all slip showed one speed, friction at rest rests on what is assumed of β₁, and says so."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy import special

from estimators import FrictionModel, Moments, fit
from estimators.defaults import PRIOR
from estimators.linear import assumed_slope
from estimators.linear.assumed_slope import change_from_rest
from estimators.linear.fit_data import gather
from estimators.linear.posterior_grid import posterior_grid
from slipcore.samples import FrictionSamples
from stiction_client.support import ASSUMED_CHANGE, SLOWEST_SLIP

MIDDLE = 0.06
"""N an element, in the middle of the grasps'."""


def grasp(seed: int, speed: np.ndarray | float, slope: float = 8.0, count: int = 300) -> FrictionSamples:
    """Of friction 0.4 + ``slope`` v − 0.8 f_n, which scatters by 3 % between grasps and by 0.02 between places."""
    rng = np.random.default_rng([seed, 71])
    element = rng.integers(0, 30, count)
    f_n = rng.uniform(0.02, 0.1, 30)[element] * rng.uniform(0.9, 1.1, count)
    v = np.broadcast_to(np.asarray(speed, float), count).copy()
    law = (1.0 + 0.03 * rng.standard_normal()) * (0.4 + slope * v - 0.8 * f_n)
    mu = law + 0.02 * rng.standard_normal(30)[element] + 0.02 * rng.standard_normal(count)
    return FrictionSamples(mu, v, f_n, mu * f_n, np.arange(count) * 0.01, element, np.ones(count), 1e-6)


def grasps(speed: np.ndarray | float, count: int = 6, slope: float = 8.0) -> list[FrictionSamples]:
    return [grasp(seed, speed, slope) for seed in range(count)]


def half_width(model: FrictionModel, v: float, f_n: float = MIDDLE) -> float:
    """Of the 95 % interval of the friction expected there."""
    at = np.array([1.0, v, f_n])
    return float(special.stdtrit(model.degrees_of_freedom, 0.975) * np.sqrt(at @ model.covariance @ at))


@pytest.mark.parametrize("speed", [1e-3, 5e-3, 2e-2])
@pytest.mark.parametrize("method", ["auto", "hierarchical", "bayes"])
def test_friction_at_rest_may_differ_from_that_of_the_slip_by_what_is_assumed(method: str, speed: float) -> None:
    model = fit(grasps(speed), method=method)
    sliding = float(model.predict(speed, MIDDLE))
    expected = np.hypot(half_width(model, speed), special.ndtri(0.975) * change_from_rest(speed) * sliding)
    assert half_width(model, 0.0) == pytest.approx(expected, rel=0.1)
    assert float(model.predict(0.0, MIDDLE)) == pytest.approx(sliding, rel=1e-3)
    assert not model.identifiable[1]
    assert model.support == "extrapolated"
    assert model.advice.endswith("if velocity changes it no more than is assumed: record slip at other speeds")
    assert model.support_at(speed, MIDDLE).kind == "supported"
    assert "beta1 ~ N(0, (" in str(model.diagnostics["prior"])
    (note,) = (note for note in model.notes if "assumed" in note)
    assert f"between rest and the {speed:g} m/s" in note
    assert f"± {special.ndtri(0.975) * change_from_rest(speed):.0%}" in note


def test_the_posterior_is_that_of_friction_where_it_slid_and_of_a_change_from_there_in_closed_form() -> None:
    """v and the rest have nothing to do with each other then: the variances add, and what was seen is as without v."""
    for count in (1, 3):
        mean, covariance = posterior_grid(gather(grasps(5e-3, count))).nodes.moments()
        still = [replace(each, tangential_velocity=np.zeros(300)) for each in grasps(5e-3, count)]
        level, own = posterior_grid(gather(still)).nodes.moments()
        rest, sliding = np.array([1.0, 0.0, MIDDLE]), np.array([1.0, 5e-3, MIDDLE])
        change = PRIOR.velocity_effect * np.hypot(gather(grasps(5e-3, count)).mean_friction, np.sqrt(rest @ own @ rest))
        assert sliding @ mean == pytest.approx(rest @ level, rel=1e-4)
        assert sliding @ covariance @ sliding == pytest.approx(rest @ own @ rest, rel=1e-3)
        assert covariance[1, 1] == pytest.approx((change / 5e-3) ** 2, rel=1e-3)
        assert rest @ covariance @ rest == pytest.approx(rest @ own @ rest + change**2, rel=1e-3)


def test_nothing_is_assumed_where_the_samples_show_what_velocity_does(monkeypatch: pytest.MonkeyPatch) -> None:
    data = grasps(np.linspace(3e-4, 4e-3, 300))
    before = fit(data, method="hierarchical")
    assert before.identifiable[1]
    assert not {SLOWEST_SLIP, ASSUMED_CHANGE} & {*before.diagnostics}
    monkeypatch.setattr(assumed_slope, "change_from_rest", lambda _: 10.0)
    after = fit(data, method="hierarchical")
    np.testing.assert_array_equal(after.coefficients, before.coefficients)
    np.testing.assert_array_equal(after.covariance, before.covariance)


def test_the_closer_the_speeds_the_less_is_known_of_friction_at_rest_and_never_less_than_by_the_prior() -> None:
    """Of spreads from a thousandth to a half: data take over without a step, and no better than they know by then."""
    widths = []
    for part in np.geomspace(1e-3, 0.5, 12):
        speeds = 5e-3 * (1.0 + part * np.linspace(-1.0, 1.0, 300))
        widths.append(half_width(fit(grasps(speeds), method="hierarchical"), 0.0))
    assert (np.diff(widths) < 0.02 * widths[0]).all(), widths
    assert widths[0] < 1.1 * np.hypot(widths[-1], 1.96 * 0.1 * 0.39)
    assert widths[0] / widths[-1] > 2.0


def test_a_slope_that_slow_slip_shows_is_not_pulled_to_nothing() -> None:
    """At 1 µm/s a slope of 25,000 s/m, as of sepiolite, changes friction by 6 %: it is seen, so nothing is assumed."""
    speeds = np.random.default_rng(3).uniform(1e-7, 2e-6, 300)
    model = fit(grasps(speeds, slope=2.5e4), method="hierarchical")
    assert SLOWEST_SLIP not in model.diagnostics
    assert model.coefficients[1] == pytest.approx(2.5e4, rel=0.2)


def test_slip_at_rest_assumes_nothing_of_friction_there() -> None:
    model = fit(grasps(0.0), method="hierarchical")
    assert SLOWEST_SLIP not in model.diagnostics
    assert model.support == "supported"
    assert half_width(model, 0.0) < 0.04 * float(model.predict(0.0, MIDDLE))


def test_noise_of_the_speed_hides_neither_that_there_was_one() -> None:
    """Slowest is what hardly any sample was slower than, not the one that was slowest by chance."""
    rng = np.random.default_rng(5)
    seen = [
        replace(each, tangential_velocity=np.append(1e-6, 5e-3 * (1.0 + 2e-3 * rng.standard_normal(299))))
        for each in grasps(5e-3)
    ]
    model = fit([replace(each, weight=np.append(1e-6, np.ones(299))) for each in seen], method="hierarchical")
    assert model.domain.tangential_velocity[0] == 1e-6
    assert float(model.diagnostics[SLOWEST_SLIP]) == pytest.approx(5e-3, rel=0.01)
    assert model.support == "extrapolated"


@pytest.mark.parametrize("speed", [1e-12, 1e-9, 1.0, 1e3])
@pytest.mark.parametrize("count", [1, 2])
def test_any_speed_in_any_unit_of_force_gives_an_interval_that_is_as_wide_as_assumed(speed: float, count: int) -> None:
    data = grasps(speed, count, slope=0.0)
    model = fit(data, method="hierarchical")
    change = special.ndtri(0.975) * change_from_rest(speed) * gather(data).mean_friction
    assert half_width(model, 0.0) == pytest.approx(np.hypot(half_width(model, speed), change), rel=0.25)
    for factor in (1e-6, 1e6):
        other = fit([each.at_element_area(factor * each.element_area) for each in data], method="hierarchical")
        assert half_width(other, 0.0, factor * MIDDLE) == pytest.approx(half_width(model, 0.0), rel=1e-5)


def test_one_grasp_of_one_sample_a_place_answers() -> None:
    (whole,) = grasps(5e-3, 1)
    model = fit(whole.take(np.unique(whole.element, return_index=True)[1]), method="hierarchical")
    assert 0.0 < float(model.predict(0.0, MIDDLE, 0.01, "contact", 60)) < 0.4
    assert np.isfinite(model.covariance).all()


def test_moments_in_any_order_and_from_their_bytes_give_the_same() -> None:
    parts = [Moments.from_bytes(Moments.from_samples(each).to_bytes()) for each in grasps(5e-3, 3)]
    expected = fit(grasps(5e-3, 3), method="hierarchical")
    for order in itertools.permutations(range(3)):
        first, *others = (parts[k] for k in order)
        model = fit([first.merge(*others)], method="hierarchical")
        np.testing.assert_allclose(model.coefficients, expected.coefficients, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(model.covariance, expected.covariance, rtol=1e-5, atol=1e-9)
        assert model.diagnostics[ASSUMED_CHANGE] == expected.diagnostics[ASSUMED_CHANGE]
        assert float(model.diagnostics[SLOWEST_SLIP]) == pytest.approx(5e-3, rel=1e-9)


@pytest.mark.parametrize("unknown", [1, 6])
def test_where_velocities_are_unknown_nothing_more_is_assumed(unknown: int) -> None:
    """Samples of unknown velocity count as of rest, but for what their own prior allows."""
    unposed = [replace(each, velocity_is_relative=np.full(300, k < unknown)) for k, each in enumerate(grasps(5e-3))]
    model = fit(unposed, method="hierarchical")
    assert SLOWEST_SLIP not in model.diagnostics
    assert half_width(model, 0.0) < 0.1 * float(model.predict(0.0, MIDDLE))


def test_sensors_answer_at_rest_each() -> None:
    data = [replace(each, sensor=f"sensor {k % 2}") for k, each in enumerate(grasps(5e-3))]
    model = fit(data, method="hierarchical")
    for own in (model, model.of_sensor("sensor 0")):
        assert own.support == "extrapolated"
        assert half_width(own, 0.0) > 1.9 * 0.1 * 0.38


@pytest.mark.parametrize("method", ["ols", "robust", "conjugate"])
def test_methods_without_the_prior_say_as_before_that_friction_at_rest_is_not_identified(method: str) -> None:
    model = fit(grasps(5e-3), method=method)
    assert model.support == "not identified"
    assert SLOWEST_SLIP not in model.diagnostics
