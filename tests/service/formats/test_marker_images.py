"""Images and videos of markers as files: which are read, in which order, and what is refused."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2", reason="opencv-python-headless is not installed: pip install 'stiction[images]'")

import cv2
from PIL import Image

from service.formats import marker_images
from service.formats.marker_images import Grey
from slipcore.errors import InvalidInput


def grey(level: int = 100, shape: tuple[int, int] = (48, 64)) -> Grey:
    return np.full(shape, level, dtype=np.uint8)


def save(path: Path, image: Grey) -> Path:
    Image.fromarray(image).save(path)
    return path


def film(path: Path, frames: int = 10) -> Path:
    """A video of noise."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (64, 48), isColor=False)
    assert writer.isOpened()
    for number in range(frames):
        writer.write(np.random.default_rng(number).integers(0, 256, (48, 64)).astype(np.uint8))
    writer.release()
    return path


def test_a_folder_is_read_in_the_order_of_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 100, 1):
        save(tmp_path / f"gel{number}.png", grey(number))
    (tmp_path / "notes.txt").write_text("no image")
    (tmp_path / ".gel2.png").write_bytes(b"hidden")
    found = marker_images.find([tmp_path])
    assert [int(image[0, 0]) for image in found] == [1, 9, 10, 100]
    assert [int(image[0, 0]) for image in marker_images.find(list(reversed(found.files)))] == [1, 9, 10, 100]
    assert (found.frame_rate, found.stated) == (None, None)


@pytest.mark.parametrize("name", ["a.png", "a.JPG", "a.jpeg", "a.bmp", "a.tiff"])
def test_images_of_several_kinds_are_read_as_grey(tmp_path: Path, name: str) -> None:
    Image.fromarray(np.full((48, 64, 3), (200, 100, 50), dtype=np.uint8)).save(tmp_path / name)
    (image,) = marker_images.find([tmp_path / name])
    assert image.dtype == np.uint8
    assert np.abs(image.astype(int) - 124).max() <= 2  # 0.299 R + 0.587 G + 0.114 B


def test_a_video_is_read_with_its_rate(tmp_path: Path) -> None:
    found = marker_images.find([film(tmp_path / "gel.avi")])
    assert (found.frame_rate, found.stated) == (25.0, 10)
    images = list(found)
    assert [image.shape for image in images] == [(48, 64)] * 10
    assert not np.array_equal(images[0], images[9])


def test_a_video_that_ends_early_gives_the_frames_until_then(tmp_path: Path) -> None:
    whole = film(tmp_path / "gel.avi").read_bytes()
    (tmp_path / "cut.avi").write_bytes(whole[: len(whole) // 2])
    found = marker_images.find([tmp_path / "cut.avi"])
    assert found.stated == 10
    assert 2 <= len(list(found)) < 10


def test_what_is_not_there_or_no_image_is_refused_by_name(tmp_path: Path) -> None:
    empty, text, junk = tmp_path / "empty", tmp_path / "a.png", tmp_path / "a.mp4"
    empty.mkdir()
    text.write_text("no image")
    junk.write_bytes(b"no video" * 100)
    with pytest.raises(InvalidInput, match=r"images is the folder .*empty without any"):
        marker_images.find([empty])
    for absent in (tmp_path / "absent.png", tmp_path / "absent.mp4"):
        with pytest.raises(InvalidInput, match=r"images is .*absent\.\w+, which is not there"):
            marker_images.find([absent])
    with pytest.raises(InvalidInput, match=r"image a\.png is not readable"):
        list(marker_images.find([text]))
    with pytest.raises(InvalidInput, match=r"images is .*a\.mp4, which is no video"):
        marker_images.find([junk])


def test_a_damaged_image_is_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (48, 64)).astype(np.uint8)
    for name in ("a.png", "a.jpg"):
        whole = save(tmp_path / name, noise).read_bytes()
        (tmp_path / name).write_bytes(whole[: len(whole) // 2])
        with pytest.raises(InvalidInput, match=rf"image {name} is not readable"):
            list(marker_images.find([tmp_path / name]))


def test_images_of_two_sizes_are_refused(tmp_path: Path) -> None:
    files = [save(tmp_path / "1.png", grey()), save(tmp_path / "2.png", grey(shape=(48, 60)))]
    with pytest.raises(InvalidInput, match=r"size of 2\.png is 60 x 48 pixels; allowed: 64 x 48 pixels"):
        list(marker_images.find(files))


def test_pixels_of_more_than_eight_bits_are_refused(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((48, 64), dtype=np.uint16)).save(tmp_path / "deep.png")
    with pytest.raises(InvalidInput, match=r"image deep\.png is of mode I;16; allowed: 8 bits"):
        list(marker_images.find([tmp_path / "deep.png"]))


@pytest.mark.parametrize("side", [10_000, 60_000], ids=["above ours", "above the library's"])
def test_an_image_of_too_many_pixels_is_refused_before_it_is_unpacked(tmp_path: Path, side: int) -> None:
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path = tmp_path / "bomb.png"
    body = chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + body)
    with pytest.raises(InvalidInput, match=r"image bomb\.png is .*; allowed: at most 50000000 pixels"):
        list(marker_images.find([path]))


def test_a_video_of_too_many_pixels_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = film(tmp_path / "gel.avi")
    monkeypatch.setattr(marker_images, "MAX_PIXELS", 1000)
    with pytest.raises(InvalidInput, match=r"image gel\.avi is 64 x 48 pixels; allowed: at most 1000 pixels"):
        marker_images.find([path])
