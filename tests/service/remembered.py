"""Numerics that many tests have jobs do with the same few logs, worked out once: what jobs store is what they ask."""

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from types import ModuleType
from typing import Any

import pytest


def remembered(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, of whose results those for the same content of the arguments are one."""
    kept: dict[bytes, Any] = {}

    @wraps(function)
    def once(*given: Any, **options: Any) -> Any:
        key = hashlib.sha256(pickle.dumps((given, options))).digest()
        if key not in kept:
            kept[key] = function(*given, **options)
        return kept[key]

    return once


@contextmanager
def remembering(*functions: tuple[ModuleType, str]) -> Iterator[None]:
    """Let whoever calls these functions by their modules get what is remembered."""
    with pytest.MonkeyPatch.context() as patched:
        for module, name in functions:
            patched.setattr(module, name, remembered(getattr(module, name)))
        yield
