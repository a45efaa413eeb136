"""Forces of frames as they come, against the forces that an independent solver knows."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog, InvalidInput
from slipcore.forces import ForceStream, Gel, StreamedForces, reconstruct
from slipcore.forces.defaults import FORCE_STREAM

GEL = Gel(young_modulus=1e6, poisson_ratio=0.49, thickness=5e-3)
LIGHT = [0, 0]
"""Frames of the scene with 0.5 N, whose contact a lattice of 8 × 8 markers holds."""
INSIDE = slice(6, 14)
AROUND = slice(5, 15)
"""What holds that of the frame with 5 N."""
NOISE = 1e-6
Pressed = Callable[..., GraspLog]


class Later(Executor):
    """Does what it was given once it is told to."""

    def __init__(self) -> None:
        self.given: list[tuple[Future[Any], Callable[..., Any]]] = []

    def submit(self, do: Callable[..., Any], /, *_: Any, **__: Any) -> Future[Any]:
        self.given.append((Future(), do))
        return self.given[-1][0]

    def work(self) -> None:
        """Do it all."""
        for future, do in self.given:
            future.set_result(do())
        self.given.clear()


def made(log: GraspLog, **options: Any) -> ForceStream:
    return ForceStream(log.position, log.element_area, GEL, **options)


def still(log: GraspLog, axes: int, k: int) -> np.ndarray:
    """Displacements of markers that nothing touches."""
    shown = NOISE * np.random.default_rng(k).standard_normal(log.position.shape)
    shown[..., axes:] = 0.0
    return shown


def total(log: GraspLog, k: int) -> np.ndarray:
    assert log.force is not None
    return log.force[k].sum(axis=(0, 1))


def test_forces_are_met_from_the_touch_on_and_end_with_it(pressed: Pressed) -> None:
    log = pressed([0, 1], noise=NOISE, crop=AROUND)
    stream = made(log, noise=NOISE)
    found = [stream.step(0.1 * k, still(log, 3, k)) for k in range(3)]
    assert all(each.wait_for is None and not each.forces.force.any() for each in found)
    found += [stream.step(1.0 + 0.1 * k, log.displacement[k // 4]) for k in range(8)]
    for each, normal in zip(found[6::4], (-0.5, -5.0), strict=True):
        assert each.wait_for is None
        np.testing.assert_allclose(each.forces.resultant, [0.0, 0.0, normal], atol=0.02 * abs(normal))
        assert each.forces.contact.any()
        assert (each.forces.deviation[each.forces.contact] > 0.0).all()
        assert (each.forces.resultant_deviation > 0.0).all()
        assert each.contact is each.forces.contact
        assert each.force_deviation == np.median(each.forces.deviation[each.forces.contact][:, 2])
    lifted = stream.step(10.0, still(log, 3, 99))
    assert not lifted.forces.force.any()
    assert lifted.forces.force.shape == found[-1].forces.force.shape
    assert lifted.wait_for is None
    assert lifted.force_deviation == 0.0


@pytest.mark.parametrize(("thickness", "shown"), [(5e-3, True), pytest.param(np.inf, False, marks=pytest.mark.long)])
def test_in_the_plane_of_a_thick_gel_no_force_is_sure_for_a_detector(
    pressed: Pressed, thickness: float, shown: bool
) -> None:
    log, beside = pressed([3, 3], noise=NOISE, axes=2, crop=AROUND), Later()
    stream = ForceStream(log.position, log.element_area, replace(GEL, thickness=thickness), NOISE, beside)
    assert not stream.step(-0.1, still(log, 2, 0)).contact.any()  # nothing is set up yet
    beside.work()
    for k in range(2):
        found = stream.step(0.1 * k, log.displacement[k])
        beside.work()
    forces = found.forces
    assert found.contact is forces.contact
    assert found.force_deviation == (forces.ratio_noise if shown else np.abs(forces.force).max())
    assert forces.ratio_noise < forces.force_noise  # which has the error of discretisation, and that lasts


def test_in_the_plane_of_a_thick_gel_nothing_touches_until_the_noise_is_known(pressed: Pressed) -> None:
    """By no noise at all a quarter of the markers had moved."""
    log = pressed(LIGHT, crop=INSIDE)
    stream = ForceStream(log.position, log.element_area, replace(GEL, thickness=np.inf))
    for k in range(16):
        found = stream.step(k / 30.0, still(log, 2, k))
        assert (found.wait_for == "noise") == (k < 14)
        assert not found.contact.any()


@pytest.mark.long
def test_in_the_plane_alone_the_contact_is_found_too(pressed: Pressed) -> None:
    log = pressed([3, 3], noise=NOISE, axes=2)
    stream = made(log, noise=NOISE)
    found = [stream.step(0.1 * k, log.displacement[k]) for k in range(2)][-1]
    np.testing.assert_allclose(found.forces.resultant, total(log, 0), atol=0.3)


def test_the_first_frames_tell_the_noise_where_it_is_not_given(pressed: Pressed) -> None:
    log = pressed(LIGHT, noise=NOISE, crop=INSIDE)
    stream = made(log)
    found = [stream.step(k / 30.0, still(log, 3, k)).wait_for for k in range(15)]
    assert found == ["noise"] * 14 + [None]
    first = [stream.step(0.5 + k / 30.0, log.displacement[0]) for k in range(3)][-1]
    assert first.forces.resultant[2] == pytest.approx(total(log, 0)[2], rel=0.01)


def test_while_forces_are_waited_for_only_the_grippers_bounds_them(pressed: Pressed) -> None:
    """Else they may be all that the gel bears: its modulus on all elements."""
    log = pressed(LIGHT, crop=INSIDE)
    stream = made(log)
    unknown = stream.step(0.0, log.displacement[0])
    bears = GEL.young_modulus * log.element_area * np.prod(log.grid)
    assert (unknown.wait_for, unknown.given, unknown.force_deviation) == ("noise", False, 0.0)
    np.testing.assert_allclose(unknown.forces.resultant_deviation, bears)
    assert unknown.forces.moment_deviation == pytest.approx(bears * np.hypot(*log.position[-1, -1, :2]))
    known = stream.step(0.1, log.displacement[0], None, 8.0, 0.1)
    assert (known.wait_for, known.given) == ("noise", True)
    np.testing.assert_allclose(known.forces.resultant, [0.0, 0.0, -8.0], rtol=1e-3)
    np.testing.assert_allclose(known.forces.resultant_deviation, [bears, bears, 0.1], rtol=1e-3)
    assert not known.forces.force.any()


def test_frames_do_not_wait_for_looks_beside_them(pressed: Pressed) -> None:
    log, beside = pressed(LIGHT, noise=NOISE, crop=INSIDE), Later()
    stream = made(log, noise=NOISE, executor=beside)
    times = iter(0.1 * np.arange(100))

    def step(displacement: np.ndarray) -> StreamedForces:
        return stream.step(next(times), displacement)

    waits = []
    for _ in range(3):  # the response to traction in the plane, then, as z is seen, with depth; then the lattice
        waits.append(step(still(log, 3, 0)).wait_for)
        beside.work()
    assert waits[0] == "set-up"
    assert step(log.displacement[0]).wait_for == "contact"
    assert step(log.displacement[0]).wait_for == "contact"
    assert len(beside.given) == 1
    beside.work()
    now = step(log.displacement[0])
    assert now.wait_for is None
    assert now.age == pytest.approx(0.2)
    assert now.forces.resultant[2] == pytest.approx(total(log, 0)[2], rel=0.01)


def test_once_markers_have_moved_on_the_contact_may_have_grown(pressed: Pressed) -> None:
    """From 0.5 to 5 N before the next look: by the contact of 0.5 N alone, F_z would be 2.1 deviations off."""
    log, beside = pressed([0, 1], noise=NOISE, axes=2, crop=slice(3, 17)), Later()
    stream = made(log, noise=NOISE, executor=beside)
    for k, displacement in enumerate([still(log, 2, 0), still(log, 2, 1), log.displacement[0], log.displacement[0]]):
        stream.step(0.1 * k, displacement)
        beside.work()
    as_sought = stream.step(0.4, log.displacement[0]).forces
    moved_on = stream.step(0.5, log.displacement[1]).forces
    errors = np.abs(moved_on.resultant - total(log, 1))
    assert (errors < 1.96 * moved_on.resultant_deviation).all()
    assert as_sought.resultant_deviation[2] < 0.1 * moved_on.resultant_deviation[2]


def test_a_contact_that_has_ended_meanwhile_is_not_that_of_the_next_touch(pressed: Pressed) -> None:
    log, beside = pressed(LIGHT, noise=NOISE, crop=INSIDE), Later()
    stream = made(log, noise=NOISE, executor=beside)
    for k in range(6):
        stream.step(0.1 * k, still(log, 3, k))
        beside.work()
    stream.step(1.0, log.displacement[0])
    stream.step(1.1, still(log, 3, 7))
    stream.step(1.2, log.displacement[0])
    beside.work()
    assert stream.step(1.3, log.displacement[0]).wait_for == "contact"
    beside.work()
    assert stream.step(1.4, log.displacement[0]).wait_for is None


def test_who_stops_takes_the_look_along_that_has_not_begun(pressed: Pressed) -> None:
    log, beside = pressed(LIGHT, noise=NOISE, crop=INSIDE), Later()
    stream = made(log, noise=NOISE, executor=beside)
    stream.close()
    stream.step(0.0, still(log, 3, 0))
    stream.close()
    ((future, _),) = beside.given
    assert future.cancelled()


def test_markers_that_are_lost_tell_nothing(pressed: Pressed) -> None:
    log = pressed([1, 1], noise=NOISE, crop=AROUND)
    observed = np.random.default_rng(3).random(log.position.shape[:2]) > 0.1
    shown = np.where(observed[..., None], log.displacement[0], np.nan)
    stream = made(log, noise=NOISE)
    found = [stream.step(0.1 * k, shown, observed) for k in range(6)][-1]
    assert found.forces.resultant[2] == pytest.approx(-5.0, rel=0.03)


def test_a_sensor_at_rest_that_shows_no_noise_is_not_touched(pressed: Pressed) -> None:
    log = pressed(LIGHT, crop=INSIDE)
    stream = made(log)
    for k in range(16):
        found = stream.step(k / 30.0, np.zeros(log.position.shape))
    assert not found.forces.force.any()
    found = [stream.step(1.0 + k / 30.0, log.displacement[0]) for k in range(6)][-1]
    assert found.forces.resultant[2] == pytest.approx(total(log, 0)[2], rel=0.02)


@pytest.mark.parametrize(
    ("axes", "gel", "report", "deviation"),
    [(3, GEL, 0.5, 0.2), (3, GEL, 0.8, None), (2, Gel(1e6, 0.5), 0.8, None)],
    ids=["as sure as said", "sure", "in the plane"],
)
def test_a_grippers_force_does_in_a_stream_what_it_does_in_a_log(
    pressed: Pressed, axes: int, gel: Gel, report: float, deviation: float | None
) -> None:
    shown = pressed(LIGHT, noise=NOISE, axes=axes, crop=INSIDE)
    same = np.stack([shown.displacement[0]] * 6)
    log = replace(shown, time=0.1 * np.arange(6), displacement=same, force=None, gripper_force=np.full(6, report))
    batch = reconstruct(replace(log, gripper_force_deviation=deviation), gel, noise=NOISE)
    stream = ForceStream(log.position, log.element_area, gel, noise=NOISE)
    found = [stream.step(time, same[0], None, report, deviation) for time in log.time][-1]
    assert found.given
    for name in ("force", "deviation", "resultant", "resultant_deviation"):
        np.testing.assert_allclose(getattr(found.forces, name), getattr(batch, name)[-1], rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(found.forces.contact, batch.contact[-1])
    assert found.contradiction == pytest.approx(batch.contradiction[-1, 2], rel=1e-6)


def test_a_grippers_force_is_no_longer_used_where_it_is_no_longer_told(pressed: Pressed) -> None:
    log = pressed(LIGHT, noise=NOISE, crop=INSIDE)
    stream = made(log, noise=NOISE)
    told = [0.5] * 4 + [None] * 4 + [0.0] * 4 + [0.6] * 4
    found = [stream.step(0.1 * k, log.displacement[0], None, force) for k, force in enumerate(told)]
    assert [each.given for each in found[3::4]] == [True, False, False, True]
    assert [np.isnan(each.contradiction) for each in found[3::4]] == [False, True, True, False]
    known, unknown = found[3].forces.resultant_deviation[2], found[7].forces.resultant_deviation[2]
    assert known < unknown


def test_a_grippers_force_that_the_gels_shape_contradicts_is_told(pressed: Pressed) -> None:
    log = pressed(LIGHT, noise=NOISE, crop=INSIDE)
    for force, said in ((0.5, 0.0), (0.8, 1.0)):
        stream, shares = made(log, noise=NOISE), []
        for k in range(FORCE_STREAM.compared + 4):
            stream.step(0.1 * k, log.displacement[0], None, force)
            shares.append(stream.contradicted)
        assert (shares[FORCE_STREAM.compared - 2], shares[-1]) == (0.0, said)


@pytest.mark.parametrize(
    ("force", "deviation", "said"),
    [
        (np.nan, None, "gripper_force is nan"),
        (True, None, "gripper_force is of dtype bool"),
        (-0.2, None, "positive where the object presses"),
        (360.5, None, r"gripper_force is up to 360 N; allowed: at most 360 N, 10 times Young's modulus"),
        (2e4, None, "gripper_force is 2e.04 N at its largest"),
        (1.0, 0.0, "gripper_force_deviation is 0 N"),
        (1.0, np.nan, "gripper_force_deviation is nan"),
        (None, 0.1, "gripper_force_deviation is given without gripper_force"),
    ],
)
def test_what_no_gripper_reports_is_refused_by_name(
    pressed: Pressed, force: float | None, deviation: float | None, said: str
) -> None:
    log = pressed(LIGHT, crop=INSIDE)
    stream = made(log)
    with pytest.raises(InvalidInput, match=said):
        stream.step(0.0, log.displacement[0], None, force, deviation)
    assert not stream._recent


def test_what_does_not_fit_is_refused_by_name_and_changes_nothing(pressed: Pressed) -> None:
    log = pressed(LIGHT, noise=NOISE, crop=INSIDE)
    for wrong, said in (
        ({"position": log.position[0]}, "position is of shape"),
        ({"element_area": -1.0}, "element_area is -1"),
        ({"element_area": 1e-12}, "an area that needs at most"),
        ({"noise": -1.0}, "noise is -1"),
        ({"gel": replace(GEL, thickness=5e-6)}, "thickness is 5e-06"),
    ):
        given = {"position": log.position, "element_area": log.element_area, "gel": GEL} | wrong
        with pytest.raises(InvalidInput, match=said):
            ForceStream(**given)
    stream = made(log, noise=NOISE)
    for time, displacement, said in (
        (0.0, log.displacement, "displacement is of shape"),
        (np.nan, log.displacement[0], "finite time"),
        (0.0, np.full(log.position.shape, np.nan), "finite time"),
        (0.0, 1e3 * np.ones(log.position.shape), "is it in m"),
    ):
        with pytest.raises(InvalidInput, match=said):
            stream.step(time, displacement)
    assert stream._tracking is None


def test_displacement_at_the_end_of_the_range_counts_as_not_seen(pressed: Pressed) -> None:
    log = pressed([0, 1], noise=NOISE, crop=AROUND)
    grown = np.linspace(0.2, 1.0, 8)[:, None, None, None] * log.displacement[1]
    end = 0.6 * grown[..., 2].min()
    stream = made(log, noise=NOISE)
    for k in range(3):
        stream.step(0.1 * k, still(log, 3, k))
    rng = np.random.default_rng(8)
    shown = grown + NOISE * rng.standard_normal(grown.shape)
    shown[..., 2] = np.maximum(shown[..., 2], end)
    shown = np.concatenate((shown, shown[-1:] + NOISE * rng.standard_normal((4, *shown.shape[1:]))))
    shown[..., 2] = np.maximum(shown[..., 2], end)
    shown[8:, ..., 2][shown[7:8, ..., 2].repeat(4, axis=0) == end] = end
    found = [stream.step(1.0 + 0.1 * k, each) for k, each in enumerate(shown)]
    assert found[0].saturated == 0
    assert found[-1].saturated == np.count_nonzero(shown[-1, ..., 2] == end)
    assert abs(found[-1].forces.resultant[2] - total(log, 1)[2]) < 0.05 * abs(total(log, 1)[2])
