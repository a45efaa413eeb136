import io
import struct
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.formats import npy, npz
from slipcore import GraspLog, InvalidInput
from stiction_client import container

ZipOf = Callable[..., Path]


def members(log: GraspLog) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(container.encode(log))) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_log_comes_back_as_it_was_written(log: GraspLog, tmp_path: Path) -> None:
    back = npz.read(container.write(log, tmp_path / "log.npz"))
    for name in ("time", "position", "displacement", "force", "normal", "object_pose", "gripper_force"):
        np.testing.assert_array_equal(getattr(back, name), getattr(log, name), err_msg=name)
    assert back.gripper_force_deviation == log.gripper_force_deviation
    assert (back.element_area, back.sensor, dict(back.metadata)) == (1e-6, "Prüfstand 1", dict(log.metadata))
    assert back.truth is not None
    assert log.truth is not None
    for name in ("contact", "slip_kinematic", "slip_contact_factor", "stick_ratio"):
        np.testing.assert_array_equal(getattr(back.truth, name), getattr(log.truth, name), err_msg=name)
    assert back.truth.friction == log.truth.friction


def test_masks_come_back_as_they_were_written(log: GraspLog, tmp_path: Path) -> None:
    masks = np.random.default_rng(1).random((2, 5, 3, 4)) < 0.5
    back = npz.read(container.write(replace(log, contact=masks[0], observed=masks[1]), tmp_path / "log.npz"))
    np.testing.assert_array_equal(back.contact, masks[0])
    np.testing.assert_array_equal(back.observed, masks[1])
    assert npz.read(container.write(log, tmp_path / "log.npz")).observed is None


def test_a_log_without_options_comes_back_without_them(log: GraspLog, tmp_path: Path) -> None:
    bare = GraspLog(log.time, log.position, log.displacement, log.element_area)
    back = npz.read(container.write(bare, tmp_path / "log.npz"))
    assert back.force is back.normal is back.object_pose is back.truth is back.gripper_force is None
    assert (back.sensor, dict(back.metadata)) == ("unknown", {})


