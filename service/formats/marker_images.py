"""Grey images of a marker gel: files in the order of the numbers in their names, or a video (docs/formats.md)."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from warnings import catch_warnings, simplefilter

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from service.formats.tracked_markers import FRAME_RATE
from slipcore.errors import InvalidInput

Grey = NDArray[np.uint8]

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Names of images end so; what else is in a folder is left alone."""
KINDS = ("PNG", "JPEG", "BMP", "TIFF")
DEEP = ("I", "F")
"""How Pillow's modes of more than 8 bits begin: which of the bits count is not said in the file."""
MAX_PIXELS = 50_000_000
"""Pixels of an image: more than tactile sensors' cameras have, and 0.6 GB while dots are found."""


@dataclass(frozen=True, slots=True)
class Images:
    """Images of one size: their ``files``, or one video; the ``frame_rate`` (1/s) and the number of frames that the
    video states, None of files.
    """

    files: tuple[Path, ...]
    frame_rate: float | None = None
    stated: int | None = None

    def __iter__(self) -> Iterator[Grey]:
        """Grey images [rows, columns]. Raises ``InvalidInput`` for one not readable or of another size."""
        shape: tuple[int, ...] | None = None
        for name, image in _video(self.files[0]) if self.stated is not None else _stills(self.files):
            shape = shape or image.shape
            if image.shape != shape:
                raise InvalidInput(f"size of {name}", _size(image.shape), f"{_size(shape)}, as of the first image")
            yield image


def find(paths: Sequence[Path]) -> Images:
    """The images that ``paths`` are: files, a folder of them, or one video. Raises ``InvalidInput`` where none is."""
    files = [file for path in paths for file in (_in_folder(path) if path.is_dir() else [path])]
    for file in files:
        if not file.is_file():
            raise InvalidInput("images", f"{file}, which is not there", "files of images, a folder of them, or a video")
    if len(files) == 1 and files[0].suffix.lower() not in SUFFIXES:
        with _opened(files[0]) as video:
            rate, frames = video.get(cv2.CAP_PROP_FPS), int(video.get(cv2.CAP_PROP_FRAME_COUNT))
        return Images((files[0],), rate if FRAME_RATE[0] <= rate <= FRAME_RATE[1] else None, max(frames, 0))
    return Images(tuple(sorted(files, key=_numbers)))


def _in_folder(folder: Path) -> list[Path]:
    files = [path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and not path.name.startswith(".")]
    if not files:
        raise InvalidInput(
            "images", f"the folder {folder} without any", f"files in it that end in {', '.join(SUFFIXES)}"
        )
    return files


def _numbers(path: Path) -> list[tuple[int, str]]:
    """Orders frame2.png before frame10.png."""
    return [(int(digits or 0), text) for text, digits in re.findall(r"(\D*)(\d*)", path.name)]


def _stills(files: Sequence[Path]) -> Iterator[tuple[str, Grey]]:
    for file in files:
        yield file.name, _still(file)


def _still(file: Path) -> Grey:
    """Raises ``InvalidInput`` before its pixels are unpacked where there are too many."""
    try:
        with catch_warnings():
            simplefilter("ignore", Image.DecompressionBombWarning)  # our own bound is the lower one
            with Image.open(file, formats=KINDS) as image:
                _check_pixels(file.name, *image.size)
                if image.mode.startswith(DEEP):
                    raise InvalidInput(f"image {file.name}", f"of mode {image.mode}", "8 bits a channel")
                return np.asarray(image.convert("L"))
    except InvalidInput:
        raise
    except Image.DecompressionBombError as error:
        raise InvalidInput(f"image {file.name}", "far too large", f"at most {MAX_PIXELS} pixels") from error
    except (OSError, SyntaxError, ValueError) as error:  # of files that are no images, or damaged ones
        raise InvalidInput(f"image {file.name}", f"not readable ({error})"[:200], ", ".join(KINDS)) from error


def _video(file: Path) -> Iterator[tuple[str, Grey]]:
    with _opened(file) as video:
        number = 0
        while (frame := _next(video, file)) is not None:
            yield f"frame {number} of {file.name}", frame
            number += 1


def _next(video: cv2.VideoCapture, file: Path) -> Grey | None:
    """The next frame; None at the video's end, also where that comes early."""
    try:
        is_there, frame = video.read()
        if not is_there:
            return None
        return np.asarray(frame if frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    except cv2.error as error:
        raise InvalidInput(
            f"video {file.name}", f"not readable ({error.err})"[:200], "a video of plain frames"
        ) from error


@contextmanager
def _opened(file: Path) -> Iterator[cv2.VideoCapture]:
    """FFmpeg alone: other readers of the library would take a name for a pattern of names."""
    video = cv2.VideoCapture(str(file), cv2.CAP_FFMPEG)
    try:
        if not video.isOpened():
            allowed = f"a video that OpenCV reads, or images that end in {', '.join(SUFFIXES)}"
            raise InvalidInput("images", f"{file}, which is no video", allowed)
        size = (int(video.get(name)) for name in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        _check_pixels(file.name, *size)
        yield video
    finally:
        video.release()


def _check_pixels(name: str, width: int, height: int) -> None:
    if width * height > MAX_PIXELS:
        raise InvalidInput(f"image {name}", f"{width} x {height} pixels", f"at most {MAX_PIXELS} pixels")


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]} pixels"
