"""The surface-change alarm: its evidence against numerical integration, its rate and its delay."""

import math

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators import ChangeAlarm, InvalidSamples, Moments, Scale, Scales
from estimators.change_alarm import TAUS, grasp_level, noticeable, watched
from estimators.defaults import PRIOR
from estimators.linear.grasp_statistics import GraspStatistics
from slipcore.samples import FrictionSamples


def alarm_of(levels: list[float], variance: float = 1e-4) -> ChangeAlarm:
    alarm = ChangeAlarm.init()
    for level in levels:
        alarm = alarm.step(level, variance)
    return alarm


def test_evidence_is_the_ratio_of_two_integrals() -> None:
    """Level, shift and τ by quadrature in place of closed forms."""
    levels, shift, variance, start = np.array([1.02, 0.97, 1.01, 0.83, 0.86]), 0.2, 1e-4, 3
    side = np.linspace(-0.6, 0.6, 161)
    m, delta = np.meshgrid(0.95 + side, side)
    cell = (side[1] - side[0]) ** 2

    def given(tau: float) -> tuple[float, float]:
        deviation = math.sqrt(tau**2 + variance)
        log = [stats.norm.logpdf(levels, m[..., None] + moved, deviation).sum(axis=-1) for moved in (0.0, later)]
        density = stats.norm.pdf(delta, 0.0, shift) * cell
        return float((np.exp(log[0]) * density).sum()), float((np.exp(log[1]) * density).sum())

    later = delta[..., None] * (np.arange(len(levels)) >= start)
    prior = stats.t.pdf(TAUS / PRIOR.grasp_scatter, PRIOR.grasp_degrees_of_freedom) * TAUS
    null, moved = prior @ np.array([given(tau) for tau in TAUS])
    assert alarm_of(levels.tolist(), variance).e_values[start] == pytest.approx(moved / null, rel=0.01)


def test_a_surface_that_stays_as_it_is_raises_an_alarm_in_a_thousand_grasps_at_most() -> None:
    alarms, grasps = 0, 0
    for seed in range(40):
        rng, alarm = np.random.default_rng(seed), ChangeAlarm.init()
        for level in 1.0 + 0.07 * rng.standard_normal(100):
            alarm, grasps = alarm.step(float(level), 1e-4), grasps + 1
            if alarm.changed:
                alarms, alarm = alarms + 1, ChangeAlarm.init()
    assert alarms <= stats.poisson.ppf(0.999, 1e-3 * grasps)


def test_friction_that_falls_by_a_fifth_is_found_within_five_grasps() -> None:
    found, since = [], []
    for seed in range(20):
        levels = 1.0 + 0.05 * np.random.default_rng(seed).standard_normal(35)
        levels[30:] *= 0.8
        alarm = alarm_of(levels.tolist())
        found.append(alarm.changed)
        if alarm.changed:
            assert alarm.since is not None
            since.append(alarm.since)
            assert alarm.change == pytest.approx(-0.2, abs=0.1)
    assert np.mean(found) >= 0.95
    assert abs(np.median(since) - 30) <= 1


def test_a_drop_is_found_sooner_where_other_materials_scatter_little() -> None:
    """By the prior that their grasps tell, as the model's own fit takes it; the same grasps by the default one."""
    close = estimators.ScatterPrior(0.01, 30.0, materials=20)
    sooner, found = [], 0
    for seed in range(10):
        levels = 1.0 + 0.01 * np.random.default_rng(seed).standard_normal(12)
        levels[6:] *= 0.8
        by_default, by_others = ChangeAlarm.init(), ChangeAlarm.init(scatter_prior=close)
        for level in levels[:9]:
            by_default, by_others = by_default.step(float(level), 1e-4), by_others.step(float(level), 1e-4)
        sooner.append(by_others.e_detector / by_default.e_detector)
        found += by_others.changed
    assert min(sooner) > 3.0
    assert found == 10


