import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import httpx
import pytest

from db.database import Database
from db.errors import StorageUnavailable
from service.settings import Settings


def test_the_process_lives_and_takes_work(client: httpx.Client) -> None:
    assert client.get("/healthz").json() == {"status": "ok"}
    assert client.get("/readyz").json() == {"status": "ready", "database": "ok", "blobs": "ok"}


def test_readiness_names_what_is_missing(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]], tmp_path: Path
) -> None:
    with serving(Settings(data_folder=tmp_path, workers=0)) as client:
        assert client.get("/readyz").status_code == httpx.codes.OK
        shutil.rmtree(tmp_path / "spool")
        response = client.get("/readyz")
        assert client.get("/healthz").status_code == httpx.codes.OK
    assert response.status_code == httpx.codes.SERVICE_UNAVAILABLE
    assert response.headers["retry-after"] == "1"
    assert response.json()["type"] == "/problems/storage-unavailable"
    assert "blob folder" in response.json()["detail"]


def test_readiness_asks_the_database_too(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(_: Database) -> None:
        raise StorageUnavailable("the database does not answer")

    with serving(Settings(data_folder=tmp_path, workers=0)) as client:
        with monkeypatch.context() as patched:
            patched.setattr(Database, "ping", gone)
            response = client.get("/readyz")
        assert client.get("/readyz").status_code == httpx.codes.OK
    assert (response.status_code, response.json()["type"]) == (503, "/problems/storage-unavailable")
    assert "database" in response.json()["detail"]


def test_a_nearly_full_disk_takes_no_upload_and_is_not_ready(
    serving: Callable[[Settings], AbstractContextManager[httpx.Client]], tmp_path: Path
) -> None:
    with serving(Settings(data_folder=tmp_path, workers=0, least_free_bytes=2**50)) as client:
        upload = client.post("/v1/grasp-logs", content=b"PK", headers={"content-type": "application/zip"})
        answers = [client.get("/readyz"), upload]
        assert client.get("/v1/grasp-logs").status_code == httpx.codes.OK
    for response in answers:
        assert (response.status_code, response.json()["type"]) == (503, "/problems/storage-unavailable")
        assert "nearly full" in response.json()["detail"]
