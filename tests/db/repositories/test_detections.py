from time import process_time
from types import SimpleNamespace
from typing import Any

from db.repositories.detections import _copies


def test_a_thousand_copies_of_one_grasp_are_told_in_a_moment() -> None:
    """Each is alike all before it. They made a chain, along which each was gone for each: 4 s, in a transaction."""
    marks = [f"{number:064x}" for number in range(1000)]
    rows: Any = [
        SimpleNamespace(number=k, id=mark, sha256=mark, samples=100, fingerprint=mark, alike=marks[:k])
        for k, mark in enumerate(marks)
    ]
    begin = process_time()
    assert _copies(rows) == {marks[0]: marks[1:]}
    assert process_time() - begin < 1.0