def test_one_odd_grasp_is_no_change_and_two_are() -> None:
    level = (1.0 + 0.02 * np.random.default_rng(2).standard_normal(12)).tolist()
    assert not alarm_of([*level, 0.6]).changed
    again = alarm_of([*level, 0.6, 0.6])
    assert again.changed
    assert again.since == 12


def test_heavy_tails_raise_an_alarm_in_a_thousand_grasps_at_most() -> None:
    """Levels on 5 degrees of freedom, each alarm answered by a new beginning; 2 in 1,000 by the newest grasp alone."""
    alarms, grasps = 0, 0
    for seed in range(1000, 1020):
        rng, alarm = np.random.default_rng(seed), ChangeAlarm.init()
        for level in 1.0 + 0.05 * rng.standard_t(5.0, 200) / math.sqrt(5.0 / 3.0):
            alarm, grasps = alarm.step(float(level), 1e-4), grasps + 1
            if alarm.changed:
                alarms, alarm = alarms + 1, ChangeAlarm.init()
    assert alarms <= 1e-3 * grasps


def test_about_half_of_the_falls_that_are_called_noticeable_are_noticed() -> None:
    found = []
    for seed in range(60):
        rng = np.random.default_rng([9, seed])
        alarm = alarm_of((1.0 + rng.choice([0.03, 0.06, 0.1]) * rng.standard_normal(12)).tolist())
        scatter = float(np.std(alarm.levels))
        for level in (1.0 - noticeable(alarm)) * (1.0 + scatter * rng.standard_normal(5)):
            alarm = alarm.step(float(level), 1e-4)
            if alarm.changed:
                break
        found.append(alarm.changed)
    assert 0.3 < np.mean(found) < 0.7  # four standard errors about one half, and some for what is not known of τ


def test_a_fall_that_no_number_of_grasps_shows_is_all_of_friction() -> None:
    assert noticeable(alarm_of([1.0, 1.0]), grasps=1) == 1.0
    for alarm, grasps in ((ChangeAlarm.init(), 5), (alarm_of([1.0]), 0)):
        with pytest.raises(InvalidSamples, match="grasps"):
            noticeable(alarm, grasps)


def test_few_grasps_tell_of_no_change() -> None:
    for levels in ([], [1.0], [1.0, 0.2], [1.0, 1.0, 0.5]):
        alarm = alarm_of(levels)
        assert (alarm.changed, alarm.since, alarm.change, alarm.e_detector) == (False, None, 0.0, 0.0)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_the_unit_of_force_does_not_matter(factor: float) -> None:
    model, grasps = fitted(1.0)
    other, scaled = fitted(factor)
    for one, same in zip(grasps, scaled, strict=True):
        np.testing.assert_allclose(grasp_level(other, same), grasp_level(model, one), rtol=1e-6)


def fitted(factor: float) -> tuple[estimators.FrictionModel, tuple]:
    """Eight grasps whose friction differs, the last by a third, with forces times a factor."""
    rng, parts = np.random.default_rng(3), []
    for scale in [1.0] * 7 + [0.67]:
        v, f_n = rng.uniform(1e-4, 4e-3, 200), rng.uniform(0.05, 0.2, 200)
        mu = scale * (0.45 + 8.0 * v - 0.8 * f_n) + 0.02 * rng.standard_normal(200)
        element, one = np.arange(200) % 20, np.ones(200)
        parts.append(FrictionSamples(mu, v, f_n * factor, mu * f_n * factor, v, element, one, 1e-6 * factor))
    moments = [Moments.from_samples(part) for part in parts]
    return estimators.fit(moments, method="hierarchical"), moments[0].merge(*moments[1:]).grasps


def test_the_level_of_a_grasp_is_its_part_of_the_law() -> None:
    model, grasps = fitted(1.0)
    levels = [grasp_level(model, grasp)[0] for grasp in grasps]
    assert levels[-1] / np.mean(levels[:-1]) == pytest.approx(0.67, abs=0.02)
    alarm = watched(model, grasps)
    assert alarm.levels == tuple(levels)
    again = alarm.step(alarm.levels[-1], alarm.variances[-1])  # the newest grasp alone is no change
    assert again.e_values.argmax() == 7


