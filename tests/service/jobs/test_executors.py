"""Which executors a service has, and what is said of a job that failed."""

from pathlib import Path

import pytest

from service.jobs.executor import reason_of
from service.jobs.executors import executor_for_short_jobs, executors
from service.jobs.process_executor import ProcessExecutor
from service.jobs.worker import StoreConfig

CONFIG = StoreConfig("sqlite:///x", Path("there"))


@pytest.mark.parametrize(("address", "kind"), [(None, "ProcessExecutor"), ("tcp://a:1", "DaskExecutor")])
def test_there_are_as_many_executors_as_asked_for_each_its_own(address: str | None, kind: str) -> None:
    made = executors(CONFIG, 3, address, 5.0)
    assert [type(each).__name__ for each in made] == [kind] * 3
    assert len({id(each) for each in made}) == 3
    assert executors(CONFIG, 0, address, 5.0) == []
    assert [each.missing for each in made] == [None] * 3


def test_short_jobs_have_one_beside_those_of_this_machine_alone() -> None:
    assert isinstance(executor_for_short_jobs(CONFIG, 1, None, 5.0), ProcessExecutor)
    assert executor_for_short_jobs(CONFIG, 0, None, 5.0) is None
    assert executor_for_short_jobs(CONFIG, 1, "tcp://a:1", 5.0) is None


def test_the_reason_of_a_failure_is_its_first_line() -> None:
    assert reason_of(ValueError("no room\nINSERT INTO jobs")) == "ValueError: no room"
    assert reason_of(KeyError()) == "KeyError: "
