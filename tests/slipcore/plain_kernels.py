"""Compiled kernels as the plain Python that they are made of: quick where compiling takes longer than the test."""

from inspect import unwrap
from types import ModuleType

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from slipcore.lanes import BYTES


def as_plain_python(patched: pytest.MonkeyPatch, *modules: ModuleType) -> None:
    """Let kernels of these modules, and those that they call, run as they are written; lanes as an array."""
    lanes = {"count": _count, "load": _load, "store": _store, "transpose": _transpose}
    for module in modules:
        for name, value in list(vars(module).items()):
            if isinstance(value, Dispatcher):
                patched.setattr(module, name, unwrap(value))
            elif name in lanes:
                patched.setattr(module, name, lanes[name])


def _count(array: np.ndarray) -> int:
    return BYTES // array.itemsize


def _load(array: np.ndarray, at: int) -> np.ndarray:
    assert len(array) >= at + _count(array)
    return array[at : at + _count(array)].copy()


def _store(array: np.ndarray, at: int, lanes: np.ndarray) -> None:
    array[at : at + _count(array)] = lanes


def _transpose(array: np.ndarray, at: int) -> None:
    number = _count(array)
    tile = array[at : at + number**2].reshape(number, number)
    tile[:] = tile.T.copy()
