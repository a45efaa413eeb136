"""Small files that keep a reader busy for seconds: who sends them has a bounded share, and others go on."""

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.formats import reading
from service.processes import fair_queue
from service.settings import Settings

ENDLESS = (Path(__file__).parents[2] / "data/hostile/endless-hdf5").read_bytes()
"""1 kB in which the library goes round until its time is up."""

TABLE = b"time,marker,x,y\n0,1,2,3\n"
HDF5, CSV = "application/x-hdf5", "text/csv"
ENDLESS_SECONDS = 20.0
"""s that each of the endless files takes here, on a machine that may be busy; usually 5 s."""


@pytest.fixture
def new_key(served: Settings, client: httpx.Client) -> Iterator[Callable[[], dict[str, str]]]:
    """Headers with an access key of its own on the shared server."""
    client.get("/readyz")
    database = Database(served.resolved_database_url)

    def make() -> dict[str, str]:
        key_id, text = keys.new_key()
        with database.write() as session:
            access_keys.add(session, key_id, "robot", "upload", keys.digest(text))
        return {"authorization": f"Bearer {text}"}

    yield make
    database.close()


@contextmanager
def attack(client: httpx.Client, count: int, headers: dict[str, str]) -> Iterator[list[socket.socket]]:
    """So many connections that have sent an endless file each, and wait."""
    lines = {"host": "localhost", "content-type": HDF5, "content-length": str(len(ENDLESS)), **headers}
    head = "POST /v1/grasp-logs HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in lines.items())
    with ExitStack() as connections:
        opened = [
            connections.enter_context(socket.create_connection((client.base_url.host, client.base_url.port or 80)))
            for _ in range(count)
        ]
        for connection in opened:
            connection.sendall(head.encode() + b"\r\n" + ENDLESS)
        time.sleep(0.5)
        yield opened


def upload_table(client: httpx.Client, headers: dict[str, str]) -> float:
    """s until a small table was answered."""
    began = time.monotonic()
    answer = client.post("/v1/grasp-logs", content=TABLE, headers={"content-type": CSV, **headers})
    assert answer.status_code == 422, answer.text
    assert answer.json()["name"] != "file", "it was read"
    return time.monotonic() - began


def test_one_key_cannot_keep_the_readers_from_others_nor_once_it_is_gone(
    client: httpx.Client, new_key: Callable[[], dict[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "LEAST_SECONDS", ENDLESS_SECONDS)
    hostile, honest = new_key(), new_key()
    with attack(client, 4, hostile) as connections:
        assert upload_table(client, honest) < ENDLESS_SECONDS
        assert not any(has_answer(connection) for connection in connections)
    assert upload_table(client, hostile) < ENDLESS_SECONDS, "it waited for files that nobody waits for"


def has_answer(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return bool(connection.recv(1))
    except BlockingIOError:
        return False


def test_who_has_too_many_waiting_is_told_to_come_again(
    client: httpx.Client, new_key: Callable[[], dict[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fair_queue, "MOST_WAITING_OF_ONE", 1)
    hostile = new_key()
    with attack(client, 2, hostile):
        answer = client.post("/v1/grasp-logs", content=ENDLESS, headers={"content-type": HDF5, **hostile})
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/too-many-uploads")
        assert answer.headers["retry-after"] == "5"


@pytest.mark.parametrize("name", ["mcap", "x-rosbag", "x-rosbag2", "vnd.apache.parquet"])
def test_what_does_not_begin_as_its_format_does_reaches_no_reader(
    client: httpx.Client, new_key: Callable[[], dict[str, str]], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading.Readers, "convert", None)
    kind = f"application/{'x-' if name == 'mcap' else ''}{name}"
    answer = client.post("/v1/grasp-logs", content=TABLE, headers={"content-type": kind, **new_key()})
    assert (answer.status_code, answer.json()["name"]) == (422, "file")
    assert "starts with" in answer.json()["value"]
