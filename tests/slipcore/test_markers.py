from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slipcore import GraspLog, GroundTruth, InvalidInput, SlipDetector, SlipHistory, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.markers import MarkerLattice, contact_by_motion, mean_spacing, on_lattice
from slipcore.surface.strain import Lattice

PITCH = 1e-3


def square(side: int) -> np.ndarray:
    """Markers [side², 3] on a lattice, in no order."""
    axis = PITCH * np.arange(side)
    points = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.zeros((side, side))], axis=-1).reshape(-1, 3)
    return np.random.default_rng(1).permutation(points)


def test_markers_on_a_lattice_are_that_lattice() -> None:
    markers = square(7)
    lattice = MarkerLattice.over(markers)
    assert lattice.occupied.all()
    assert lattice.element_area == pytest.approx(PITCH**2, rel=1e-9)
    np.testing.assert_array_equal(lattice.position, markers[lattice.marker])
    assert len(np.unique(lattice.marker)) == 49
    np.testing.assert_allclose(np.diff(lattice.position[..., 0], axis=0), PITCH, rtol=1e-12)


def test_every_element_is_the_one_marker_that_it_names() -> None:
    markers = square(12) + np.random.default_rng(4).uniform(-0.2e-3, 0.2e-3, (144, 3))
    lattice = MarkerLattice.over(markers)
    own = lattice.marker[lattice.occupied]
    assert len(np.unique(own)) == len(own) >= 0.9 * 144
    np.testing.assert_array_equal(lattice.position[lattice.occupied], markers[own])
    moved = np.random.default_rng(5).normal(scale=1e-5, size=(144, 3))
    frame = lattice.step(None, moved)
    np.testing.assert_array_equal(frame.displacement[lattice.occupied], moved[own])
    np.testing.assert_array_equal(frame.observed, lattice.occupied)


@given(st.integers(0, 2**32 - 1), st.integers(4, 90))
@settings(max_examples=60)
def test_markers_thrown_anywhere_make_a_lattice_without_folds(seed: int, count: int) -> None:
    markers = np.random.default_rng(seed).uniform(0.0, 1e-2, (count, 3)) * [1.0, 1.0, 0.0]
    try:
        lattice = MarkerLattice.over(markers)
    except InvalidInput:
        assume(count > 10)  # a few may lie in a band, and are refused
        raise
    assert Lattice.at_rest(lattice.position).orientation == 1.0
    own = lattice.marker[lattice.occupied]
    assert len(np.unique(own)) == len(own)


def test_a_lost_marker_is_masked_and_moves_on_with_those_around_it() -> None:
    markers = square(6)
    lattice = MarkerLattice.over(markers)
    middle = int(np.argmin(np.hypot(*(markers[:, :2] - 2e-3).T)))
    where = np.argwhere(lattice.marker == middle)[0]
    frame = lattice.step(None, np.full((36, 3), 1e-4))
    moved = np.full((36, 3), 3e-4)
    moved[middle] = np.nan
    frame = lattice.step(frame, moved)
    assert not frame.observed[tuple(where)]
    assert frame.observed.sum() == 35
    np.testing.assert_allclose(frame.displacement[tuple(where)], 3e-4, rtol=1e-12)
    back = lattice.step(frame, np.full((36, 3), 4e-4))
    assert back.observed.all()
    np.testing.assert_array_equal(back.displacement[tuple(where)], np.full(3, 4e-4))


def test_without_any_marker_the_last_frame_stands_and_nothing_is_observed() -> None:
    lattice = MarkerLattice.over(square(4))
    frame = lattice.step(lattice.step(None, np.full((16, 3), 2e-5)), np.full((16, 3), np.nan))
    assert not frame.observed.any()
    np.testing.assert_array_equal(frame.displacement, 2e-5)


def test_a_marker_lost_from_the_start_begins_at_rest() -> None:
    lattice = MarkerLattice.over(square(4))
    moved = np.full((16, 3), 2e-5)
    moved[3] = np.nan
    frame = lattice.step(None, moved)
    assert np.isfinite(frame.displacement).all()
    assert not frame.observed[lattice.marker == 3].any()


@pytest.mark.parametrize(
    ("markers", "message"),
    [
        (np.zeros((3, 3)), r"markers is of shape \[3, 3\]; allowed: 4 or more"),
        (np.zeros((9, 2)), "markers is of shape"),
        (np.full((9, 3), np.nan), "allowed: 4 or more finite points"),
        (np.outer(np.arange(9.0), [1e-3, 2e-3, 0.0]), "markers is in one line"),
        (np.zeros((9, 3)), "markers is in one line"),
        (
            np.outer(np.arange(9.0), [1e-3, 1e-3, 0.0]) + [[1e-7 * (k % 2), 0.0, 0.0] for k in range(9)],
            "markers is 9 in a band across",
        ),
    ],
)
def test_markers_that_span_nothing_are_refused(markers: np.ndarray, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        MarkerLattice.over(markers)


def test_a_frame_of_other_markers_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"displacement is of shape \[5, 3\]; allowed: shape \[16, 3\]"):
        MarkerLattice.over(square(4)).step(None, np.zeros((5, 3)))


