"""Changes functions of modules that are loaded already: each gets its new code, and nothing is imported anew.

A compiled kernel is compiled from its new code when it is next called, and so are all kernels that call it.
"""

import gc
import inspect
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import count
from types import CodeType, FunctionType
from typing import Any

from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher

Change = tuple[FunctionType, CodeType]


class Functions:
    """The functions that are alive, by where their code stands; ``ran`` has the lines of files that ran before."""

    def __init__(self, ran: Mapping[str, set[int]]) -> None:
        self._ran = ran
        self._alive: dict[Any, list[FunctionType]] = defaultdict(list)
        things = gc.get_objects()
        for function in things:
            if type(function) is FunctionType:
                self._alive[_place(function.__code__)].append(function)
        self.kernels = [thing for thing in things if isinstance(thing, Dispatcher)]

    def changes(self, file: str, before: bytes, after: bytes) -> list[Change] | None:
        """What turns a loaded file's functions into those of another source.

        None where that is not possible: a line that runs at import differs, or there is no such function.
        """
        if not any(getattr(module, "__file__", None) == file for module in list(sys.modules.values())):
            return None
        old, new = (compile(source, file, "exec", dont_inherit=True) for source in (before, after))
        if _runs_otherwise(old, new):
            return None
        found: list[Change] = []
        for own, other in _pairs(old, new):
            if _is_body(own) or _words(own) == _words(other):
                continue
            alive = self._alive[_place(own)]
            if own.co_freevars != other.co_freevars:
                return None
            found += [(function, other) for function in alive]
        return found if found or _words(old) == _words(new) else None

    def make(self, changes: list[Change]) -> None:
        """Let functions have their new code."""
        changed = {id(function) for function, _ in changes}
        stale = [kernel for kernel in self.kernels if id(kernel.py_func) in changed]
        others = [(kernel, _used(kernel.py_func)) for kernel in self.kernels if kernel not in stale]
        for kernel in stale:  # grows by those that call one of them
            stale += [other for other, used in others if id(kernel) in used and other not in stale]
        for kernel in stale:
            kernel._make_finalizer()()
            kernel._reset_overloads()
            kernel._cache = NullCache()
        for function, code in changes:
            function.__code__ = code

    def compile(self, changes: list[Change]) -> bool:
        """Whether one of them is a compiled kernel."""
        changed = {id(function) for function, _ in changes}
        return any(id(kernel.py_func) in changed for kernel in self.kernels)

    def have_run(self, changes: list[Change]) -> bool:
        """Whether one of them ran before: what came of it is not what it would be after a new import."""
        return any(self._has_run(function.__code__) for function, _ in changes)

    def _has_run(self, code: CodeType) -> bool:
        lines = {line for _, _, line in code.co_lines() if line is not None} - {code.co_firstlineno}
        return not lines or bool(lines & self._ran.get(code.co_filename, set()))


def _used(function: FunctionType) -> set[int]:
    """What the global names and the closure of a function stand for."""
    names = [name for code in _all_codes(function.__code__) for name in code.co_names]
    values = [function.__globals__[name] for name in names if name in function.__globals__]
    modules = [value for value in values if inspect.ismodule(value)]
    values += [getattr(module, name, None) for module in modules for name in names]
    return {id(value) for value in [*values, *inspect.getclosurevars(function).nonlocals.values()]}


def _all_codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from _all_codes(part)


def _place(code: CodeType) -> tuple[str, str, int]:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _is_body(code: CodeType) -> bool:
    """Whether it is that of a module or a class, which is run once."""
    return not code.co_flags & inspect.CO_OPTIMIZED


def _runs_otherwise(old: CodeType, new: CodeType) -> bool:
    if _own_words(old) != _own_words(new):
        return True
    bodies = [pair for pair in _matched(old, new) if _is_body(pair[0])]
    return any(_runs_otherwise(*pair) for pair in bodies)


def _pairs(old: CodeType, new: CodeType) -> Iterator[tuple[CodeType, CodeType]]:
    """What stands in both, at any depth."""
    yield old, new
    for pair in _matched(old, new):
        yield from _pairs(*pair)


def _matched(old: CodeType, new: CodeType) -> Iterator[tuple[CodeType, CodeType]]:
    """What stands directly in both, by its name."""
    others = _inside(new)
    return ((code, others[name]) for name, code in _inside(old).items() if name in others)


def _inside(code: CodeType) -> dict[tuple[str, int], CodeType]:
    counts: dict[str, Iterator[int]] = defaultdict(count)
    parts = [part for part in code.co_consts if isinstance(part, CodeType)]
    return {(part.co_qualname, next(counts[part.co_qualname])): part for part in parts}


def _own_words(code: CodeType) -> tuple[Any, ...]:
    """All that a piece of code does but for what stands in it, wherever it stands."""
    values = [(type(value), "" if isinstance(value, CodeType) else repr(value)) for value in code.co_consts]
    return code.co_code, code.co_flags, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars, values


def _words(code: CodeType) -> tuple[Any, ...]:
    return *_own_words(code), [_words(part) for part in code.co_consts if isinstance(part, CodeType)]
