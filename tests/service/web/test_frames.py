import json
import math
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipcore
from service.domain.models import stored_results
from service.formats.lattice import lattice_axes
from service.web import frames
from slipcore import GraspLog, SlipHistory


@pytest.fixture(scope="module")
def history(ramp: GraspLog) -> SlipHistory:
    return slipcore.detect_slip(ramp)


@pytest.fixture
def stored(history: SlipHistory, tmp_path: Path) -> stored_results.StoredHistory:
    path = tmp_path / "history"
    path.write_bytes(stored_results.encode_history(history))
    return stored_results.decode_history(path)


def unpacked(content: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and arrays, as the player reads them."""
    (length,) = struct.unpack_from("<I", content)
    header = json.loads(content[4 : 4 + length])
    types = {"Float32Array": "<f4", "Uint8Array": "u1", "Int8Array": "i1"}
    assert (4 + length) % 4 == 0
    arrays = {
        each["name"]: np.frombuffer(content, types[each["type"]], each["length"], 4 + length + each["offset"])
        for each in header["arrays"]
    }
    assert all(each["offset"] % 4 == 0 for each in header["arrays"])
    return header, arrays


def test_the_player_gets_what_was_found_and_recorded(ramp: GraspLog, history: SlipHistory, stored: Any) -> None:
    header, arrays = unpacked(frames.pack(stored, ramp))
    assert (header["rows"], header["columns"], header["step"], header["frames"]) == (14, 14, 1, len(ramp))
    state = arrays["state"].reshape(history.contact.shape)
    np.testing.assert_array_equal(state > 0, history.contact)
    np.testing.assert_array_equal(state == 2, history.slip & history.contact)
    np.testing.assert_allclose(arrays["time"], ramp.time, rtol=1e-6)
    assert ramp.force is not None
    np.testing.assert_allclose(arrays["normal_force"], np.abs(ramp.force[..., 2].sum(axis=(1, 2))), rtol=1e-5)
    assert len(arrays["onset"]) == len(history.events.onset)


def test_arrows_run_along_columns_and_rows_of_any_lattice(ramp: GraspLog, stored: Any) -> None:
    """The same log on a lattice whose columns run against y shows the same arrows in its own directions."""
    turned = replace(
        ramp, position=np.stack([ramp.position[..., 1], -ramp.position[..., 0], ramp.position[..., 2]], -1)
    )
    axes, turned_axes = lattice_axes(ramp.position), lattice_axes(turned.position)
    for found in (axes, turned_axes):
        np.testing.assert_allclose(found.T @ found, np.eye(2), atol=1e-9)
    rotation = np.array([[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(turned_axes, rotation @ axes, atol=1e-9)
    header, arrays = unpacked(frames.pack(stored, ramp))
    assert ramp.displacement is not None
    shown = arrays["displacement"].reshape(*ramp.displacement.shape[:3], 2) * header["displacement"] / 127
    np.testing.assert_allclose(shown, ramp.displacement[..., :2] @ axes, atol=header["displacement"] / 127)


def test_of_forces_alone_no_displacement_is_shown(ramp: GraspLog, stored: Any) -> None:
    header, arrays = unpacked(frames.pack(stored, replace(ramp, displacement=None, truth=None)))
    assert "displacement" not in header.keys() | arrays.keys()
    assert header["force"] > 0.0


@pytest.mark.parametrize("step", [1, 3])
def test_patches_stand_where_their_pressure_is(
    ramp: GraspLog, stored: Any, history: SlipHistory, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    monkeypatch.setattr(frames, "MOST_CELLS", -(-history.contact.size // step))
    pose = stored.patches.pose.copy()
    pose[:, 2] = np.linspace(0.0, 3.0, len(pose))  # as if the patch were not round
    header, arrays = unpacked(frames.pack(replace(stored, patches=replace(stored.patches, pose=pose)), ramp))
    (patch,) = history.patches
    shown = np.arange(patch.first, patch.first + len(patch.pose))
    shown = shown[shown % step == 0]
    assert header["step"] == step
    np.testing.assert_array_equal(arrays["patch_frame"] * step, shown)
    assert [header["regimes"][code] for code in arrays["patch_regime"]] == patch.regime[shown - patch.first].tolist()
    places = arrays["patch_place"].reshape(-1, 4)
    assert ramp.force is not None
    for frame, yaw, (column, row, *along) in zip(shown, pose[shown - patch.first, 2], places, strict=True):
        pressing = np.maximum(np.abs(ramp.force[frame, ..., 2]) * history.contact[frame], 0.0)
        rows, columns = np.indices(pressing.shape)
        centre = [(weights * pressing).sum() / pressing.sum() for weights in (columns, rows)]
        np.testing.assert_allclose([column, row], centre, atol=1.0)
        np.testing.assert_allclose(lattice_axes(ramp.position) @ along, [np.cos(yaw), np.sin(yaw)], atol=1e-6)


def test_a_long_log_is_thinned_out(
    ramp: GraspLog, stored: Any, history: SlipHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frames, "MOST_CELLS", history.contact.size // 3)
    header, arrays = unpacked(frames.pack(stored, ramp))
    assert header["step"] in {3, 4}
    elements = math.prod(ramp.grid)
    assert arrays["state"].size == len(arrays["time"]) * elements <= history.contact.size // 3 + elements


def test_without_the_upload_the_map_is_there_and_the_forces_are_not(stored: Any) -> None:
    header, arrays = unpacked(frames.pack(stored, None))
    assert {*arrays} == {"time", "stick_ratio", "onset", "state", "patch_frame", "patch_regime"}
    assert (header["rows"], header["columns"]) == (14, 14)


def test_without_a_map_the_curves_are_there(ramp: GraspLog, stored: Any) -> None:
    _, arrays = unpacked(frames.pack(replace(stored, contact=None, slip=None), ramp))
    assert "state" not in arrays
    assert {"stick_ratio", "force", "displacement"} <= {*arrays}