@pytest.mark.parametrize("turned", [0.0, 0.3])
def test_the_spacing_is_that_of_a_lattice(turned: float) -> None:
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    assert mean_spacing(square(9)[:, :2] @ rotation) == pytest.approx(PITCH, rel=1e-9)


def jittered(log: GraspLog, generator: np.random.Generator) -> np.ndarray:
    """Every third point of the log's lattice, moved by at most one."""
    side = log.grid[0]
    rows, columns = np.meshgrid(np.arange(1, side, 3), np.arange(1, side, 3), indexing="ij")
    jitter = generator.integers(-1, 2, (2, *rows.shape))
    places: np.ndarray = np.clip(np.stack([rows, columns]) + jitter, 0, side - 1).reshape(2, -1)
    return places


@pytest.fixture(scope="module")
def dots() -> tuple[GraspLog, np.ndarray]:
    """A ramp seen at many points, and those that are tracked."""
    schedule = RampSchedule(rest=0.2, press=0.4, settle=0.2, shear=1.0, hold=0.2)
    log = tangential_ramp(points=48, pitch=0.25e-3, schedule=schedule, marker_noise=1e-6, seed=7)
    return log, jittered(log, np.random.default_rng(2))


def test_scattered_dots_score_as_a_lattice_does_though_one_in_twenty_is_lost(
    dots: tuple[GraspLog, np.ndarray], f1_score: Callable[[GraspLog, SlipHistory], float]
) -> None:
    log, (rows, columns) = dots
    truth = log.truth
    assert truth is not None
    displacement = log.displacement[:, rows, columns].copy()
    displacement[np.random.default_rng(3).random(displacement.shape[:2]) < 0.05] = np.nan
    known = truth.contact[:, rows, columns]
    scattered, lattice = on_lattice(log.time, log.position[rows, columns], displacement, known)
    history = detect_slip(scattered, "filter")
    assert history.observed is not None
    contact = truth.contact[:, rows, columns][:, lattice.marker] & history.observed
    slip = truth.slip_contact_factor[:, rows, columns][:, lattice.marker]
    scored = replace(scattered, truth=GroundTruth(contact, slip, slip, truth.stick_ratio, truth.friction))
    masks = truth.contact[:, 1::3, 1::3], *[truth.slip_contact_factor[:, 1::3, 1::3]] * 2
    regular = GraspLog(
        log.time,
        log.position[1::3, 1::3],
        log.displacement[:, 1::3, 1::3],
        9 * log.element_area,
        contact=masks[0],
        truth=GroundTruth(*masks, truth.stick_ratio, truth.friction),
    )
    assert f1_score(scored, history) > f1_score(regular, detect_slip(regular, "filter")) - 0.05


def test_a_stream_of_dots_is_its_batch(dots: tuple[GraspLog, np.ndarray]) -> None:
    log, (rows, columns) = dots
    markers, moved = log.position[rows, columns], log.displacement[:, rows, columns]
    batch, lattice = on_lattice(log.time, markers, moved)
    history = detect_slip(batch, "filter")
    detector, frame = SlipDetector(lattice.position, lattice.element_area, "filter"), None
    for k, time in enumerate(log.time):
        frame = lattice.step(frame, moved[k])
        answer = detector.step(time, frame.displacement, observed=frame.observed)
        np.testing.assert_array_equal(answer.slip, history.slip[k])


def test_contact_by_motion_is_near_the_true_one_of_simulated_grasps() -> None:
    log = tangential_ramp(points=24, pitch=0.75e-3)
    assert log.truth is not None
    rng = np.random.default_rng(3)
    seen = np.array(log.displacement) + 1e-6 * rng.standard_normal(log.displacement.shape)
    seen[..., 2] = 0.0
    found, truth = contact_by_motion(log.time, seen), log.truth.contact
    loaded = found.any(axis=(1, 2))
    assert loaded.any()
    found, truth = found[loaded], truth[loaded]
    assert (found & truth).sum() / (found | truth).sum() > 0.6
    turned = contact_by_motion(log.time, seen[..., ::-1, :, :])
    np.testing.assert_array_equal(turned, contact_by_motion(log.time, seen)[:, ::-1], err_msg="by place alone")


def test_without_motion_nothing_touches_and_a_whole_sensor_that_moves_touches_whole() -> None:
    time, still = np.arange(40) / 30, 1e-6 * np.random.default_rng(1).standard_normal((40, 10, 10, 3))
    assert not contact_by_motion(time, still).any()
    moving = still + np.linspace(0.0, 1e-3, 40)[:, None, None, None] * [1.0, 0.0, 0.0]
    assert contact_by_motion(time, moving)[20:].all()
