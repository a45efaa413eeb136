import json
import logging
import os
import re
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

import pytest
import uvicorn
from sqlalchemy import text

from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.observability import logs
from service.observability.logs import JsonLines, Logs, TextLines
from service.serving import configuration
from service.settings import Settings

KEY = "stiction_0123456789ab_" + "c0ffee00" * 8


def record(message: str, *values: object, error: Exception | None = None, **fields: object) -> logging.LogRecord:
    info = (type(error), error, error.__traceback__) if error is not None else None
    made = logging.LogRecord("service.x", logging.WARNING, "file.py", 1, message, values, info)
    vars(made).update(logs.of(**fields))
    return made


def test_a_record_is_one_object_on_one_line() -> None:
    with logs.log_context(request_id="r1"):
        logs.note(kind="fit")
        line = JsonLines().format(record("%s came\nlate", "job", job="j1", seconds=0.25))
    found = json.loads(line)
    assert "\n" not in line
    assert abs(datetime.fromisoformat(found.pop("time")) - datetime.now(UTC)) < timedelta(seconds=10)
    assert found == {
        "level": "warning",
        "logger": "service.x",
        "message": "job came\nlate",
        "request_id": "r1",
        "kind": "fit",
        "job": "j1",
        "seconds": 0.25,
        "process": os.getpid(),
    }
    assert not logs.ABOUT.get()


def test_an_exception_is_a_field_with_its_causes() -> None:
    try:
        try:
            raise ZeroDivisionError("first")
        except ZeroDivisionError as error:
            raise ValueError("\udc80 second") from error
    except ValueError as error:
        found = json.loads(JsonLines().format(record("failed", error=error)))
    assert re.search(r"ZeroDivisionError: first.*ValueError: \\udc80 second", found["exception"], re.DOTALL)


def test_nobody_forges_a_line_of_text() -> None:
    line = TextLines().format(record("sensor %s", "a\n2026-01-01T00:00:00Z ERROR b: c", job="j1"))
    assert line.endswith(r" WARNING service.x: sensor a\n2026-01-01T00:00:00Z ERROR b: c job=j1")


@pytest.mark.parametrize("form", [JsonLines, TextLines])
@pytest.mark.parametrize(
    ("secret", "shown"),
    [
        (f"authorization: Bearer {KEY}", "authorization: Bearer stiction_0123456789ab_***"),
        ("postgresql://u:hu@s:h/!@db/stiction?x=1", "postgresql://u:***@db/stiction?x=1"),
        ("s3://b/p and http://db:8000/x", "s3://b/p and http://db:8000/x"),
    ],
)
def test_what_is_secret_is_struck_out(form: type[logging.Formatter], secret: str, shown: str) -> None:
    assert shown in form().format(record(secret))
    assert shown in form().format(record("failed", error=RuntimeError(secret)))


def read(line: str) -> dict[str, Any]:
    assert line.startswith("{"), line
    found: dict[str, Any] = json.loads(line)
    return found


SERVERS = ("uvicorn", "uvicorn.error", "uvicorn.access")


@pytest.fixture(autouse=True)
def _nothing_is_going_on() -> Iterator[None]:
    """What other tests have begun in this process is no matter of these."""
    token = logs.ABOUT.set({})
    yield
    logs.ABOUT.reset(token)


