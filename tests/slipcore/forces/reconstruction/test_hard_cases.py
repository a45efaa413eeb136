"""Hard cases of forces from displacement: one marker, saturated frames, other units, and frames without end."""

import gc
import tracemalloc
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput
from slipcore.forces import ForceStream, Gel, reconstruct

GEL = Gel(young_modulus=1e6, poisson_ratio=0.49, thickness=5e-3)
NOISE = 1e-6
INSIDE, AROUND = slice(6, 14), slice(5, 15)
Pressed = Callable[..., GraspLog]


def test_one_marker_in_contact_is_one_element_with_forces(pressed: Pressed) -> None:
    log = pressed([6, 6], crop=AROUND)
    moved = NOISE * np.random.default_rng(0).standard_normal(log.displacement.shape)
    moved[:, 4, 4] += [3e-5, 0.0, -1e-4]
    found = reconstruct(replace(log, displacement=moved, force=None), GEL, noise=NOISE)
    np.testing.assert_array_equal(np.argwhere(found.contact[0]), [[4, 4]])
    assert found.resultant[0, 2] < -3.0 * found.resultant_deviation[0, 2]
    assert np.isfinite(found.deviation).all()


def test_saturated_markers_that_are_told_as_not_seen_leave_the_force_known(pressed: Pressed) -> None:
    log = pressed([6, 6], noise=NOISE, crop=AROUND)
    assert log.force is not None
    total, top = log.force[0].sum(axis=(0, 1)), 0.9 * np.abs(log.displacement).max()
    clipped = np.clip(log.displacement, -top, top)
    kept = (np.abs(log.displacement) < top).all(axis=-1)
    assert not kept.all()
    masked = reconstruct(replace(log, displacement=clipped, observed=kept), GEL, noise=NOISE).resultant[0]
    np.testing.assert_allclose(masked, total, rtol=0.0, atol=0.05 * abs(total[2]))  # as of a lattice cut by its edge


def test_displacement_at_the_end_of_its_range_is_taken_as_not_seen_though_nobody_says_so(pressed: Pressed) -> None:
    """Clipped at half of the largest depth, as of a camera that sees no further; else F_z is 1.7 N too small."""
    log = pressed([3, 6], noise=NOISE, crop=AROUND)
    assert log.force is not None
    clipped = log.displacement.copy()
    clipped[..., 2] = np.maximum(clipped[..., 2], 0.5 * clipped[..., 2].min())
    found = reconstruct(replace(log, displacement=clipped, force=None), GEL, noise=NOISE)
    np.testing.assert_array_equal(found.saturated, clipped != log.displacement)
    whole = reconstruct(replace(log, force=None), GEL, noise=NOISE)
    assert not whole.saturated.any()
    away = np.abs(found.resultant - whole.resultant)
    assert (away < 3.0 * np.hypot(found.resultant_deviation, whole.resultant_deviation)).all()
    hidden = found.saturated[1, ..., 2]
    assert found.deviation[1, hidden, 2].mean() > 1.5 * whole.deviation[1, hidden, 2].mean()


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_ratios_of_forces_do_not_depend_on_the_unit_of_force(pressed: Pressed, factor: float) -> None:
    log = pressed([6, 6], noise=NOISE, crop=INSIDE)
    first = replace(GEL, young_modulus=1e8 if factor < 1.0 else 1e6)
    other = replace(first, young_modulus=factor * first.young_modulus)
    found, scaled = (reconstruct(log, gel, noise=NOISE) for gel in (first, other))
    largest = np.abs(found.force).max()
    np.testing.assert_allclose(scaled.force / factor, found.force, rtol=0.0, atol=1e-9 * largest)  # rounding
    np.testing.assert_array_equal(scaled.contact, found.contact)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_lengths_that_are_not_in_metres_are_refused_by_name(pressed: Pressed, factor: float) -> None:
    log = pressed([6, 6], crop=INSIDE)
    with pytest.raises(InvalidInput, match=r"position is .* m .*; allowed: .* m"):
        replace(log, position=factor * log.position, displacement=factor * log.displacement)


@pytest.mark.parametrize("frames", [200, pytest.param(10_000, marks=pytest.mark.long)])
def test_frames_without_end_hold_no_more_memory(pressed: Pressed, frames: int) -> None:
    """Touched and lifted in turn; what is held is compared after a fifth of them and at the end."""
    log = pressed([0, 0], noise=NOISE, crop=INSIDE)
    stream, generator = ForceStream(log.position, log.element_area, GEL, noise=NOISE), np.random.default_rng(0)
    held = []
    tracemalloc.start()
    try:
        for k in range(frames):
            shown = log.displacement[0] * ((k // 20) % 2) + NOISE * generator.standard_normal(log.position.shape)
            stream.step(0.1 * k, shown)
            if k + 1 in (frames // 5, frames):
                gc.collect()  # tuples that the interpreter keeps for reuse count as held
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # A frame is 1.5 kB, 240 kB if each of the 160 were kept; other threads of the tests hold some.
    assert held[1] - held[0] < 100e3
