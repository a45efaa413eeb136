"""The frame at rest beside mappings of a file's own, presets, and what cannot be."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service import formats
from slipcore import InvalidInput
from tests.service.formats.test_presets import recorder, written

MOVED = 1e-4 * np.random.default_rng(1).random((3, 2, 2, 3))
PLACES = np.stack(np.meshgrid([0.0, 1e-3], [0.0, 1e-3], [0.0], indexing="ij"), -1)[:, :, 0]
LOG = {"time": [0.0, 0.03, 0.06], "displacement": MOVED.tolist(), "position": PLACES.tolist(), "element_area": 1e-6}


def log_of(folder: Path, **members: Any) -> Path:
    path = folder / "log.json"
    path.write_text(json.dumps(LOG | members), encoding="utf-8")
    return path


def test_rest_leaves_a_files_own_mapping(tmp_path: Path) -> None:
    own = {"force": {"field": "force", "unit": ["mN", "mN", "-mN"]}}
    path = log_of(tmp_path, force=(1e3 * MOVED).tolist(), mapping=own)
    plain, rested = formats.read(path), formats.read(path, rest="1")
    assert plain.force is not None
    assert rested.force is not None
    np.testing.assert_array_equal(rested.force, plain.force)
    np.testing.assert_allclose(plain.force, MOVED * [1.0, 1.0, -1.0], rtol=1e-12, atol=0)
    np.testing.assert_array_equal(rested.displacement[1], 0.0)


def test_each_alternative_of_a_preset_has_the_frame_at_rest(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", recorder(0))
    np.testing.assert_array_equal(formats.read(path, mapping="papillarray", rest="3").displacement[3], 0.0)
    with pytest.raises(InvalidInput, match=r"rest is frame 99 of 5; allowed: 0 to 4"):
        formats.read(path, mapping="papillarray", rest="99")


def test_rest_in_a_folder_of_a_format_of_files_is_refused_by_name(tmp_path: Path) -> None:
    tracked = tmp_path / "tracked.csv"
    tracked.write_text("time,marker,x,y\n0,1,0,0\n1,1,0,0\n", encoding="utf-8")
    for path in (log_of(tmp_path), tracked):
        with pytest.raises(InvalidInput, match=r"rest is the folder .*; allowed: a file"):
            formats.read(path, rest=tmp_path)


def test_one_gripper_force_of_all_frames_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="gripper_force is of shape"):
        formats.read(log_of(tmp_path), mapping=json.dumps({"gripper_force": {"value": 1.0}}), rest="least contact")


@pytest.mark.parametrize(
    ("members", "rest", "said"),
    [
        ({"contact": [[[True] * 2] * 2] * 5 + [[[False] * 2] * 2]}, "least contact", "least contact, of 6 frames"),
        ({"displacement": np.zeros((3, 2, 2, 0)).tolist()}, "first", "displacement is of shape"),
    ],
    ids=["contact of other frames", "no components"],
)
def test_rest_of_what_cannot_be_is_refused_by_name(
    tmp_path: Path, members: dict[str, Any], rest: str, said: str
) -> None:
    with pytest.raises(InvalidInput, match=said):
        formats.read(log_of(tmp_path, **members), rest=rest)


def test_a_mapping_that_speaks_of_presets_is_none(tmp_path: Path) -> None:
    """It had dropped a contact that is not there, and failed by a KeyError."""
    path = tmp_path / "log.csv"
    path.write_text("t,dx,dy\n0,0,0\n1,0,0\n", encoding="utf-8")
    given = {"time": "t", "displacement": ["dx", "dy"], "sensor": {"value": "preset 1"}, "grid": [1, 1], "pitch": 1e-3}
    with pytest.raises(InvalidInput, match="contact"):
        formats.read(path, mapping=json.dumps(given | {"contact": "touching"}))
    with pytest.raises(InvalidInput, match="missing"):
        formats.read(path, mapping=json.dumps(given | {"displacement": ["dx", "missing"]}))


OBSERVED = np.ones((3, 2, 2), bool)
OBSERVED[0, 0, 1] = False
"""One element is not observed in the first frame."""


@pytest.mark.parametrize("rest", ["first", "file"])
def test_what_is_not_observed_at_rest_has_no_displacement(tmp_path: Path, rest: str) -> None:
    """The placeholder was taken for its place at rest, and its offset for displacement ever after."""
    moved = np.where(OBSERVED[..., None], MOVED, 0.0)
    path = log_of(tmp_path, displacement=moved.tolist(), observed=OBSERVED.tolist())
    (tmp_path / "alone").mkdir()
    first = {"displacement": moved[[0, 0]].tolist(), "observed": OBSERVED[[0, 0]].tolist(), "time": [0.0, 0.03]}
    alone = log_of(tmp_path / "alone", **first)
    rested = formats.read(path, rest=alone if rest == "file" else rest)
    assert rested.observed is not None
    np.testing.assert_array_equal(rested.observed, OBSERVED.all(axis=0) & OBSERVED)
    np.testing.assert_allclose(rested.displacement[:, 1], MOVED[:, 1] - MOVED[0, 1], rtol=1e-12, atol=0)


def test_lost_frames_of_the_sensor_alone_do_not_shift_its_rest(tmp_path: Path) -> None:
    offset, observed = np.full((5, 2, 2, 3), 2e-4), np.ones((5, 2, 2), bool)
    observed[:3, 1, 1], offset[:3, 1, 1] = False, 0.0
    (tmp_path / "alone").mkdir()
    times = (0.03 * np.arange(5)).tolist()
    alone = log_of(tmp_path / "alone", displacement=offset.tolist(), observed=observed.tolist(), time=times)
    rested = formats.read(log_of(tmp_path), rest=alone)
    np.testing.assert_allclose(rested.displacement, MOVED - 2e-4, rtol=0, atol=1e-18)
    assert rested.observed is None


@pytest.mark.parametrize("with_force", [False, True])
def test_one_frame_of_the_sensor_alone_is_its_rest(tmp_path: Path, with_force: bool) -> None:
    """It had been refused: a log has two at least."""
    (tmp_path / "alone").mkdir()
    told = {"displacement": np.full((1, 2, 2, 3), 2e-4).tolist(), "time": [0.0]}
    forces = {"force": np.zeros((1, 2, 2, 3)).tolist(), "gripper_force": [0.1]} if with_force else {}
    rested = formats.read(log_of(tmp_path), rest=log_of(tmp_path / "alone", **told, **forces))
    np.testing.assert_allclose(rested.displacement, MOVED - 2e-4, rtol=0, atol=1e-18)
    with pytest.raises(InvalidInput, match=r"time is 1 frame\(s\); allowed: at least 2 frames"):
        formats.read(log_of(tmp_path, **told))


@pytest.mark.parametrize("mapped", [False, True], ids=["tracked", "mapped"])
def test_one_frame_of_the_markers_alone_is_their_rest(tmp_path: Path, mapped: bool) -> None:
    """In every format alike."""
    log, alone = tmp_path / "log.csv", tmp_path / "alone.csv"
    place = [(1e-3 * (k % 4), 1e-3 * (k // 4)) for k in range(16)]
    for path, frames, moved in ((log, 3, 1e-4), (alone, 1, 0.0)):
        rows = [f"{t},{k},{x + moved},{y}\n" for t in range(frames) for k, (x, y) in enumerate(place)]
        path.write_text("time,marker,x,y\n" + "".join(rows), encoding="utf-8")
    places = {"time": "time", "element": "marker", "grid": [4, 4], "position": ["x", "y"], "displacement": ["x", "y"]}
    settings = {"mapping": json.dumps(places)} if mapped else {"scale": 1.0}
    found = formats.read(log, rest=alone, **settings)
    np.testing.assert_allclose(found.displacement, np.full((3, 4, 4, 3), [1e-4, 0.0, 0.0]), rtol=0, atol=1e-12)


def test_places_of_what_is_not_observed_at_rest_are_its_usual_ones(tmp_path: Path) -> None:
    places = np.where(OBSERVED[..., None], PLACES + MOVED, 0.0)
    mapping = json.dumps({"position": "displacement", "displacement": "displacement", "rest": "first"})
    path = log_of(tmp_path, displacement=places.tolist(), observed=OBSERVED.tolist())
    np.testing.assert_allclose(formats.read(path, mapping=mapping).position, PLACES, rtol=0, atol=1e-4)
    never = np.where(np.arange(4).reshape(2, 2) == 3, False, OBSERVED)
    with pytest.raises(InvalidInput, match=r"position is of element \[1, 1\] observed in no frame"):
        formats.read(log_of(tmp_path, displacement=places.tolist(), observed=never.tolist()), mapping=mapping)


@pytest.mark.parametrize("own", [False, True], ids=["given", "the log's own"])
def test_a_file_at_rest_goes_before_a_frame_of_the_mapping(tmp_path: Path, own: bool) -> None:
    """The mapping's frame had been taken, and the file had been named as what was."""
    (tmp_path / "alone").mkdir()
    mapping = {"displacement": "displacement", "rest": "first"}
    within = {"mapping": mapping} if own else {}
    alone = log_of(tmp_path / "alone", displacement=np.full(MOVED.shape, 3e-4).tolist(), **within)
    log = formats.read(log_of(tmp_path, **within), rest=alone, mapping=None if own else json.dumps(mapping))
    np.testing.assert_allclose(log.displacement, MOVED - 3e-4, rtol=0, atol=1e-18)
    assert log.metadata["rest"] == "log.json"


