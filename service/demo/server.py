"""A real server in a process of its own, for the demo."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import httpx

START_TIMEOUT = 600.0
"""s; a start takes seconds, and minutes where the kernels must be compiled and others work on the machine, too."""

SAID_AFTER = 10.0
"""s of silence; then it is said what is waited for."""


@contextmanager
def running_server(folder: Path) -> Iterator[str]:
    """Serve from ``folder`` on a free loopback port, yield the address, stop the server at the end.

    Raises ``RuntimeError`` with the end of the server's own log if it does not get ready.
    """
    with starting_server(folder) as address:
        yield address()


@contextmanager
def starting_server(folder: Path, say: Callable[[str], object] = print) -> Iterator[Callable[[], str]]:
    """The same, for who has something to do while the server starts: waits for it where the address is asked for.

    ``say`` is called with what is waited for where that takes long.
    """
    folder.mkdir(parents=True, exist_ok=True)
    port = _free_port()
    log = folder / "server.log"
    command = [sys.executable, "-m", "service.cli", "serve", "--host", "127.0.0.1", "--port", str(port)]
    environment = {"STICTION_LEAST_FREE_BYTES": "0"} | os.environ | {"STICTION_DATA_FOLDER": str(folder)}
    with log.open("wb") as output:
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=subprocess.STDOUT)
        try:
            yield partial(_address, f"http://127.0.0.1:{port}", process, log, say)
        finally:
            process.terminate()
            process.wait(timeout=30)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _address(url: str, process: "subprocess.Popen[bytes]", log: Path, say: Callable[[str], object]) -> str:
    """The server's address, once it is ready: as long as its process lives, within bounds, it is waited for."""
    began, is_said = time.monotonic(), False
    with httpx.Client(timeout=2.0, verify=False, trust_env=False) as client:  # certificates take longer than asking
        while (waited := time.monotonic() - began) < START_TIMEOUT and process.poll() is None:
            if _is_ready(client, url):
                return url
            if waited > SAID_AFTER and not is_said:
                say("The server is not ready yet: after a change its kernels are compiled first, for a minute or two.")
                is_said = True
            time.sleep(0.05)
    tail = "\n".join(log.read_text(errors="replace").splitlines()[-20:])
    raise RuntimeError(f"the server did not get ready on {url}; the end of its log:\n{tail}")


def _is_ready(client: httpx.Client, url: str) -> bool:
    with suppress(httpx.TransportError):  # not listening yet
        return client.get(f"{url}/readyz").status_code == httpx.codes.OK
    return False