@pytest.mark.parametrize(("level", "variance"), [(math.nan, 0.0), (1.0, -1.0), (1.0, math.inf)])
def test_a_level_that_is_no_number_is_refused(level: float, variance: float) -> None:
    with pytest.raises(InvalidSamples, match=r"^(level|variance) is .*; allowed: finite"):
        ChangeAlarm.init().step(level, variance)


def test_settings_at_the_ends_of_their_ranges_are_taken() -> None:
    alarm = ChangeAlarm.init(rate=1.0 - 1e-9, shift=1e-9, reference=1)
    assert (alarm.rate, alarm.shift, alarm.reference) == (1.0 - 1e-9, 1e-9, 1)


@pytest.mark.parametrize("settings", [{"rate": 0.0}, {"shift": 0.0}, {"reference": 0}])
def test_settings_that_cannot_be_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(InvalidSamples, match=next(iter(settings))):
        ChangeAlarm.init(**settings)


def law(scale: float = 0.0, scales: Scales | None = None) -> estimators.FrictionModel:
    """μ = 0.5 + 10 v − f_n."""
    seen = estimators.Domain((0.0, 1e-2), (0.0, 0.2))
    cost = estimators.Cost(0.0, 0.0)
    return estimators.FrictionModel(
        "ols",
        np.array([0.5, 10.0, -1.0]),
        np.zeros((3, 3)),
        scale,
        9,
        6.0,
        6.0,
        seen,
        np.ones(3, bool),
        1e-6,
        cost,
        scales=scales,
    )


def two_places(share: float = 1.0) -> GraspStatistics:
    """Friction of 0.4 and 0.6 where 0.5 and 0.4 are expected, with weights of 1 and 4."""
    mean = np.array([[1e-2, 0.1, 0.4], [0.0, 0.1, 0.6]])
    none = np.zeros((2, 3, 3))
    return GraspStatistics(np.ones(2), np.array([1.0, 4.0]), mean, none, none[0], 5.0, 17.0, share=share)


def test_a_level_is_the_least_squares_factor_of_the_law() -> None:
    """Without scatter all places count alike, each known to a billionth of 0.6."""
    level, variance = grasp_level(law(), two_places())
    assert level == pytest.approx((0.5 * 0.4 + 0.4 * 0.6) / (0.25 + 0.16), rel=1e-12)
    assert variance == pytest.approx((1e-9 * 0.6) ** 2 / 0.41, rel=1e-9)
    level, variance = grasp_level(law(0.1), two_places(share=0.5))
    assert variance == pytest.approx(0.01 / (0.5 * 0.41), rel=1e-9)


def test_a_place_is_as_sure_as_places_and_its_own_samples_scatter() -> None:
    """Places by 0.3, samples by 0.4: of weights 1 and 4 the variances are 0.25 and 0.13."""
    scatter = Scales(*(Scale(value, 9.0) for value in (0.7, 0.3, 0.4)))
    level, variance = grasp_level(law(9.0, scatter), two_places())
    information = 0.25 / 0.25 + 0.16 / 0.13
    assert variance == pytest.approx(1.0 / information, rel=1e-12)
    assert level == pytest.approx((0.2 / 0.25 + 0.24 / 0.13) / information, rel=1e-12)


def test_only_the_last_thousand_grasps_are_kept() -> None:
    alarm = ChangeAlarm(levels=tuple(range(1000)), variances=(1.0,) * 1000).step(7.0, 2.0)
    assert (len(alarm.levels), alarm.levels[0], alarm.levels[-1]) == (1000, 1, 7.0)
    assert (len(alarm.variances), alarm.variances[-1]) == (1000, 2.0)


def test_a_change_is_the_mean_since_over_the_mean_before() -> None:
    alarm = alarm_of([1.0, 1.02, 0.98, 1.0, 1.0, 0.5, 0.5, 0.5, 0.5])
    assert (alarm.changed, alarm.since) == (True, 5)
    assert alarm.change == pytest.approx(-0.5, rel=1e-12)
