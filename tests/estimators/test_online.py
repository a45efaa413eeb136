"""The sequential test: a stated rate of false alarms however long it looks, and a prompt answer to a change."""

from collections.abc import Callable

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
    with pytest.raises(estimators.InvalidSamples, match="sample"):
        ChangeDetector(estimators.fit(samples(50))).step(1e-3, 0.05, float("nan"))


def test_the_former_name_of_the_e_value_still_works(samples: Make) -> None:
    detector = ChangeDetector(estimators.fit(samples())).step(2e-3, 0.1, 0.5)
    with pytest.warns(DeprecationWarning, match="e_value"):
        assert detector.evidence == detector.e_value
