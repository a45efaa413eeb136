"""What a file is, by how it begins and by what was said of it."""

import zipfile
from pathlib import Path

import pytest

from service import formats
from service.formats import FORMATS, UnsupportedFormat, UnusedSetting
from slipcore import InvalidInput


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "upload"


BEGINS = {
    "mcap": b"\x89MCAP0\r\n",
    "rosbag1": b"#ROSBAG V2.0",
    "rosbag2": b"SQLite format 3\x00",
    "hdf5": b"\x89HDF\r\n\x1a\n",
    "parquet": b"PAR1",
    "json": b"\xef\xbb\xbf \r\n\t{",
}


@pytest.mark.parametrize("name", list(BEGINS))
def test_a_file_is_known_by_how_it_begins(path: Path, name: str) -> None:
    path.write_bytes(BEGINS[name] + b"more")
    assert formats.identify(path) == name
    assert formats.identify(path, "application/octet-stream; x=y") == name
    path.write_bytes(BEGINS[name][:-1])
    if name != "rosbag1":
        with pytest.raises(UnsupportedFormat):
            formats.identify(path)


def test_a_zip_is_known_by_what_is_in_it(path: Path) -> None:
    for names, name in (
        (["format.npy", "index.npy"], "npz"),
        (["SN/index.npy", "a.db3"], "tac3d"),
        (["bag/a_0.mcap", "x"], "rosbag2"),
    ):
        with zipfile.ZipFile(path, "w") as archive:
            for each in names:
                archive.writestr(each, b"")
        assert formats.identify(path) == name
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.txt", b"")
        archive.writestr("b", b"")
    with pytest.raises(UnsupportedFormat, match=r"a zip of a.txt, b; allowed"):
        formats.identify(path)


def test_folders_are_known_by_their_files(tmp_path: Path) -> None:
    assert formats.identify(tmp_path) == "tac3d"
    (tmp_path / "a_0.db3").touch()
    assert formats.identify(tmp_path) == "rosbag2"
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").touch()
    assert formats.identify(tmp_path) == "parquet"


def test_a_table_is_of_markers_or_with_a_mapping_of_frames(path: Path) -> None:
    path.write_text("time,marker,x,y\n0,0,1,1\n")
    assert formats.identify(path) == "tracked markers"
    for content_type in (None, "text/csv"):
        assert formats.identify(path, content_type, {"mapping": "{}"}) == "frame table"
    assert formats.identify(path, "text/csv", {"mapping": None}) == "tracked markers"
    path.write_text("time,force\n0,1\n")
    with pytest.raises(
        UnsupportedFormat, match="file is a table that begins with 'time,force'; allowed: the columns of"
    ):
        formats.identify(path)


def test_what_is_said_of_a_file_goes_before_how_it_begins(path: Path) -> None:
    path.write_bytes(b"PAR1")
    assert formats.identify(path, " Application/JSON ; charset=utf-8") == "json"
    with pytest.raises(UnsupportedFormat, match=r"content type is image/png; allowed: application/vnd.stiction"):
        formats.identify(path, "image/png")


def test_what_is_of_no_format_is_told_how_it_begins(path: Path) -> None:
    path.write_bytes(b"")
    with pytest.raises(UnsupportedFormat, match="file is empty; allowed: npz, tac3d, tracked markers, "):
        formats.identify(path)
    path.write_bytes(b"\x00\x01\x02\x03\x04")
    told = (
        r"file is of no known format \(it starts with b'\\x00\\x01\\x02\\x03'\); allowed: npz, tac3d, tracked markers"
    )
    with pytest.raises(UnsupportedFormat, match=told):
        formats.identify(path)


@pytest.mark.parametrize("name", ["mcap", "rosbag1", "rosbag2", "parquet"])
def test_a_reader_is_given_only_what_begins_as_its_format_does(path: Path, name: str) -> None:
    path.write_bytes(BEGINS[name])
    formats.check_start(path, name)
    path.write_bytes(b"PK\x03\x04")
    if name == "rosbag2":
        formats.check_start(path, name)
        path.write_bytes(b"SQLite format 4")
    with pytest.raises(
        InvalidInput, match=rf"file is no {name} \(it starts with .*\); allowed: a file that starts with"
    ):
        formats.check_start(path, name)


def test_something_may_stand_before_hdf5_and_before_what_has_no_beginning(path: Path) -> None:
    path.write_bytes(b"\x00")
    for name in ("hdf5", "json", "tac3d"):
        formats.check_start(path, name)


@pytest.mark.parametrize(
    ("name", "settings", "told"),
    [
        (
            "npz",
            {"rest": "first"},
            "rest is first with npz; allowed: only beside tracked markers or a format of topics",
        ),
        ("tracked markers", {"mapping": "{}"}, "mapping is {} with tracked markers; allowed: only beside a format of"),
        (
            "mcap",
            {"scale": 1.0},
            "scale is 1.0 with mcap; allowed: only beside a table of tracked markers: other formats",
        ),
        ("json", {"frame_rate": 30}, "frame_rate is 30 with json; allowed: .*: other formats have times"),
        (
            "json",
            {"mapping": '{"episode": 0}'},
            r"mapping episode is 0 with json; allowed: only for Parquet \(LeRobot\)",
        ),
        (
            "parquet",
            {"mapping": '{"notes": {"a": "b"}}'},
            "mapping notes is .* with parquet; allowed: only for a table",
        ),
    ],
)
def test_a_setting_that_a_format_has_no_use_for_is_refused(name: str, settings: formats.Settings, told: str) -> None:
    with pytest.raises(UnusedSetting, match=told):
        formats.check_settings(name, settings)


def test_settings_that_are_not_given_are_fine_with_all() -> None:
    for name in FORMATS:
        formats.check_settings(name, {"scale": None, "frame_rate": None, "rest": None, "mapping": None})
    formats.check_settings("tracked markers", {"scale": 1.0, "frame_rate": 30.0, "rest": "first"})
    formats.check_settings("parquet", {"mapping": '{"episode": 0}', "rest": "least contact"})


def test_the_folder_of_a_sensor_alone_is_of_a_format_of_folders(path: Path, tmp_path: Path) -> None:
    path.write_text("{}")
    (tmp_path / "alone").mkdir()
    with pytest.raises(InvalidInput, match=r"rest is the folder .*/alone; allowed: a file, as of any json"):
        formats.read(path, rest=tmp_path / "alone")