@pytest.fixture
def log(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Iterator[Callable[[], list[dict[str, Any]]]]:
    """Let this process, and those that it starts, log JSON, and read what they did."""
    loggers = {name: logging.getLogger(name) for name in ("", "service", "db", *SERVERS)}
    before = {name: (logger.level, logger.handlers[:], logger.propagate) for name, logger in loggers.items()}
    for logger in loggers.values():  # those of pytest would be closed, and those of other tests' servers hide theirs
        logger.handlers.clear()
        logger.propagate = True
        logger.setLevel(logging.NOTSET)
    logs.configure(Logs("json", "debug"))
    path, others = tmp_path / "log", tmp_path / "other.log"
    with path.open("w", encoding="utf-8", buffering=1) as stream:
        # standard error is another one in each phase of a test, but for other processes
        cast(logging.StreamHandler[Any], loggers[""].handlers[0]).setStream(stream)

        def lines() -> list[dict[str, Any]]:
            with others.open("a", encoding="utf-8") as file:
                file.write(capfd.readouterr().err)
            return [read(line) for line in (path.read_text() + others.read_text()).splitlines()]

        yield lines
    logging.captureWarnings(False)
    for name, (level, handlers, propagate) in before.items():
        loggers[name].setLevel(level)
        loggers[name].handlers[:], loggers[name].propagate = handlers, propagate
    logs._chosen = None


Log = Callable[[], list[dict[str, Any]]]


def test_a_process_logs_what_was_chosen_and_libraries_only_warn(log: Log) -> None:
    assert logs.current() == Logs("json", "debug")
    for name in ("service.a", "db.b", "uvicorn.error", "alembic"):
        for level in (logging.DEBUG, logging.INFO, logging.WARNING):
            logging.getLogger(name).log(level, "x")
    assert [(line["logger"], line["level"]) for line in log()] == [
        *(("service.a", level) for level in ("debug", "info", "warning")),
        *(("db.b", level) for level in ("debug", "info", "warning")),
        *(("uvicorn.error", level) for level in ("info", "warning")),
        ("alembic", "warning"),
    ]


@pytest.mark.parametrize("engine_name", ["sqlite", pytest.param("postgresql", marks=pytest.mark.long)], indirect=True)
def test_server_and_worker_log_one_story_without_secrets(
    tmp_path: Path, database: Database, serving: Any, log: Log, content: bytes, upload: Any, wait: Any
) -> None:
    with database.write() as session:
        access_keys.add(session, keys.key_id(KEY) or "", "robot", "admin", keys.digest(KEY))
    with serving(Settings(data_folder=tmp_path, database_url=database.url, access="keys")) as client:
        client.headers.update({"Authorization": f"Bearer {KEY}", "X-Request-ID": "request-1"})
        client.headers["Idempotency-Key"] = "hush-1"
        client.post("/v1/materials", json={"name": "secret alloy"}).raise_for_status()
        client.headers["Idempotency-Key"] = "hush-2"
        job = upload(client, content, material="secret alloy").json()["job"]["id"]
        assert wait(client, job)["status"] == "done"
        client.head("/v1/materials/secret alloy", params={"token": KEY})  # no parameter of it
        with database.write() as session:
            session.execute(text("DROP TABLE idempotency_keys"))
        assert client.post("/v1/materials", json={"name": "felt"}).status_code in {500, 503}

    lines = log()
    assert not [secret for secret in (KEY[22:], "hush-", "secret alloy") if secret in json.dumps(lines)]
    answered = [line for line in lines if line["message"] == "answered"]
    told = [(line["request_id"], line["method"], line["route"], line["status"]) for line in answered]
    assert told[:2] == [("request-1", "POST", "/v1/materials", 201), ("request-1", "POST", "/v1/grasp-logs", 202)]
    assert ("request-1", "HEAD", "/v1/materials/{name}", 422) in told
    assert all(line["seconds"] > 0.0 for line in answered)
    queued, done = [line for line in lines if line.get("job") == job]
    assert (queued["message"], queued["kind"], queued["request_id"]) == ("job queued", "ingest", "request-1")
    assert (done["message"], done["kind"], done["stage"]) == ("job done", "ingest", "friction_model")
    assert queued["process"] == os.getpid() != done["process"]
    (failure,) = [line for line in lines if "exception" in line]
    assert (failure["request_id"], failure["level"]) == ("request-1", "error")
    assert "idempotency_keys" in failure["exception"]


@pytest.mark.parametrize("address", ["postgresql://u:hu%40sh@127.0.0.1:1/x", "postgresql://u:hu@sh@127.0.0.1:1/x"])
def test_a_database_that_is_not_there_is_logged_without_its_password(tmp_path: Path, log: Log, address: str) -> None:
    server = uvicorn.Server(configuration(Settings(data_folder=tmp_path, database_url=address)))
    with pytest.raises(SystemExit):
        server.run()
    told = json.dumps(log())
    assert "127.0.0.1" in told or "allowed: %40" in told
    assert not [secret for secret in ("hu%40sh", "hu@sh", "sh@") if secret in told]
