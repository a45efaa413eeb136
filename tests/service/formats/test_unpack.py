"""Chunks that unpack to what they may, and files that give no more than they have."""

import bz2
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest

from service.formats import unpack
from service.formats.unpack import BoundedFile, BoundedPath, Unpacker, zstd
from slipcore.errors import InvalidInput

Pack = Callable[[bytes], bytes]
PACKED: dict[str, Pack] = {
    "": bytes,
    "none": bytes,
    "lz4": lz4.frame.compress,
    "bz2": bz2.compress,
    "zstd": zstd.compress,
}
CONTENT = bytes(range(256)) * 40


@pytest.mark.parametrize("compression", PACKED)
@pytest.mark.parametrize("size", [len(CONTENT), None])
def test_a_chunk_comes_back_as_it_was_packed(compression: str, size: int | None) -> None:
    assert Unpacker().unpack(PACKED[compression](CONTENT), compression, size) == CONTENT


@pytest.mark.parametrize("compression", PACKED)
def test_one_byte_more_than_it_says_is_too_much(compression: str) -> None:
    allowed = (
        rf"chunk is {len(CONTENT)} bytes or more; allowed: at most {len(CONTENT) - 1} bytes unpacked, 2147483648 in"
    )
    with pytest.raises(InvalidInput, match=allowed):
        Unpacker().unpack(PACKED[compression](CONTENT), compression, len(CONTENT) - 1)


@pytest.mark.parametrize("compression", PACKED)
def test_a_chunk_that_says_nothing_may_unpack_to_what_any_may(
    compression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = PACKED[compression](CONTENT)
    monkeypatch.setattr(unpack, "MAX_CHUNK_BYTES", len(CONTENT))
    assert Unpacker().unpack(packed, compression) == CONTENT
    monkeypatch.setattr(unpack, "MAX_CHUNK_BYTES", len(CONTENT) - 1)
    with pytest.raises(InvalidInput, match="bytes or more; allowed: at most"):
        Unpacker().unpack(packed, compression)


def test_what_says_to_be_too_large_is_not_unpacked() -> None:
    with pytest.raises(InvalidInput, match=r"chunk is 67108865 bytes by its header; allowed: at most 67108864 bytes"):
        Unpacker().unpack(b"", "none", 64 * 2**20 + 1)
    assert Unpacker().unpack(b"", "none", 64 * 2**20) == b""


def test_chunks_of_one_recording_are_added_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpack, "MAX_UNPACKED_BYTES", 10)
    unpacker = Unpacker()
    assert [unpacker.unpack(b"12345", "none") for _ in range(2)] == [b"12345"] * 2
    with pytest.raises(InvalidInput, match="10 in all"):
        unpacker.unpack(b"1", "none")
    assert Unpacker().unpack(b"1", "none") == b"1"


@pytest.mark.parametrize("compression", ["lz4", "bz2", "zstd"])
def test_damage_is_named_with_what_it_should_have_been(compression: str) -> None:
    with pytest.raises(InvalidInput, match=rf"chunk is damaged \(.*\); allowed: {compression} data"):
        Unpacker().unpack(b"\x00" * 50, compression, 100)


def test_another_compression_is_named() -> None:
    with pytest.raises(InvalidInput, match="compressed by 'brotlibrotlibrotlibr'; allowed: lz4, zstd, bz2 or not at"):
        Unpacker().unpack(b"", "brotli" * 5, 100)


def test_zstd_may_ask_for_64_mib_and_no_more() -> None:
    def packed(window: int) -> bytes:
        options = {zstd.CompressionParameter.window_log: window, zstd.CompressionParameter.content_size_flag: 0}
        compressor = zstd.ZstdCompressor(options=options)
        return compressor.compress(CONTENT) + compressor.flush()

    assert Unpacker().unpack(packed(26), "zstd", len(CONTENT)) == CONTENT
    with pytest.raises(InvalidInput, match="chunk is damaged"):
        Unpacker().unpack(packed(27), "zstd", len(CONTENT))


@pytest.mark.parametrize(
    ("asked", "given"),
    [(3, b"012"), (0, b""), (10, b"0123456789"), (2**62, b"0123456789"), (-1, b"0123456789"), (None, b"0123456789")],
)
def test_a_file_is_never_asked_for_more_than_it_has(asked: int | None, given: bytes, tmp_path: Path) -> None:
    path = tmp_path / "recording"
    path.write_bytes(b"0123456789")
    with BoundedFile(path) as file:
        assert file.read(asked) == given
        assert file.read(2**62) == b"0123456789"[len(given) :]
        assert file.read() == file.read(1) == b""


def test_a_bounded_path_opens_bounded_files_and_tells_its_name_alone(tmp_path: Path) -> None:
    path = tmp_path / "recording"
    assert not BoundedPath(path).exists()
    path.write_bytes(b"01")
    bounded = BoundedPath(path)
    assert bounded.exists()
    assert str(bounded) == "recording"
    with bounded.open() as file:
        assert (file.size, file.read(2**62)) == (2, b"01")
