"""A zip's bounds, to the last byte and member."""

import errno
import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from service.formats import archive
from service.formats.archive import open_archive, read_member, unpacked_bytes
from slipcore.errors import InvalidInput


def npy(values: object) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.asarray(values))
    return stream.getvalue()


@pytest.fixture
def zip_of(tmp_path: Path) -> Callable[..., Path]:
    def make(members: dict[str, bytes], method: int = zipfile.ZIP_STORED, comment: bytes = b"") -> Path:
        with zipfile.ZipFile(tmp_path / "a.zip", "w", method) as file:
            for name, content in members.items():
                file.writestr(name, content)
            file.comment = comment
        return tmp_path / "a.zip"

    return make


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_members_are_read_in_any_order_and_again(zip_of: Callable[..., Path], method: int) -> None:
    path = zip_of({"a.npy": npy([1.0, 2.0]), "deep/b.npy": npy([[True], [False]])}, method)
    with open_archive(path) as opened:
        assert read_member(opened, "deep/b.npy", "b").tolist() == [[True], [False]]
        for _ in range(2):
            assert read_member(opened, "a.npy", "a").tolist() == [1.0, 2.0]
        with pytest.raises(KeyError):
            read_member(opened, "c.npy", "c")


def test_bytes_are_those_of_all_members_or_of_a_file_that_is_no_zip(
    zip_of: Callable[..., Path], tmp_path: Path
) -> None:
    assert unpacked_bytes(zip_of({"a": bytes(1000), "b": bytes(2000)}, zipfile.ZIP_DEFLATED)) == 3000
    (tmp_path / "plain").write_bytes(b"PK\x03\x05" + bytes(100))
    assert unpacked_bytes(tmp_path / "plain") == 104
    (tmp_path / "cut").write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(InvalidInput, match=r"file is not a complete zip \(104 bytes, no table of contents\)"):
        unpacked_bytes(tmp_path / "cut")


def test_an_empty_zip_is_one(zip_of: Callable[..., Path]) -> None:
    with open_archive(zip_of({})) as opened:
        assert opened.namelist() == []


@pytest.mark.parametrize("length", [1, 2**16 - 1])
def test_a_comment_of_any_length_is_part_of_a_zip(zip_of: Callable[..., Path], length: int) -> None:
    with open_archive(zip_of({"a.npy": npy(1)}, comment=b"c" * length)) as opened:
        assert opened.namelist() == ["a.npy"]


def test_members_may_unpack_to_as_much_as_may_be(zip_of: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    path = zip_of({"a": bytes(600), "b": bytes(400)})
    monkeypatch.setattr(archive, "MAX_ARRAY_BYTES", 1000)
    with open_archive(path):
        pass
    monkeypatch.setattr(archive, "MAX_ARRAY_BYTES", 999)
    with pytest.raises(InvalidInput, match="file is 1000 bytes unpacked; allowed: at most 999 bytes unpacked"):
        unpacked_bytes(path)


def test_a_table_of_contents_may_be_as_large_as_may_be(
    zip_of: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = zip_of({"abcd": b""})
    monkeypatch.setattr(archive, "MAX_DIRECTORY_BYTES", 50)  # 46 and the name
    with open_archive(path):
        pass
    monkeypatch.setattr(archive, "MAX_DIRECTORY_BYTES", 49)
    told = r"table of contents is 50 bytes; allowed: at most 49 bytes, no zip64 \(zip without -fz\)"
    with pytest.raises(InvalidInput, match=told):
        unpacked_bytes(path)


def test_a_log_s_table_of_contents_may_have_a_thousand_members(zip_of: Callable[..., Path]) -> None:
    with open_archive(zip_of({f"{k:04d}": b"" for k in range(1000)})) as opened:
        assert len(opened.namelist()) == 1000
    with pytest.raises(InvalidInput, match="at most 65536 bytes"):
        unpacked_bytes(zip_of({f"{k:04d}": b"" for k in range(1400)}))


@pytest.mark.parametrize("name", ["/a", "../a", "a/../b", "./a", "a//b", "c:a", "a\\b"])
def test_a_name_that_leads_elsewhere_is_none(zip_of: Callable[..., Path], name: str) -> None:
    with pytest.raises(InvalidInput, match=r"member name is .*; allowed: a plain relative path"):
        unpacked_bytes(zip_of({name: b"x"}))


def test_folders_and_dots_in_names_are_plain(zip_of: Callable[..., Path]) -> None:
    path = zip_of({"a/": b"", "a/..b": b"", "a/b..": b"x", ".c": b""})
    assert unpacked_bytes(path) == 1


def test_what_a_stored_member_claims_is_no_more_than_the_file_has(zip_of: Callable[..., Path]) -> None:
    path = zip_of({"a.npy": npy(np.zeros(10))})
    content = bytearray(path.read_bytes())
    entry = content.index(b"PK\x01\x02")
    content[entry + 24 : entry + 28] = struct.pack("<I", 10**6)
    path.write_bytes(content)
    with open_archive(path) as opened, pytest.raises(InvalidInput, match=r"1000000 bytes in 'a.npy' by its header"):
        read_member(opened, "a.npy", "a")


def test_what_the_disk_does_is_not_the_file_s_fault() -> None:
    with pytest.raises(OSError, match="no disk"), archive._sound():
        raise OSError(errno.EIO, "no disk")
    with pytest.raises(InvalidInput, match="a truncated or damaged zip"), archive._sound():
        raise OSError(errno.EINVAL, "no place")
