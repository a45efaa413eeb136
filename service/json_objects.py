"""Objects of JSON whose keys stand once: of two that are alike the last would count, without a word."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

MOST_NAMED = 100
"""Characters of a key that a refusal repeats."""


class RepeatedKey(ValueError):
    """An object has a ``key`` more than once, here as a refusal repeats it."""

    def __init__(self, key: str) -> None:
        self.key = ascii(key)[:MOST_NAMED]
        super().__init__(f"the key {self.key} more than once")


def unique(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """The object of these keys and values, as ``object_pairs_hook`` of ``json``; raises ``RepeatedKey``."""
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        raise RepeatedKey(next(key for key in counts if counts[key] > 1))
    return found
