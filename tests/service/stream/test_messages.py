"""Numbers in messages of a stream."""

import pytest

from service.stream.messages import DEEPEST, packed
from slipcore import InvalidInput


def nested(depth: int) -> list[object]:
    numbers: list[object] = [1.0, 2]
    for _ in range(depth - 1):
        numbers = [numbers]
    return numbers


def test_lists_are_flattened_down_to_the_deepest_that_is_allowed() -> None:
    for depth in range(1, DEEPEST + 1):
        assert list(packed("force", nested(depth))) == [1.0, 2.0]
    with pytest.raises(InvalidInput, match=f"one with a list in it; allowed: numbers, in lists at most {DEEPEST} deep"):
        packed("force", nested(DEEPEST + 1))
