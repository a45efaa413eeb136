from datetime import UTC, datetime

import pytest
from fastapi import APIRouter, FastAPI, WebSocket
from fastapi.staticfiles import StaticFiles

from db.records import AccessKey, Scope
from service.app import create_app
from service.domain.access import keys
from service.http import access
from service.http.access import READ, Access
from service.settings import Settings


@pytest.mark.parametrize("scope", keys.SCOPES)
def test_a_scope_implies_those_before_it_and_no_other(scope: Scope) -> None:
    allowed = [needed for needed in keys.SCOPES if Access("k", scope).allows(needed)]
    assert allowed == list(keys.SCOPES[: keys.SCOPES.index(scope) + 1])


def test_a_key_is_long_random_and_known_again_by_its_digest() -> None:
    key_id, text = keys.new_key()
    assert keys.new_key()[1] != text
    assert keys.key_id(text) == key_id
    assert len(bytes.fromhex(text.rpartition("_")[2])) == 32
    stored = AccessKey(key_id, "robot", "read", keys.digest(text), datetime.now(UTC), None)
    assert keys.is_key(text, stored)
    for last in "01":
        assert keys.is_key(text[:-1] + last, stored) == (text[-1] == last)
    assert stored.sha256 not in repr(stored)


@pytest.mark.parametrize(
    "text", ["", "stiction_", "stiction_0123456789ab_" + "0" * 63, "stiction_" + "é" * 77, "0" * 9999]
)
def test_what_is_no_key_has_no_id(text: str) -> None:
    assert keys.key_id(text) is None


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("::1", True),
        ("localhost", True),
        ("::ffff:127.0.0.1", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.0.7", False),
        ("::ffff:10.0.0.1", False),
        ("localhost.example.org", False),
        ("localhost.evil.example", False),
        ("", False),
        ("/run/stiction.socket", False),
    ],
)
def test_loopback_is_told_from_what_others_reach(host: str, expected: bool) -> None:
    assert keys.is_loopback(host) is expected


def test_a_route_that_says_no_scope_stops_the_application() -> None:
    router = APIRouter()
    router.get("/said", dependencies=[READ])(lambda: None)
    router.get("/{silent}")(lambda: None)

    @router.websocket("/stream")
    async def stream(socket: WebSocket) -> None:
        await socket.accept()

    app = FastAPI()
    app.include_router(router, prefix="/v1")
    app.mount("/files", StaticFiles(directory="/"))
    with pytest.raises(RuntimeError, match=r"GET /v1/\{silent\}, WS /v1/stream, WS /files is not said"):
        access.check_routes(app)


def test_each_route_needs_the_scope_that_is_meant_for_it() -> None:
    """Reading needs read; changing a material, which its owners may, upload; the rest, such as the trail, admin."""
    for route, scopes in access.scopes_of_routes(create_app(Settings())).items():
        method, _, path = route.partition(" ")
        administers = path in {"/v1/audit", "/v1/jobs/{id}/cancel", "/audit", "/keys", "/jobs/{id}/cancel"}
        asks = method == "GET" or path in {"/v1/recognise", "/v1/grasp-force", "/live/{id}/frames"}
        expected = "admin" if administers else "read" if asks else "upload"
        assert scopes == {expected}, route
