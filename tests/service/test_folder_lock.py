from pathlib import Path

import pytest

from service.folder_lock import FolderInUse, locked


def test_a_folder_has_one_server_at_a_time(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    with locked(folder), pytest.raises(FolderInUse, match="in use by another server"), locked(folder):
        raise AssertionError("two servers in one folder")
    with locked(folder):
        assert folder.is_dir()
