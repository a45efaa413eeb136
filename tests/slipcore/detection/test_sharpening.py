"""Which smoothing is taken back before slip is looked for, and what a history says of it."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from slipcore import GraspLog, detect_slip
from slipcore.defaults import FilterOptions, StrainRateOptions
from slipcore.detection.sharpening import kernels_of, sharpened, smoothing_found
from slipcore.surface.smoothing import unsmoothed

PITCH = 1.5e-3


def noise(width: float, size: float, seed: int) -> np.ndarray:
    """Of 60 frames of 12 × 12 elements, smoothed over so many elements (standard deviation of the kernel)."""
    fresh = np.random.default_rng(seed).standard_normal((60, 12, 12, 3))
    return np.asarray(size * gaussian_filter(fresh, (0.0, width, width, 0.0)))


def log(of_markers: float, of_forces: float | None) -> GraspLog:
    side = PITCH * np.arange(12.0)
    rest = np.stack([*np.meshgrid(side, side, indexing="ij"), np.zeros((12, 12))], axis=-1)
    force = None if of_forces is None else noise(of_forces, 2e-3, 2)
    return GraspLog(np.arange(60) / 30.0, rest, noise(of_markers, 2e-6, 1), PITCH**2, force)


def test_the_width_of_a_kernel_is_told_in_metres_and_of_what_was_smoothed_alone() -> None:
    assert kernels_of(log(0.0, 0.0)) == {}
    markers = kernels_of(log(1.0, 0.0))
    assert set(markers) == {"marker_kernel"}
    assert markers["marker_kernel"] == pytest.approx(PITCH, rel=0.15)
    forces = kernels_of(log(0.0, 1.0))
    assert set(forces) == {"force_kernel"}
    assert forces["force_kernel"] == pytest.approx(PITCH, rel=0.15)
    assert kernels_of(log(0.0, None)) == {}


def test_each_field_is_sharpened_by_its_own_kernel_in_units_of_the_pitch() -> None:
    displacement, force = noise(1.0, 1e-6, 3), noise(1.0, 1e-3, 4)
    options = FilterOptions(marker_kernel=2.0 * PITCH, force_kernel=0.5 * PITCH)
    found = sharpened(displacement, force, options, PITCH**2)
    np.testing.assert_array_equal(found[0], unsmoothed(displacement, 2.0, options.smoothing_noise))
    np.testing.assert_array_equal(found[1], unsmoothed(force, 0.5, options.smoothing_noise))


def test_what_is_not_smoothed_is_left_as_it_is() -> None:
    displacement, force = noise(1.0, 1e-6, 3), noise(1.0, 1e-3, 4)
    for options in (FilterOptions(), StrainRateOptions()):
        found = sharpened(displacement, force, options, PITCH**2)
        assert found[0] is displacement
        assert found[1] is force
    markers, none = sharpened(displacement, None, FilterOptions(marker_kernel=PITCH, force_kernel=PITCH), PITCH**2)
    assert none is None
    assert markers is not displacement


@pytest.mark.parametrize(
    ("kernels", "told"),
    [
        ({"marker_kernel": 1.5e-3}, "as if displacement over 1.5 mm were smoothed"),
        ({"force_kernel": 2.25e-3}, "as if forces over 2.25 mm were smoothed"),
        ({"marker_kernel": 1e-3, "force_kernel": 2e-3}, "as if displacement over 1 mm and forces over 2 mm were"),
    ],
)
def test_a_history_tells_what_was_smoothed_in_millimetres(kernels: dict[str, float], told: str) -> None:
    (finding,) = smoothing_found(kernels)
    assert finding.name == "smoothed"
    assert told in finding.evidence


def test_where_nothing_is_smoothed_nothing_is_said() -> None:
    assert smoothing_found({}) == ()
    assert "smoothed" not in {finding.name for finding in detect_slip(log(0.0, 0.0)).findings}
