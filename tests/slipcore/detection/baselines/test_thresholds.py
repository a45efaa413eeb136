"""Each threshold method of the literature on one frame after touch, where what it measures is known by hand."""

import numpy as np
import pytest

from slipcore import GraspLog, detect_slip

PITCH = 1e-3
X, Y = np.meshgrid(*[PITCH * np.arange(7.0)] * 2, indexing="ij")
REST = np.stack([X, Y, np.zeros_like(X)], axis=-1)
PRESSED = np.broadcast_to([0.0, 0.0, -0.5], (2, 7, 7, 3))


def slip_after(moved: np.ndarray, method: str, force: np.ndarray = PRESSED, **options: float) -> np.ndarray:
    """What slips [n, m] in the frame after all elements touched, if they then have moved by so much."""
    log = GraspLog(np.array([0.0, 0.1]), REST, np.stack([np.zeros_like(REST), moved]), PITCH**2, force)
    return np.asarray(detect_slip(log, method, **options).slip[1])


def field(along_x: np.ndarray | float, along_y: np.ndarray | float = 0.0) -> np.ndarray:
    return np.stack([along_x + 0.0 * X, along_y + 0.0 * X, 0.0 * X], axis=-1)


@pytest.mark.parametrize(
    ("moved", "norm"),
    [
        (field(2e-3 * X), 2e-3),
        (field(0.0, 2e-3 * Y), 2e-3),
        (field(2e-3 * Y), np.sqrt(2.0) * 1e-3),  # half of a shear is rotation
        (field(0.0, 2e-3 * X), np.sqrt(2.0) * 1e-3),
    ],
)
def test_a_gradient_counts_by_its_norm_without_the_rotation_common_to_all(moved: np.ndarray, norm: float) -> None:
    for threshold, slips in ((0.99 * norm, True), (1.01 * norm, False)):
        found = slip_after(moved, "deformation_gradient", least_gradient=threshold, share=1e-9)
        assert (found == slips).all()


def test_a_gradient_counts_from_its_share_of_the_largest_on() -> None:
    """Twice as much stretch in the last rows: the others are above one share of that and below another."""
    moved = field(np.where(X > 3.5 * PITCH, 4e-3 * (X - 3.5 * PITCH), 0.0) + 4e-3 * X)
    for share, expected in ((0.4, True), (0.6, False)):
        found = slip_after(moved, "deformation_gradient", least_gradient=1e-9, share=share)
        assert (found[1] == expected).all()
        assert found[-2].all()


def test_nothing_slips_before_anything_touches() -> None:
    for method in ("deformation_gradient", "local_deformation", "strain_threshold", "rigid_fit", "force_ratio"):
        assert not slip_after(field(4e-3 * X), method, np.zeros((2, 7, 7, 3))).any()


@pytest.mark.parametrize(("threshold", "slips"), [(0.9e-3, True), (1.1e-3, False)])
def test_a_strain_counts_without_rotation(threshold: float, slips: bool) -> None:
    """Stretch by 1e-3 along x: E_xx = 1e-3 + 5e-7."""
    assert (slip_after(field(1e-3 * X), "strain_threshold", threshold=threshold) == slips).all()
    turned = field(-1e-2 * Y - 5e-5 * X, 1e-2 * X - 5e-5 * Y)  # by 10 mrad
    assert not slip_after(turned, "strain_threshold", threshold=1e-5).any()


@pytest.mark.parametrize(("ratio", "slips"), [(0.39, False), (0.41, True)])
def test_forces_count_over_the_break_away_ratio_by_their_length_in_the_plane(ratio: float, slips: bool) -> None:
    force = PRESSED.copy()
    force[1] += [0.6 * ratio * 0.5, -0.8 * ratio * 0.5, 0.0]
    assert (slip_after(field(0.0), "force_ratio", force, break_away_ratio=0.4) == slips).all()


def test_an_element_that_is_pulled_does_not_slip_by_its_ratio_of_forces() -> None:
    force = PRESSED.copy()
    force[1, 2, 2] = [1.0, 0.0, 0.1]
    assert not slip_after(field(0.0), "force_ratio", force, break_away_ratio=0.4)[2, 2]


def test_what_leaves_the_rigid_motion_of_the_core_slips() -> None:
    """All move by 0.1 mm but one element at the rim, and one that deviates less than the threshold."""
    moved = field(1e-4)
    moved[0, 3, 1] = 4e-5
    moved[6, 3, 1] = 2e-5
    for share, expected in ((0.3, [(0, 3)]), (0.1, [(0, 3), (6, 3)]), (0.5, [])):
        found = slip_after(moved, "rigid_fit", core_share=0.3, deviation_share=share, least_deviation=1e-9)
        assert list(zip(*np.nonzero(found), strict=True)) == expected
    assert not slip_after(moved, "rigid_fit", core_share=0.3, deviation_share=0.1, least_deviation=5e-5).any()
