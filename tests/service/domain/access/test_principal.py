"""Who asks, with which key, and what an error says of what was asked."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from db.database import Database
from db.errors import NotFound
from db.repositories import access_keys, materials, owners
from service.domain import errors
from service.domain.access import keys, quotas
from service.domain.access.keys import NO_KEY, NoKeys
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.materials import ownership
from service.settings import Settings

KEY = Principal("k", "lab", False, "10.0.0.9", "r")


def test_a_key_is_named_in_the_audit_trail_and_owns_as_itself_and_as_its_group() -> None:
    assert (KEY.actor.name, KEY.actor.address, KEY.actor.request_id) == ("key:k", "10.0.0.9", "r")
    assert (KEY.share, KEY.owners) == ("k", ("key:k", "group:lab"))
    assert replace(KEY, group=None).owners == ("key:k",)


def test_who_has_no_key_is_anybody_from_an_address_and_may_do_all() -> None:
    nobody = replace(ANONYMOUS, address="10.0.0.9")
    assert (nobody.actor.name, nobody.share, nobody.owners, nobody.is_admin) == (
        "anybody",
        "address 10.0.0.9",
        (),
        True,
    )


def test_a_key_is_known_by_its_form_alone() -> None:
    key_id, text = keys.new_key()
    assert keys.key_id(text) == key_id
    for wrong in (text[:-1], f"{text}0", text.upper(), f" {text}", text.replace("stiction", "friction")):
        assert keys.key_id(wrong) is None


def test_a_key_is_valid_until_the_moment_it_ends_or_is_revoked() -> None:
    _, text = keys.new_key()
    stored = replace(NO_KEY, sha256=keys.digest(text))
    soon, past = (datetime.now(UTC) + timedelta(seconds=s) for s in (60.0, -1e-3))
    assert keys.is_key(text, stored)
    assert keys.is_key(text, replace(stored, expires_at=soon))
    assert not keys.is_key(text, replace(stored, expires_at=past))
    assert not keys.is_key(text, replace(stored, revoked_at=past))
    assert not keys.is_key(f"{text}0", stored)
    assert not keys.is_key(text, NO_KEY)


def test_without_keys_only_this_machine_may_be_listened_to(database: Database) -> None:
    for settings in (Settings(access="open", host="0.0.0.0"), Settings(access="auto", host="127.0.0.1")):
        keys.check_start(settings, database)
    refused = (Settings(access="auto", host="0.0.0.0"), Settings(access="keys", host="127.0.0.1"))
    for settings in refused:
        told = f"host is {settings.host}, access is {settings.access}, and there are no keys; allowed: make one with "
        with pytest.raises(NoKeys, match=told):
            keys.check_start(settings, database)
    with database.write() as session:
        access_keys.add(session, "k", "robot", "read", "0" * 64)
    for settings in refused:
        keys.check_start(settings, database)


def test_whoever_began_something_with_a_key_that_ended_is_told(database: Database) -> None:
    with database.write() as session:
        access_keys.add(session, "k", "robot", "read", "0" * 64)
        keys.check_not_ended(session, "k")
        keys.check_not_ended(session, None)
        access_keys.revoke(session, "k")
        with pytest.raises(errors.KeyEnded, match="was revoked or has expired since this began; allowed: a valid one"):
            keys.check_not_ended(session, "k")
        with pytest.raises(NotFound):
            keys.check_not_ended(session, "x")


def test_without_owners_the_scope_decides_and_with_owners_who_is_one(database: Database) -> None:
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        ownership.check_may_add(session, material, KEY)
        with pytest.raises(errors.InsufficientScope, match="the key has scope upload; this needs admin"):
            ownership.check_may_change(session, material, KEY)
        owners.add(session, material, "group:lab")
        stranger = replace(KEY, key_id="other", group="shop")
        for check in (ownership.check_may_add, ownership.check_may_change):
            check(session, material, KEY)
            check(session, material, replace(stranger, is_admin=True))
            with pytest.raises(errors.NotOwner) as refusal:
                check(session, material, stranger)
            assert refusal.value.facts == {"owners": ["group:lab"]}


def test_a_quota_tells_its_setting_and_when_to_come_again(database: Database) -> None:
    settings = Settings(key_queued_jobs=1, key_logs_a_day=1, key_changes_a_day=1)
    with database.write() as session:
        access_keys.add(session, "k", "robot", "upload", "0" * 64)
        for check in (quotas.check_job, quotas.check_upload, quotas.check_change):
            check(session, settings, "k")
            check(session, settings, None)
            check(session, Settings(), "k")
    told = quotas._exceeded("queued jobs", 3, "STICTION_KEY_QUEUED_JOBS", quotas.JOBS_RETRY_SECONDS)
    assert str(told) == "queued jobs of this key are 3; allowed: 3 (STICTION_KEY_QUEUED_JOBS)"
    assert told.retry_seconds == 10
    assert [quotas._any_is_set(each) for each in (settings, Settings(), Settings(key_stored_bytes=1))] == [
        True, False, True
    ]  # fmt: skip


def test_an_error_repeats_a_value_in_short_and_says_what_is_allowed() -> None:
    told = errors.InvalidValue("name", "x" * 300, "shorter")
    assert (str(told), told.name, told.allowed) == (f"name is {'x' * 200}; allowed: shorter", "name", "shorter")
    assert (errors.shown(None), errors.shown("a\ud800")) == ("None", "a\\ud800")
    ended = errors.JobEnded("j", "done")
    assert (str(ended), ended.value) == ("job j is done: it cannot be cancelled any more", "done")
    assert str(errors.ResultsNotReady("j", "queued")) == "job j is queued; its results are not there"
    assert errors.NoModel("none", "ols").value == "ols"
    assert errors.DomainError("x").facts == {}
