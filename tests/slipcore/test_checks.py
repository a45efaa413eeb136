"""Faults put into a log on purpose are found by name; a log without them is left alone."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from service.domain.sensors.calibrate import CORRECTED_BY_ANOTHER
from service.domain.sensors.reconstruct import BY_ANOTHERS_GEL, CONTRADICTED, NOT_CHECKED, RECONSTRUCTED
from slipcore import Finding, GraspLog, InvalidInput, check_log, collect_friction, detect_slip
from slipcore.checks import AGAINST_FRICTION
from slipcore.checks.contact import _load_ratio
from slipcore.checks.subject import Subject
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.contradicting_forces import EARLY, LATE
from slipcore.finding import SEVERITIES
from slipcore.frames import BY_MOTION
from slipcore.surface.log_normals import normals_of
from tests.slipcore.conftest import RECORDED

Scene = Callable[..., GraspLog]


def names(log: GraspLog, **options: float) -> set[str]:
    """Of all that is found."""
    return {finding.name for finding in check_log(log, detect_slip(log, lookahead=2), **options)}


@pytest.fixture(scope="module")
def long_ramp() -> GraspLog:
    """With friction samples enough to be compared."""
    schedule = RampSchedule(rest=0.2, press=0.5, settle=0.2, shear=4.0, hold=0.3)
    made = tangential_ramp(points=20, pitch=0.75e-3, schedule=schedule, marker_noise=1e-6, force_noise=5e-4, seed=3)
    return replace(made, truth=None)


def pressing(log: GraspLog) -> np.ndarray:
    """Normal force of each element, [t, n, m] N, 0 where it does not press."""
    assert log.force is not None
    return np.maximum(-log.force[..., 2], 0.0)


def with_force(log: GraspLog, force: np.ndarray) -> GraspLog:
    return replace(log, force=force)


def with_sideways(log: GraspLog) -> GraspLog:
    """Each element also feels 0.4 of its normal force towards the middle."""
    assert log.force is not None
    inward = -log.position[..., :2] / np.maximum(np.linalg.norm(log.position[..., :2], axis=-1), 1e-9)[..., None]
    force = log.force.copy()
    force[..., :2] += 0.4 * pressing(log)[..., None] * inward
    return with_force(log, force)


def with_smoothed_normal(log: GraspLog) -> GraspLog:
    """Normal forces as an inverse problem gives them that spreads each over its neighbours, tangential ones exact."""
    assert log.force is not None
    force = log.force.copy()
    for axis in (1, 2):
        for _ in range(4):
            force[..., 2] = 0.5 * force[..., 2] + 0.25 * (
                np.roll(force[..., 2], 1, axis) + np.roll(force[..., 2], -1, axis)
            )
    return with_force(log, force)


def with_gains(log: GraspLog) -> GraspLog:
    """Tangential gains that differ by 30 % from element to element."""
    assert log.force is not None
    force = log.force.copy()
    force[..., :2] *= np.random.default_rng(2).uniform(0.5, 1.5, (*log.grid, 1))
    return with_force(log, force)


def rolling(log: GraspLog) -> GraspLog:
    """The same forces, as they would be seen by a sensor over which the contact moves four elements."""
    assert log.force is not None
    steps = np.linspace(0.0, 4.0, len(log)).astype(int)
    return with_force(
        log, np.stack([np.roll(field, step, axis=0) for field, step in zip(log.force, steps, strict=True)])
    )


def saturated(log: GraspLog) -> GraspLog:
    assert log.force is not None
    most = 0.6 * float(np.abs(log.force).max())
    return with_force(log, np.clip(log.force, -most, most))


def pressed_beyond_its_range(log: GraspLog) -> GraspLog:
    """Depth is seen up to half of the largest."""
    seen = log.displacement.copy()
    seen[..., 2] = np.maximum(seen[..., 2], 0.5 * seen[..., 2].min())
    return replace(log, displacement=seen)


def doubled(log: GraspLog) -> GraspLog:
    """A recorder of twice the sensor's rate."""
    kept = np.arange(len(log)) // 2
    return replace(
        log,
        displacement=log.displacement[kept],
        force=None if log.force is None else log.force[kept],
        normal=None if log.normal is None else log.normal[kept],
        object_pose=None if log.object_pose is None else log.object_pose[kept],
    )


