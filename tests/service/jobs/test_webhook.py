import hashlib
import hmac
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import timedelta
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from db.database import Database
from db.errors import StorageUnavailable
from db.records import SeenClock
from db.repositories import audit, stores
from db.tables import AuditEntryRow, now
from service.jobs import webhook
from service.jobs.webhook import DeliveryFailed, Webhook
from service.settings import Settings
from tests.waiting import wait_until

ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
SECRET = "a secret of the laboratory"


class Receiver:
    """An address on loopback, what it was sent, and what it answers."""

    def __init__(self) -> None:
        self.got: list[tuple[dict[str, str], bytes]] = []
        self.status, self.headers = 204, dict[str, str]()
        self.overtaking: Callable[[], bool] | None = None  # what happens before the next answer
        self.server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self.url = f"http://127.0.0.1:{self.server.server_port}/hooks/friction?token=hush"

    @property
    def told(self) -> list[dict[str, Any]]:
        return [json.loads(body) for _, body in self.got]

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                receiver.got.append(({name.lower(): value for name, value in self.headers.items()}, body))
                if (meanwhile := receiver.overtaking) is not None:
                    receiver.overtaking = None
                    meanwhile()
                self.send_response(receiver.status)
                for name, value in receiver.headers.items():
                    self.send_header(name, value)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        return Handler


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    receiver = Receiver()
    thread = threading.Thread(target=receiver.server.serve_forever, args=(0.01,))
    thread.start()
    yield receiver
    receiver.server.shutdown()
    thread.join()
    receiver.server.server_close()


@pytest.fixture(autouse=True)
def settled(monkeypatch: pytest.MonkeyPatch) -> None:
    """No entry has to wait."""
    monkeypatch.setattr(webhook, "SETTLED", 0.0)


@pytest.fixture
def stored(database: Database) -> Database:
    """A database that belongs to a store."""
    with database.write() as session:
        stores.set_id(session, "5" * 32)
    return database


def found(database: Database, subject: str, action: str = "material.surface_changed", age: float = 60.0) -> None:
    """An entry of ``age`` s of the audit trail."""
    details = {"change": "friction of the newest grasp is 25 % lower", "of": "Stück"}
    with database.write() as session:
        at = now() - timedelta(seconds=age)
        session.add(AuditEntryRow(at=at, actor="service", action=action, subject=subject, details=details))


def hook(database: Database, receiver: Receiver, secret: str | None = None, expected: int = 0) -> Webhook:
    """One that has sent all that is in the trail and new: so much."""
    made = Webhook(database, receiver.url, secret, lambda: True)
    assert made.send_new() == expected
    return made


def test_what_the_service_finds_is_told_once_and_in_order(stored: Database, receiver: Receiver) -> None:
    found(stored, "from before there was a webhook")
    sender = hook(stored, receiver)
    found(stored, "paper")
    found(stored, "3" * 64, "blob.damaged")
    found(stored, "felt", "material.created")
    assert sender.send_new() == 2
    assert sender.send_new() == 0
    assert [each["subject"] for each in receiver.told] == ["paper", "3" * 64]
    first = receiver.told[0]
    assert first["details"] == {"change": "friction of the newest grasp is 25 % lower", "of": "Stück"}
    assert (first["store"], first["action"], first["id"]) == ("5" * 32, "material.surface_changed", 2)
    with stored.read() as session:
        entry = audit.first_between(session, 1, 2, ["material.surface_changed"])
    assert entry is not None
    assert first["at"] == entry.at.isoformat()


@pytest.mark.parametrize("age", [-86400.0, 60.0])
def test_an_entry_waits_until_those_before_it_are_sure_to_be_seen(
    stored: Database, receiver: Receiver, monkeypatch: pytest.MonkeyPatch, age: float
) -> None:
    """By when it was seen: the clock of the process that made it may be ahead."""
    clock = [0.0]
    monkeypatch.setattr(webhook, "SETTLED", 30.0)
    monkeypatch.setattr(webhook.time, "monotonic", lambda: clock[0])
    sender = hook(stored, receiver)
    found(stored, "paper", age=age)
    found(stored, "felt")
    counts = []
    for clock[0] in (5.0, 20.0, 35.0, 40.0):
        counts += [sender.send_new()]
    assert counts == [0, 0, 2, 0]
    assert [each["subject"] for each in receiver.told] == ["paper", "felt"]


