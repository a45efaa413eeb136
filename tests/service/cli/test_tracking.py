"""From images to a log: `stiction track`, and what the other commands make of its table."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2", reason="opencv-python-headless is not installed: pip install 'stiction[images]'")

import cv2
from PIL import Image
from scipy.spatial import cKDTree

from service import formats
from service.cli import main
from service.cli.exit_codes import INPUT_REFUSED
from slipcore import detect_slip
from slipcore.frames import FloatArray
from tests.service.formats.dot_images import draw, lattice, sheared_press

Capture = pytest.CaptureFixture[str]
SHAPE, FRAMES = (250, 260), 12


def places() -> FloatArray:
    return sheared_press(lattice(10, 10), FRAMES)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Images of 10 x 10 dots that shear."""
    path = tmp_path / "images"
    path.mkdir()
    for number, place in enumerate(places()):
        Image.fromarray(draw(place, SHAPE)).save(path / f"gel{number}.png")
    return path


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return int(ending.value.code or 0)


def test_images_become_a_log_that_other_commands_take(folder: Path, tmp_path: Path, capsys: Capture) -> None:
    table, scale = tmp_path / "markers.csv", 2.5e-5
    assert run("track", folder, "--output", table, "--rate", 30, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["frames"], told["markers"], told["dark"], told["lost_places"]) == (FRAMES, 100, True, 0)
    assert told["frame_rate"] == 30.0

    log = formats.read(table, scale=scale)
    assert np.diff(log.time) == pytest.approx(1 / 30)
    position, displacement = log.position.reshape(100, 3), log.displacement.reshape(FRAMES, 100, 3)
    distance, which = cKDTree(scale * places()[0]).query(position[:, :2])
    assert len(set(which)) == 100
    assert max(distance) < 0.05 * scale
    assert np.abs(displacement[..., :2] - scale * (places() - places()[0])[:, which]).max() < 0.05 * scale
    assert detect_slip(log).contact[-1].any()

    assert run("check", table, "--scale", scale) == 0
    assert "rounded" not in capsys.readouterr().out
    assert run("detect", table, "--scale", scale, "--rest", 1, "--json") == 0
    assert json.loads(capsys.readouterr().out)["frames"] == FRAMES


def test_a_video_that_ends_early_gives_a_table_and_is_told(tmp_path: Path, capsys: Capture) -> None:
    film = tmp_path / "gel.avi"
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, SHAPE[::-1], isColor=False)
    for place in places():
        writer.write(draw(place, SHAPE))
    writer.release()
    film.write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    table = tmp_path / "markers.csv"
    assert run("track", film, "--output", table) == 0
    out, err = capsys.readouterr()
    assert "100, dark, of radius 3.6" in out
    assert f"of the {FRAMES} frames it states" in err
    log = formats.read(table, scale=2.5e-5)
    assert 2 <= len(log) < FRAMES
    assert np.diff(log.time) == pytest.approx(1 / 25)


def test_a_long_step_between_two_frames_is_told(tmp_path: Path, capsys: Capture) -> None:
    for number, shift in enumerate((0.0, 8.5)):
        Image.fromarray(draw(lattice(10, 10) + np.array([shift, 0.0]), SHAPE)).save(tmp_path / f"{number}.png")
    assert run("track", tmp_path, "--output", tmp_path / "markers.csv") == 0
    assert "may be taken for its neighbour" in capsys.readouterr().err


def test_without_the_library_the_extra_is_named(
    folder: Path, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "service.formats.marker_images", raising=False)
    monkeypatch.setitem(sys.modules, "cv2", None)
    assert run("track", folder, "--output", tmp_path / "markers.csv") == INPUT_REFUSED
    assert "library of images is cv2, which is not installed; allowed: the extra `images`" in capsys.readouterr().err


def test_what_is_wrong_leaves_no_table(folder: Path, tmp_path: Path, capsys: Capture) -> None:
    table = tmp_path / "markers.csv"
    (folder / "gel7.png").write_text("no image")
    assert run("track", folder, "--output", table) == INPUT_REFUSED
    assert "image gel7.png is not readable" in capsys.readouterr().err
    assert run("track", folder, "--output", folder / "gel1.png") == INPUT_REFUSED
    assert run("track", folder, "--output", table, "--rate", 0) == 2
    assert not table.exists()
