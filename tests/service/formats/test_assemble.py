"""From named fields to a log, without a file."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from service.formats import assemble as module
from service.formats import rest
from service.formats.assemble import as_array, assemble
from service.formats.mapping import default_origins, parse
from slipcore import GraspLog
from slipcore.errors import InvalidInput

FRAMES = 4
PLACE = 1e-3 * np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
RNG = np.random.default_rng(0)
MOVED = RNG.normal(0.0, 1e-5, (FRAMES, 3, 3, 3))
FORCE = RNG.normal(0.0, 0.1, (FRAMES, 3, 3, 3))


@dataclass
class Fields:
    """A recording of arrays by name."""

    arrays: dict[str, Any]
    lattice: tuple[int, int] | None = None

    def column(self, _name: str, _topic: str | None, field: str, _once: bool) -> Any:
        found = self.arrays.get(field)
        return None if found is None else np.asarray(found)

    def grid(self) -> tuple[int, int] | None:
        return self.lattice

    def contents(self) -> str:
        return f"the fields {', '.join(self.arrays)}"


def made(mapping: dict[str, Any] | None = None, lattice: tuple[int, int] | None = None, **arrays: Any) -> GraspLog:
    whole = {"time": np.arange(4.0), "displacement": MOVED, "position": PLACE, **arrays}
    given = parse(json.dumps(mapping or {})).over(default_origins())
    return assemble(Fields({name: each for name, each in whole.items() if each is not None}, lattice), given)


def test_members_are_found_under_their_own_names_and_an_area_follows_from_their_places() -> None:
    log = made(force=FORCE)
    np.testing.assert_array_equal(log.displacement, MOVED)
    np.testing.assert_array_equal(log.force, FORCE)
    assert log.element_area == pytest.approx(1e-6)
    assert log.metadata == {"mapping": "{}", "element_area": "mean of the cells between the markers"}
    assert "element_area" not in made(element_area=2e-6).metadata


def test_units_turn_axes_and_scale_flat_fields_component_by_component() -> None:
    units = {"force": {"field": "f", "unit": ["N", "mN", "-N"]}, "displacement": {"field": "d", "unit": "mm"}}
    log = made(units | {"grid": [3, 3]}, displacement=None, d=1e3 * MOVED, f=FORCE.reshape(FRAMES, -1))
    np.testing.assert_allclose(log.force, FORCE * [1.0, 1e-3, -1.0])
    np.testing.assert_allclose(log.displacement, MOVED)


def test_places_seen_from_above_have_no_height_and_contact_is_estimated_from_motion() -> None:
    flat = {"displacement": {"field": ["x", "y"]}}
    parts = {"displacement": None, "x": MOVED[..., 0], "y": MOVED[..., 1]}
    log = made(flat, **parts)
    assert not log.displacement[..., 2].any()
    assert log.metadata["contact"] == "estimated from motion"
    assert log.contact is not None
    for known in ({"force": FORCE}, {"contact": np.ones((FRAMES, 3, 3), bool)}):
        assert "contact" not in made(flat, **parts, **known).metadata


@pytest.mark.parametrize("grid", [None, (3, 3)])
def test_of_arrays_x_and_y_are_enough_as_well(grid: tuple[int, int] | None) -> None:
    plane = {"displacement": MOVED[..., :2], "position": PLACE[..., :2]}
    if grid is not None:
        plane = {"displacement": MOVED[..., :2].reshape(FRAMES, -1), "position": PLACE[..., :2].reshape(-1, 2)}
    log = made(lattice=grid, **plane)
    np.testing.assert_array_equal(log.displacement, MOVED * [1.0, 1.0, 0.0])
    np.testing.assert_array_equal(log.position, PLACE)
    assert log.metadata["contact"] == "estimated from motion"
    assert "contact" not in made(lattice=grid, **plane, force=FORCE).metadata
    with pytest.raises(InvalidInput, match="force is of shape"):
        made(force=FORCE[..., :2])


def test_a_lattice_is_that_of_the_mapping_of_the_file_or_of_the_shapes() -> None:
    flat = {"displacement": MOVED.reshape(FRAMES, 9, 3), "position": PLACE.reshape(9, 3)}
    np.testing.assert_array_equal(made({"grid": [3, 3]}, **flat).displacement, MOVED)
    np.testing.assert_array_equal(made(lattice=(3, 3), **flat).position, PLACE)
    with pytest.raises(InvalidInput, match=r'displacement is of shape \[4, 9, 3\]; allowed: 4 axes, or a `grid` in the '
                       r'mapping, such as "grid": \[3, 3\]'):  # fmt: skip
        made(**flat)
    with pytest.raises(InvalidInput, match=r"displacement is of shape \[4, 9, 3\]; allowed: \[4, 2, 3, 3\] or as many"):
        made({"grid": [2, 3]}, **flat)
    with pytest.raises(InvalidInput, match="`grid` of 6 elements in the mapping, such as"):
        made(displacement=MOVED[:, :2].reshape(FRAMES, 6, 3))


def test_a_pitch_stands_for_places_that_nobody_tells() -> None:
    log = made({"pitch": 0.002}, position=None)
    assert np.diff(log.position[:, 0, 0]) == pytest.approx([0.002, 0.002])
    assert log.metadata["position"] == "a flat lattice of pitch 0.002 m"
    with pytest.raises(
        InvalidInput, match=r"position is not there; allowed: .*the file has the fields time, displacement"
    ):
        made(position=None)


def test_what_is_mapped_and_not_there_is_named_with_what_is() -> None:
    with pytest.raises(
        InvalidInput, match=r"force is not there \(f\); allowed: the fields time, displacement, position"
    ):
        made({"force": "f"})
    with pytest.raises(InvalidInput, match="time is not there; allowed: time"):
        made(time=None)


def test_displacement_counts_from_the_frame_at_rest() -> None:
    log = made({"rest": "2"})
    np.testing.assert_allclose(log.displacement, MOVED - MOVED[2], atol=1e-18)
    assert log.metadata["rest"] == "frame 2"
    least = made({"rest": "least contact"}, force=FORCE * np.array([3.0, 2.0, 0.0, 1.0])[:, None, None, None])
    assert least.metadata["rest"] == "frame 2"


def test_without_contact_or_force_the_least_stretched_frame_is_at_rest_of_places_and_of_displacement() -> None:
    spread = np.array([1.02, 1.01, 1.0, 1.03])[:, None, None, None]
    moved = PLACE * (spread - 1.0) + 1e-9 * MOVED
    assert made({"rest": "least contact"}, displacement=moved).metadata["rest"] == "frame 2"
    places = {"displacement": "p", "position": "p", "rest": "least contact"}
    log = made(places, displacement=None, position=None, p=PLACE + moved)
    assert log.metadata["rest"] == "frame 2"
    np.testing.assert_allclose(log.position, (PLACE + moved)[2])
    np.testing.assert_allclose(log.displacement[0], moved[0] - moved[2], atol=1e-15)


def test_places_count_from_the_first_frame_and_an_element_lost_there_from_its_median() -> None:
    observed = np.ones((FRAMES, 3, 3), bool)
    observed[0, 1, 2] = False
    log = made(
        {"displacement": "p", "position": "p"}, displacement=None, position=None, p=PLACE + MOVED, observed=observed
    )
    expected = (PLACE + MOVED)[0]
    expected[1, 2] = np.median((PLACE + MOVED)[1:, 1, 2], axis=0)
    np.testing.assert_allclose(log.position, expected)
    assert log.observed is not None
    assert not log.observed[:, 1, 2].any()  # of which nothing is known from rest
    assert not log.displacement[:, 1, 2].any()
    assert log.observed[:, 0, 0].all()
    observed[:, 1, 2] = False
    with pytest.raises(
        InvalidInput, match=r"position is of element \[1, 2\] observed in no frame; allowed: a place of"
    ):
        made(
            {"displacement": "p", "position": "p"}, displacement=None, position=None, p=PLACE + MOVED, observed=observed
        )


def test_a_frame_in_which_nothing_is_seen_is_not_at_rest() -> None:
    observed = np.ones((FRAMES, 3, 3), bool)
    observed[1] = False
    with pytest.raises(InvalidInput, match="rest is frame 1, with no element observed; allowed: a frame in which some"):
        made({"rest": "1"}, observed=observed)
    load = FORCE * np.array([3.0, 0.0, 1.0, 2.0])[:, None, None, None]
    assert made({"rest": "least contact"}, observed=observed, force=load).metadata["rest"] == "frame 2"


@pytest.mark.parametrize("shape", [(), (0,), (4,), (4, 0)])
def test_displacement_of_too_few_axes_has_no_rest(shape: tuple[int, ...]) -> None:
    given = parse(json.dumps({"rest": "first"}))
    with pytest.raises(InvalidInput, match=r"displacement is of shape .*; allowed: frames, elements and components"):
        module._from_rest({"displacement": np.zeros(shape)}, given, {})


def test_forces_alone_are_a_log_without_displacement() -> None:
    log = made(displacement=None, force=FORCE)
    assert not log.has_displacement
    assert log.metadata["displacement"] == "none"
    for pressed in (FORCE[..., 2], FORCE[..., 2].reshape(FRAMES, 9)):
        with pytest.raises(InvalidInput, match=r"force is one component an element \(shape"):
            made({"force": "f", "grid": [3, 3]}, displacement=None, f=pressed)


def test_whole_moments_count_from_the_first_and_keep_their_digits() -> None:
    began = 1_700_000_000_000_000_001
    log = made({"time": {"field": "t", "unit": "ns"}}, time=None, t=began + 20_000_000 * np.arange(4))
    np.testing.assert_allclose(log.time, 0.02 * np.arange(4), rtol=1e-15)
    assert log.metadata["start_time"] == f"{began} / 1000000000 s"
    moments = np.datetime64("2026-01-01T00:00:00", "ms") + 20 * np.arange(4)
    assert made(time=moments).time[-1] == pytest.approx(0.06)
    for whole, unit in ((np.arange(4), "s"), (np.arange(0, 4000, 1000), "ms")):
        log = made({"time": {"field": "t", "unit": unit}}, time=None, t=whole)
        np.testing.assert_allclose(log.time, np.arange(4.0))
        assert "start_time" not in log.metadata
    for wrong in (np.zeros((4, 1)), np.zeros(0), np.array(["a"] * 4)):
        with pytest.raises(InvalidInput, match="allowed: one number a frame"):
            made(time=wrong)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ([1, True], "not an array .of numbers and truth values"),
        ([[1.0], [1.0, 2.0]], "not an array"),
        ([1, "a", {}], "not an array"),
    ],
)
def test_a_value_is_an_array_of_one_kind(value: Any, told: str) -> None:
    with pytest.raises(InvalidInput, match=f"x is {told}"):
        as_array("x", value)
    np.testing.assert_array_equal(as_array("x", [1, None]), [1.0, np.nan])
    assert as_array("x", {"a": 1}).item() == '{"a": 1}'
    assert as_array("x", [[True]]).dtype == np.bool_


def test_masks_are_truth_values_or_0_and_1() -> None:
    mask = RNG.random((FRAMES, 3, 3)) > 0.5
    for told in (mask, mask.astype(int)):
        np.testing.assert_array_equal(made(contact=told).contact, mask)
    for wrong in (mask.astype(float), 2 * mask.astype(int)):
        with pytest.raises(
            InvalidInput, match=r"contact is of dtype .*; allowed: truth values, or whole numbers 0 and 1"
        ):
            made(contact=wrong)


def test_the_sensor_alone_may_be_at_rest_if_it_is_of_the_same_lattice() -> None:
    alone = rest.SensorAlone.of(made(displacement=np.broadcast_to(MOVED[1], MOVED.shape)), "rest.npz")
    given = parse(json.dumps({"pitch": 0.001})).over(default_origins()).at_rest(alone)
    log = assemble(Fields({"time": np.arange(4.0), "displacement": MOVED}), given)
    np.testing.assert_allclose(log.displacement, MOVED - MOVED[1], atol=1e-18)
    assert log.metadata["rest"] == "rest.npz"
    with pytest.raises(InvalidInput, match=r"rest is a file of \(3, 3\) elements; allowed: \(2, 3\), as the log"):
        assemble(Fields({"time": np.arange(4.0), "displacement": MOVED[:, :2]}), given)


def test_maps_of_height_are_divided_into_elements_whatever_their_sides() -> None:
    """Of 6 × 4 pixels of 1 mm, of which those of the last element rise by 10 µm from frame to frame."""
    height = np.zeros((FRAMES, 6, 4))
    height[:, 4:, 2:] = 1e-5 * np.arange(FRAMES)[:, None, None]
    log = made({"height": "height", "pixel": 1e-3, "grid": [3, 2]}, displacement=None, position=None, height=height)
    assert (log.grid, log.element_area) == ((3, 2), pytest.approx(4e-6))
    np.testing.assert_allclose(log.displacement[:, 2, 1, 2], 1e-5 * np.arange(FRAMES), rtol=1e-9)
    assert not log.displacement[:, :2].any()
    assert not log.displacement[..., :2].any()
    assert log.metadata["rest"] == "frame 0"
    for grid, told in (([7, 2], r"grid is \[7, 2\]; allowed: at most \[6, 4\]"), ([6, 5], r"grid is \[6, 5\]")):
        with pytest.raises(InvalidInput, match=told):
            made({"height": "height", "pixel": 1e-3, "grid": grid}, displacement=None, position=None, height=height)
    assert made(
        {"height": "height", "pixel": 1e-3, "grid": [6, 4]}, displacement=None, position=None, height=height
    ).grid == (6, 4)


@pytest.mark.parametrize(
    ("mapping", "told"),
    [
        ({"grid": [3, 2]}, "height is without pixel; allowed: pixel in the mapping, in m"),
        ({"grid": [3, 2], "pixel": 1e-3, "pitch": 1e-3}, "height is with a pitch; allowed: pixel in the mapping"),
        ({"pixel": 1e-3}, "grid is not there; allowed: the number of elements into which height is divided"),
    ],
)
def test_a_map_of_height_needs_the_size_of_its_pixels_and_a_grid(mapping: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        made(mapping | {"height": "height"}, displacement=None, position=None, height=np.zeros((FRAMES, 6, 4)))
