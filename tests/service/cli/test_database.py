"""What commands of the database tell on the way."""

import pytest

from service.cli import database


def test_every_hundredth_blob_is_told_and_each_count_of_anything_else(capsys: pytest.CaptureFixture[str]) -> None:
    for count in (1, 100, 101, 200):
        database._tell("blobs", count)
    database._tell("jobs", 7)
    assert capsys.readouterr().err.splitlines() == ["blobs: 100", "blobs: 200", "jobs: 7"]
