"""What a benchmark's folder is begun with, and what of a simulated grasp is true."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service import __version__
from service.slip_benchmark import folder as files
from service.slip_benchmark.kinds import KINDS
from service.slip_benchmark.making import make, scenes_in, truth_of
from service.slip_benchmark.scenes import seal
from slipcore import FrictionLaw, GraspLog
from slipcore.errors import InvalidInput
from slipcore.frames import GroundTruth
from tests.executors import Here
from tests.service.slip_benchmark.test_folder import ENTRY

LATTICE, PILLARS, *_ = KINDS.values()


def begun(folder: Path, phrase: str = "a grey heron", kinds: tuple[object, ...] = (LATTICE,)) -> None:
    """Write the manifest of a folder, and make no scene."""
    made = make(Here(), phrase, 0, kinds, folder)  # type: ignore[arg-type]
    list(made)


def test_a_folder_is_begun_with_a_seal_and_kept_for_the_same_phrase(tmp_path: Path) -> None:
    begun(tmp_path)
    manifest = files.read_manifest(tmp_path)
    assert (manifest.seal, manifest.kinds, manifest.licence) == (seal("a grey heron"), ("lattice 20x20",), "MIT")
    assert manifest.made_by == f"stiction {__version__}"
    assert manifest.scenes == ()
    assert (tmp_path / "README.md").read_text(encoding="utf-8").startswith("# Stiction slip benchmark")
    begun(tmp_path)


@pytest.mark.parametrize(
    ("phrase", "kinds", "told"),
    [
        (
            "another",
            (LATTICE,),
            "of another phrase for kinds lattice 20x20; allowed: one of the same phrase, kinds and",
        ),
        ("a grey heron", (PILLARS,), "of this phrase for kinds lattice 20x20; allowed"),
    ],
)
def test_a_folder_of_something_else_is_told_by_what_it_has(
    tmp_path: Path, phrase: str, kinds: tuple[object, ...], told: str
) -> None:
    begun(tmp_path)
    with pytest.raises(InvalidInput, match=f"made by stiction {__version__} {told}"):
        begun(tmp_path, phrase, kinds)


def test_a_folder_that_is_none_of_a_benchmark_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mine").touch()
    for folder in (tmp_path, tmp_path / "mine"):
        with pytest.raises(InvalidInput, match=r"folder is .*; allowed: a new or empty one, or one with a benchmark"):
            begun(folder)
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    for phrase in ("", "  \n"):
        with pytest.raises(InvalidInput, match=r"phrase is .*; allowed: some text, which nobody knew before"):
            begun(tmp_path / "new", phrase)
    assert not (tmp_path / "new").exists()


def test_a_folder_has_as_many_scenes_as_are_asked_for_or_as_it_has(tmp_path: Path) -> None:
    assert scenes_in(tmp_path, 3) == 3
    begun(tmp_path)
    scenes = tuple(replace(ENTRY, name=f"{k:04d}") for k in range(5))
    files.write_manifest(tmp_path, replace(files.read_manifest(tmp_path), scenes=scenes))
    assert [scenes_in(tmp_path, asked) for asked in (3, 5, 7)] == [5, 5, 7]


def test_what_is_true_of_a_grasp_is_told_by_its_elements() -> None:
    """Three of four elements touch: none slips, then one, then all three; and one that does not touch is said to."""
    shape = (4, 1, 4)
    contact = np.zeros(shape, bool)
    contact[1:, 0, :3] = True
    slip = np.zeros(shape, bool)
    slip[2, 0, 0], slip[3], slip[0, 0, 3] = True, True, True
    truth = GroundTruth(contact, slip, slip, np.array([np.nan, 1.0, 0.6, 0.0]), FrictionLaw((0.5, 0.0, -1.0), 0.03))
    force = np.broadcast_to([0.0, 0.0, -0.1], (*shape, 3)).copy()
    place = np.zeros((1, 4, 3))
    place[0, :, 0] = 1e-3 * np.arange(4)
    log = GraspLog(np.arange(4.0), place, np.zeros((*shape, 3)), 1e-6, force=force, truth=truth)
    found = truth_of(log)
    assert found.stick_ratio.tolist() == pytest.approx([np.nan, 1.0, 2 / 3, 0.0], nan_ok=True)
    assert found.macro_slip.tolist() == [False, False, False, True]
    assert found.slip.sum(axis=(1, 2)).tolist() == found.slip_kinematic.sum(axis=(1, 2)).tolist() == [0, 0, 1, 3]
    assert found.stick_area_ratio.tolist()[1:] == [1.0, 0.6, 0.0]
    assert found.friction_law.tolist() == [0.5, 0.0, -1.0, 0.03]
    assert float(found.friction) == pytest.approx(0.4)
    assert (found.force.dtype, found.displacement.dtype) == (np.float32, np.float32)
    assert found.object_pose.tolist() == [[0.0] * 3] * 4
    posed = truth_of(replace(log, object_pose=np.ones((4, 3))))
    assert posed.object_pose.tolist() == [[1.0] * 3] * 4
