"""Maps of height: what elements under them move by, and what is not seen."""

import json
import tracemalloc
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from service import formats
from service.formats.height_maps import Elements, rise
from service.formats.reading import WORKING_FACTOR
from slipcore import InvalidInput, detect_slip
from slipcore.frames import FloatArray

PIXEL = 0.1e-3
PIXELS = (60, 80)
GRID = (6, 8)
"""Elements of 10 × 10 pixels, 1 mm wide."""
Y, X = np.meshgrid(*(PIXEL * (np.arange(n) - 0.5 * (n - 1)) for n in PIXELS), indexing="ij")


def plane(rise_x: float, rise_y: float, rise_0: float = 0.0) -> FloatArray:
    return rise_0 + rise_x * X + rise_y * Y


CURVED = 0.5e-3 * np.exp(-(X**2 + Y**2) / (3e-3) ** 2)
"""The surface at rest."""


def file_of(folder: Path, height: Any, mapping: dict[str, Any], **others: Any) -> Path:
    path = folder / "log.h5"
    with h5py.File(path, "w") as file:
        file["time"] = 0.03 * np.arange(len(height))
        file["depth"] = height
        for name, value in others.items():
            file[name] = value
        file.attrs["stiction_mapping"] = json.dumps({"pixel": PIXEL, "height": "depth", "grid": list(GRID), **mapping})
    return path