def test_places_count_from_those_of_a_file_at_rest(tmp_path: Path) -> None:
    """They had been refused as displacements of centimetres, or the log's own first places had been taken."""
    (tmp_path / "alone").mkdir()
    mapping = json.dumps({"position": "displacement", "displacement": "displacement"})
    places = PLACES + np.array([0.05, 0.0, 0.0])
    alone = log_of(tmp_path / "alone", displacement=np.stack([places] * 3).tolist())
    log = formats.read(log_of(tmp_path, displacement=(places + MOVED).tolist()), rest=alone, mapping=mapping)
    np.testing.assert_array_equal(log.position, places)
    np.testing.assert_allclose(log.displacement, MOVED, rtol=0, atol=1e-16)
    (tmp_path / "other").mkdir()
    small = {"displacement": np.stack([PLACES[:1]] * 2).tolist(), "time": [0.0, 1.0]}
    with pytest.raises(InvalidInput, match=r"rest is a file of \(1, 2\) elements; allowed: \(2, 2\), as the log"):
        formats.read(tmp_path / "log.json", rest=log_of(tmp_path / "other", **small), mapping=mapping)


def test_places_count_from_the_first_frame_unless_another_is_named(tmp_path: Path) -> None:
    """Without `rest` the places had been taken for displacement."""
    mapping = json.dumps({"position": "displacement", "displacement": "displacement"})
    log = formats.read(log_of(tmp_path, displacement=(PLACES - 5e-4 + MOVED).tolist()), mapping=mapping)
    np.testing.assert_allclose(log.displacement, MOVED - MOVED[0], rtol=0, atol=1e-16)
    np.testing.assert_array_equal(log.position, PLACES - 5e-4 + MOVED[0])
    assert log.metadata["rest"] == "frame 0"


def test_a_frame_in_which_nothing_is_observed_is_not_at_rest(tmp_path: Path) -> None:
    observed, contact = np.ones((3, 2, 2), bool), np.ones((3, 2, 2), bool)
    observed[1] = contact[1] = contact[2, 0] = False
    path = log_of(tmp_path, observed=observed.tolist(), contact=contact.tolist())
    assert formats.read(path, rest="least contact").metadata["rest"] == "frame 2"
    with pytest.raises(InvalidInput, match="rest is frame 1, with no element observed; allowed: a frame in which some"):
        formats.read(path, rest="1")
