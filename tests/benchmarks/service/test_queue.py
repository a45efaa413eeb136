from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.service.queue import (
    BURST,
    Costs,
    Ingests,
    Work,
    arrivals,
    erlang_c_wait,
    pollaczek_khinchine_wait,
    simulate,
)

COUNT = 60_000
COSTS = Costs(ingest=0.1, fit=0.01, fit_per_log=0.001)


def lasting(seconds: NDArray[np.float64]) -> Callable[[int], Work]:
    """Jobs of one part each."""

    def job(k: int) -> Work:
        yield float(seconds[k])

    return job


def assert_mean(waits: NDArray[np.float64], expected: float) -> None:
    """Within four standard errors of twenty batches, after the start; the batches tell that to 10 % or better."""
    batches = waits[len(waits) // 10 :].reshape(20, -1).mean(axis=1)
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    assert error < 0.1 * expected
    assert abs(batches.mean() - expected) < 4.0 * error


@pytest.mark.parametrize(("workers", "busy"), [(1, 0.5), (1, 0.8), (2, 0.7), (4, 0.8)])
def test_waits_for_work_of_random_length_are_those_of_erlang(workers: int, busy: float) -> None:
    generator = np.random.default_rng(workers)
    rate = busy * workers  # the mean work is 1 s
    waits, total = simulate(arrivals(rate, COUNT, 1, generator), lasting(generator.exponential(1.0, COUNT)), workers)
    assert_mean(waits, erlang_c_wait(rate, 1.0, workers))
    assert total == pytest.approx(COUNT, rel=4.0 / np.sqrt(COUNT))  # four standard errors


@pytest.mark.parametrize("busy", [0.3, 0.6, 0.8])
def test_waits_for_work_of_one_length_are_those_of_pollaczek_and_khinchine(busy: float) -> None:
    moments = arrivals(busy, COUNT, 1, np.random.default_rng(7))
    waits, _ = simulate(moments, lasting(np.ones(COUNT)), 1)
    assert_mean(waits, pollaczek_khinchine_wait(busy, 1.0))


def test_erlang_and_pollaczek_agree_where_both_hold() -> None:
    expected = pollaczek_khinchine_wait(0.7, 1.0, variance=1.0)
    assert erlang_c_wait(0.7, 1.0, 1) == pytest.approx(expected, rel=1e-12)  # rounding of a few operations


def test_a_burst_is_worked_off_in_its_order() -> None:
    waits, busy = simulate(np.zeros(5), lasting(np.full(5, 2.0)), 2)
    assert waits.tolist() == [0.0, 0.0, 2.0, 2.0, 4.0]
    assert busy == 10.0


def test_bursts_come_at_the_mean_rate() -> None:
    moments = arrivals(5.0, COUNT, BURST, np.random.default_rng(3))
    assert len(moments) == COUNT
    assert (np.diff(moments) >= 0.0).all()
    bursts = COUNT / BURST
    assert moments[-1] == pytest.approx(COUNT / 5.0, rel=4.0 / np.sqrt(bursts))  # four standard errors
    assert len(np.unique(moments)) == bursts


@pytest.mark.parametrize("workers", [1, 3])
@pytest.mark.parametrize("coalesced", [False, True])
def test_every_log_comes_into_a_fit_that_began_after_it(workers: int, coalesced: bool) -> None:
    generator = np.random.default_rng(5)
    moments = arrivals(8.0 * workers, 500, 10, generator)
    ingests = Ingests(COSTS, moments, generator.integers(0, 2, 500), 100, coalesced)
    waits, _ = simulate(moments, ingests.job, workers)
    shortest = COSTS.ingest + COSTS.fit + 101 * COSTS.fit_per_log
    assert (ingests.fitted - moments - waits >= shortest - 1e-9).all()  # rounding of moments of about 100 s


def test_one_worker_fits_after_each_log_or_once_for_all_that_wait() -> None:
    one_material = np.zeros(20, dtype=np.int64)
    for coalesced, fits in ((False, 20), (True, 1)):
        ingests = Ingests(COSTS, np.zeros(20), one_material, 0, coalesced)
        _, busy = simulate(np.zeros(20), ingests.job, 1)
        assert ingests.fits == fits
        logs = 20 if coalesced else sum(range(1, 21))
        assert busy == pytest.approx(20 * COSTS.ingest + fits * COSTS.fit + logs * COSTS.fit_per_log, rel=1e-12)


def test_a_fit_under_which_samples_came_is_done_again() -> None:
    """Two logs of one material at once: the first fit saw one log only, and is repeated with both."""
    ingests = Ingests(COSTS, np.array([0.0, 0.005]), np.zeros(2, dtype=np.int64), 0, coalesced=False)
    simulate(np.array([0.0, 0.005]), ingests.job, 2)
    assert ingests.fits == 3
    assert ingests.fitted.tolist() == pytest.approx([0.117, 0.117], rel=1e-9)  # 0.105 + 0.01 + 2 · 0.001: rounding
