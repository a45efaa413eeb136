"""The sequential test: a stated rate of false alarms however long it looks, and a prompt answer to a change."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import estimators
from estimators import ChangeDetector
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


def watch(detector: ChangeDetector, data: FrictionSamples) -> int | None:
    """After how many samples the detector said that the surface had changed."""
    columns = (data.tangential_velocity, data.normal_force, data.friction_coefficient)
    for k, row in enumerate(zip(*columns, strict=True)):
        detector = detector.step(*map(float, row))
        if detector.changed:
            return k + 1
    return None


def test_false_alarms_stay_under_the_stated_rate(samples: Make) -> None:
    model = estimators.fit(samples(20_000), method="conjugate")
    alarm, runs = 0.1, 150
    alarms = sum(watch(ChangeDetector(model, alarm=alarm), samples(300, seed=100 + s)) is not None for s in range(runs))
    assert alarms <= stats.binom(runs, alarm).ppf(1.0 - 1e-3)
    assert alarms >= 1  # the bound is not idle


@pytest.mark.parametrize(("offset", "within"), [(0.06, 8), (-0.02, 60)])
def test_a_wet_or_dusty_surface_is_noticed_promptly(samples: Make, offset: float, within: int) -> None:
    detector = ChangeDetector(estimators.fit(samples(5000), method="conjugate"))
    delays = [watch(detector, samples(300, seed=seed, offset=offset)) for seed in range(20)]
    assert None not in delays
    assert np.median(delays) <= within


def test_a_late_change_is_not_buried_under_a_quiet_past(samples: Make) -> None:
    model = estimators.fit(samples(5000), method="conjugate")
    buried, fresh = ChangeDetector(model, reset_after=10**6), ChangeDetector(model, reset_after=200)
    quiet = samples(3000, seed=7)
    for row in zip(quiet.tangential_velocity, quiet.normal_force, quiet.friction_coefficient, strict=True):
        buried, fresh = buried.step(*map(float, row)), fresh.step(*map(float, row))
    late = samples(300, seed=8, offset=0.02)
    assert watch(fresh, late) < (watch(buried, late) or len(late) + 1)


def test_the_e_value_is_the_mixture_of_likelihood_ratios(samples: Make) -> None:
    detector = ChangeDetector(estimators.fit(samples(100)), spread=0.7, total=3.0, count=8)
    shifts = np.linspace(-8.0, 8.0, 200_001)
    ratio = np.exp(shifts * 3.0 - 4.0 * shifts**2) * stats.norm(0.0, 0.7).pdf(shifts)
    np.testing.assert_allclose(detector.e_value, np.trapezoid(ratio, shifts), rtol=1e-6)


def test_once_seen_a_change_stays_until_restarted(samples: Make) -> None:
    model = estimators.fit(samples(500), method="conjugate")
    seen = ChangeDetector(model, total=100.0, count=10)
    assert seen.changed
    assert seen.step(1e-3, 0.05, 0.36) is seen
    assert not seen.restart(model).changed


@pytest.mark.parametrize("options", [{"alarm": 0.0}, {"alarm": 1.0}, {"spread": 0.0}, {"reset_after": 0}])
def test_settings_out_of_range_are_refused(samples: Make, options: dict[str, float]) -> None:
    with pytest.raises(estimators.InvalidSamples, match=next(iter(options))):
        ChangeDetector(estimators.fit(samples(50)), **options)


def test_a_sample_that_is_no_number_is_refused(samples: Make) -> None:
    with pytest.raises(estimators.InvalidSamples, match="friction_coefficient is nan; allowed: a finite number"):
        ChangeDetector(estimators.fit(samples(50))).step(1e-3, 0.05, float("nan"))


def test_the_former_name_of_the_e_value_still_works(samples: Make) -> None:
    detector = ChangeDetector(estimators.fit(samples())).step(2e-3, 0.1, 0.5)
    with pytest.warns(DeprecationWarning, match="e_value"):
        assert detector.evidence == detector.e_value


def test_settings_at_the_ends_of_their_ranges_are_taken(samples: Make) -> None:
    model = estimators.fit(samples(50))
    assert ChangeDetector(model, alarm=1e-9, spread=1e-9, reset_after=1).reset_after == 1


def test_a_sum_starts_afresh_after_so_many_samples(samples: Make) -> None:
    detector = ChangeDetector(estimators.fit(samples(500)), reset_after=2)
    first = detector.step(1e-3, 0.05, 0.4)
    second = first.step(1e-3, 0.05, 0.4)
    assert (first.count, second.count) == (1, 2)
    assert second.total == pytest.approx(2.0 * first.total, rel=1e-12)
    third = second.step(1e-3, 0.05, 0.4)
    assert (third.count, third.total) == (1, first.total)


def test_a_deviation_is_the_normal_score_of_a_sample(samples: Make) -> None:
    """Of coefficients that are known, on so many degrees of freedom: as likely above as that of the normal."""
    model = replace(estimators.fit(samples(50)), covariance=np.zeros((3, 3)), scale=0.1, scatter_degrees_of_freedom=5.0)
    expected = float(model.coefficients @ [1.0, 1e-3, 0.05])
    for above in (0.25, -0.25, 0.0):
        score = stats.norm.isf(stats.t(5.0).sf(above / 0.1))
        assert ChangeDetector(model)._deviation(1e-3, 0.05, expected + above) == pytest.approx(score, abs=1e-9)
    unsure = replace(model, covariance=np.diag([0.03, 0.0, 0.0]))  # 0.2² in all
    assert ChangeDetector(unsure)._deviation(1e-3, 0.05, expected + 0.25) == pytest.approx(
        stats.norm.isf(stats.t(5.0).sf(1.25)), rel=1e-9
    )
