"""The whole interface under generated requests, right and wrong: no failure, no answer that it does not describe."""

import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, closing
from itertools import product
from pathlib import Path
from typing import Any

import httpx
import pytest

from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.settings import Settings

CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
)
Serving = Callable[[Settings], AbstractContextManager[httpx.Client]]
Fuzz = Callable[..., dict[str, Any]]


@pytest.fixture
def fuzz(tmp_path: Path) -> Fuzz:
    """Send generated requests to a server, some with names that lead somewhere, and get the report."""

    def run(client: httpx.Client, settings: Settings, *options: str, known: dict[str, list[str]]) -> dict[str, Any]:
        key_id, key = keys.new_key()
        with closing(Database(settings.resolved_database_url)) as database, database.write() as session:
            access_keys.add(session, key_id, "fuzz", "admin", keys.digest(key))
        configuration, report = tmp_path / "schemathesis.toml", tmp_path / "report.json"
        configuration.write_text(dictionaries(known))
        command = [sys.executable, "-m", "schemathesis.cli", "--config-file", configuration, "run"]
        command += [f"{client.base_url}/openapi.json".replace("//openapi", "/openapi"), "--checks", ",".join(CHECKS)]
        command += ["-H", f"Authorization: Bearer {key}", "--report", "json", "--report-json-path", report]
        command += ["--request-timeout", "60"]  # a busy machine is no failure
        command += ["--suppress-health-check", "filter_too_much"]  # of its generator, by chance of the seed
        ran = subprocess.run([*command, *options], cwd=tmp_path, capture_output=True, text=True)
        assert report.exists(), ran.stdout + ran.stderr
        told: dict[str, Any] = json.loads(report.read_text())
        assert (told["failures"], told["errors"], ran.returncode) == ([], [], 0), ran.stdout[-5000:]
        return told

    return run


def dictionaries(known: dict[str, list[str]]) -> str:
    """Values that a parameter or a field takes half the time."""
    values = "".join(f"[dictionaries.{name}]\nvalues = {json.dumps(values)}\n" for name, values in known.items())
    used = "".join(f'"path.{name}" = {{ dictionary = "{name}", probability = 0.5 }}\n' for name in known)
    return f"{values}[parameters]\n{used}" if known else ""


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_folder=tmp_path / "data", workers=0, rate_limit=0.0, shutdown_seconds=0.0)


def test_a_few_generated_requests_find_no_failure(serving: Serving, fuzz: Fuzz, settings: Settings) -> None:
    with serving(settings) as client:
        client.post("/v1/materials", json={"name": "paper"}).raise_for_status()
        report = fuzz(client, settings, "-n", "1", "--phases", "fuzzing", "--seed", "1", known={"name": ["paper"]})
    assert report["operations"]["tested"] == report["operations"]["total"] >= 24
    assert report["test_cases"]["generated"] >= 24


@pytest.mark.long
@pytest.mark.parametrize("seed", ["1", "2"])
def test_thousands_of_generated_requests_find_no_failure(
    serving: Serving, fuzz: Fuzz, settings: Settings, content: bytes, upload: Any, wait: Any, seed: str
) -> None:
    chosen = settings.model_copy(update={"workers": 1})
    with serving(chosen) as client:
        while client.get("/readyz").status_code != httpx.codes.OK:
            time.sleep(0.1)
        for name in ("paper", "steel"):
            client.post("/v1/materials", json={"name": name}).raise_for_status()
        logs = [upload(client, content, material=name).json() for name in ("paper", "steel")]
        for log in logs:
            wait(client, log["job"]["id"])
        known = {"name": ["paper", "steel"], "id": [log["id"] for log in logs] + [log["job"]["id"] for log in logs]}
        report = fuzz(client, chosen, "-n", "80", "--seed", seed, known=known)
        assert client.get("/readyz").status_code == httpx.codes.OK
    assert report["test_cases"]["generated"] >= 2500
    print(json.dumps(report["test_cases"] | {"seconds": report["running_time"]}))  # noqa: T201  (for docs/long-tests.md)


HOSTILE = (
    "../../etc/passwd",
    "..%2f..%2fetc%2fpasswd",
    "%2e%2e/%2e%2e/etc/passwd",
    "x' OR '1'='1",
    "x'; DROP TABLE materials; --",
    'x" OR 1=1 --',
    "%27%20OR%201=1",
    "{{7*7}}",
    "${jndi:ldap://x}",
    "x%0d%0aSet-Cookie:%20a=b",
    "x%0aSet-Cookie:%20a=b",
    "%ff%fe",
    "\u202e",
    "x" * 4000,
    "-1",
    "%",
)


@pytest.fixture
def hostile_client(reach: Any) -> Iterator[Any]:
    client = reach("open")
    client.request("POST", "/v1/materials", json={"name": "paper"})
    yield client
    assert [item["name"] for item in client.get("/v1/materials").json()["items"]] == ["paper"]


def test_a_path_leads_nowhere_else(hostile_client: Any) -> None:
    paths = (
        "/v1/materials/{}",
        "/v1/materials/{}/fits",
        "/v1/jobs/{}",
        "/v1/grasp-logs/{}",
        "/v1/grasp-logs/{}/samples",
    )
    for path, text in product(paths, HOSTILE):
        answer = hostile_client.get(path.format(text))
        assert answer.status_code in {400, 404}, (path, text)
        assert answer.headers["content-type"] == "application/problem+json"
        assert "set-cookie" not in answer.headers


def test_a_query_finds_nothing_else(hostile_client: Any) -> None:
    lists = {"materials": ("search", "cursor", "sort", "limit")}
    lists["grasp-logs"] = ("material", "sensor", "status", "withdrawn")
    for path, queries in lists.items():
        for query, text in product(queries, HOSTILE):
            answer = hostile_client.get(f"/v1/{path}", params={query: text})
            assert answer.status_code in {200, 400, 404, 422}, (query, text)
            assert answer.status_code != 200 or answer.json()["items"] == []


def test_headers_carry_nothing_through(hostile_client: Any) -> None:
    names = ("X-Request-ID", "Idempotency-Key", "If-None-Match", "Content-Type", "Accept")
    for name, text in product(names, ("a\r\nSet-Cookie: b=c", "a\nb", "\x7f", "a" * 20_000, "ü")):
        answer = hostile_client.request("POST", "/v1/materials", content=b"{}", headers={name: text.encode()})
        assert answer.status_code in {400, 415, 422, 431}, name
        assert "set-cookie" not in answer.headers
        assert all(text not in value for value in answer.headers.values())
