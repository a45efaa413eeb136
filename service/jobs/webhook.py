"""Tell an address of the operator's what the service itself has found, from the audit trail."""

import hashlib
import hmac
import json
import logging
import time
from collections.abc import Callable
from datetime import timedelta

from db.database import Database
from db.errors import DatabaseError
from db.records import AuditAction, AuditEntry
from db.repositories import audit, stores
from db.tables import now
from service.periodic_thread import PeriodicThread

logger = logging.getLogger(__name__)

ACTIONS: tuple[AuditAction, ...] = ("material.surface_changed", "blob.damaged")
"""What is told: entries that nobody asked for, and that somebody should know of."""

LOOK_SECONDS = 5.0
"""s between two looks for new entries."""

SETTLED = timedelta(seconds=10.0)
"""Age from which an entry is sent: on PostgreSQL one with a smaller id may be committed a moment after it."""

EXPIRED = timedelta(days=7.0)
"""Age from which an entry is not sent any more, so that one that is refused for good does not stop all others."""

LONGEST_PAUSE = 600.0
"""s between two attempts at most; the first pause is ``LOOK_SECONDS``, each further one twice as long."""

TIMEOUT = 10.0
"""s until the address must have answered."""

AT_ONCE = 100
"""Entries read at once."""


class NotTaken(Exception):
    """The address did not take what it was sent."""


class Webhook:
    """Sends entries of the audit trail to ``url``, in their order, in whichever process ``leads`` the others.

    Each is sent until it is answered 2xx, so that one may come twice, with the same id. Without a ``url`` nothing is.
    """

    def __init__(self, database: Database, url: str | None, secret: str | None, leads: Callable[[], bool]) -> None:
        self._database, self._url, self._leads = database, url, leads
        self._secret = None if secret is None else secret.encode()
        self._pause, self._next = 0.0, 0.0
        self._thread = PeriodicThread("webhook", LOOK_SECONDS, self._look)

    def start(self) -> None:
        """Begin, where there is an address."""
        if self._url is not None:
            self._thread.start()

    async def stop(self) -> None:
        """End after the entry that is being sent."""
        await self._thread.stop()

    def send_new(self) -> int:
        """Send what is new and settled; returns how many entries the address took. Raises ``NotTaken``."""
        store, last = self._position()
        with self._database.read() as session:
            entries = audit.list_after(session, last, ACTIONS, now() - SETTLED, AT_ONCE)
        taken = 0
        for entry in entries:
            if self._thread.is_stopping:
                break
            if entry.at < now() - EXPIRED:
                logger.error("webhook: entry %d of the audit trail is too old to be sent", entry.id)
            else:
                self._send(store, entry)
                taken += 1
            with self._database.write(durable=False) as session:
                stores.set_webhook_entry(session, entry.id)
        return taken

    def _look(self) -> None:
        if not self._leads() or time.monotonic() < self._next:
            return
        try:
            self.send_new()
            self._pause = 0.0
        except NotTaken as reason:
            self._pause = min(max(2.0 * self._pause, LOOK_SECONDS), LONGEST_PAUSE)
            self._next = time.monotonic() + self._pause
            logger.warning("webhook: %s; the next attempt is in %g s", reason, self._pause)
        except DatabaseError as error:
            logger.warning("the webhook is told nothing: %s", error)

    def _position(self) -> tuple[str | None, int]:
        """The store's id, and the newest entry that was sent: of a first webhook, the newest of all."""
        with self._database.read() as session:
            store, last = stores.find_id(session), stores.webhook_entry(session)
        if last is None:
            with self._database.write(durable=False) as session:
                last = audit.newest_id(session)
                stores.set_webhook_entry(session, last)
        return store, last

    def _send(self, store: str | None, entry: AuditEntry) -> None:
        import httpx  # a server without a webhook needs none

        content = told(store, entry)
        headers = {"content-type": "application/json", "user-agent": "stiction"}
        if self._secret is not None:
            headers["stiction-signature"] = f"sha256={hmac.new(self._secret, content, hashlib.sha256).hexdigest()}"
        try:
            with httpx.stream("POST", str(self._url), content=content, headers=headers, timeout=TIMEOUT) as answer:
                status, taken = answer.status_code, answer.is_success  # whatever else it says is not read
        except (httpx.HTTPError, httpx.InvalidURL) as error:  # whose texts may tell the address
            raise NotTaken(f"the address cannot be reached ({type(error).__name__})") from error
        if not taken:
            raise NotTaken(f"the address answered {status} to entry {entry.id} of the audit trail")


def told(store: str | None, entry: AuditEntry) -> bytes:
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
