"""When the transactions of a key wait for one another."""

from typing import Any

import pytest

from service.domain import quotas
from service.settings import Settings


@pytest.mark.parametrize("quota", ["key_queued_jobs", "key_logs_a_day", "key_stored_bytes", "key_changes_a_day"])
@pytest.mark.parametrize(("key_id", "is_set", "locked"), [("a", True, ["a"]), ("a", False, []), (None, True, [])])
def test_a_key_is_locked_only_where_something_of_it_is_counted(
    monkeypatch: pytest.MonkeyPatch, quota: str, key_id: str | None, is_set: bool, locked: list[str]
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(quotas.access_keys, "lock", lambda _, key: asked.append(key))
    session: Any = None
    quotas.lock(session, Settings(**({quota: 5} if is_set else {})), key_id)
    assert asked == locked
