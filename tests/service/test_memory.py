"""A server of its own under large bodies: its memory must not follow their size."""

import gzip
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from backports import zstd

MIB = 2**20
BOUND = 64 * MIB
"""Bytes by which the server may grow for bodies of any size: chunks on their way, and the allocator's slack."""

PORT = 8741
PACKERS = {"gzip": gzip.compress, "zstd": zstd.compress}


@pytest.fixture
def server(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "uvicorn", "service.app:create_app", "--factory", "--port", str(PORT)]
    settings = {"STICTION_DATA_FOLDER": str(tmp_path), "STICTION_MAX_UPLOAD_BYTES": str(4096 * MIB)}
    settings["STICTION_MAX_EXPANSION"] = "100000"
    with (tmp_path / "log").open("wb") as log:
        process = subprocess.Popen(command, env=os.environ | settings, stdout=log, stderr=log)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def peak(process: subprocess.Popen[bytes]) -> int:
    """Largest resident memory so far, in bytes."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


def zeros(size: int) -> Iterator[bytes]:
    """Not a log: it is looked at once it is there, and refused."""
    for _ in range(size // MIB):
        yield bytes(MIB)


@pytest.mark.long
@pytest.mark.parametrize("encoding", ["", "gzip", "zstd"])
def test_the_memory_of_an_upload_is_bounded_whatever_its_size(
    server: subprocess.Popen[bytes], encoding: str, record_property: Callable[[str, object], None]
) -> None:
    headers = {"content-type": "application/octet-stream"} | ({"content-encoding": encoding} if encoding else {})
    with httpx.Client(base_url=f"http://127.0.0.1:{PORT}", timeout=300.0) as client:
        until = time.monotonic() + 60.0
        while time.monotonic() < until:
            try:
                client.get("/healthz").raise_for_status()
                break
            except httpx.TransportError:
                time.sleep(0.1)
        first = client.post("/v1/grasp-logs", content=zeros(2 * MIB), headers={"content-type": headers["content-type"]})
        assert first.status_code in (415, 422), first.text
        before = peak(server)
        packed = PACKERS[encoding](bytes(64 * MIB)) * 16 if encoding else zeros(1024 * MIB)
        answer = client.post("/v1/grasp-logs", content=packed, headers=headers)
        assert answer.status_code in (415, 422), answer.text
        growth = peak(server) - before
    record_property("growth in MiB", growth / MIB)
    assert growth < BOUND