def test_a_log_that_numpy_itself_saved_is_read(log: GraspLog, tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez_compressed(
        path,
        format="stiction-grasp-log",
        version=np.int64(1),
        time=log.time.astype(">f8"),
        position=np.asfortranarray(log.position),
        displacement=log.displacement.astype(np.float32),
        element_area=log.element_area,
    )
    back = npz.read(path)
    np.testing.assert_array_equal(back.position, log.position)
    np.testing.assert_array_equal(back.displacement, log.displacement.astype(np.float32))


@pytest.mark.parametrize("name", ["format", "version", "time", "position", "displacement", "element_area"])
def test_a_missing_member_is_named(log: GraspLog, zip_of: ZipOf, name: str) -> None:
    rest = {member: content for member, content in members(log).items() if member != f"{name}.npy"}
    with pytest.raises(InvalidInput, match=f"members is without {name};"):
        npz.read(zip_of(rest))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("format", np.array("other"), "format is 'other'; allowed: 'stiction-grasp-log'"),
        ("format", np.array(1.0), "format is of dtype float64; allowed: text"),
        ("version", np.array(2), "version is 2; allowed: 1"),
        ("version", np.array([1]), r"version is of shape \[1\]"),
        ("time", np.arange(5), "time is of dtype int64; allowed: float64"),
        ("displacement", np.zeros((5, 3, 4, 3), np.float16), "dtype float16; allowed: float64 or float32"),
        ("position", np.zeros((3, 4)), r"position is of shape \[3, 4\]; allowed: shape \[any, any, 3\]"),
        ("force", np.zeros((4, 3, 4, 3)), r"force is of shape \[4, 3, 4, 3\]; allowed: shape \[5, 3, 4, 3\]"),
        ("element_area", np.array(np.nan), "element_area is nan"),
        ("time", np.array([0.0, 0.1, 0.1, 0.2, 0.3]), "time is 0.1 s at frame 2, after 0.1 s"),
        ("sensor", np.array("\ud800"), "sensor is not valid Unicode"),
        ("metadata", np.array("[1]"), "metadata is .*; allowed: a JSON object of strings"),
        ("metadata", np.array('{"a": 1}'), "allowed: a JSON object of strings"),
        ("metadata", np.array("{"), "metadata is not JSON"),
        ("metadata", np.array('{"a": "1", "a": "2"}'), "metadata is with the key 'a' more than once"),
        ("truth_friction", np.zeros(3), r"truth_friction is of shape \[3\]"),
        ("truth_contact", np.ones((5, 3, 4)), "truth_contact is of dtype float64; allowed: bool"),
        ("truth_contact", np.ones((5, 3, 3), bool), r"truth.contact is bool of shape \[5, 3, 3\]"),
        ("time", np.array([{}, {}]), "time is of dtype object"),
        ("time", np.zeros(5, [("a", "f8")]), "an array of numbers, booleans or text, without objects"),
    ],
)
def test_a_wrong_member_is_named_with_what_is_allowed(
    log: GraspLog, zip_of: ZipOf, as_npy: Callable[[object], bytes], name: str, value: np.ndarray, message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        npz.read(zip_of(members(log) | {f"{name}.npy": as_npy(value)}))


def test_an_unknown_member_is_refused_rather_than_dropped(log: GraspLog, zip_of: ZipOf) -> None:
    with pytest.raises(InvalidInput, match=r"with the unknown forces\.npy"):
        npz.read(zip_of(members(log) | {"forces.npy": np.zeros(3)}))


def test_half_a_truth_is_refused(log: GraspLog, zip_of: ZipOf) -> None:
    rest = {name: content for name, content in members(log).items() if name != "truth_friction.npy"}
    with pytest.raises(InvalidInput, match="truth is without truth_friction"):
        npz.read(zip_of(rest))


def test_a_pickle_is_never_loaded(log: GraspLog, zip_of: ZipOf, as_npy: Callable[[object], bytes]) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return pytest.fail, ("the pickle was loaded",)

    with pytest.raises(InvalidInput, match="sensor is of dtype object"):
        npz.read(zip_of(members(log) | {"sensor.npy": as_npy(np.array(Bomb(), dtype=object))}))


def header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (header("(10**15,)"), "time is not a .npy array"),
        (header("(1000000000000,)"), "time is 8000000000000 bytes by its header; allowed: at most"),
        (header("(1000000,)") + bytes(80), "time is 8000000 bytes by its header, 80 in the file"),
        (header("(2,)") + bytes(80), "time is 16 bytes by its header, 80 in the file"),
        (header("(-1,)") + bytes(8), "time is of shape"),
        (header("(" + "1," * 40 + ")") + bytes(8), "at most 8 axes"),
        (header("(99999999999999,)", "'<U0'"), "time is of dtype <U0"),
        (header("(1,)", "'|O'") + bytes(8), "time is of dtype object"),
        (header("(1,)", "'<q9'"), "not a .npy array"),
        (header("(True,)") + bytes(8), "at most 8 axes"),
        (header("(" + "-" * 9000 + "1,)") + bytes(8), "not a .npy array"),
        (b"\x93NUMPY\x09\x00", "not a .npy array"),
        (b"\x93NUMPY\x01\x00\xff\xff" + b"(" * 65535, "not a .npy array"),
        (b"", "not a .npy array"),
        (b"hello", "not a .npy array"),
    ],
)
def test_a_header_that_lies_is_refused_before_memory_is_taken(
    log: GraspLog, zip_of: ZipOf, content: bytes, message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        npz.read(zip_of(members(log) | {"time.npy": content}))


def test_a_compression_bomb_is_refused(log: GraspLog, zip_of: ZipOf, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.formats.archive.MAX_ARRAY_BYTES", 10_000_000)
    path = zip_of(members(log) | {"force.npy": np.zeros(2_000_000)}, zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 50_000
    with pytest.raises(InvalidInput, match="bytes unpacked; allowed: at most 10000000"):
        npz.read(path)


def test_a_member_that_unpacks_to_more_than_its_directory_claims_is_refused(log: GraspLog, tmp_path: Path) -> None:
    content = bytearray(container.encode(log))
    directory = content.rfind(b"PK\x01\x02")  # the last member's entry in the table of contents
    size = struct.unpack_from("<I", content, directory + 24)[0]
    struct.pack_into("<I", content, directory + 24, size - 8)
    path = tmp_path / "log.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="truth_friction is 32 bytes by its header, 24 in the file"):
        npz.read(path)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_a_number_that_changed_on_its_way_is_found(log: GraspLog, zip_of: ZipOf, method: int) -> None:
    path = zip_of(members(log), method)
    content = bytearray(path.read_bytes())
    content[content.index(b"force.npy") + 800] ^= 1
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match=r"Bad CRC-32 for file 'force\.npy'"):
        npz.read(path)


def test_a_huge_table_of_contents_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(2000):
            archive.writestr(f"{k}.npy", b"")
    with pytest.raises(InvalidInput, match=r"table of contents is .* bytes"):
        npz.read(path)


def test_zip64_of_a_pipe_is_refused_as_such(log: GraspLog, tmp_path: Path) -> None:
    """`zip -fz - *.npy | cat` points to a zip64 table of contents, and writes none: unzip refuses it as well."""
    path = tmp_path / "log.npz"
    content = bytearray(container.encode(log))
    content[-6:-2] = b"\xff" * 4
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match=r"in the zip64 layout; allowed: .*no zip64 \(zip without -fz\)"):
        npz.read(path)


def test_zip64_is_refused(log: GraspLog, tmp_path: Path) -> None:
    content = container.encode(log)
    end = content.rfind(b"PK\x05\x06")
    path = tmp_path / "log.npz"
    path.write_bytes(content[:end] + b"PK\x06\x07" + bytes(16) + content[end:])
    with pytest.raises(InvalidInput, match="zip64"):
        npz.read(path)


@pytest.mark.parametrize("before", [b"junk", b"{}", b"\n"])
def test_a_zip_behind_other_bytes_is_refused(log: GraspLog, tmp_path: Path, before: bytes) -> None:
    path = tmp_path / "log.npz"
    path.write_bytes(before + container.encode(log))
    with pytest.raises(InvalidInput, match="a zip behind other bytes"):
        npz.read(path)


def test_zeros_that_fill_a_block_behind_a_zip_are_none_of_it(log: GraspLog, tmp_path: Path) -> None:
    """As libarchive writes them to a pipe."""
    path = tmp_path / "log.npz"
    path.write_bytes(container.encode(log) + bytes(10_240))
    assert len(npz.read(path)) == len(log)


@pytest.mark.parametrize("behind", [b"j", b"junk", b"\0\0j", bytes(70_000)])
def test_bytes_behind_a_zip_are_refused(log: GraspLog, tmp_path: Path, behind: bytes) -> None:
    path = tmp_path / "log.npz"
    path.write_bytes(container.encode(log) + behind)
    with pytest.raises(InvalidInput, match=r"other bytes behind it|no table of contents"):
        npz.read(path)


def test_of_two_zips_in_one_file_neither_is_read(log: GraspLog, tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    path.write_bytes(container.encode(log) + container.encode(replace(log, sensor="another")))
    with pytest.raises(InvalidInput, match="bytes that are no part of it"):
        npz.read(path)


@pytest.mark.parametrize("member", ["time.npy", "displacement.npy"])
def test_bytes_between_members_are_refused(log: GraspLog, tmp_path: Path, member: str) -> None:
    path = container.write(log, tmp_path / "log.npz")
    with zipfile.ZipFile(path) as archive:
        place = archive.getinfo(member).header_offset
        offsets = {entry.filename: entry.header_offset for entry in archive.infolist()}
    content, hidden = bytearray(path.read_bytes()), b"hidden"
    end = content.rfind(b"PK\x05\x06")
    directory = struct.unpack_from("<I", content, end + 16)[0]
    struct.pack_into("<I", content, end + 16, directory + len(hidden))
    entry = directory
    for offset in offsets.values():  # in the table of contents, each entry's place is 42 bytes behind its begin
        if offset >= place:
            struct.pack_into("<I", content, entry + 42, offset + len(hidden))
        entry += 46 + sum(struct.unpack_from("<HHH", content, entry + 28))
    path.write_bytes(content[:place] + hidden + content[place:])
    with pytest.raises(InvalidInput, match=r"6 bytes from \d+ on that are no member's|behind other bytes"):
        npz.read(path)


def test_members_that_were_written_as_a_stream_are_read(log: GraspLog, tmp_path: Path) -> None:
    class Stream(io.RawIOBase):
        def __init__(self) -> None:
            self.content = bytearray()

        def writable(self) -> bool:
            return True

        def write(self, content: Any, /) -> int:
            self.content += content
            return len(content)

    stream, path = Stream(), tmp_path / "log.npz"
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:  # type: ignore[call-overload]
        for name, content in members(log).items():
            archive.writestr(name, content)
    path.write_bytes(stream.content)
    np.testing.assert_array_equal(npz.read(path).time, log.time)


@pytest.mark.parametrize(
    "name", ["../time.npy", "/time.npy", "a/../time.npy", "C:time.npy", "a\\time.npy", "./time.npy"]
)
def test_a_member_name_that_points_elsewhere_is_refused(log: GraspLog, zip_of: ZipOf, name: str) -> None:
    with pytest.raises(InvalidInput, match=r"member name is .*a plain relative path"):
        npz.read(zip_of(members(log) | {name: b""}))


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_member_given_twice_is_refused(log: GraspLog, tmp_path: Path) -> None:
    path = container.write(log, tmp_path / "log.npz")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("time.npy", b"")
    with pytest.raises(InvalidInput, match=r"time\.npy is in the zip twice"):
        npz.read(path)


def test_encrypted_members_and_odd_compressions_are_refused(log: GraspLog, zip_of: ZipOf) -> None:
    with pytest.raises(InvalidInput, match=r"stored or deflated"):
        npz.read(zip_of(members(log), zipfile.ZIP_LZMA))
    path = zip_of(members(log))
    content = bytearray(path.read_bytes())
    content[content.find(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="encrypted"):
        npz.read(path)


def test_a_log_cut_anywhere_is_refused_by_name(log: GraspLog, tmp_path: Path) -> None:
    content = container.encode(log)
    path = tmp_path / "log.npz"
    for length in range(0, len(content), 97):
        path.write_bytes(content[:length])
        with pytest.raises(InvalidInput, match="file is not a complete zip"):
            npz.read(path)


def answer_of(read: Callable[[], Any]) -> Any:
    try:
        return read()
    except InvalidInput as error:
        return error


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.tuples(st.integers(0, 2**20), st.integers(0, 255)), min_size=1, max_size=6))
def test_flipped_bytes_give_a_log_or_a_named_error(
    log: GraspLog, tmp_path: Path, changes: list[tuple[int, int]]
) -> None:
    content = bytearray(container.encode(log))
    for position, value in changes:
        content[position % len(content)] = value
    path = tmp_path / "log.npz"
    path.write_bytes(content)
    answer = answer_of(lambda: npz.read(path))
    assert isinstance(answer, GraspLog) or answer.name


@settings(max_examples=300)
@given(content=st.binary(max_size=200), magic=st.booleans())
def test_the_npy_reader_answers_any_bytes_with_an_array_or_a_named_error(content: bytes, magic: bool) -> None:
    data = b"\x93NUMPY\x01\x00v\x00" * magic + content
    answer = answer_of(lambda: npy.read_array(io.BytesIO(data), "thing", len(data)))
    assert isinstance(answer, np.ndarray) or answer.name == "thing"


def test_members_in_any_order_are_read(log: GraspLog, zip_of: ZipOf) -> None:
    shuffled: Mapping[str, bytes] = dict(reversed(members(log).items()))
    np.testing.assert_array_equal(npz.read(zip_of(shuffled)).time, log.time)
