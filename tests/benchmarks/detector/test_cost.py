from pathlib import Path

import pytest

from benchmarks.detector.__main__ import logs


@pytest.mark.parametrize("name", ["all elements touch", "all elements touch, displacement alone"])
def test_steps_are_timed_where_the_contact_covers_the_sensor(name: str, tmp_path: Path) -> None:
    log = dict(logs(tmp_path))[name]
    assert log.truth is not None
    assert log.truth.contact.all(axis=(1, 2)).mean() > 0.7  # so that the median step is one of these
    assert (log.force is None) == name.endswith("alone")
