"""Who owns a material: added and removed by name, up to as many as may be."""

from typing import Any, cast

import pytest

from db.database import Database
from db.errors import NotFound
from db.paging import Window
from db.records import AuditFilter
from db.repositories import access_keys, audit, materials
from service.domain.access.principal import ANONYMOUS, Principal
from service.domain.errors import InvalidValue, QuotaExceeded, UnknownOwner
from service.domain.materials import ownership
from service.domain.resources.context import Context
from service.settings import Settings

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
KEY = "a" * 12
ADMIN = Principal(KEY, None, True)


def context_of(database: Database, **settings: Any) -> Context:
    nothing = cast(Any, None)
    return Context(Settings(**settings), database, nothing, nothing)


@pytest.fixture
def context(database: Database) -> Context:
    with database.write() as session:
        access_keys.add(session, KEY, "robot", "admin", "0" * 64)
        materials.create(session, "paper", "")
    return context_of(database)


def changes(database: Database) -> list[tuple[str, str]]:
    with database.read() as session:
        return [(each.action, each.details["owner"]) for each in audit.list_all(session, Window("id"), AuditFilter())]


def test_owners_are_told_in_order_and_one_that_is_there_changes_nothing(context: Context, database: Database) -> None:
    assert ownership.list_owners(context, "paper") == []
    for owner in ("key:" + KEY, "group:lab", "group:lab"):
        told = ownership.add_owner(context, "paper", owner, ANONYMOUS)
    assert told == ownership.list_owners(context, "paper") == ["group:lab", "key:" + KEY]
    ownership.remove_owner(context, "paper", "group:lab", ANONYMOUS)
    assert ownership.list_owners(context, "paper") == ["key:" + KEY]
    assert changes(database) == [
        ("owner.added", "key:" + KEY),
        ("owner.added", "group:lab"),
        ("owner.removed", "group:lab"),
    ]


def test_who_is_no_owner_is_not_removed(context: Context, database: Database) -> None:
    with pytest.raises(UnknownOwner, match="owner is group:lab; allowed: an owner of paper"):
        ownership.remove_owner(context, "paper", "group:lab", ANONYMOUS)
    assert changes(database) == []
    for use in (ownership.add_owner, ownership.remove_owner):
        with pytest.raises(NotFound):
            use(context, "felt", "group:lab", ANONYMOUS)


def test_a_key_that_owns_is_stored(context: Context, database: Database) -> None:
    with pytest.raises(InvalidValue, match=f"owner is key:{'b' * 12}; allowed: the id of a stored key"):
        ownership.add_owner(context, "paper", "key:" + "b" * 12, ANONYMOUS)
    assert ownership.list_owners(context, "paper") == []
    assert changes(database) == []


def test_a_material_has_a_hundred_owners_at_most(context: Context) -> None:
    for number in range(100):
        told = ownership.add_owner(context, "paper", f"group:{number}", ANONYMOUS)
    assert len(told) == 100
    assert len(ownership.add_owner(context, "paper", "group:99", ANONYMOUS)) == 100
    with pytest.raises(InvalidValue, match="owners is 101; allowed: at most 100 of a material"):
        ownership.add_owner(context, "paper", "group:100", ANONYMOUS)
    assert len(ownership.list_owners(context, "paper")) == 100


@pytest.mark.usefixtures("context")
def test_an_owner_that_is_there_takes_no_change_of_a_key(database: Database) -> None:
    of_one = context_of(database, key_changes_a_day=1)
    for _ in range(2):
        assert ownership.add_owner(of_one, "paper", "group:lab", ADMIN) == ["group:lab"]
    with pytest.raises(QuotaExceeded):
        ownership.add_owner(of_one, "paper", "group:shop", ADMIN)
    ownership.remove_owner(of_one, "paper", "group:lab", ADMIN)
