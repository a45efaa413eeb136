"""A marker's place by its neighbours: noise falls, an edge of slip stays."""

import numpy as np
import pytest

from slipcore.detection.filter.pooling import pooled_offset

NOISE = 1e-5
SCALE = 4.0 * 4.4 * NOISE**2


def pooled(offsets: np.ndarray, beside: float) -> np.ndarray:
    _, n, m = offsets.shape
    return np.array([[pooled_offset(offsets, i, j, SCALE, beside) for j in range(m)] for i in range(n)])


def test_noise_falls_by_the_share_that_is_told() -> None:
    offsets = NOISE * np.random.default_rng(5).standard_normal((2, 40, 40))
    x, y, share = np.moveaxis(pooled(offsets, 0.9), -1, 0)
    left = np.mean(x**2 + y**2) / (2.0 * NOISE**2)
    assert left == pytest.approx(share.mean(), rel=0.3)
    assert left < 0.25


def test_what_is_off_by_more_than_noise_is_not_mixed_in() -> None:
    offsets = np.zeros((2, 6, 6))
    offsets[0, :, 3:] = 30.0 * NOISE
    x = pooled(offsets, 0.9)[..., 0]
    np.testing.assert_allclose(x, offsets[0], atol=NOISE)


def test_elements_that_do_not_touch_say_nothing() -> None:
    offsets = np.full((2, 3, 3), np.nan)
    offsets[:, 1, 1] = 1e-6
    assert pooled_offset(offsets, 1, 1, SCALE, 0.9) == (1e-6, 1e-6, 1.0)
    assert pooled_offset(np.zeros((2, 3, 3)), 1, 1, SCALE, 0.0) == (0.0, 0.0, 1.0)
