"""What other users of the machine can read of what the service keeps."""

import stat
from pathlib import Path

import pytest

from tests import forking

SCRIPT = """
import os
os.umask(umask)
from fastapi.testclient import TestClient
from service.app import create_app
from service.settings import Settings
with TestClient(create_app(Settings(workers=0)), base_url="http://127.0.0.1", client=("127.0.0.1", 1)) as client:
    content = open(log, "rb").read()
    type = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    answer = client.post("/v1/grasp-logs", content=content, headers=type)
    assert answer.status_code == 202, answer.text
    from service import cli
    try:
        cli.main(["db", "backup", copy])
    except SystemExit as ended:
        assert not ended.code
    else:
        raise AssertionError("the command did not end")
"""


@pytest.mark.parametrize("umask", ["000", "022"])
def test_no_file_or_folder_is_for_others_whatever_the_umask(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, umask: str
) -> None:
    log, data, copy = tmp_path / "log.npz", tmp_path / "data", tmp_path / "copy"
    log.write_bytes(content)
    monkeypatch.setenv("STICTION_DATA_FOLDER", str(data))
    assert forking.exit_code(exec, SCRIPT, {"umask": int(umask, 8), "log": str(log), "copy": str(copy)}) == 0
    made = [data, copy, *data.rglob("*"), *copy.rglob("*")]
    modes = {stat.S_IMODE(path.stat().st_mode) for path in made if path.is_dir()}
    assert modes == {0o750}
    files = {path.name: stat.S_IMODE(path.stat().st_mode) for path in made if path.is_file()}
    assert len(files) >= 3
    assert all(mode & ~0o640 == 0 for mode in files.values()), files
