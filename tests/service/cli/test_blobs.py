"""Which files a command deletes, which it only counts, and by which age."""

from contextlib import nullcontext
from datetime import timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from db import identity, migrate
from service.cli import blobs, main
from service.jobs import steady_clock

DAY = timedelta(days=1)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, timedelta, bool]]:
    """What is to be done: of uploads or of unreferenced files, by which age, and whether they are deleted."""
    told: list[tuple[str, timedelta, bool]] = []
    monkeypatch.delenv("STICTION_KEEP_UPLOADS_DAYS", raising=False)
    monkeypatch.delenv("STICTION_KEEP_UNREFERENCED_DAYS", raising=False)
    database = SimpleNamespace(read=lambda: nullcontext(None))
    monkeypatch.setattr(blobs, "opened", lambda _: nullcontext(database))
    monkeypatch.setattr(blobs, "opened_blobs", lambda: None)
    monkeypatch.setattr(migrate, "check", lambda _: None)
    monkeypatch.setattr(identity, "verify", lambda *_: None)
    monkeypatch.setattr(steady_clock, "doubt", lambda _: None)
    for name in ("uploads", "unreferenced"):

        def note(_: Any, __: Any, age: timedelta, *, delete: bool, name: str = name) -> dict[str, int]:
            told.append((name, age, delete))
            return {"files": 0, "bytes": 0, "set_aside": 0}

        monkeypatch.setattr(blobs, f"_prune_{name}", note)
    return told


def prune(*options: str) -> int:
    with pytest.raises(SystemExit) as ending:
        main(["blobs", "prune", *options])
    return int(ending.value.code or 0)


@pytest.mark.parametrize(
    ("options", "done"),
    [
        ((), [("unreferenced", 7 * DAY, False)]),
        (("--delete",), [("unreferenced", 7 * DAY, True)]),
        (("--grace", "0h"), [("unreferenced", 0 * DAY, False)]),
        (("--older-than", "2d"), [("uploads", 2 * DAY, True)]),
        (("--older-than", "2d", "--dry-run"), [("uploads", 2 * DAY, False)]),
        (("--older-than", "2d", "--delete"), [("uploads", 2 * DAY, True), ("unreferenced", 7 * DAY, True)]),
    ],
)
def test_an_age_alone_deletes_old_uploads_and_all_else_needs_to_be_told(
    asked: list[tuple[str, timedelta, bool]], options: tuple[str, ...], done: list[tuple[str, timedelta, bool]]
) -> None:
    assert prune(*options) == 0
    assert asked == done


def test_ages_are_those_of_the_settings_where_none_is_told(
    asked: list[tuple[str, timedelta, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICTION_KEEP_UPLOADS_DAYS", "30")
    monkeypatch.setenv("STICTION_KEEP_UNREFERENCED_DAYS", "0.5")
    prune()
    assert asked == [("uploads", 30 * DAY, False), ("unreferenced", 0.5 * DAY, False)]
    asked.clear()
    prune("--grace", "3d", "--delete")
    assert asked == [("uploads", 30 * DAY, True), ("unreferenced", 3 * DAY, True)]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--delete",), 2),
        (("--older-than", "2d"), 2),
        (("--older-than", "2d", "--dry-run"), 0),
        ((), 0),
        (("--delete", "--trust-clock"), 0),
    ],
)
def test_only_what_deletes_asks_whether_the_clock_is_right(
    asked: list[tuple[str, timedelta, bool]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    code: int,
) -> None:
    monkeypatch.setattr(steady_clock, "doubt", lambda _: "2099-01-01")
    assert prune(*options) == code
    assert bool(asked) == (code == 0)
    if code:
        said = " ".join(capsys.readouterr().err.replace("│", " ").split())
        assert "the clock says 2099-01-01; allowed: --trust-clock, where it is right" in said
