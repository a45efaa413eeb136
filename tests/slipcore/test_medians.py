import numpy as np
import pytest

from slipcore.medians import medians


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 100, 2000, 2001])
def test_medians_are_those_of_numpy_to_the_last_bit(count: int) -> None:
    rng = np.random.default_rng(count)
    rows = rng.normal(size=(3, 40, count)) ** 3
    rows[0, :20] = np.round(rows[0, :20])  # with ties, zeros of both signs among them
    assert np.array_equal(medians(rows), np.median(rows, axis=-1))
    assert np.array_equal(medians(rows.swapaxes(0, 1)), np.median(rows, axis=-1).T)  # wherever the rows lie


def test_a_row_with_a_nan_has_none_and_infinite_values_count_as_such() -> None:
    rows = np.random.default_rng(1).normal(size=(6, 400))
    rows[0, 17] = rows[1, 399] = rows[2, 0] = np.nan
    rows[3, :150], rows[4, :250], rows[5, :250] = np.inf, np.inf, -np.inf
    assert np.array_equal(medians(rows), np.median(rows, axis=-1), equal_nan=True)
    assert np.array_equal(np.isnan(medians(rows)), [True, True, True, False, False, False])


def test_what_it_is_given_stays_as_it_was() -> None:
    rows = np.random.default_rng(2).normal(size=(5, 64))
    before = rows.copy()
    rows.flags.writeable = False
    medians(rows)
    assert np.array_equal(rows, before)
