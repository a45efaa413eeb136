"""After warming up, no fit compiles."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import estimators
from slipcore.samples import FrictionSamples


def test_after_warming_up_no_fit_compiles(samples: Callable[..., FrictionSamples]) -> None:
    assert estimators.warm_up() >= 0.0
    from estimators.likelihoods import kernels
    from estimators.linear import slopes_of_places as slopes
    from estimators.linear.few_columns import spanned
    from estimators.linear.lasting_errors import errors_of_levels

    sums = (kernels.sum_log1p_square, kernels.sum_log_mixture, kernels.sum_log_normal)
    sums += (spanned, errors_of_levels, slopes.seen_within, slopes.sums_of, slopes.levels_of)
    sums += (slopes.errors_of_slopes, slopes.compared, slopes.information_left)
    compiled = [len(kernel.signatures) for kernel in sums]
    for likelihood in ("student_t", "outlier", "errors_in_variables"):
        estimators.fit(samples(1000), method="bayes", likelihood=likelihood, accuracy=0.1)
    places = replace(samples(1000), element=np.arange(1000) % 5, time=np.arange(1000.0))
    for data in (places, [places, places], estimators.Moments.from_samples(places)):
        estimators.fit(data, method="hierarchical")
    assert [len(kernel.signatures) for kernel in sums] == compiled == [1] * len(sums)
