"""The audit trail as a command tells it."""

import json
from contextlib import nullcontext
from unittest.mock import Mock

import pytest

from service.cli import audit, main
from stiction_client.records import AuditEntry

ENTRY = AuditEntry(
    7, "2026-01-02T03:04:05.678+00:00", "key:7f", "10.0.0.5", "r1", "grasp_log.withdrawn", "a",
    {"sha256": "0123456789abcdef", "reason": "wrong", "logs": 0, "before": None, "note": "", "others": [], "by": ["x"]},
)  # fmt: skip


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Mock:
    told = Mock(audit=Mock(return_value=[ENTRY]))
    monkeypatch.setattr(audit, "connected", lambda *_: nullcontext(told))
    return told


def test_an_entry_is_told_to_the_second_without_what_is_empty(client: Mock, capsys: pytest.CaptureFixture[str]) -> None:
    audit.audit()
    client.audit.assert_called_once_with(None, None, None, 20)
    title, head, _, row = capsys.readouterr().out.splitlines()
    assert (title, head.split()) == ("Audit trail", ["at", "actor", "address", "action", "subject", "details"])
    told = 'sha256: 0123456789ab, reason: wrong, logs: 0, by: ["x"]'
    assert " ".join(row.split()) == f"2026-01-02 03:04:05 UTC key:7f 10.0.0.5 grasp_log.withdrawn a {told}"


def test_a_program_is_told_all_of_an_entry(client: Mock, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["audit", "--actor", "key:7f", "--action", "x", "--subject", "a", "--limit", "3", "--json"])
    client.audit.assert_called_once_with("key:7f", "x", "a", 3)
    (entry,) = json.loads(capsys.readouterr().out)["entries"]
    assert (entry["at"], entry["details"]) == (ENTRY.at, ENTRY.details)
