from contextlib import suppress
from pathlib import Path

import pytest

from service.processes.folder_lock import shared


def test_a_process_knows_whether_it_is_alone_in_a_folder(tmp_path: Path) -> None:
    alone: list[bool] = []
    with shared(tmp_path, alone.append), shared(tmp_path, alone.append), shared(tmp_path, alone.append):
        pass
    with shared(tmp_path, alone.append):
        pass
    assert alone == [True, False, False, True]


def test_a_process_that_cannot_enter_leaves_the_folder_to_others(tmp_path: Path) -> None:
    def fail(_: bool) -> None:
        raise ValueError

    alone: list[bool] = []
    with suppress(ValueError), shared(tmp_path, fail):
        pytest.fail("it did not enter")
    with shared(tmp_path, alone.append):
        assert alone == [True]
