import pickle
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from service import formats
from service.formats.assemble import MAX_CONTENT_BYTES
from service.formats.npy import MAX_ARRAY_BYTES
from slipcore import GraspLog, InvalidInput
from slipcore.contact import tangential_ramp
from stiction_client import container

Fields = dict[str, np.ndarray]


@pytest.fixture
def npz_path(log: GraspLog, tmp_path: Path) -> Path:
    return container.write(log, tmp_path / "upload")


@pytest.fixture
def tac3d_path(recording_fields: Fields, zip_of: Callable[..., Path]) -> Path:
    return zip_of({f"SN/{name}.npy": array for name, array in recording_fields.items()})


def test_the_documented_size_of_an_unpacked_log_is_what_is_taken() -> None:
    page = (Path(__file__).parents[3] / "docs/formats.md").read_text()
    told = re.search(r"a log may have (\d+) MiB \((\d+) MiB in the formats that other libraries read\)", page)
    assert told is not None
    assert [int(size) * 2**20 for size in told.groups()] == [MAX_ARRAY_BYTES, MAX_CONTENT_BYTES]


@pytest.mark.parametrize(
    "content_type",
    [None, "application/zip", "application/octet-stream", "Application/Zip; charset=x", container.CONTENT_TYPE],
)
def test_an_npz_container_is_recognised(npz_path: Path, content_type: str | None) -> None:
    assert formats.identify(npz_path, content_type) == "npz"
    assert len(formats.read(npz_path, content_type)) == 5


@pytest.mark.parametrize("content_type", [None, "application/zip", "application/vnd.tac3d+zip"])
def test_a_zipped_recording_is_recognised(tac3d_path: Path, content_type: str | None) -> None:
    assert formats.identify(tac3d_path, content_type) == "tac3d"
    assert formats.read(tac3d_path, content_type).sensor == "SN"


def test_a_recording_folder_is_recognised(recording_fields: Fields, folder_of: Callable[[Fields], Path]) -> None:
    assert formats.read(folder_of(recording_fields)).sensor == "AD2-0065L"


def test_a_content_type_that_is_not_known_lists_what_is(npz_path: Path) -> None:
    with pytest.raises(formats.UnsupportedFormat) as caught:
        formats.read(npz_path, "text/html")
    assert caught.value.name == "content type"
    assert caught.value.value == "text/html"
    for accepted in (*formats.CONTENT_TYPES, *formats.UNSPECIFIC_TYPES):
        assert accepted in caught.value.allowed


@pytest.mark.parametrize("content", [b"", b"PK", b"time,force\n1,2\n", b"\x93NUMPY\x01\x00", b"\x89PNG\r\n\x1a\n"])
def test_a_file_that_is_not_a_log_is_unsupported(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "upload"
    path.write_bytes(content)
    with pytest.raises(formats.UnsupportedFormat, match="file is"):
        formats.read(path)


def test_a_zip_of_something_else_is_unsupported(zip_of: Callable[..., Path]) -> None:
    with pytest.raises(formats.UnsupportedFormat, match=r"a zip of holiday\.jpg"):
        formats.read(zip_of({"holiday.jpg": b"\xff\xd8"}))


def test_a_log_that_is_not_what_its_content_type_says_is_invalid(npz_path: Path, tac3d_path: Path) -> None:
    with pytest.raises(InvalidInput, match="fields is without"):
        formats.read(npz_path, "application/vnd.tac3d+zip")
    with pytest.raises(InvalidInput, match="members is without"):
        formats.read(tac3d_path, container.CONTENT_TYPE)


def test_a_missing_file_is_the_operating_systems_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        formats.read(tmp_path / "nothing")


def test_the_error_survives_pickling() -> None:
    error = pickle.loads(pickle.dumps(formats.UnsupportedFormat("content type", "text/csv")))
    assert isinstance(error, formats.UnsupportedFormat)
    assert error.value == "text/csv"


def test_a_notebook_reads_a_log_as_its_page_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parents[3] / "docs" / "notebook.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    monkeypatch.chdir(tmp_path)
    Path("grasp.npz").write_bytes(container.encode(tangential_ramp(points=10, pitch=1.5e-3, seed=1)))
    exec(compile(code, "notebook.md", "exec"), {})
    assert Path("samples.csv").read_text().startswith("friction_coefficient,")
