"""Send to an address of the operator's what the service itself has found, from the audit trail."""

import asyncio
import hashlib
import hmac
import json
import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import timedelta
from functools import partial
from typing import Any

from db.database import Database
from db.errors import DatabaseError
from db.records import AuditAction, AuditEntry
from db.repositories import audit, stores
from db.tables import now
from service.jobs.steady_clock import doubt
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

ACTIONS: tuple[AuditAction, ...] = ("material.surface_changed", "blob.damaged")
"""What is sent: entries that nobody asked for, and that somebody should know of."""

LOOK_SECONDS = 5.0
"""s between two looks for new entries."""

SETTLED = 30.0
"""s since an entry was seen, from which it is sent: on PostgreSQL one with a smaller id may be committed after it."""

EXPIRED = timedelta(days=7.0)
"""Age from which an entry is not sent any more, so that one that is refused for good does not stop all others; not by a
clock that may be wrong.
"""

LONGEST_PAUSE = 600.0
"""s between two attempts at most; the first pause is ``LOOK_SECONDS``, each further one twice as long."""

TIMEOUT = 10.0
"""s that a sending may take in all, whatever the address does: a process that ends waits for it."""


class DeliveryFailed(Exception):
    """The address did not take what it was sent."""


class Webhook:
    """Sends entries of the audit trail to ``url``, in their order, in whichever process ``leads`` the others.

    Each is sent until it is answered 2xx, so that one may come twice, with the same id. Without a ``url`` nothing is.
    """

    def __init__(self, database: Database, url: str | None, secret: str | None, leads: Callable[[], bool]) -> None:
        self._database, self._url, self._leads = database, url, leads
        self._secret = None if secret is None else secret.encode()
        self._pause, self._next = 0.0, 0.0
        self._seen: list[tuple[float, int]] = []  # when the newest entry had which id, oldest first
        self._thread = PeriodicThread("webhook", LOOK_SECONDS, self._look)

    def start(self) -> None:
        """Begin, where there is an address."""
        if self._url is not None:
            self._thread.start()

    async def stop(self) -> None:
        """End after the entry that is being sent."""
        await self._thread.stop()

    def send_new(self) -> int:
        """Send what is new and settled; returns how many entries the address took. Raises ``DeliveryFailed``."""
        self._begin()
        settled, taken = self._settled(), 0
        while not self._thread.is_stopping and self._leads():
            with self._database.read() as session:  # each time, since another process may have sent it meanwhile
                store, had = stores.find_id(session), stores.webhook_entry(session)
                entry = audit.first_between(session, had or 0, settled, ACTIONS)
                is_clock_doubted = doubt(session) is not None
            if entry is None:
                break
            if entry.at < now() - EXPIRED and not is_clock_doubted:
                logger.error("webhook: entry %d of the audit trail is too old to be sent", entry.id)
            else:
                self._send(store, entry)
                taken += 1
            with self._database.write(durable=False) as session:
                stores.set_webhook_entry(session, entry.id, had)
        return taken

    def _begin(self) -> None:
        """A first webhook is sent nothing of what is there already."""
        with self._database.read() as session:
            if stores.webhook_entry(session) is not None:
                return
        with self._database.write(durable=False) as session:
            stores.set_webhook_entry(session, audit.newest_id(session), None)

    def _settled(self) -> int:
        """Id up to which no entry can come any more; by when it was seen, since processes' clocks may differ."""
        with self._database.read() as session:
            self._seen.append((time.monotonic(), audit.newest_id(session)))
        old = [number for at, number in self._seen if at <= time.monotonic() - SETTLED]
        self._seen = self._seen[max(len(old) - 1, 0) :]
        return old[-1] if old else 0

    def _look(self) -> None:
        if not self._leads() or time.monotonic() < self._next:
            return
        try:
            self.send_new()
            self._pause = 0.0
        except (DeliveryFailed, DatabaseError) as reason:
            self._pause = min(max(2.0 * self._pause, LOOK_SECONDS), LONGEST_PAUSE)
            self._next = time.monotonic() + self._pause
            logger.warning("webhook: %s; the next attempt is in %g s", reason, self._pause)

    def _send(self, store: str | None, entry: AuditEntry) -> None:
        content = message_body(store, entry)
        headers = {"content-type": "application/json", "user-agent": "stiction"}
        if self._secret is not None:
            headers["stiction-signature"] = f"sha256={hmac.new(self._secret, content, hashlib.sha256).hexdigest()}"
        with asyncio.Runner(loop_factory=_Loop) as runner:
            status = runner.run(_answer(str(self._url), content, headers))
        if not 200 <= status < 300:
            raise DeliveryFailed(f"the address answered {status} to entry {entry.id} of the audit trail")


class _Loop(asyncio.SelectorEventLoop):
    """Asks for addresses of names in threads that nobody waits for, however long a resolver hangs."""

    async def getaddrinfo(
        self,
        host: bytes | str | None,
        port: bytes | str | int | None,
        *,
        family: int = 0,
        type: int = 0,  # noqa: A002 - as asyncio calls it
        proto: int = 0,
        flags: int = 0,
    ) -> Any:
        """As ``socket.getaddrinfo``."""
        found: asyncio.Future[Any] = self.create_future()

        def tell(answer: Callable[[], None]) -> None:
            if not found.done():
                answer()

        def resolve() -> None:
            try:
                answer = partial(found.set_result, socket.getaddrinfo(host, port, family, type, proto, flags))
            except (OSError, UnicodeError) as error:
                answer = partial(found.set_exception, error)
            with suppress(RuntimeError):  # nobody waits any more
                self.call_soon_threadsafe(tell, answer)

        threading.Thread(target=resolve, name="webhook's name", daemon=True).start()
        return await found


async def _answer(url: str, content: bytes, headers: Mapping[str, str]) -> int:
    """The status that the address answers a POST with; whatever else it says is not read. Raises ``DeliveryFailed``."""
    import httpx  # a server without a webhook needs none

    try:
        async with (
            asyncio.timeout(TIMEOUT),
            httpx.AsyncClient(timeout=None) as client,
            client.stream("POST", url, content=content, headers=headers) as answer,
        ):
            return answer.status_code
    except TimeoutError as error:
        raise DeliveryFailed(f"the address took longer than {TIMEOUT:g} s") from error
    except (httpx.HTTPError, httpx.InvalidURL, UnicodeError) as error:  # whose texts may hold the address
        raise DeliveryFailed(f"the address cannot be reached ({type(error).__name__})") from error


def message_body(store: str | None, entry: AuditEntry) -> bytes:
    """What the address is sent of an entry: JSON, in UTF-8."""
    record = {
        "store": store,
        "id": entry.id,
        "at": entry.at.isoformat(),
        "action": entry.action,
        "subject": entry.subject,
        "details": dict(entry.details),
    }
    return json.dumps(record, ensure_ascii=False).encode()
