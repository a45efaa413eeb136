"""Texts that are access keys, and those that are not."""

import hashlib
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from db.records import AccessKey
from service.domain.access import keys

TEXT = f"stiction_{'0a' * 6}_{'1b' * 32}"
NOW = datetime.now(UTC)
STORED = AccessKey("0a" * 6, "robot", "read", hashlib.sha256(TEXT.encode()).hexdigest(), NOW, None)


@pytest.mark.parametrize(
    "text",
    [
        "",
        TEXT[:-1],
        f"{TEXT}0",
        f" {TEXT}",
        f"{TEXT}\n",
        TEXT.upper(),
        TEXT.replace("stiction_", "friction_"),
        TEXT.replace("0a0a", "0a0g"),
        TEXT.replace("_1b", "-1b"),
    ],
)
def test_what_only_resembles_a_key_has_no_id(text: str) -> None:
    assert keys.key_id(text) is None


@pytest.mark.parametrize("text", ["", f"{TEXT}0", TEXT.replace("1b", "1c", 1)])
def test_another_text_is_not_the_key(text: str) -> None:
    assert keys.is_key(TEXT, STORED)
    assert not keys.is_key(text, STORED)
    assert not keys.is_key(text, keys.NO_KEY)


@pytest.mark.parametrize(
    ("revoked", "expires", "is_valid"),
    [
        (None, None, True),
        (None, 1.0, True),
        (None, -1.0, False),
        (-1.0, None, False),
        (-1.0, 1.0, False),
        (1.0, 1.0, False),
    ],
)
def test_a_key_is_valid_until_it_expires_or_is_revoked(
    revoked: float | None, expires: float | None, is_valid: bool
) -> None:
    moments = (None if hours is None else NOW + timedelta(hours=hours) for hours in (revoked, expires))
    stored = replace(STORED, **dict(zip(("revoked_at", "expires_at"), moments, strict=True)))
    assert keys.is_valid(stored) is is_valid
    assert keys.is_key(TEXT, stored) is is_valid
