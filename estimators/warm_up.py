"""Compile what a first fit would otherwise wait for."""

import time


def warm_up() -> float:
    """Compile the sums over samples and over places, or load them from where they are kept; seconds that it took.

    The libraries that only some methods need are loaded on the way.
    """
    began = time.perf_counter()
    import numpy as np
    import statsmodels.regression.linear_model  # noqa: F401

    import estimators.sampling.ensemble  # noqa: F401
    from estimators.likelihoods import kernels
    from estimators.linear.within_places import within_places

    beta, one, column = np.zeros((1, 3)), np.ones(1), np.ones(3)
    kernels.sum_log1p_square(beta, one, column, column, column, column)
    kernels.sum_log_mixture(beta, np.ones((1, 2)), np.ones((1, 3)), column, column, column, column)
    kernels.sum_log_normal(beta, np.ones((1, 2)), np.ones(2), column, column, column, column)
    wander = np.random.default_rng(0).standard_normal((40, 3))
    within_places(wander, wander, np.ones(40), np.arange(40.0), np.zeros(2), np.arange(40) % 2)
    return time.perf_counter() - began
