"""Access keys: how one is made and known again, and whether the service can be started without any."""

import hashlib
import hmac
import ipaddress
import re
import secrets
from datetime import UTC, datetime
from functools import lru_cache
from typing import get_args

from sqlalchemy.orm import Session

from db.database import Database
from db.records import AccessKey, Scope
from db.repositories import access_keys
from service.domain.errors import KeyEnded
from service.settings import Settings

SCOPES: tuple[Scope, ...] = get_args(Scope)
"""What keys are for; each scope implies those before it."""

_KEY = re.compile(r"stiction_([0-9a-f]{12})_[0-9a-f]{64}")

NO_KEY = AccessKey("", "", "read", "0" * 64, datetime.min.replace(tzinfo=UTC), None)
"""Stands for a key that is not stored: no text is it, and to find that out takes as long as with one that is."""


def new_key() -> tuple[str, str]:
    """A new key's public id and its text, which is to be shown once."""
    key_id = secrets.token_hex(6)
    return key_id, f"stiction_{key_id}_{secrets.token_hex(32)}"


def key_id(text: str) -> str | None:
    """The public part of a key; None for what is no key."""
    found = _KEY.fullmatch(text)
    return found[1] if found else None


def digest(text: str) -> str:
    """What is stored of a key.

    256 random bits cannot be guessed, however fast the hash, so a slow one as for passwords would only cost time.
    """
    return hashlib.sha256(text.encode()).hexdigest()


def is_key(text: str, stored: AccessKey) -> bool:
    """Whether ``text`` is this key, neither revoked nor expired; takes as long wherever they differ."""
    return hmac.compare_digest(digest(text), stored.sha256) and is_valid(stored)


def is_valid(stored: AccessKey) -> bool:
    """Whether a key is neither revoked nor expired."""
    return stored.revoked_at is None and (stored.expires_at is None or datetime.now(UTC) < stored.expires_at)


def check_not_ended(session: Session, key_id: str | None) -> None:
    """Look again at the key of something that took its time; raises ``KeyEnded``. None is where none was asked for."""
    if key_id is not None and not is_valid(access_keys.get(session, key_id)):
        raise KeyEnded


@lru_cache(maxsize=1024)
def is_loopback(host: str) -> bool:
    """Whether an address, or a name, is this machine's own and reached from nowhere else."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host == "localhost"
    return (getattr(address, "ipv4_mapped", None) or address).is_loopback


class NoKeys(RuntimeError):
    """The service would ask everybody for a key, and there is none."""


def check_start(settings: Settings, database: Database) -> None:
    """Refuse to listen where others can reach the service, unless there are keys; raises ``NoKeys``."""
    if settings.access == "open" or (settings.access == "auto" and is_loopback(settings.host)):
        return
    with database.read() as session:
        if not access_keys.any_valid(session):
            what = f"host is {settings.host}, access is {settings.access}, and there are no keys"
            raise NoKeys(f"{what}; allowed: make one with `stiction keys create`, or set STICTION_ACCESS=open")