def with_places(log: GraspLog) -> GraspLog:
    """Where markers are, in the place of how far they have moved."""
    return replace(log, displacement=log.position + log.displacement)


def before_shear(log: GraspLog) -> GraspLog:
    """The recording ends when the object is pressed and settled."""
    return log.take(slice(0, 27))


def with_offset(log: GraspLog, *offset: float) -> GraspLog:
    """Each element reads so many N more than there are."""
    return with_force(log, np.asarray(log.force) + np.array(offset))


def leaning(log: GraspLog, degrees: float) -> GraspLog:
    """Forces in a frame that is turned about y against that of the markers."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return with_force(log, np.asarray(log.force) @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]))


def drifting(log: GraspLog, *drift: float) -> GraspLog:
    """The zero of each element moves by so many N from the first frame to the last, evenly."""
    share = np.linspace(0.0, 1.0, len(log))[:, None, None, None]
    return with_force(log, np.asarray(log.force) + share * np.array(drift))


def gripped(log: GraspLog, factor: float = 1.0, creep: float = 0.0) -> GraspLog:
    """With the gripper's true force, and normal forces times a factor of which a part is lost within a second."""
    force = np.array(log.force)
    force[..., 2] *= factor * (1.0 - creep * (1.0 - np.exp(-(log.time - log.time[0]))))[:, None, None]
    return replace(log, force=force, gripper_force=pressing(log).sum(axis=(1, 2)), gripper_force_deviation=0.02)


def with_leaning_normals(log: GraspLog, degrees: float) -> GraspLog:
    """Normals in a frame that is turned about y against that of the markers."""
    assert log.normal is not None
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return replace(log, normal=log.normal @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]))


