import json
import socket
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, closing, suppress
from pathlib import Path

import httpx
import pytest

from service.settings import Settings

ENDLESS = (Path(__file__).parents[2] / "data/hostile/endless-hdf5").read_bytes()
HDF5 = "application/x-hdf5"
Hold = Callable[[tuple[str, int]], socket.socket]


def ask(address: tuple[str, int], request: bytes) -> socket.socket:
    connection = socket.create_connection(address, timeout=10.0)
    connection.sendall(request)
    return connection


def upload(length: int, body: bytes) -> bytes:
    head = (
        f"POST /v1/grasp-logs HTTP/1.1\r\nHost: localhost\r\nContent-Type: {HDF5}\r\nContent-Length: {length}\r\n\r\n"
    )
    return head.encode() + body


def a_file_whose_reader_does_not_end(address: tuple[str, int]) -> socket.socket:
    return ask(address, upload(len(ENDLESS), ENDLESS))


def a_body_that_does_not_come(address: tuple[str, int]) -> socket.socket:
    return ask(address, upload(1000, b"\x89HDF"))


def answers_that_nobody_reads(address: tuple[str, int]) -> socket.socket:
    return ask(address, b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)


@pytest.mark.parametrize(
    ("hold", "is_begun"),
    [
        (a_file_whose_reader_does_not_end, False),
        (a_body_that_does_not_come, False),
        (answers_that_nobody_reads, True),
    ],
)
def test_a_server_that_is_to_stop_waits_a_bounded_time_for_its_clients(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]], tmp_path: Path, hold: Hold, is_begun: bool
) -> None:
    settings = Settings(data_folder=tmp_path, workers=0, shutdown_seconds=0.0)
    with ExitStack() as running:
        client = running.enter_context(serving(settings))
        address = client.base_url.host, int(client.base_url.port or 0)
        hold(address).close()
        with closing(hold(address)) as held:
            time.sleep(0.3)  # for both to begin
            began = time.monotonic()
            running.close()
            assert time.monotonic() - began < 4.0
            head, _, body = answer(held).partition(b"\r\n\r\n")
            assert is_begun or (head.split()[1], json.loads(body)["type"]) == (b"503", "/problems/stopping")


def answer(connection: socket.socket) -> bytes:
    with suppress(ConnectionResetError):
        return b"".join(iter(lambda: connection.recv(65536), b""))
    return b""
