"""What is read of a benchmark's files, and what is refused with which words."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.slip_benchmark import folder as files
from service.slip_benchmark.folder import Manifest, SceneEntry
from service.slip_benchmark.scenes import FORMAT, VERSION
from slipcore.errors import InvalidInput

ENTRY = SceneEntry("0001", "lattice 20x20", "no noise", 0.0, 0.0, 90, (20, 10), "a", "b")
MANIFEST = Manifest("5ea1", ("lattice 20x20",), "MIT", "stiction 9", (ENTRY,))
SHAPE = (4, 1, 2)


def test_a_manifest_is_read_as_it_was_written(tmp_path: Path) -> None:
    files.write_manifest(tmp_path, MANIFEST)
    assert files.read_manifest(tmp_path) == MANIFEST
    assert files.read_manifest(tmp_path).scenes[0].elements == (20, 10)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"version": VERSION + 1}, f"needed: {FORMAT} of version {VERSION}"),
        ({"format": "another"}, f"needed: {FORMAT}"),
        ({"kinds": None}, "not iterable"),
        ({"scenes": [{**asdict(ENTRY), "name": "../1"}]}, "a scene called '../1'"),
        ({"scenes": [{**asdict(ENTRY), "elements": [3]}]}, "not enough values"),
        ({"more": 1}, "unexpected keyword argument 'more'"),
    ],
)
def test_a_manifest_of_something_else_is_refused_with_the_reason(
    tmp_path: Path, changes: dict[str, Any], why: str
) -> None:
    record = {"format": FORMAT, "version": VERSION, **asdict(MANIFEST)}
    files.write_json(tmp_path / files.MANIFEST, record | changes)
    with pytest.raises(InvalidInput, match="damaged or of something else") as refusal:
        files.read_manifest(tmp_path)
    assert why in str(refusal.value)
    assert f"allowed: a manifest of version {VERSION}, as `stiction benchmark make` writes it" in str(refusal.value)


def test_a_folder_is_whole_with_both_files_of_each_scene(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"benchmark is .*, without manifest\.json; allowed: a folder that"):
        files.read_whole_benchmark(tmp_path)
    files.write_manifest(tmp_path, replace(MANIFEST, scenes=()))
    with pytest.raises(InvalidInput, match="is not made whole; allowed: all of them: run `stiction benchmark make`"):
        files.read_whole_benchmark(tmp_path)
    scenes = tuple(replace(ENTRY, name=f"{k:04d}") for k in range(5))
    files.write_manifest(tmp_path, replace(MANIFEST, scenes=scenes))
    for name in ("0000", "0001"):
        for path in (files.input_path(tmp_path, name), files.truth_path(tmp_path, name)):
            path.parent.mkdir(exist_ok=True)
            path.touch()
    files.truth_path(tmp_path, "0001").unlink()
    with pytest.raises(InvalidInput, match=r"is without 4 of 5 scenes \(0001, 0002, 0003\); allowed"):
        files.read_whole_benchmark(tmp_path)
    files.write_manifest(tmp_path, replace(MANIFEST, scenes=scenes[:1]))
    assert files.read_whole_benchmark(tmp_path).scenes == scenes[:1]


def test_files_that_were_changed_are_named(tmp_path: Path) -> None:
    for path, content in ((files.input_path(tmp_path, "1"), b"in"), (files.truth_path(tmp_path, "1"), b"true")):
        path.parent.mkdir()
        path.write_bytes(content)
    known = replace(
        ENTRY, name="1", input_sha256=files.sha256(files.input_path(tmp_path, "1")),
        truth_sha256=files.sha256(files.truth_path(tmp_path, "1")),
    )  # fmt: skip
    files.check_unchanged(tmp_path, known)
    for changed, named in (
        (replace(known, truth_sha256="0"), "truth/1.npz"),
        (replace(known, input_sha256="0"), "inputs/1.npz"),
    ):
        with pytest.raises(InvalidInput, match=f"{named} is not the file of the manifest; allowed: files as they were"):
            files.check_unchanged(tmp_path, changed)


def said(tmp_path: Path, **arrays: Any) -> files.Prediction:
    files.write_arrays(tmp_path / "said.npz", {name: np.asarray(array) for name, array in arrays.items()})
    return files.read_prediction(tmp_path / "said.npz", SHAPE)


SLIP = np.zeros(SHAPE, bool)


def test_a_prediction_is_read_with_what_it_says_and_no_more(tmp_path: Path) -> None:
    whole = said(
        tmp_path, slip=SLIP, probability=np.full(SHAPE, 0.5), macro_slip=[True, False, True, False], friction=0.5,
        force=np.ones((*SHAPE, 3), np.float32),
    )  # fmt: skip
    assert whole.macro_slip is not None
    assert whole.macro_slip.tolist() == [True, False, True, False]
    assert whole.friction == 0.5
    assert whole.force is not None
    assert whole.force.dtype == np.float64
    assert said(tmp_path, slip=SLIP).friction is None
    assert said(tmp_path, slip=SLIP, friction=1).friction == 1.0


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"probability": np.zeros(SHAPE)}, "members is without slip; allowed: slip; optional probability, macro_slip"),
        ({"slip": SLIP, "slop": SLIP, "a": SLIP}, "members is with the unknown a, slop; allowed: slip; optional"),
        ({"slip": SLIP.astype(int)}, r"slip is int64 of shape \[4, 1, 2\]; allowed: bool of shape \[4, 1, 2\]"),
        ({"slip": SLIP, "macro_slip": SLIP}, r"macro_slip is bool of shape \[4, 1, 2\]; allowed: bool of shape \[4\]"),
        ({"slip": SLIP, "friction": [0.5]}, r"friction is float64 of shape \[1\]; allowed: real numbers of shape \[\]"),
        ({"slip": SLIP, "friction": True}, r"friction is bool of shape \[\]; allowed: real numbers"),
        ({"slip": SLIP, "friction": np.nan}, "friction is not finite somewhere; allowed: finite numbers; leave out"),
        ({"slip": SLIP, "probability": np.full(SHAPE, 1.01)}, "probability is 1.01 to 1.01; allowed: 0 to 1"),
        ({"slip": SLIP, "probability": np.full(SHAPE, -0.5)}, "probability is -0.5 to -0.5; allowed: 0 to 1"),
    ],
)
def test_a_prediction_is_refused_by_the_member_that_is_wrong(tmp_path: Path, arrays: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        said(tmp_path, **arrays)


def test_methods_are_the_folders_of_results_in_order(tmp_path: Path) -> None:
    assert files.methods_of(tmp_path) == []
    for name in ("b", "a", ".hidden"):
        (tmp_path / files.RESULTS / name).mkdir(parents=True)
    (tmp_path / files.RESULTS / "file").touch()
    assert files.methods_of(tmp_path) == ["a", "b"]


def test_json_of_a_benchmark_holds_no_nan(tmp_path: Path) -> None:
    files.write_json(tmp_path / "a.json", {"β": 1.5})
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"β": 1.5}
    with pytest.raises(ValueError, match="not JSON compliant"):
        files.write_json(tmp_path / "a.json", {"b": float("nan")})
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"β": 1.5}