FAULTS: dict[str, Callable[[GraspLog], GraspLog]] = {
    "slow frames": lambda log: replace(log, time=1e3 * log.time),
    "fast frames": lambda log: replace(log, time=1e-3 * log.time),
    "places for displacement": with_places,
    "no displacement": lambda log: replace(log, displacement=np.zeros_like(log.displacement)),
    "no contact": lambda log: with_force(log, 1e-4 * np.asarray(log.force)),
    "repeated frames": doubled,
    "force too large": lambda log: with_force(log, 1e2 * np.asarray(log.force)),
    "displacement too small": lambda log: replace(log, displacement=1e-3 * log.displacement),
    "force pulls": lambda log: with_force(log, -np.asarray(log.force)),
    "saturation": saturated,
    "no rest": lambda log: log.take(slice(30, None)),
    "element area": lambda log: replace(log, element_area=10.0 * log.element_area),
    "zero offset": lambda log: with_offset(log, 0.005, 0.0, 0.0),
    "zero drift": lambda log: drifting(log, 0.005, 0.0, 0.0),
    "gripper's force differs": lambda log: gripped(log, creep=0.2),
    "leaning normals": lambda log: with_leaning_normals(log, 3.0),
    "odd friction": lambda log: with_force(log, np.asarray(log.force) * np.array([9.81, 9.81, 1.0])),
    "leaning forces": lambda log: leaning(log, 8.0),
    "turned axes": lambda log: with_force(log, np.asarray(log.force)[..., [1, 0, 2]]),
    "sideways force without load": with_sideways,
    "contact travels": rolling,
    "no slip": before_shear,
    "friction follows force": with_smoothed_normal,
    "friction differs by place": with_gains,
    "scatter beyond noise": with_gains,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_by_name(long_ramp: GraspLog, fault: str) -> None:
    assert fault in names(FAULTS[fault](long_ramp))


@pytest.mark.parametrize(
    ("changes", "because"),
    [
        ({"axes": [1.0, 1.0, 0.0]}, "in the plane alone"),
        ({"axes": [1.0, 1.0, -1.0]}, "pressed in by 0.00"),
        ({"contact": False}, "own `contact` says so"),
        ({"contact": False, "metadata": {"contact": BY_MOTION}}, "no marker moves"),
    ],
)
def test_why_nothing_touches_is_said(short_ramp: GraspLog, changes: dict[str, Any], because: str) -> None:
    given = {name: value for name, value in changes.items() if name != "axes"}
    if "contact" in given:
        given["contact"] = np.zeros(short_ramp.displacement.shape[:3], bool)
    moved = short_ramp.displacement * changes.get("axes", 1.0)
    log = replace(short_ramp, force=None, normal=None, displacement=moved, **given)
    (found,) = check_log(log, detect_slip(log))
    assert found.name == "no contact"
    assert because in found.evidence


def test_zeros_by_which_a_sensor_says_that_nothing_touches_are_no_copies(long_ramp: GraspLog) -> None:
    gated = long_ramp.displacement.copy(), np.array(long_ramp.force)
    for field in gated:
        field[:21] = 0.0
    assert "repeated frames" not in names(replace(long_ramp, displacement=gated[0], force=gated[1], normal=None))


def test_nothing_is_found_in_a_log_without_fault(long_ramp: GraspLog, short_ramp: GraspLog) -> None:
    assert names(long_ramp) == set()
    assert names(short_ramp) == set()
    assert names(replace(long_ramp, force=None, normal=None, object_pose=None)) == set()


@pytest.mark.parametrize("name", ["cond1", "cond1_layer5c", "reversal", "ring"])
def test_nothing_but_its_beginning_is_found_in_scenes_of_another_solver(name: str, scene: Scene) -> None:
    assert names(scene(name, marker_noise=3e-6, force_noise=2e-3)) <= {"no rest"}


@pytest.mark.parametrize(
    "offset", [(0.0, 0.0, -0.01), (0.0, 0.0, -0.03), (0.0, 0.0, 0.01), (-0.01, 0.0, 0.0), (0.0, 0.01, 0.0)]
)
def test_a_zero_that_is_off_is_found_along_each_axis(long_ramp: GraspLog, offset: tuple[float, ...]) -> None:
    assert "zero offset" in names(with_offset(long_ramp, *offset))


@pytest.mark.parametrize("noise", [0.0, 1e-3, 4e-3])
def test_a_zero_is_told_without_what_noise_adds_to_it(long_ramp: GraspLog, noise: float) -> None:
    """Squares of noise do not average out, however many elements there are."""
    offset = (0.006, 0.0, 0.0)
    rng = np.random.default_rng(4)
    log = with_offset(long_ramp, *offset)
    log = with_force(log, np.asarray(log.force) + noise * rng.standard_normal((*np.shape(log.force),)))
    (found,) = (each for each in check_log(log, detect_slip(log, lookahead=2)) if each.name == "zero offset")
    told = re.search(r"elements read ([\d.]+) mN", found.evidence)
    assert told is not None
    assert float(told[1]) == pytest.approx(6.0, abs=0.4)


@pytest.mark.parametrize("offset", [-0.01, 0.005, 0.01])
def test_a_zero_that_is_off_is_found_where_markers_are_seen_in_the_plane_only(
    long_ramp: GraspLog, offset: float
) -> None:
    """Pressed straight down they stay where they are."""
    displacement = long_ramp.displacement * np.array([1.0, 1.0, 0.0])
    planar = replace(long_ramp, displacement=displacement, normal=None)
    assert "zero offset" not in names(planar)
    assert "zero offset" in names(with_offset(planar, 0.0, 0.0, offset))


def test_noise_that_outlasts_the_rest_is_no_offset(long_ramp: GraspLog) -> None:
    """Each element's own, 3 mN, goes on for half a second; the rest has a fifth of one."""
    assert "zero offset" not in names(with_lasting_noise(long_ramp, 3e-3, 0.5))


@pytest.mark.parametrize(
    "drift", [(-0.005, 0.0, 0.0), (0.0, 0.005, 0.0), (0.0, 0.0, 0.005), (0.0, 0.0, -0.005), (-0.02, 0.0, 0.0)]
)
def test_a_zero_that_drifts_is_found_along_each_axis(long_ramp: GraspLog, drift: tuple[float, ...]) -> None:
    """Friction comes out as 0.37 to 0.46 for 0.4 by those of 5 mN."""
    for log in (long_ramp, replace(long_ramp, displacement=long_ramp.displacement * np.array([1.0, 1.0, 0.0]))):
        assert "zero drift" not in names(log)
        assert "zero drift" in names(drifting(log, *drift))


def test_where_all_elements_touch_the_rest_after_the_grasp_shows_a_drift(long_ramp: GraspLog) -> None:
    """A log that goes back the way it came, of the middle elements alone, all of which touch."""
    middle = np.s_[:, 7:13, 7:13]
    fields = [np.asarray(field)[middle] for field in (long_ramp.displacement, long_ramp.force, long_ramp.normal)]
    displacement, force, normal = (np.concatenate([field, field[::-1]]) for field in fields)
    time = (long_ramp.time[1] - long_ramp.time[0]) * np.arange(len(force))
    position, area = long_ramp.position[7:13, 7:13], long_ramp.element_area
    log = GraspLog(time, position, displacement, area, force=force, normal=normal)
    assert "zero drift" not in names(log)
    assert "zero drift" in names(drifting(log, 0.008, 0.0, 0.0))


@pytest.mark.parametrize("noise", [0.0, 2e-3, 1e-2])
@pytest.mark.parametrize("lasts", [0.0, 0.5])
def test_noise_of_each_element_is_no_drift(long_ramp: GraspLog, noise: float, lasts: float) -> None:
    assert "zero drift" not in names(with_lasting_noise(long_ramp, noise, lasts))


def with_lasting_noise(log: GraspLog, deviation: float, lasts: float) -> GraspLog:
    """Each element's own of so many N, that goes on for so many seconds."""
    rng = np.random.default_rng(5)
    kept = np.exp(-float(log.time[1] - log.time[0]) / lasts) if lasts else 0.0
    force = np.array(log.force)
    noise = rng.normal(0.0, deviation, force.shape[1:])
    for frame in force:
        noise = kept * noise + np.sqrt(1.0 - kept**2) * rng.normal(0.0, deviation, noise.shape)
        frame += noise
    return with_force(log, force)


@pytest.mark.parametrize("drift", [0.0, 3e-3])
def test_what_smoothed_forces_leak_beside_a_contact_is_no_drift(drift: float) -> None:
    """It grows with the contact, to 5 % of its elements' force here, and falls off with the distance."""
    ramp = tangential_ramp(points=26, pitch=0.75e-3, normal_force=8.0, marker_noise=1e-6, force_noise=0.0)
    growing = np.asarray(ramp.force) * np.linspace(0.6, 1.0, len(ramp))[:, None, None, None]
    smoothed = gaussian_filter(growing, (0.0, 3.5, 3.5, 0.0))
    noise = 1e-3 * np.random.default_rng(2).standard_normal(smoothed.shape)
    found = names(drifting(with_force(ramp, smoothed + noise), drift, 0.0, 0.0))
    assert ("zero drift" in found) == (drift > 0.0)


@pytest.mark.parametrize("degrees", [-10.0, -3.0, 3.0, 9.0])
def test_normals_in_a_frame_that_leans_are_found(long_ramp: GraspLog, degrees: float) -> None:
    leaning_log = with_leaning_normals(long_ramp, degrees)
    assert "leaning normals" in names(leaning_log)
    assert "leaning normals" in names(leaning_log.take(slice(30, None)))  # also without rest
    assert "leaning normals" not in names(with_leaning_normals(long_ramp, 1.0))


@pytest.mark.parametrize("degrees", [-90.0, 15.0, 30.0, 60.0, 90.0])
def test_a_lean_of_any_size_is_told_by_its_angle(long_ramp: GraspLog, degrees: float) -> None:
    found = check_log(turned := with_leaning_normals(long_ramp, degrees), detect_slip(turned))
    (evidence,) = (each.evidence for each in found if each.name == "leaning normals")
    assert f"lean by {abs(degrees):.1f}°" in evidence


def test_normals_of_the_deformed_shape_lean_nowhere(long_ramp: GraspLog) -> None:
    shaped = replace(long_ramp, normal=normals_of(replace(long_ramp, normal=None)))
    assert "leaning normals" not in names(shaped)
    assert "leaning normals" not in names(shaped.take(slice(30, None)))


def on_a_fingertip(log: GraspLog, elements: int, radius: float = 8e-3) -> GraspLog:
    """The log's middle on a cylinder of 14 mm that ends in a cap: normals and rest places in closed form."""
    begin = (log.grid[0] - elements) // 2
    cut = slice(begin, begin + elements)
    along, around = np.meshgrid(np.linspace(-7e-3, 7e-3, elements), np.linspace(-0.7, 0.7, elements), indexing="ij")
    tilt = np.clip(along, 0.0, None) / radius
    normal = np.stack([np.sin(tilt), np.cos(tilt) * np.sin(around), np.cos(tilt) * np.cos(around)], axis=-1)
    position = radius * normal + np.minimum(along, 0.0)[..., None] * np.array([1.0, 0.0, 0.0])
    displacement, force = (np.asarray(each)[:, cut, cut] for each in (log.displacement, log.force))
    return replace(
        log,
        position=position,
        displacement=displacement,
        force=force,
        normal=np.broadcast_to(normal, force.shape),
        element_area=1e-5,
        truth=None,
        contact=None,
    )


@pytest.mark.parametrize(("elements", "degrees"), [(3, 4.0), (4, 10.0), (5, 4.0), (6, 4.0), (10, 4.0)])
def test_normals_of_a_coarse_fingertip_lean_only_where_they_are_turned(
    long_ramp: GraspLog, elements: int, degrees: float
) -> None:
    """A surface by differences of places had been off by up to 5° on these; of four rows the cap's rim hides 4°."""
    tip = on_a_fingertip(long_ramp, elements)
    assert "leaning normals" not in names(tip)
    assert "leaning normals" in names(with_leaning_normals(tip, degrees))


def test_normals_of_a_dome_whose_places_are_given_flat_say_nothing_of_a_lean(long_ramp: GraspLog) -> None:
    tip = on_a_fingertip(long_ramp, 5)
    assert "leaning normals" not in names(replace(tip, position=tip.position * np.array([1.0, 1.0, 0.0])))


def test_a_gripper_that_reports_late_and_a_contact_beside_the_elements_contradict_nothing(long_ramp: GraspLog) -> None:
    log = gripped(long_ramp)
    assert log.gripper_force is not None
    late = np.interp(log.time - 0.1, log.time, log.gripper_force)
    assert "gripper's force differs" not in names(replace(log, gripper_force=late))
    fields = {name: getattr(log, name)[:, : log.grid[0] // 2] for name in ("displacement", "force", "normal")}
    half = replace(log, position=log.position[: log.grid[0] // 2], truth=None, contact=None, **fields)
    assert "gripper's force differs" not in names(half)


@pytest.mark.parametrize(
    ("factor", "creep", "is_found"),
    [(1.0, 0.0, False), (1.05, 0.0, False), (0.7, 0.0, True), (1.3, 0.0, True), (0.102, 0.0, True), (1.0, 0.2, True)],
)
def test_forces_that_the_gripper_contradicts_are_found(
    long_ramp: GraspLog, factor: float, creep: float, is_found: bool
) -> None:
    log = gripped(long_ramp, factor, creep)
    assert ("gripper's force differs" in names(log)) == is_found
    assert "gripper's force differs" not in names(replace(log, gripper_force_deviation=100.0))


@pytest.mark.parametrize("gains", [(9.81, 9.81, 1.0), (1.0, 1.0, 9.81)])
def test_axes_in_different_units_are_found(long_ramp: GraspLog, gains: tuple[float, ...]) -> None:
    assert "odd friction" in names(with_force(long_ramp, np.asarray(long_ramp.force) * np.array(gains)))


@pytest.mark.parametrize(("pressed", "noise"), [(1.0, 2e-3), (0.3, 2e-3), (6.0, 2e-2)])
def test_noise_of_a_light_grasp_is_no_sideways_force(pressed: float, noise: float) -> None:
    schedule = RampSchedule(rest=0.2, press=0.5, settle=0.2, shear=2.0, hold=0.3)
    made = tangential_ramp(
        points=20,
        pitch=0.75e-3,
        normal_force=pressed,
        schedule=schedule,
        marker_noise=1e-6,
        force_noise=noise,
        seed=3,
    )
    for log in (made, made.take(slice(12, None))):  # also without rest
        assert "sideways force without load" not in names(replace(log, truth=None))


def test_a_zero_is_not_sought_where_the_markers_took_theirs_in_touch(long_ramp: GraspLog) -> None:
    """As with `rest=first` of a recording that begins pressed: forces are right there, and markers are at 0."""
    begun = long_ramp.take(slice(25, None))
    assert "zero offset" not in names(replace(begun, displacement=begun.displacement - begun.displacement[:5].mean(0)))


def test_markers_that_were_zeroed_under_a_load_do_not_make_forces_lean(long_ramp: GraspLog) -> None:
    """As with `rest=first` of a recording that begins while the contact is pulled: no marker moves, and forces are."""
    pulled = long_ramp.take(slice(45, None))
    assert names(replace(pulled, displacement=pulled.displacement - pulled.displacement[0])) <= {"no rest", "no slip"}


@pytest.mark.parametrize("degrees", [-20.0, -8.0, 20.0])
def test_a_leaning_frame_is_found_whichever_way_it_leans(long_ramp: GraspLog, degrees: float) -> None:
    assert "leaning forces" in names(leaning(long_ramp, degrees))


@pytest.mark.parametrize("signs", [(-1, 1, 1), (1, -1, 1), (-1, -1, 1)])
def test_axes_that_are_turned_are_found_where_the_load_shows_them(signs: tuple[int, ...], scene: Scene) -> None:
    """The load of this scene goes along x alone, so that a turned y is not seen, and changes nothing."""
    log = scene("reversal", marker_noise=3e-6, force_noise=2e-3)
    assert ("turned axes" in names(with_force(log, np.asarray(log.force) * np.array(signs)))) == (signs[0] < 0)


def test_of_a_dome_the_normals_are_taken_off(long_ramp: GraspLog) -> None:
    """All of a log turned by 20° together leans in no frame of its own."""
    sine, cosine = np.sin(np.radians(20.0)), np.cos(np.radians(20.0))
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    normal = np.broadcast_to([0.0, 0.0, 1.0], long_ramp.displacement.shape) @ turn
    turned = replace(
        leaning(long_ramp, 20.0),
        position=long_ramp.position @ turn,
        displacement=long_ramp.displacement @ turn,
        normal=normal,
        object_pose=None,
    )
    assert "leaning forces" not in names(turned)


def test_places_are_found_without_forces_and_whichever_way_the_lattice_lies(short_ramp: GraspLog) -> None:
    alone = replace(short_ramp, force=None, normal=None, object_pose=None)
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(alone, position=alone.position @ turn, displacement=alone.displacement @ turn)
    for log in (alone, turned):
        assert "places for displacement" in names(with_places(log))
        assert "places for displacement" not in names(log)


def test_slip_of_a_twentieth_is_none_and_of_a_fifth_is_some(short_ramp: GraspLog) -> None:
    assert short_ramp.truth is not None
    slipping = 1.0 - np.nan_to_num(short_ramp.truth.stick_ratio, nan=1.0)
    for share, said in ((0.05, True), (0.2, False)):
        ends = int(np.flatnonzero(slipping > share)[0])
        assert ("no slip" in names(short_ramp.take(slice(0, ends)))) == said


def test_noise_by_which_friction_scatters_is_no_scatter_beyond_noise(long_ramp: GraspLog) -> None:
    """With 5 mN friction scatters by 13 %, and so do an element's readings from frame to frame."""
    force = np.asarray(long_ramp.force)
    noisy = with_force(long_ramp, force + 5e-3 * np.random.default_rng(5).standard_normal(force.shape))
    assert "scatter beyond noise" not in names(noisy, scatter_share=0.05)
    assert "scatter beyond noise" in names(with_gains(long_ramp), scatter_share=0.05)


@pytest.mark.parametrize("recording", RECORDED[:2], indirect=True)
def test_of_real_recordings_it_is_said_why_their_friction_is_wrong(recording: GraspLog) -> None:
    """Their elements' friction falls with force; one of them rolls, and one pivots."""
    found = names(recording)
    assert {"friction follows force", "friction differs by place"} <= found
    assert found & {"sideways force without load", "contact travels"}


@pytest.mark.parametrize("recording", RECORDED[2:], indirect=True)
def test_of_a_recording_whose_elements_agree_with_its_contact_no_friction_is_called_wrong(recording: GraspLog) -> None:
    """By a quarter, which is within the limits: the other finger of the object that pivots."""
    assert not names(recording) & {"friction follows force", "sideways force without load"}


def test_a_hold_of_few_rounded_readings_is_no_saturation(long_ramp: GraspLog) -> None:
    middle = np.s_[:, 9:11, 9:11]
    assert long_ramp.force is not None
    small = replace(
        long_ramp,
        position=long_ramp.position[middle[1:]],
        displacement=np.round(0.1 * long_ramp.displacement[middle], 6),
        force=np.round(long_ramp.force[middle], 2),
        normal=None if long_ramp.normal is None else long_ramp.normal[middle],
    )
    assert "saturation" not in names(small)


def test_displacement_beyond_the_range_is_found_with_its_axis(long_ramp: GraspLog) -> None:
    log = pressed_beyond_its_range(long_ramp)
    (found,) = [each for each in check_log(log, detect_slip(log)) if each.name == "saturation"]
    assert found.evidence.endswith("reach the largest displacement along z")
    assert "press less" in found.remedy


def test_a_log_without_any_tangential_force_is_looked_through(long_ramp: GraspLog) -> None:
    assert names(with_force(long_ramp, np.asarray(long_ramp.force) * [0.0, 0.0, 1.0])) <= {
        "force too large",
        "odd friction",
    }


def test_frames_that_pull_among_others_that_press_are_looked_through(long_ramp: GraspLog) -> None:
    force = np.asarray(long_ramp.force).copy()
    force[:10] = [0.1, 0.0, 1e-3]
    assert "force pulls" not in names(with_force(long_ramp, force))


@pytest.mark.parametrize("count", [1, 2])
def test_a_moment_is_a_load_on_several_elements_and_none_on_one(count: int) -> None:
    """Two elements are pulled apart sideways by half of what presses them, and so is one of its own accord."""
    position, force = np.zeros((3, 1, 3)), np.zeros((1, 3, 1, 3))
    position[:, 0, 0] = np.arange(3)
    force[0, :count, 0] = [[0.0, 0.5, -1.0], [0.0, -0.5, -1.0]][:count]
    pressing = -force[..., 2]
    seen = SimpleNamespace(
        log=SimpleNamespace(force=force, position=position),
        pressing=pressing,
        total=pressing.sum(axis=(1, 2)),
        held=np.array([True]),
    )
    np.testing.assert_allclose(_load_ratio(cast("Subject", seen)), [0.5], rtol=1e-12, err_msg="rounding")


def test_a_limit_can_be_moved_and_a_wrong_one_is_refused(long_ramp: GraspLog) -> None:
    assert "slow frames" in names(long_ramp, longest_interval=0.01)
    assert "fast frames" in names(long_ramp, shortest_interval=0.1)
    with pytest.raises(InvalidInput, match="place_scatter"):
        names(long_ramp, place_scatter=-1.0)


def findings_in_code() -> set[str]:
    """The names of all findings that the packages make."""
    sources = [
        path.read_text(encoding="utf-8") for part in ("slipcore", "service") for path in Path(part).rglob("*.py")
    ]
    return {name for source in sources for name in re.findall(r'\bFinding\(\s*"([^"]+)"', source)} | {
        LATE,
        EARLY,
        RECONSTRUCTED,
        NOT_CHECKED,
        CONTRADICTED,
        CORRECTED_BY_ANOTHER,
        BY_ANOTHERS_GEL,
    }


def test_every_finding_is_documented_with_its_severity() -> None:
    page = Path("docs/checks.md").read_text(encoding="utf-8")
    assert dict(re.findall(r"^\| ([^|]+) \| (warning|note) \|", page, re.MULTILINE)) == SEVERITIES
    assert findings_in_code() == set(SEVERITIES)


def test_severity_parts_what_makes_friction_doubtful_from_what_informs() -> None:
    assert Finding("saturation", "", "").severity == "warning"
    assert Finding("no rest", "", "").severity == "note"
    assert Finding("of a newer version", "", "").severity == "note"
    assert {name for name in SEVERITIES if Finding(name, "", "").severity == "warning"} == AGAINST_FRICTION


def test_what_is_told_in_per_cent_of_friction_is_the_same_of_twice_the_friction(long_ramp: GraspLog) -> None:
    log = with_gains(long_ramp)
    history = detect_slip(log, lookahead=2)
    samples = collect_friction(log, history).elements
    twice = replace(samples, friction_coefficient=2.0 * samples.friction_coefficient)
    told, again = (
        {each.name: each.evidence for each in check_log(log, history, friction)} for friction in (samples, twice)
    )
    for name in ("friction differs by place", "scatter beyond noise"):
        assert "%" in told[name]
        assert again[name] == told[name]
