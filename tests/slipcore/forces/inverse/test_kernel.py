"""Rows of the resolution kernel."""

from functools import cache

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput
from slipcore.forces import Gel, Reconstruction, ResolutionKernel, reconstruct
from slipcore.forces.tracking.sensor import SensorResponse

PITCH, GEL = 1e-3, Gel(1e6, 0.48, 4e-3)
LINE = PITCH * (np.arange(9) - 4.0)
REST = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((9, 9))), axis=-1)


@cache
def sensor() -> SensorResponse:
    return SensorResponse.of(REST, PITCH**2, GEL, (0, 1, 2))


def found(noise: float, with_depth: bool = True) -> Reconstruction:
    """Of a round pressure that is sheared by a fifth of it."""
    place = sensor().nodes.places()
    pressure = 0.1 * np.maximum(1.0 - np.sum(place**2, axis=1) / (2.8e-3) ** 2, 0.0)
    field = np.einsum("mak,ak->m", sensor().response, np.stack((0.2 * pressure, 0.0 * pressure, pressure)))
    displacement = field.reshape(3, 9, 9).transpose(1, 2, 0) * [1.0, 1.0, -1.0 if with_depth else 0.0]
    shown = np.stack([displacement] * 3) + noise * np.random.default_rng(1).standard_normal((3, 9, 9, 3))
    return reconstruct(GraspLog(np.arange(3) / 30.0, REST, shown, PITCH**2), GEL, noise=max(noise, 1e-8))


def kernel_of(result: Reconstruction) -> ResolutionKernel:
    assert result.kernel is not None
    return result.kernel


def test_a_row_is_that_of_the_dense_kernel() -> None:
    kernel = kernel_of(found(3e-6))
    k = len(kernel.places)
    support = kernel.fit.support
    dense = kernel.fit.operator @ kernel.observation.response[..., support].reshape(-1, 3 * k)
    over = np.einsum("nmk,akbl->nmalb", kernel.elements[..., support] / kernel.load, dense.reshape(3, k, 3, k))
    outward = np.array([1.0, 1.0, -1.0])
    for element in ((4, 4), (3, 5), (0, 0)):
        expected = over[element] * outward[:, None, None] * outward
        np.testing.assert_allclose(
            kernel.row(*element), expected, rtol=0.0, atol=1e-10 * np.abs(over).max()
        )  # rounding


def test_with_next_to_no_noise_an_element_shows_its_own_force_alone() -> None:
    """To a tenth of the largest share: what lies between nodes counts as noise, too."""
    kernel = kernel_of(found(0.0))
    row, own = kernel.row(4, 4), kernel.elements[4, 4, kernel.fit.support] / kernel.load
    for axis in range(3):
        np.testing.assert_allclose(row[axis, :, axis], own, rtol=0.0, atol=0.1 * own.max())
        others = np.delete(row[axis], axis, axis=1)
        assert np.abs(others).max() < 0.02


def test_noise_widens_it_and_a_wide_one_still_sums_to_one() -> None:
    """As ``kernel_width`` says of the contact in the median."""
    widths = []
    for noise in (0.3e-6, 30e-6):
        result = found(noise)
        row = kernel_of(result).row(4, 4)[2, :, 2]
        assert row.sum() == pytest.approx(1.0, abs=0.15)
        widths.append(PITCH * row.sum() / np.sqrt(np.sum(row**2)))
    assert widths[1] > 1.2 * widths[0]


def test_elements_that_are_none_and_logs_without_contact_have_no_row() -> None:
    kernel = kernel_of(found(1e-6))
    for element in ((9, 0), (0, -1)):
        with pytest.raises(InvalidInput, match=r"^(row is 9|column is -1); allowed: a whole number, 0 to 8$"):
            kernel.row(*element)
    still = GraspLog(np.arange(3) / 30.0, REST, np.zeros((3, 9, 9, 3)), PITCH**2)
    assert reconstruct(still, GEL, noise=1e-6).kernel is None
