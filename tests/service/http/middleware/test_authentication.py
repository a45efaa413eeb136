import asyncio
import logging
import re
from collections.abc import Callable
from typing import Any
from unittest.mock import AsyncMock

import httpx
import pytest
from sqlalchemy import event
from starlette.requests import HTTPConnection

from db.database import Database
from db.repositories import access_keys
from service.app import create_app
from service.domain.access import keys
from service.domain.access.keys import SCOPES, NoKeys, check_start
from service.http import access
from service.http.middleware import authentication
from service.settings import Settings
from service.web.routes import practice
from stiction_client import AsyncFrictionClient, Material, ProblemError

ROUTES = access.scopes_of_routes(create_app(Settings()))
HTTP_ROUTES = {route: scopes for route, scopes in ROUTES.items() if not route.startswith("WS ")}
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)

Make = Callable[..., str]
Reach = Callable[..., Any]


def knock(client: Any, route: str) -> httpx.Response:
    """The answer of a route to a request that is well-formed as far as anybody without the route's secrets knows."""
    method, _, path = route.partition(" ")
    path = re.sub(r"\{\w+\}", "x", path)
    answer: httpx.Response = (
        client.open_stream(path)
        if method == "WS"
        else client.request(method, path, json={} if method != "GET" else None)
    )
    return answer


@ONLY_SQLITE
def test_no_route_answers_without_its_scope(reach: Reach, make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(practice, "load_practice", AsyncMock())  # simulating the grasps takes seconds for each key
    texts = {scope: make(scope) for scope in SCOPES}
    clients = {scope: reach(key=key) for scope, key in texts.items()}
    nobody = reach()
    assert ROUTES
    for route, needed in HTTP_ROUTES.items():
        answer = knock(nobody, route)
        assert (answer.status_code, answer.headers["www-authenticate"]) == (401, 'Bearer realm="stiction"'), route
        assert answer.headers["content-type"] == "application/problem+json"
        for scope, client in clients.items():
            answer = knock(client, route)
            if SCOPES.index(scope) < max(map(SCOPES.index, needed)):
                assert answer.status_code == 403, route
                assert answer.json()["type"] == "/problems/insufficient-scope"
                assert f'error="insufficient_scope", scope="{max(needed)}"' in answer.headers["www-authenticate"]
            else:
                assert answer.status_code not in {401, 403}, route


@ONLY_SQLITE
@pytest.mark.parametrize(
    "path", ["/v1", "/v1/nothing", "/v1/materials/", "/", "//healthz", "/healthz/", "/v1/%2e%2e/healthz"]
)
def test_even_what_is_not_there_is_not_told_without_a_key(reach: Reach, path: str) -> None:
    assert reach().get(path).status_code == 401


def test_a_key_lets_in_and_a_revoked_or_changed_one_does_not(
    reach: Reach, make: Make, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(authentication, "KEPT_SECONDS", -1.0)
    text = make()
    client = reach(key=text)
    assert client.get("/v1/materials").status_code == 200
    for wrong in (text[:-1] + ("0" if text[-1] != "0" else "1"), text + "0", make().replace("stiction_", ""), "x"):
        answer = reach(key=wrong).get("/v1/materials")
        assert (answer.status_code, answer.json()["type"]) == (401, "/problems/invalid-key")
        assert answer.headers["www-authenticate"] == 'Bearer realm="stiction", error="invalid_token"'
        assert wrong not in answer.text or wrong == "x"
    with database.write() as session:
        access_keys.revoke(session, keys.key_id(text) or "")
    assert client.get("/v1/materials").status_code == 401


@ONLY_SQLITE
@pytest.mark.parametrize("header", ["Basic dTpw", "Bearer", "Bearer ", "bearer a b", "Bearer ü".encode(), "\x00"])
def test_other_headers_are_no_keys(reach: Reach, header: Any) -> None:
    assert reach().get("/v1/materials", headers={"Authorization": header}).status_code == 401


@ONLY_SQLITE
def test_a_key_is_read_from_the_database_once_in_a_while(reach: Reach, make: Make, database: Database) -> None:
    client, seen = reach(key=make()), []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        seen.extend([statement] if "access_keys" in statement else [])

    event.listen(database.engine, "before_cursor_execute", note)
    for _ in range(3):
        assert client.get("/v1/materials").status_code == 200
    event.remove(database.engine, "before_cursor_execute", note)
    assert len(seen) == 1


@ONLY_SQLITE
@pytest.mark.parametrize(
    ("mode", "server", "address", "status"),
    [
        ("auto", "127.0.0.1", "127.0.0.1", 200),
        ("auto", "[::1]", "::1", 200),
        ("auto", "127.0.0.1", "10.0.0.9", 401),  # a proxy on this machine says for whom it asks
        ("auto", "10.0.0.5", "127.0.0.1", 401),
        ("open", "10.0.0.5", "10.0.0.9", 200),
        ("keys", "127.0.0.1", "127.0.0.1", 401),
    ],
)
def test_who_must_send_a_key(reach: Reach, mode: str, server: str, address: str, status: int) -> None:
    assert reach(mode, server, address).get("/v1/materials").status_code == status
    assert reach(mode, server, address).get("/healthz").status_code == 200


@ONLY_SQLITE
@pytest.mark.parametrize("mode", ["auto", "open"])
@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8000", 200),
        ("localhost", 200),
        ("LOCALHOST:8000", 200),
        ("[::1]:8000", 200),
        ("[::1]", 200),
        ("evil.example", 421),
        ("evil.example:8000", 421),
        ("localhost.evil.example", 421),
        ("127.0.0.1.evil.example", 421),
        ("192.168.0.7:8000", 421),
        ("", 421),
    ],
)
def test_a_page_that_has_its_name_lead_here_learns_nothing(
    reach: Reach, make: Make, mode: str, host: str, status: int
) -> None:
    local = reach(mode, server="127.0.0.1", address="127.0.0.1")
    answer = local.get("/v1/materials", headers={"Host": host})
    assert answer.status_code == status
    assert status == 200 or answer.json()["type"] == "/problems/misdirected-request"
    local.headers["Authorization"] = f"Bearer {make()}"
    assert local.get("/v1/materials", headers={"Host": host}).status_code == httpx.codes.OK
    assert reach("open").get("/v1/materials", headers={"Host": host}).status_code == httpx.codes.OK  # behind a proxy


