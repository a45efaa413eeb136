"""One array, its header checked before anything is read."""

import io
from typing import Any

import numpy as np
import pytest

from service.formats import npy
from slipcore.errors import InvalidInput


def saved(array: Any, version: tuple[int, int] | None = None) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(array), version)
    return stream.getvalue()


def read(content: bytes, size: int | None = None) -> Any:
    return npy.read_array(io.BytesIO(content), "it", len(content) if size is None else size)


@pytest.mark.parametrize(
    "array",
    [
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        np.array(["a", "β", "\U0010ffff"]),
        np.array([True, False]),
        np.array(7, ">i2"),
        np.zeros((0, 3)),
    ],
)
@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_an_array_is_read_as_it_was_saved(array: Any, version: tuple[int, int]) -> None:
    found = read(saved(array, version))
    assert (found.dtype, found.shape) == (array.dtype, array.shape)
    assert np.array_equal(found, array)


def test_a_version_that_few_writers_have_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"it is not a .npy array .*; allowed: the .npy format, version 1.0 or 2.0"):
        read(saved([1.0], (3, 0)))


@pytest.mark.parametrize("array", [np.array([1j]), np.array([b"x"]), np.array(["now"], "M8[s]"), np.zeros(2, "V3")])
def test_only_numbers_truth_values_and_text_are_read(array: Any) -> None:
    with pytest.raises(InvalidInput, match=r"it is of dtype .*; allowed: an array of numbers, booleans or text"):
        read(saved(array))


def test_what_the_header_claims_is_what_is_there() -> None:
    content = saved(np.zeros(3))
    for size, held in ((len(content) - 1, 23), (len(content) + 1, 25)):
        told = f"it is 24 bytes by its header, {held} in the file; allowed: a complete .npy array"
        with pytest.raises(InvalidInput, match=told):
            read(content, size)
    with pytest.raises(InvalidInput, match="it is cut off after 23 of 24 bytes; allowed: a complete"):
        read(content[:-1], len(content))


def test_an_array_may_be_as_large_as_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(npy, "MAX_ARRAY_BYTES", 24)
    assert len(read(saved(np.zeros(3)))) == 3
    with pytest.raises(InvalidInput, match="it is 32 bytes by its header; allowed: at most 24 bytes"):
        read(saved(np.zeros(4)))


def test_arrays_have_eight_axes_at_most() -> None:
    assert read(saved(np.zeros((1,) * 8))).ndim == 8
    with pytest.raises(InvalidInput, match=r"it is of shape \[1, 1.*; allowed: at most 8 axes, none negative"):
        read(saved(np.zeros((1,) * 9)))


def test_text_has_code_points_that_there_are() -> None:
    content = saved(np.array(["\U0010ffff"]))
    with pytest.raises(
        InvalidInput, match="it is text with the code point 0x110000; allowed: code points up to 0x10ffff"
    ):
        read(content[:-4] + (0x110000).to_bytes(4, "little"))
