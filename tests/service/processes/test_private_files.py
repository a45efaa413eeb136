"""What is withheld from others, in this process."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.processes.private_files import withhold


@pytest.fixture(autouse=True)
def umask() -> Iterator[None]:
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.mark.parametrize(
    ("shell", "file", "folder"), [(0o000, 0o640, 0o750), (0o022, 0o640, 0o750), (0o077, 0o600, 0o700)]
)
def test_others_get_nothing_and_a_stricter_shell_has_its_way(
    tmp_path: Path, shell: int, file: int, folder: int
) -> None:
    os.umask(shell)
    withhold()
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("file", "folder")] == [file, folder]