@ONLY_SQLITE
def test_a_stream_of_such_a_page_is_not_opened(reach: Reach) -> None:
    local = reach(server="127.0.0.1", address="127.0.0.1")
    local.headers["Host"] = "evil.example"
    assert local.open_stream("/v1/stream").status_code == 421


@ONLY_SQLITE
def test_a_key_that_is_sent_counts_where_none_is_needed(reach: Reach, make: Make) -> None:
    assert reach("open", key=make("read")).request("POST", "/v1/materials", json={"name": "felt"}).status_code == 403
    assert reach("open", key="wrong").get("/v1/materials").status_code == 401


@ONLY_SQLITE
def test_the_client_sends_its_key(reach: Reach, make: Make) -> None:
    async def materials(key: str | None) -> list[Material]:
        transport = httpx.ASGITransport(reach().app, client=("10.0.0.9", 50000))
        async with AsyncFrictionClient("http://10.0.0.5", key=key, transport=transport) as client:
            return await client.materials()

    assert asyncio.run(materials(make())) == []
    with pytest.raises(ProblemError) as refused:
        asyncio.run(materials(None))
    assert (refused.value.status, refused.value.type) == (401, "/problems/key-required")


@ONLY_SQLITE
def test_no_key_reaches_the_logs(reach: Reach, make: Make, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    text = make()
    for key in (text, text + "0"):
        reach(key=key).get("/v1/materials")
    assert text.rpartition("_")[2] not in caplog.text


@ONLY_SQLITE
def test_a_database_that_is_away_is_said_at_the_gate(reach: Reach, make: Make, database: Database) -> None:
    client = reach(key=make())
    with database.connect() as connection:
        connection.exec_driver_sql("ALTER TABLE access_keys RENAME TO hidden")
        connection.commit()
    answer = client.get("/v1/materials")
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "1")


@pytest.mark.parametrize(
    ("settings", "needed"),
    [
        (Settings(host="0.0.0.0"), True),
        (Settings(host="::"), True),
        (Settings(access="keys"), True),
        (Settings(), False),
        (Settings(host="::1"), False),
        (Settings(host="0.0.0.0", access="open"), False),
    ],
    ids=str,
)
def test_a_service_that_others_reach_does_not_start_without_keys(
    database: Database, make: Make, settings: Settings, needed: bool
) -> None:
    if needed:
        with pytest.raises(NoKeys, match=f"host is {settings.host}.* `stiction keys create`"):
            check_start(settings, database)
        key_id = keys.key_id(make()) or ""
        check_start(settings, database)
        with database.write() as session:
            access_keys.revoke(session, key_id)
        with pytest.raises(NoKeys):
            check_start(settings, database)
    else:
        check_start(settings, database)


@ONLY_SQLITE
def test_each_key_and_each_address_without_one_has_its_own_rate(reach: Reach, make: Make) -> None:
    first, second = make(), make()
    client = reach(rate_limit=2.0)
    for key in (first, second, "wrong", ""):
        client.headers = {"Authorization": f"Bearer {key}"} if key else {}
        answers = [client.get("/v1/materials") for _ in range(4)]
        refused = answers[-1]
        assert refused.status_code == 429, key
        assert (refused.json()["type"], refused.headers["retry-after"]) == ("/problems/too-many-requests", "1")
        assert (answers[0].status_code == 200) == (key in {first, second})
    assert client.get("/healthz").status_code == 200
    client.headers, client.address = {"Authorization": f"Bearer {second}"}, "10.0.0.10"
    assert client.get("/v1/materials").status_code == 429
    client.headers = {}
    assert client.get("/v1/materials").status_code == 401


@ONLY_SQLITE
def test_who_is_on_this_machine_may_ask_at_any_rate(reach: Reach) -> None:
    client = reach("auto", "127.0.0.1", "127.0.0.1", rate_limit=1.0)
    assert {client.get("/v1/materials").status_code for _ in range(5)} == {200}
    client = reach("open", rate_limit=1.0)
    assert [client.get("/v1/materials").status_code for _ in range(2)] == [200, 429]


@ONLY_SQLITE
def test_who_has_had_a_key_waits_to_begin_among_its_own(
    reach: Reach, make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(authentication, "KEPT_SECONDS", 0.0)
    text = make("read")
    client = reach(key=text)

    def starts_as(sent: str) -> str:
        scope = {"type": "http", "client": ("10.0.0.9", 1), "headers": [(b"authorization", f"Bearer {sent}".encode())]}
        name: str = client.app.state.authenticator.starts_as(HTTPConnection(scope))
        return name

    assert starts_as(text) == "address 10.0.0.9"
    client.get("/v1/materials")
    assert starts_as(text) == keys.key_id(text)
    assert starts_as(text[:-1] + ("0" if text[-1] != "0" else "1")) == "address 10.0.0.9"
    assert starts_as("") == "address 10.0.0.9"