def test_what_is_not_taken_comes_again_before_what_follows(stored: Database, receiver: Receiver) -> None:
    sender = hook(stored, receiver)
    found(stored, "paper")
    found(stored, "felt")
    for receiver.status in (500, 404, 301):
        with pytest.raises(DeliveryFailed, match=f"answered {receiver.status} to entry 1 "):
            sender.send_new()
    receiver.status = 200
    assert Webhook(stored, receiver.url, None, lambda: True).send_new() == 2  # after a restart
    assert [each["subject"] for each in receiver.told] == ["paper"] * 4 + ["felt"]


def test_no_other_address_is_asked_where_one_sends_on(stored: Database, receiver: Receiver) -> None:
    sender = hook(stored, receiver)
    found(stored, "paper")
    receiver.status, receiver.headers = 307, {"location": "/elsewhere"}
    with pytest.raises(DeliveryFailed, match="answered 307"):
        sender.send_new()
    assert len(receiver.got) == 1


def test_one_that_was_taken_just_before_a_fault_comes_again_with_its_id(
    stored: Database, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    sender = hook(stored, receiver)
    found(stored, "paper")

    def fail(*_: object) -> None:
        raise StorageUnavailable("the database is away")

    with monkeypatch.context() as patched:
        patched.setattr(stores, "set_webhook_entry", fail)
        with pytest.raises(StorageUnavailable):
            sender.send_new()
    assert sender.send_new() == 1
    assert receiver.got[0][1] == receiver.got[1][1]


def test_an_entry_too_old_does_not_stop_what_follows(
    stored: Database, receiver: Receiver, caplog: pytest.LogCaptureFixture
) -> None:
    sender = hook(stored, receiver)
    found(stored, "paper", age=8 * 86400.0)
    found(stored, "felt")
    assert sender.send_new() == 1
    assert [each["subject"] for each in receiver.told] == ["felt"]
    assert "entry 1 of the audit trail is too old to be sent" in caplog.text


def test_nothing_is_given_up_by_a_clock_that_may_be_wrong(stored: Database, receiver: Receiver) -> None:
    sender = hook(stored, receiver)
    found(stored, "paper", age=8 * 86400.0)
    with stored.write() as session:
        stores.note_clock(session, SeenClock(now() - timedelta(days=30), 1e6))
    assert sender.send_new() == 1


def test_what_another_process_has_sent_meanwhile_is_not_sent_again(stored: Database, receiver: Receiver) -> None:
    """One that leads no more ends after the entry that it is at."""
    first = hook(stored, receiver)
    for subject in ("paper", "felt", "cork"):
        found(stored, subject)

    def overtaken() -> bool:
        return second.send_new() == 3

    second = Webhook(stored, receiver.url, None, lambda: True)
    receiver.overtaking = overtaken
    assert first.send_new() == 1
    assert [each["subject"] for each in receiver.told] == ["paper", "paper", "felt", "cork"]


def test_a_name_that_is_none_is_told_without_it(stored: Database) -> None:
    """It had ended the look with a traceback, every 5 s."""
    sender = Webhook(stored, "http://xn--a/", None, lambda: True)
    assert sender.send_new() == 0
    found(stored, "paper")
    with pytest.raises(DeliveryFailed, match=r"cannot be reached \(InvalidCodepoint\)"):
        sender.send_new()


@ONLY_SQLITE
def test_a_resolver_that_hangs_is_left(stored: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    """It held whoever sends for 25 s, and a process that was to end."""
    ended = threading.Event()
    monkeypatch.setattr(webhook, "TIMEOUT", 0.2)
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: ended.wait(20.0))
    sender = Webhook(stored, "http://hooks.example/", None, lambda: True)
    assert sender.send_new() == 0
    found(stored, "paper")
    begun = time.monotonic()
    with pytest.raises(DeliveryFailed, match=r"took longer than 0\.2 s"):
        sender.send_new()
    assert time.monotonic() - begun < 10.0
    ended.set()


@ONLY_SQLITE
def test_a_name_that_nobody_knows_is_told_without_it(stored: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "no such name")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    sender = Webhook(stored, "http://hooks.example/", None, lambda: True)
    assert sender.send_new() == 0
    found(stored, "paper")
    with pytest.raises(DeliveryFailed, match=r"cannot be reached \(ConnectError\)"):
        sender.send_new()


@pytest.mark.parametrize("how", ["drips", "goes on to say"])
def test_an_address_that_never_ends_its_answer_is_left(
    stored: Database, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    monkeypatch.setattr(webhook, "TIMEOUT", 0.5)
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            with listening.accept()[0] as connection, suppress(OSError):
                connection.sendall(b"HTTP/1.1 ")
                while not ended.wait(0.05):
                    connection.sendall(b"2" if how == "drips" else b"103 Early Hints\r\n\r\nHTTP/1.1 ")

        thread = threading.Thread(target=serve)
        thread.start()
        sender = Webhook(stored, f"http://127.0.0.1:{listening.getsockname()[1]}/", None, lambda: True)
        assert sender.send_new() == 0
        found(stored, "paper")
        with pytest.raises(DeliveryFailed, match=r"took longer than 0\.5 s"):
            sender.send_new()
        ended.set()
        thread.join()


@ONLY_SQLITE
def test_a_secret_signs_what_is_sent(stored: Database, receiver: Receiver) -> None:
    sender = hook(stored, receiver, SECRET)
    found(stored, "paper")
    sender.send_new()
    ((headers, body),) = receiver.got
    signature = hmac.new(SECRET.encode(), body, hashlib.sha256).hexdigest()
    assert headers["stiction-signature"] == f"sha256={signature}"
    assert headers["content-type"] == "application/json"


@ONLY_SQLITE
def test_pauses_between_attempts_grow_to_ten_minutes(
    stored: Database, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = 0
    monkeypatch.setattr(webhook.time, "monotonic", lambda: float(seconds))
    sender = hook(stored, receiver)
    found(stored, "paper")
    receiver.status = 503
    asked = []
    for seconds in range(0, 1300, 5):
        before = len(receiver.got)
        sender._look()
        asked += [seconds] * (len(receiver.got) - before)
    assert asked == [0, 5, 15, 35, 75, 155, 315, 635, 1235]


@ONLY_SQLITE
def test_an_address_that_nobody_listens_at_is_waited_for_and_not_logged(
    stored: Database, receiver: Receiver, caplog: pytest.LogCaptureFixture
) -> None:
    hook(stored, receiver)
    found(stored, "paper")
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        sender = Webhook(stored, f"http://127.0.0.1:{bound.getsockname()[1]}/?token=hush", None, lambda: True)
        sender._look()
    told = [record.getMessage() for record in caplog.records if record.name == webhook.__name__]
    assert told == ["webhook: the address cannot be reached (ConnectError); the next attempt is in 5 s"]
    assert hook(stored, receiver, expected=1)


@ONLY_SQLITE
def test_only_the_process_that_leads_sends(stored: Database, receiver: Receiver) -> None:
    hook(stored, receiver)
    found(stored, "paper")
    Webhook(stored, receiver.url, None, lambda: False)._look()
    assert receiver.got == []


@ONLY_SQLITE
def test_a_server_with_a_webhook_tells(
    tmp_path: Path, database: Database, serving: Any, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webhook, "LOOK_SECONDS", 0.02)
    settings = Settings(data_folder=tmp_path, database_url=database.url, webhook_url=receiver.url, lease_seconds=0.5)
    with serving(settings):

        def has_begun() -> bool:
            with database.read() as session:
                return stores.webhook_entry(session) is not None

        wait_until(has_begun, "the server to lead")
        found(database, "paper")
        wait_until(lambda: receiver.got, "the entry to be sent")
    assert receiver.told[0]["subject"] == "paper"
    assert "hush" not in f"{settings!r}"
