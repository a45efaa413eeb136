"""What every viewer is shown of a log: arrows to scale, resultants, and where patches are."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.exports import DetectedLog, scene
from slipcore import GraspLog

SHAPE = (3, 2, 2)


def recorded(force: bool = True, touching: bool = True) -> DetectedLog:
    """Elements of 4 mm²; in frame 1 one bears 3 N along x and 4 N along y, another 10 N but does not touch."""
    place = 2e-3 * np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0], indexing="ij"), axis=-1)[:, :, 0]
    vectors = np.zeros((*SHAPE, 3))
    vectors[1, 0, 0], vectors[1, 1, 1] = [3.0, 4.0, -7.0], [10.0, 0.0, -1.0]
    contact = np.zeros(SHAPE, bool)
    contact[1, 0, 0] = touching
    moved = 1e-6 * vectors
    log = GraspLog(np.arange(3.0), place, moved, 4e-6, force=vectors if force else None)
    history: Any = SimpleNamespace(contact=contact)
    return DetectedLog(log, history, "log")


def test_the_longest_force_of_what_touches_spans_two_cells() -> None:
    found = scene.arrows(recorded())
    assert (found.longest, found.what, found.unit) == (5.0, "tangential force", "N")
    assert found.end[1, 0, 0] - found.begin[1, 0, 0] == pytest.approx([2.4e-3, 3.2e-3, 0.0])
    assert np.linalg.norm(found.end[1, 0, 0] - found.begin[1, 0, 0]) == pytest.approx(2 * 2e-3)
    assert found.begin[2, 1, 1].tolist() == [2e-3, 2e-3, 0.0]
    assert found.end[1, 1, 1] - found.begin[1, 1, 1] == pytest.approx([8e-3, 0.0, 0.0])


def test_without_forces_arrows_are_displacements() -> None:
    found = scene.arrows(recorded(force=False))
    assert (found.what, found.unit) == ("displacement", "m")
    assert found.longest == pytest.approx(5e-6)
    assert found.end[1, 0, 0] - found.begin[1, 0, 0] == pytest.approx([2.4e-3, 3.2e-3, 0.0])


def test_where_nothing_touches_no_arrow_is_the_longest() -> None:
    found = scene.arrows(recorded(touching=False))
    assert found.longest == 0.0
    assert np.isfinite(found.end).all()


def test_resultants_are_those_of_all_elements_and_unknown_without_forces() -> None:
    log = recorded().log
    assert scene.normal_force(log).tolist() == [0.0, 8.0, 0.0]
    assert scene.tangential_force(log) == pytest.approx([0.0, np.hypot(13.0, 4.0), 0.0])
    plain = recorded(force=False).log
    assert np.isnan(scene.normal_force(plain)).all()
    assert np.isnan(scene.tangential_force(plain)).all()
    assert scene.tangential_force(plain).shape == (3,)


def test_patches_are_shown_in_the_frames_in_which_they_are() -> None:
    pose = np.array([[1e-3, 2e-3, 0.0], [np.nan, np.nan, np.nan], [3e-3, 4e-3, 0.1]])
    patch = SimpleNamespace(first=5, pose=pose, regime=np.array(["stick", "none", "sliding"]))
    history: Any = SimpleNamespace(patches=(patch, SimpleNamespace(first=7, pose=pose[:1], regime=np.array(["stick"]))))
    shown = {frame: list(scene.patches_at(history, frame)) for frame in range(4, 9)}
    assert shown == {
        4: [],
        5: [(1e-3, 2e-3, "stick")],
        6: [],
        7: [(3e-3, 4e-3, "sliding"), (1e-3, 2e-3, "stick")],
        8: [],
    }


def test_states_have_the_colours_that_are_told_apart() -> None:
    assert scene.COLOURS.tolist() == [[139, 148, 158, 64], [0, 114, 178, 255], [213, 94, 0, 255]]


def test_arrows_of_reconstructed_forces_are_called_so() -> None:
    measured = recorded()
    told = replace(measured.log, metadata={"force": "reconstructed"})
    assert scene.arrows(replace(measured, log=told)).what == "reconstructed tangential force"
