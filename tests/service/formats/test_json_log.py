"""Logs in JSON, in one object or in frames."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.formats import json_log
from service.formats.mapping import parse
from slipcore import GraspLog, InvalidInput

PLACE = 1e-3 * np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
MOVED = np.random.default_rng(0).normal(0.0, 1e-5, (3, 3, 3, 3))
ONCE: dict[str, Any] = {"position": PLACE.tolist(), "element_area": 1e-6, "sensor": "left"}
TIMES = [0.0, 0.5, 1.0]


def read(folder: Path, document: Any, mapping: dict[str, Any] | None = None) -> GraspLog:
    path = folder / "log.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
    return json_log.read(path, None if mapping is None else parse(json.dumps(mapping)))


def frames(**members: list[Any]) -> list[dict[str, Any]]:
    return [dict(zip(members, values, strict=True)) for values in zip(*members.values(), strict=True)]


def test_an_object_of_members_is_a_log(tmp_path: Path) -> None:
    log = read(tmp_path, {**ONCE, "time": TIMES, "displacement": MOVED.tolist(), "metadata": {"a": "1"}})
    np.testing.assert_array_equal(log.displacement, MOVED)
    np.testing.assert_array_equal(log.time, TIMES)
    assert (log.sensor, log.element_area, log.metadata) == ("left", 1e-6, {"a": "1"})


def test_members_of_a_frame_stand_in_frames_or_in_the_object(tmp_path: Path) -> None:
    inside = frames(time=TIMES, displacement=MOVED.tolist())
    np.testing.assert_array_equal(read(tmp_path, {**ONCE, "frames": inside}).displacement, MOVED)
    mixed = read(tmp_path, {**ONCE, "time": TIMES, "frames": frames(displacement=MOVED.tolist())})
    np.testing.assert_array_equal(mixed.time, TIMES)
    np.testing.assert_array_equal(mixed.displacement, MOVED)


def test_a_member_stands_in_one_of_the_two(tmp_path: Path) -> None:
    inside = frames(time=TIMES, displacement=MOVED.tolist())
    with pytest.raises(InvalidInput, match="time is in the object and in its frames; allowed: in one of the two"):
        read(tmp_path, {**ONCE, "time": TIMES, "frames": inside})


@pytest.mark.parametrize("missing", [0, 1, 2])
def test_a_member_that_only_some_frames_have_is_refused_with_how_many(tmp_path: Path, missing: int) -> None:
    inside = frames(time=TIMES, displacement=MOVED.tolist(), force=MOVED.tolist())
    del inside[missing]["force"]
    with pytest.raises(InvalidInput, match="force is in 2 of 3 frames; allowed: in each of them, or in none"):
        read(tmp_path, {**ONCE, "frames": inside})


def test_a_file_s_own_mapping_is_taken_unless_another_is_given(tmp_path: Path) -> None:
    document = {**ONCE, "time": TIMES, "mm": (1e3 * MOVED).tolist(), "um": (1e6 * MOVED).tolist()}
    own = {"displacement": {"field": "mm", "unit": "mm"}}
    other = {"displacement": {"field": "um", "unit": "um"}}
    np.testing.assert_allclose(read(tmp_path, {**document, "mapping": own}).displacement, MOVED)
    given = read(tmp_path, {**document, "mapping": own}, other)
    np.testing.assert_allclose(given.displacement, MOVED)
    assert json.loads(given.metadata["mapping"]) == other
    with pytest.raises(InvalidInput, match="displacement is not there"):
        read(tmp_path, document)


def test_a_mapping_reaches_into_objects_and_frames(tmp_path: Path) -> None:
    inside = [{"at": {"s": time}, "skin": {"moved": moved}} for time, moved in zip(TIMES, MOVED.tolist(), strict=True)]
    mapping = {"time": "frames.at.s", "displacement": "frames.skin.moved"}
    log = read(tmp_path, {**ONCE, "frames": inside}, mapping)
    np.testing.assert_array_equal(log.time, TIMES)
    np.testing.assert_array_equal(log.displacement, MOVED)


def test_what_is_not_there_is_told_with_the_keys_that_are(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"displacement is not there; allowed: .*the file has the keys time, none"):
        read(tmp_path, {"time": TIMES, "none": None})
    with pytest.raises(InvalidInput) as refusal:
        read(tmp_path, {"time": TIMES, **{f"key {number}": 1 for number in range(100)}})
    assert len(refusal.value.allowed.partition("the file has ")[2]) == 300


@pytest.mark.parametrize(("document", "value"), [("[1]", "JSON of a list"), ("5", "JSON of a int"), ("{", "not JSON")])
def test_a_file_is_one_object(tmp_path: Path, document: str, value: str) -> None:
    with pytest.raises(InvalidInput, match=f"file is {value}.*; allowed: a JSON object"):
        read(tmp_path, document)


def test_a_file_has_so_many_bytes_at_most(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = json.dumps({**ONCE, "time": TIMES, "displacement": MOVED.tolist()})
    monkeypatch.setattr(json_log, "MAX_JSON_BYTES", len(document))
    assert len(read(tmp_path, document)) == 3
    monkeypatch.setattr(json_log, "MAX_JSON_BYTES", len(document) - 1)
    with pytest.raises(
        InvalidInput, match=rf"file is {len(document)} bytes of JSON; allowed: at most {len(document) - 1}"
    ):
        read(tmp_path, document)
