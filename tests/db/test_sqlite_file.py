import sqlite3
from pathlib import Path

import pytest

from db.errors import StorageUnavailable
from db.sqlite_file import SIDE_FILES, SqliteFile


@pytest.mark.parametrize("suffix", SIDE_FILES)
def test_a_look_makes_no_file_in_place_of_one_that_is_gone(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / "database"
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("CREATE TABLE log (id)")
    file = SqliteFile(str(path))
    file.note_opened(connection)
    file.check_head()
    beside = Path(f"{path}{suffix}")
    beside.rename(tmp_path / "away")
    with pytest.raises(StorageUnavailable, match=suffix):
        file.check_head()
    assert not beside.exists()
    connection.close()