def test_a_plane_rises_by_its_value_at_each_centre(tmp_path: Path) -> None:
    """The mean of a linear function is its value at the centre; x runs along columns, y along rows."""
    log = formats.read(file_of(tmp_path, CURVED + np.stack([plane(0.0, 0.0), plane(2e-3, -1e-3, -3e-5)]), {}))
    x, y = np.moveaxis(log.position[..., :2], -1, 0)
    assert log.element_area == pytest.approx(1e-6)
    np.testing.assert_allclose(np.diff(x, axis=1), 1e-3, rtol=1e-9)
    np.testing.assert_allclose(np.diff(y, axis=0), 1e-3, rtol=1e-9)
    np.testing.assert_allclose(log.displacement[1, ..., 2], -3e-5 + 2e-3 * x - 1e-3 * y, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(log.displacement[0], 0.0)
    assert log.observed is not None
    assert log.observed.all()
    assert (log.metadata["displacement"], log.metadata["rest"]) == ("along the normal", "frame 0")


def test_depth_in_mm_has_a_unit_that_turns_it(tmp_path: Path) -> None:
    pressed = 1e3 * np.stack([CURVED, CURVED + 0.2e-3])
    log = formats.read(file_of(tmp_path, pressed, {"height": {"field": "depth", "unit": "-mm"}}))
    np.testing.assert_allclose(log.displacement[1, ..., 2], -0.2e-3, rtol=1e-9)


def test_elements_between_pixels_weigh_them_by_area() -> None:
    """Of three pixels in two elements, the middle one counts half for each."""
    elements = Elements.dividing((1, 3), 1.0, (1, 2))
    np.testing.assert_allclose(elements.corners((1, 3), 1.0)[1], [[0.0, 1.5], [1.5, 3.0], [1.5, 3.0], [0.0, 1.5]])
    risen, seen = rise(np.array([[[0.0, 0.0, 0.0]], [[3e-3, 6e-3, np.nan]]]), 0, elements, 1.0)
    np.testing.assert_allclose(risen[1], [4e-3, 0.0])
    np.testing.assert_array_equal(seen[1], [True, False])


@pytest.mark.parametrize("side", [1e-4, 0.03], ids=["small", "of the map"])
def test_maps_take_no_more_memory_than_is_counted_with(tmp_path: Path, side: float) -> None:
    """They took 17 times their bytes, and 260 kB of them 2 GB where each of many elements covers the map."""
    at = np.stack(np.broadcast_arrays(1e-4 * np.arange(60), 1e-4 * np.arange(60)[:, None], 0.0), axis=-1)
    told: dict[str, Any] = {"height": {"field": "depth", "unit": "mm"}, "position": "at", "element_area": "area"}
    path = file_of(tmp_path, np.zeros((40, 240, 320), dtype="f4"), told | {"grid": [60, 60]}, at=at, area=side**2)
    formats.read(path)  # imports
    tracemalloc.start()
    formats.read(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most <= WORKING_FACTOR * 40 * 240 * 320 * 4


@pytest.mark.parametrize("pixel", [1e-320, 25.0, 1e300])
def test_a_pixel_in_another_unit_is_refused(tmp_path: Path, pixel: float) -> None:
    with pytest.raises(InvalidInput, match="is it in m"):
        formats.read(file_of(tmp_path, np.zeros((2, *PIXELS)), {"pixel": pixel}))


@pytest.mark.parametrize("place", [(0, 0), (30, 40)], ids=["of no element", "of an element"])
def test_a_number_that_stands_for_no_height_is_refused(tmp_path: Path, place: tuple[int, int]) -> None:
    """In sums over the map nothing else was left beside it: all displacement was 0."""
    height = FRAMES.astype("f4")
    height[(1, *place)] = np.finfo("f4").max
    with pytest.raises(InvalidInput, match=r"height is 3.4.*e\+38 m \(is it in m\?\) .* NaN where nothing is seen"):
        formats.read(file_of(tmp_path, height, {**PLACES, "element_area": {"value": 1e-7}}, markers=markers()))


@pytest.mark.parametrize("pixels", [20, 40, 67, 80])
def test_markers_on_the_edge_of_a_map_are_observed_alike(pixels: int) -> None:
    """Half of each square is seen, but for rounding by which some were not."""
    middle, side = 2e-3 / pixels * (0.5 * pixels), 5e-4
    at = np.linspace(-middle, middle, 5)
    position = np.zeros((5, 5, 3))
    position[..., 0], position[..., 1] = np.meshgrid(at, at)
    for wide in (side, 0.6 * side, 0.998 * side):
        _, seen = rise(np.zeros((1, pixels, pixels)), 0, Elements(position, (wide, wide)), 2e-3 / pixels)
        corners = np.zeros((5, 5), dtype=bool)
        corners[::4, ::4] = True
        np.testing.assert_array_equal(seen.reshape(5, 5), ~corners)


def test_what_is_infinite_in_all_frames_is_not_seen() -> None:
    height = np.full((2, 4, 4), 1e-3)
    height[:, 0, 0] = np.inf
    _, seen = rise(height, 0, Elements.dividing((4, 4), 1e-4, (4, 4)), 1e-4)
    assert seen.sum(axis=1).tolist() == [15, 15]


def test_missing_pixels_do_not_let_a_curved_rest_show(tmp_path: Path) -> None:
    height = CURVED - np.array([0.0, 1e-4, 1e-4])[:, None, None]
    height[1, :, 3:7] = np.nan  # under half of the elements' first column
    height[2, :4, 10:18] = np.nan
    height[0, 30:36, 40:] = np.nan  # over half at rest
    log = formats.read(file_of(tmp_path, height, {}))
    assert log.observed is not None
    assert not log.observed[:, 3, 4:].any()
    assert log.observed[1:, :3].all()
    seen = np.broadcast_to(log.observed[1:], log.displacement[1:, ..., 2].shape)
    np.testing.assert_allclose(log.displacement[1:, ..., 2][seen], -1e-4, rtol=1e-9)


@pytest.mark.parametrize(("rest", "frame"), [("2", 2), ("least contact", 1)])
def test_the_frame_at_rest_is_that_which_is_chosen(tmp_path: Path, rest: str, frame: int) -> None:
    """Of least contact is the frame in which the surface stands highest."""
    level = np.array([-1e-4, 0.0, -2e-4])
    height = CURVED + level[:, None, None]
    height[0, 0, 0] = np.nan  # which says nothing of where the surface is highest
    log = formats.read(file_of(tmp_path, height, {}), rest=rest)
    expected = (level - level[frame])[:, None, None] * np.ones(GRID)
    np.testing.assert_allclose(log.displacement[..., 2], expected, rtol=0, atol=1e-12)
    assert log.metadata["rest"] == f"frame {frame}"


def test_markers_beside_take_the_height_around_them(tmp_path: Path) -> None:
    """Their places are from the middle of the map, and they count from the same frame at rest."""
    x, y = np.meshgrid([-2e-3, 0.0, 2e-3], [-1e-3, 1e-3])
    at_rest = np.stack([x, y], axis=-1)
    place = np.stack([at_rest + 1e-4, at_rest])
    height = np.stack([plane(0.0, 3e-3, 1e-5), plane(0.0, 0.0)])
    fields = {name: {"field": ["x", "y"]} for name in ("displacement", "position")}
    path = file_of(tmp_path, height, {**fields, "grid": [2, 3], "rest": "1"}, x=place[..., 0], y=place[..., 1])
    log = formats.read(path)
    np.testing.assert_allclose(log.position[..., :2], at_rest, atol=1e-15)
    np.testing.assert_allclose(log.displacement[0, ..., :2], 1e-4, rtol=1e-9)
    np.testing.assert_allclose(log.displacement[0, ..., 2], 1e-5 + 3e-3 * y, rtol=0, atol=1e-12)
    assert "displacement" not in log.metadata
    assert log.contact is None  # z shows it


PLACES = {"position": "markers", "displacement": "markers"}
FRAMES = np.stack([CURVED, CURVED - 1e-4, CURVED - 1e-4])


def markers(offset_x: float = 0.0) -> FloatArray:
    """Places [3, 6, 8, 3] m of markers a millimetre apart about the middle of a map that stand still."""
    x, y = np.meshgrid(*(1e-3 * (np.arange(n) - 0.5 * (n - 1)) for n in (8, 6)))
    return np.stack([np.stack([x + offset_x, y, np.zeros_like(x)], axis=-1)] * 3)


def test_a_marker_lost_at_rest_costs_no_other(tmp_path: Path) -> None:
    """Its place, NaN there, had made every square's side NaN. It is where it was seen later, as without maps."""
    place, observed = markers(), np.ones((3, *GRID), dtype=bool)
    place[0, 1, 2], observed[0, 1, 2] = np.nan, False
    path = file_of(tmp_path, FRAMES, {**PLACES, "observed": "seen"}, markers=place, seen=observed)
    log = formats.read(path)
    observed[:, 1, 2] = False
    np.testing.assert_array_equal(log.observed, observed)
    np.testing.assert_allclose(log.displacement[1:, ..., 2][observed[1:]], -1e-4, rtol=1e-9)
    np.testing.assert_allclose(log.position, markers()[0], atol=1e-15)
    assert log.element_area == pytest.approx(1e-6)


def test_markers_beyond_the_map_are_not_observed_however_they_are_told(tmp_path: Path) -> None:
    place = markers(offset_x=0.6e-3)
    told = {"position": "at", "displacement": "moved"}
    logs = [
        formats.read(file_of(tmp_path, FRAMES, PLACES, markers=place)),
        formats.read(file_of(tmp_path, FRAMES, told, at=place[0], moved=np.zeros_like(place))),
    ]
    for log in logs:
        assert log.observed is not None
        assert log.observed[..., :7].all()
        assert not log.observed[..., 7].any()
    np.testing.assert_array_equal(logs[0].displacement, logs[1].displacement)


@pytest.mark.parametrize("shape", [(0, *GRID, 3), (3, *GRID, 1), (2, *GRID, 3), (3, *GRID, 2, 3)])
def test_places_of_another_shape_are_refused_by_name(tmp_path: Path, shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInput, match=r"(displacement|position) is of shape"):
        formats.read(file_of(tmp_path, FRAMES, PLACES, markers=np.resize(markers(), shape)))


def test_height_beside_force_without_markers_is_refused(tmp_path: Path) -> None:
    """Such a log would have said that it has no displacement."""
    path = file_of(tmp_path, FRAMES, {"force": "f"}, f=np.ones((3, *GRID, 3)))
    with pytest.raises(InvalidInput, match="height is beside force alone"):
        formats.read(path)
    path = file_of(tmp_path, FRAMES, {"force": "f", **PLACES}, f=np.ones((3, *GRID, 3)), markers=markers())
    assert formats.read(path).has_displacement


FAR_OFF = [[[0.1, 0.1, 0.0], [0.101, 0.1, 0.0]], [[0.1, 0.101, 0.0], [0.101, 0.101, 0.0]]]


@pytest.mark.parametrize(
    ("mapping", "said"),
    [
        ({"pixel": -1.0}, "pixel"),
        ({"pitch": 1e-3}, "height is with a pitch"),
        ({"pixels": [3, 3]}, r"height is of shape \[2, 60, 80\]; allowed: \[frames, 3, 3\]"),
        ({"displacement": "moved"}, "displacement is of shape"),
        ({"height": {"field": "depth", "unit": "N"}}, "unit of height"),
        ({"position": {"value": FAR_OFF}}, "none of an element"),
        ({"position": {"value": FAR_OFF}, "element_area": {"value": -1e-6}}, "element_area is -1e-06 m²"),
        ({"position": {"value": FAR_OFF}, "element_area": {"value": [1e-6, 1e-6]}}, r"element_area is of shape \[2\]"),
        ({"position": {"value": np.zeros((*GRID, 1)).tolist()}}, r"position is of shape \[6, 8, 1\]"),
        ({"grid": [6, 81]}, r"grid is \[6, 81\]; allowed: at most \[60, 80\]"),
        ({"grid": [3000, 3000]}, r"grid is \[3000, 3000\]"),
        ({"rest": "7"}, "frame 7 of 2"),
    ],
)
def test_what_cannot_be_is_refused_by_name(tmp_path: Path, mapping: dict[str, Any], said: str) -> None:
    path = file_of(tmp_path, np.stack([CURVED, CURVED]), {}, moved=np.ones((2, *GRID, 3)))
    with pytest.raises(InvalidInput, match=said):
        formats.read(path, mapping=json.dumps({"pixel": PIXEL, "height": "depth", "grid": list(GRID), **mapping}))


def test_a_map_without_its_scale_or_number_of_elements_is_refused(tmp_path: Path) -> None:
    path = file_of(tmp_path, np.stack([CURVED, CURVED]), {})
    for name, said in (("pixel", "without pixel"), ("grid", "grid is not there")):
        mapping = {"pixel": PIXEL, "height": "depth", "grid": list(GRID)}
        del mapping[name]
        with pytest.raises(InvalidInput, match=said):
            formats.read(path, mapping=json.dumps(mapping))
    with pytest.raises(InvalidInput, match="of maps of height no file"):
        formats.read(path, rest=path)


def test_flat_maps_of_json_need_their_rows_and_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    height = np.stack([CURVED, CURVED - 1e-4]).reshape(2, -1)
    path.write_text(json.dumps({"time": [0.0, 0.03], "depth": height.tolist()}), encoding="utf-8")
    mapping = {"pixel": PIXEL, "height": "depth", "grid": list(GRID)}
    with pytest.raises(InvalidInput, match="`pixels` in the mapping"):
        formats.read(path, mapping=json.dumps(mapping))
    log = formats.read(path, mapping=json.dumps(mapping | {"pixels": list(PIXELS)}))
    np.testing.assert_allclose(log.displacement[1, ..., 2], -1e-4, rtol=1e-9)


def test_slip_is_not_looked_for_in_height_alone(tmp_path: Path) -> None:
    """Nothing would seem to slip."""
    log = formats.read(file_of(tmp_path, np.stack([CURVED, CURVED]), {}))
    allowed = (
        r"allowed: x and y of it, .* but forces along the normal, .*: slipcore.forces.reconstruct \(docs/forces.md#"
    )
    with pytest.raises(InvalidInput, match=f"displacement is along the normal; {allowed}from-depth-alone"):
        detect_slip(log)
    assert "\n## From depth alone\n" in (Path(__file__).parents[3] / "docs/forces.md").read_text(encoding="utf-8")
