"""A process for look-ups beside the server: the same data, lost and started anew, ended with it."""

import asyncio
import errno
import os
import re
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from service.lookup_server import LookupServer, server_of
from service.processes import spawned
from service.serving import Server
from service.settings import Settings
from tests import forking
from tests.waiting import wait_until

DASHBOARD = re.compile(r"the dashboard is at (\S+)/$", re.MULTILINE)
LOOK_UPS = re.compile(r"look-ups are answered at (\S+)/ by process (\d+)$", re.MULTILINE)
PATIENCE = 60.0
"""s; only against waiting for ever."""


class Service:
    """``stiction serve`` with a process for look-ups, by what it logs."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._log = folder, folder / "log"
        command = ("service.cli", "serve", "--port", "0", "--lookup-port", "0")
        settings = {
            "STICTION_DATA_FOLDER": str(folder / "data"),
            "STICTION_WORKERS": "0",
            "STICTION_SHUTDOWN_SECONDS": "3",  # longer than the wait before a lost process is started anew
        }
        self.process = forking.start_module(command, settings, self._log)
        wait_until(lambda: LOOK_UPS.search(self.log) or not self.process.is_alive(), "the start")
        assert self.process.is_alive(), self.log
        found = DASHBOARD.search(self.log)
        assert found is not None
        self.url = found[1]

    @property
    def log(self) -> str:
        return self._log.read_text() if self._log.exists() else ""

    @property
    def look_ups(self) -> tuple[str, int]:
        """Address and process id of the process that was started last."""
        address, process = LOOK_UPS.findall(self.log)[-1]
        return address, int(process)


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    running = Service(tmp_path)
    yield running
    running.process.kill()
    running.process.join()


def is_gone(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def test_look_ups_have_a_process_that_is_started_anew_and_ends_with_the_server(service: Service) -> None:
    httpx.post(f"{service.url}/v1/materials", json={"name": "paper"}).raise_for_status()
    address, first = service.look_ups
    assert first != service.process.pid
    material = f"{address}/v1/materials/paper"
    assert httpx.get(material, timeout=PATIENCE).json()["name"] == "paper"

    os.kill(first, signal.SIGKILL)
    wait_until(lambda: is_gone(first), "the process to die")
    assert httpx.get(material, timeout=PATIENCE).json()["name"] == "paper"  # it waited, and was not refused
    same, second = service.look_ups
    assert (same, second != first) == (address, True)
    assert f"process {first}, which answered look-ups, has ended" in service.log
    assert "ERROR service.lookup_server: the process that answers look-ups is started anew" in service.log

    service.process.terminate()
    service.process.join(PATIENCE)
    assert not service.process.is_alive()
    assert is_gone(second)
    assert f"Finished server process [{second}]" in service.log
    assert "Traceback" not in service.log


def test_a_signal_to_all_processes_ends_them_and_starts_none(service: Service) -> None:
    address, process = service.look_ups
    httpx.get(f"{address}/healthz", timeout=PATIENCE).raise_for_status()
    host, port = service.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port))) as upload:  # which the server waits for
        head = "POST /v1/grasp-logs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n"
        upload.sendall(f"{head}Content-Type: application/vnd.stiction.grasp-log+npz\r\n\r\nPK".encode())
        wait_until(lambda: list((service.folder / "data/spool").iterdir()), "the upload to begin", 30.0)
        service.process.terminate()
        os.kill(process, signal.SIGTERM)
        service.process.join(PATIENCE)
    assert not service.process.is_alive()
    assert is_gone(process)
    assert service.look_ups == (address, process)
    assert "started anew" not in service.log


def test_the_process_ends_when_the_server_is_killed(service: Service) -> None:
    address, process = service.look_ups
    httpx.get(f"{address}/healthz", timeout=PATIENCE).raise_for_status()
    assert not is_gone(process)
    service.process.kill()
    service.process.join()
    wait_until(lambda: is_gone(process), "the process to end", PATIENCE)


def test_a_process_that_cannot_be_started_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    tries: list[object] = []

    def fail(**given: object) -> None:
        tries.append(given)
        raise OSError(errno.EAGAIN, "no more processes")

    monkeypatch.setattr("service.lookup_server.RESTART_SECONDS", 0.0)
    monkeypatch.setattr(spawned.CONTEXT, "Process", fail)

    async def serve() -> None:
        lookups = LookupServer(Settings(data_folder=tmp_path, lookup_port=0))
        lookups.start(lambda: len(tries) < 3)
        async with asyncio.timeout(PATIENCE):
            while len(tries) < 3:
                await asyncio.sleep(0.0)
        await lookups.stop()

    asyncio.run(serve())
    assert len(tries) == 3
    assert caplog.text.count("no process for look-ups could be started") == 3


def test_a_port_that_is_taken_is_refused_by_name(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=rf"STICTION_LOOKUP_PORT \(--lookup-port\) is {port}, .*: a free port"):
            server_of(Settings(data_folder=tmp_path, lookup_port=port))


def test_without_a_port_there_is_no_process(tmp_path: Path) -> None:
    assert type(server_of(Settings(data_folder=tmp_path))) is Server
