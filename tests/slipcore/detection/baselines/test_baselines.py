from dataclasses import replace

import numpy as np
import pytest

from slipcore import GraspLog, detect_slip
from slipcore.contact import tangential_ramp

BASELINES = ["strain_threshold", "rigid_fit", "local_deformation", "deformation_gradient", "force_ratio"]


@pytest.fixture(scope="module")
def ramp() -> GraspLog:
    return tangential_ramp()


@pytest.mark.parametrize(("method", "least"), list(zip(BASELINES, [0.8, 0.7, 0.7, 0.6, 0.6], strict=True)))
def test_on_a_clean_ramp_each_method_of_the_literature_finds_most_slip(
    method: str, least: float, ramp: GraspLog
) -> None:
    history = detect_slip(ramp, method, **({"break_away_ratio": 0.38} if method == "force_ratio" else {}))
    assert ramp.truth is not None
    true = ramp.truth.slip_contact_factor & ramp.truth.contact
    found = history.slip & ramp.truth.contact
    assert 2.0 * np.count_nonzero(true & found) / (true.sum() + found.sum()) > least
    assert not found[ramp.time < 1.0].any() or method == "force_ratio"


def test_a_rigid_motion_of_all_is_no_slip_to_any_of_them(ramp: GraspLog) -> None:
    pressed = ramp.displacement[45]
    angle = 1e-3 * np.arange(30.0)[:, None, None]
    moved = np.broadcast_to(pressed, (30, *pressed.shape)).copy()
    x, y = ramp.position[..., 0] + pressed[..., 0], ramp.position[..., 1] + pressed[..., 1]
    moved[..., 0] += 1e-5 * np.arange(30.0)[:, None, None] + (np.cos(angle) - 1.0) * x - np.sin(angle) * y
    moved[..., 1] += np.sin(angle) * x + (np.cos(angle) - 1.0) * y
    force = np.broadcast_to(ramp.force[45], moved.shape)
    log = GraspLog(ramp.time[:30], ramp.position, moved, ramp.element_area, force)
    for method in BASELINES:
        slip = detect_slip(log, method).slip
        if method == "local_deformation":  # takes rotation for deformation, as it compares displacements
            slip = slip[:15]
        assert not slip.any(), method


def test_a_ratio_of_forces_says_that_it_knows_nothing_without_them(ramp: GraspLog) -> None:
    history = detect_slip(replace(ramp, force=None), "force_ratio")
    assert not history.slip.any()
    known = history.contact[1:] & history.contact[:-1]
    np.testing.assert_array_equal(history.probability[1:][known], 0.5)


def test_holding_on_to_deformation_they_miss_that_pressing_ends_slip(ramp: GraspLog) -> None:
    """The paper's criticism of [26] and [27]: deformation remains when the normal force rises."""
    held = 20
    rising = np.linspace(1.0, 1.5, held)[:, None, None, None] * np.array([0.0, 0.0, 1.0]) + np.array([1.0, 1.0, 0.0])
    displacement = np.concatenate([ramp.displacement, np.repeat(ramp.displacement[-1:], held, axis=0) * rising])
    force = np.concatenate([ramp.force, np.repeat(ramp.force[-1:], held, axis=0) * rising])
    time = np.arange(len(force)) / 30.0
    log = GraspLog(time, ramp.position, displacement, ramp.element_area, force)
    for method in ("strain_threshold", "local_deformation", "deformation_gradient"):
        history = detect_slip(log, method)
        assert history.slip[-1].sum() >= 0.9 * history.slip[len(ramp) - 1].sum() > 0
    filtered = detect_slip(log, "filter")
    assert filtered.slip[-1].sum() < 0.2 * filtered.slip[len(ramp) - 1].sum()


@pytest.mark.parametrize("pitch", [0.5e-3, 4e-3])
@pytest.mark.parametrize(("stretch", "slips"), [(0.019, False), (0.021, True)])
def test_local_deformation_compares_the_stretch_since_touch_with_its_threshold(
    pitch: float, stretch: float, slips: bool
) -> None:
    """A stretch alike in all directions moves neighbours apart by that share of their distance, whatever this is."""
    x, y = np.meshgrid(*[pitch * np.arange(5.0)] * 2, indexing="ij")
    rest, pressing = np.stack([x, y, 0.0 * x], axis=-1), np.array([0.0, 0.0, -0.5]) * np.ones((2, 5, 5, 3))
    log = GraspLog(np.array([0.0, 0.1]), rest, np.stack([0.0 * rest, stretch * rest]), pitch**2, pressing)
    slip = detect_slip(log, "local_deformation", threshold=0.02).slip
    assert not slip[0].any()
    assert (slip[1] == slips).all()
