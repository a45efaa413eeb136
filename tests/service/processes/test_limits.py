import resource
from collections.abc import Iterator

import pytest

from service.processes import limits

FILES = resource.RLIMIT_NOFILE


@pytest.fixture
def hard() -> Iterator[int]:
    """The most files that this process may have open, of which it has half at the begin."""
    before = resource.getrlimit(FILES)
    most = before[1] if before[1] != resource.RLIM_INFINITY else 4096
    resource.setrlimit(FILES, (most // 2, before[1]))
    yield most
    resource.setrlimit(FILES, before)


def test_a_process_raises_its_own_limit_of_files_as_far_as_it_wants(hard: int) -> None:
    assert limits.open_files(hard // 4) == hard // 2
    assert resource.getrlimit(FILES)[0] == hard // 2
    assert limits.open_files(hard - 1) == hard - 1
    assert resource.getrlimit(FILES)[0] == hard - 1


def test_no_more_files_are_had_than_the_machine_allows(hard: int) -> None:
    if resource.getrlimit(FILES)[1] == resource.RLIM_INFINITY:
        pytest.skip("this machine allows any number")
    assert limits.open_files(hard + 100) == hard
