"""A disk without a free byte: uploads are refused, jobs wait, and both go on once there is room."""

import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

AWAY = (503, "/problems/storage-unavailable")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "data"
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=12m", "tmpfs", folder], capture_output=True).returncode:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", folder], check=True)


def fill(folder: Path) -> Path:
    """Leave no byte free."""
    filler = folder / "filler"
    with filler.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))
    return filler


@pytest.mark.long
def test_a_full_disk_refuses_uploads_and_lets_jobs_wait(
    small_disk: Path,
    new_url: Callable[..., str],
    new_fleet: Callable[[Path, str], Any],
    contents: Callable[[int], list[bytes]],
) -> None:
    """The disk of the data folder, which SQLite's file is on."""
    fleet = new_fleet(small_disk, new_url(small_disk))
    *before, late = contents(4)
    server = fleet.serve()
    server.make_material()
    accepted = [server.accept(content) for content in before]
    fleet.work()
    fleet.wait_until(lambda: bool(fleet.runners()), "the worker to start")
    filler = fill(small_disk)
    for content in (late, *before):
        refused = server.upload(content)
        assert (refused.status_code, refused.json()["type"]) == AWAY
    assert server.client.get("/readyz").status_code == httpx.codes.SERVICE_UNAVAILABLE
    fleet.wait_until(
        lambda: "jobs wait" in fleet.log.read_text() or " waits: " in fleet.log.read_text(), "a job to wait"
    )
    for path in ("/v1/materials/paper", "/v1/jobs", "/v1/grasp-logs"):
        assert server.client.get(path).status_code == httpx.codes.OK
    assert fleet.unfinished() == len(before)
    filler.unlink()
    accepted.append(server.accept(late))
    assert [server.accept(content) for content in before] == accepted[:-1]
    fleet.check_complete(accepted)
