"""Small uploads that unpack to much, at a server of its own: its memory stays within its setting, and it answers."""

import gzip
import io
import json
import os
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from backports import zstd
from numpy.typing import NDArray

from service.formats import parquet
from slipcore import GraspLog
from stiction_client.container import FORMAT, VERSION

MIB = 2**20
PEAK_BYTES = 512 * MIB
NPZ = "application/vnd.stiction.grasp-log+npz"
HEALTH_SECONDS = 2.0
"""s that /healthz may take at its worst, on a machine with other work; before, it took 16 s."""


@dataclass
class Server:
    process: subprocess.Popen[bytes]
    url: str

    def peak(self) -> int:
        """Largest resident memory so far, in bytes."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])

    def upload(self, content: bytes, content_type: str = NPZ, encoding: str = "") -> httpx.Response:
        headers = {"content-type": content_type} | ({"content-encoding": encoding} if encoding else {})
        return httpx.post(f"{self.url}/v1/grasp-logs", content=content, headers=headers, timeout=120.0)


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    command = [sys.executable, "-m", "service.cli", "serve", "--port=0"]
    settings = {"STICTION_DATA_FOLDER": str(tmp_path / "data"), "STICTION_WORKERS": "0"}
    with (tmp_path / "log").open("wb") as log:
        process = subprocess.Popen(command, env=os.environ | settings, stdout=log, stderr=log)
    try:
        yield Server(process, address(process, tmp_path / "log"))
    finally:
        process.terminate()
        process.wait()


def address(process: subprocess.Popen[bytes], log: Path) -> str:
    """The URL that a server says it listens on."""
    deadline = time.monotonic() + 60.0
    while (begin := (text := log.read_text()).find("http://127.0.0.1:")) < 0 or "\n" not in text[begin:]:
        assert process.poll() is None, text
        assert time.monotonic() < deadline, text
        time.sleep(0.02)
    return text[begin:].split()[0].rstrip('".,')


def arrays(frames: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
    """Times, positions at rest and displacements of 20×20 markers that do not move."""
    x, y = np.meshgrid(1e-3 * np.arange(20.0), 1e-3 * np.arange(20.0), indexing="ij")
    return np.arange(frames) / 30.0, np.stack([x, y, 0.0 * x], axis=-1), np.zeros((frames, 20, 20, 3), np.float32)


def container(frames: int, noise: int, compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A log in single precision: zeros but for so many numbers of ``noise``."""
    time, position, field = arrays(frames)
    field.reshape(-1)[:noise] = 1e-6 * np.random.default_rng(0).standard_normal(noise)
    members: dict[str, Any] = {"format": FORMAT, "version": VERSION, "element_area": 1e-6, "displacement": field}
    members |= {"time": time, "position": position, "force": field}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression, compresslevel=1) as archive:
        for name, value in members.items():
            array = io.BytesIO()
            np.save(array, np.asarray(value))
            archive.writestr(f"{name}.npy", array.getvalue())
    return buffer.getvalue()


def wide_window(content: bytes) -> bytes:
    """As zstd that asks for up to 128 MiB to be unpacked."""
    options = {zstd.CompressionParameter.window_log: 27, zstd.CompressionParameter.enable_long_distance_matching: 1}
    return bytes(zstd.compress(content, options=options))


def slowest_health(url: str, ended: threading.Event) -> float:
    slowest = 0.0
    with httpx.Client(base_url=url, timeout=60.0) as client:
        while not ended.is_set():
            began = time.monotonic()
            client.get("/healthz").raise_for_status()
            slowest = max(slowest, time.monotonic() - began)
            time.sleep(0.05)
    return slowest


def bombs() -> list[tuple[bytes, str, str, set[int]]]:
    """Twenty bodies, with content type and encoding, and what they may be answered."""
    steep, within_ratio, small = container(14_000, 0), container(6_000, 250_000), container(1_000, 0)
    assert len(steep) < MIB, "some 600 kB for 134 MB of single precision"
    zeros, document = bytes(64 * MIB), json.dumps({"time": [[]] * 500_000}).encode()
    return [
        *[(steep, NPZ, "", {413})] * 8,
        *[(within_ratio, NPZ, "", {200, 202})] * 2,
        *[(small, NPZ, "", {200, 202})] * 4,
        (gzip.compress(zeros, 1), NPZ, "gzip", {413}),
        (gzip.compress(steep, 1), NPZ, "gzip", {413}),
        *[(wide_window(zeros), NPZ, "zstd", {422})] * 2,
        (document, "application/json", "", {422}),
        (b"PAR0" * 10, "application/vnd.apache.parquet", "", {422}),
    ]


@pytest.mark.long
def test_twenty_bombs_at_once_leave_the_server_small_and_quick(
    server: Server, record_property: Callable[[str, object], None]
) -> None:
    sent, ended = bombs(), threading.Event()
    with ThreadPoolExecutor(len(sent) + 1) as threads:
        health = threads.submit(slowest_health, server.url, ended)
        answers = list(threads.map(lambda bomb: server.upload(*bomb[:3]), sent))
        ended.set()
    record_property("peak in MiB", server.peak() / MIB)
    record_property("slowest /healthz in s", health.result())
    for answer, (_, _, _, allowed) in zip(answers, sent, strict=True):
        assert answer.status_code in allowed, answer.text
    assert len(answers) == 20
    assert server.peak() <= PEAK_BYTES
    assert health.result() < HEALTH_SECONDS


@pytest.mark.parametrize("encoding", ["", "gzip"])
def test_an_archive_may_not_unpack_to_too_many_times_the_body_that_came(client: httpx.Client, encoding: str) -> None:
    bomb = container(2_000, 0)
    body = gzip.compress(bomb) if encoding else bomb
    headers = {"content-type": NPZ} | ({"content-encoding": encoding} if encoding else {})
    problem = client.post("/v1/grasp-logs", content=body, headers=headers).json()
    assert (problem["type"], problem["name"]) == ("/problems/upload-too-large", "body")
    assert problem["value"].startswith(f"{len(body)} bytes that unpack to 19")
    assert problem["allowed"] == "at most 200 times as many"


def test_zstd_may_not_ask_for_more_memory_than_is_usual_over_http(client: httpx.Client) -> None:
    headers = {"content-type": NPZ, "content-encoding": "zstd"}
    problem = client.post("/v1/grasp-logs", content=wide_window(bytes(16 * MIB)), headers=headers).json()
    assert problem["type"] == "/problems/invalid-request"
    assert "requires too much memory" in problem["value"]


def test_a_table_that_grows_when_it_is_read_is_refused(client: httpx.Client, tmp_path: Path) -> None:
    log = GraspLog(*arrays(2_000), element_area=1e-6)
    parquet.write(log, tmp_path / "log")
    body = (tmp_path / "log").read_bytes()
    headers = {"content-type": "application/vnd.apache.parquet"}
    problem = client.post("/v1/grasp-logs", content=body, headers=headers).json()
    assert (problem["type"], problem["name"]) == ("/problems/upload-too-large", "body")
