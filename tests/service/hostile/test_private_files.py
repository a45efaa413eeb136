"""What other users of the machine can read of what the service keeps."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import os, sys
os.umask(int(sys.argv[1], 8))
from fastapi.testclient import TestClient
from service.app import create_app
from service.settings import Settings
with TestClient(create_app(Settings(workers=0)), base_url="http://127.0.0.1", client=("127.0.0.1", 1)) as client:
    content = open(sys.argv[2], "rb").read()
    type = {"content-type": "application/vnd.stiction.grasp-log+npz"}
    answer = client.post("/v1/grasp-logs", content=content, headers=type)
    assert answer.status_code == 202, answer.text
    from service import cli
    try:
        cli.main(["db", "backup", sys.argv[3]])
    except SystemExit as ended:
        assert not ended.code
    else:
        raise AssertionError("the command did not end")
"""


@pytest.mark.parametrize("umask", ["000", "022"])
def test_no_file_or_folder_is_for_others_whatever_the_umask(tmp_path: Path, content: bytes, umask: str) -> None:
    log, data, copy = tmp_path / "log.npz", tmp_path / "data", tmp_path / "copy"
    log.write_bytes(content)
    environment = os.environ | {"STICTION_DATA_FOLDER": str(data)}
    command = [sys.executable, "-c", SCRIPT, umask, str(log), str(copy)]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stderr
    made = [data, copy, *data.rglob("*"), *copy.rglob("*")]
    modes = {stat.S_IMODE(path.stat().st_mode) for path in made if path.is_dir()}
    assert modes == {0o750}
    files = {path.name: stat.S_IMODE(path.stat().st_mode) for path in made if path.is_file()}
    assert len(files) >= 3
    assert all(mode & ~0o640 == 0 for mode in files.values()), files
