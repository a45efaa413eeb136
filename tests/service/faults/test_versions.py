"""A worker of an older version: it leaves the jobs of a database that a newer one has upgraded to a newer worker."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

import migrations
from db import migrate

INPUT_REFUSED = 3
REFUSED = f"database revision is 9999; allowed: at most {migrate.head()}"
NEWER = '''"""What a later version needs."""

import sqlalchemy as sa
from alembic import op

revision = "9999"
down_revision = "{head}"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table("later", sa.Column("id", sa.Integer, primary_key=True))


def downgrade() -> None:
    op.drop_table("later")
'''


@pytest.fixture
def newer(fleet: Any, tmp_path: Path) -> Callable[..., Any]:
    """Starts a command of a version that has one more migration."""
    folder = tmp_path / "newer"
    shutil.copytree(Path(migrations.__file__).parent, folder / "migrations")
    (folder / "migrations/versions/m9999_later.py").write_text(NEWER.format(head=migrate.head()))
    paths = os.pathsep.join([str(folder), *filter(None, sys.path)])

    def start(*command: str) -> subprocess.Popen[bytes]:
        environment = os.environ | fleet.environment | {"PYTHONPATH": paths, "STICTION_WORKERS": "1"}
        with fleet.log.open("ab") as log:
            arguments = [sys.executable, "-m", "service.cli", *command]
            return subprocess.Popen(arguments, cwd=folder, env=environment, stdout=log, stderr=log)

    return start


def test_a_worker_does_not_start_on_a_newer_database(fleet: Any) -> None:
    server = fleet.serve()
    with fleet.database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    worker = fleet.work()
    fleet.wait_until(lambda: not worker.is_alive(), "the worker to refuse to start")
    assert worker.exitcode == INPUT_REFUSED
    assert REFUSED in fleet.log.read_text()
    fleet.wait_until(lambda: not server.is_ready(), "the server that runs to say so")
    assert REFUSED in server.client.get("/readyz").json()["detail"]
    assert fleet.runners() == set()


@pytest.mark.long
def test_a_worker_of_an_older_version_leaves_the_jobs_to_a_newer_one(
    fleet: Any, newer: Callable[..., Any], contents: Callable[[int], list[bytes]]
) -> None:
    first, second = contents(2)
    server, worker = fleet.serve(), fleet.work()
    server.make_material()
    accepted = [server.accept(first)]
    fleet.wait_until(fleet.all_ended, "the worker to do its first job")
    assert newer("db", "upgrade").wait() == 0
    accepted.append(server.accept(second))
    fleet.wait_until(lambda: not worker.is_alive(), "the worker to leave")
    assert worker.exitcode == INPUT_REFUSED
    assert fleet.log.read_text().count(REFUSED) >= 2  # in its log, and as its last word
    assert server.client.get(f"/v1/grasp-logs/{accepted[1]}").json()["job"]["status"] == "queued"
    process = newer("worker")
    try:
        fleet.wait_until(fleet.all_ended, "the newer worker to end the job")
    finally:
        process.terminate()
        assert process.wait() == 0
    jobs = server.client.get("/v1/jobs").raise_for_status().json()["items"]
    assert [(job["status"], job["deaths"]) for job in jobs] == [("done", 0)] * 2
    assert server.client.get("/v1/materials/paper").json()["models"]["ols"]["version"] == len(jobs)
