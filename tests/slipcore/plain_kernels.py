"""Compiled kernels as the plain Python that they are made of: quick where compiling takes longer than the test."""

from inspect import unwrap
from types import ModuleType

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from slipcore.lanes import COUNT


def as_plain_python(patched: pytest.MonkeyPatch, *modules: ModuleType) -> None:
    """Let kernels of these modules, and those that they call, run as they are written; eight lanes as an array."""
    lanes = {"load": _load, "store": _store, "transpose": _transpose}
    for module in modules:
        for name, value in list(vars(module).items()):
            if isinstance(value, Dispatcher):
                patched.setattr(module, name, unwrap(value))
            elif name in lanes:
                patched.setattr(module, name, lanes[name])


def _load(array: np.ndarray, at: int) -> np.ndarray:
    assert len(array) >= at + COUNT
    return array[at : at + COUNT].copy()


def _store(array: np.ndarray, at: int, lanes: np.ndarray) -> None:
    array[at : at + COUNT] = lanes


def _transpose(array: np.ndarray, at: int) -> None:
    tile = array[at : at + COUNT * COUNT].reshape(COUNT, COUNT)
    tile[:] = tile.T.copy()
