"""One compiled pass must say of normals what the checks of a whole log say (``check_normal``, in numpy)."""

import numpy as np
import pytest

from slipcore.defaults import LIMITS
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray, check_normal
from slipcore.surface.unit_normals import are_outward_units


def outward(seed: int) -> FloatArray:
    """Unit vectors [3, 4, 3] that point outwards."""
    rng = np.random.default_rng(seed)
    vectors = rng.standard_normal((3, 4, 3))
    vectors[..., 2] = 0.05 + np.abs(vectors[..., 2])
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def is_refused(normal: FloatArray) -> bool:
    try:
        check_normal(normal, normal.shape)
    except InvalidInput:
        return True
    return False


@pytest.mark.parametrize("length", [1.0, 1.0 + 0.9 * LIMITS.normal_length, 1.0 - 0.9 * LIMITS.normal_length])
def test_unit_vectors_to_the_tolerance_are_right(length: float) -> None:
    for seed in range(20):
        normal = length * outward(seed)
        assert are_outward_units(normal, LIMITS.normal_length)
        assert not is_refused(normal)


@pytest.mark.parametrize(
    "wrong",
    [
        (0.0, 0.0, 1.0 + 1.1 * LIMITS.normal_length),
        (0.0, 0.0, 1.0 - 1.1 * LIMITS.normal_length),
        (0.0, 0.0, -1.0),
        (1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, np.nan, 1.0),
        (np.inf, 0.0, 1.0),
        (0.0, 0.0, np.nan),
    ],
)
def test_a_single_wrong_vector_anywhere_is_seen(wrong: tuple[float, float, float]) -> None:
    for at in ((0, 0), (1, 2), (2, 3)):
        normal = outward(1)
        normal[at] = wrong
        assert not are_outward_units(normal, LIMITS.normal_length)
        assert is_refused(normal)
