"""Entries of a scene, of its parts and of its effects: whether they are what their types say."""

from collections.abc import Mapping
from dataclasses import fields
from numbers import Integral
from typing import Any, get_args, get_origin

import numpy as np

from slipcore import arguments
from slipcore.errors import InvalidInput

UNBOUNDED = frozenset(
    {"radius", "tube_radius", "thickness", "width", "wavelength", "correlation_length", "young_modulus"}
)
"""Entries that may be inf, by which something is flat, rigid, thick or everywhere the same."""


def check_types(kind: type[Any], entries: Mapping[str, Any]) -> None:
    """Raises ``InvalidInput`` for an entry of the dataclass ``kind`` that is no number, whole number, text or tuple of
    numbers where its type says so; a truth value is none of them.
    """
    for entry in fields(kind):
        if entry.name in entries:
            _check(f"{entry.name} of {kind.__name__}", entry.type, entries[entry.name])


def check_own_types(record: Any) -> None:
    """``check_types`` of a record that is made: the first thing that it does with its entries."""
    check_types(type(record), {entry.name: getattr(record, entry.name) for entry in fields(record)})


def check_finite(record: Any) -> None:
    """Raises ``InvalidInput`` for a number of an effect that is NaN, or inf where that means nothing."""
    for entry in fields(record):
        value = getattr(record, entry.name)
        if _holds_numbers(entry.type):
            unbounded = entry.name in UNBOUNDED
            wrong = np.isnan(value) if unbounded else ~np.isfinite(value)
            if np.any(wrong):
                allowed = "numbers, or inf" if unbounded else "finite numbers"
                raise InvalidInput(f"{entry.name} of {type(record).__name__}", arguments.shown(value), allowed)


def check_seed(seed: object) -> None:
    """Raises ``InvalidInput`` for a seed that is no whole number, or below 0."""
    if not _is_whole(seed) or seed < 0:  # type: ignore[operator]
        raise InvalidInput("seed", arguments.shown(seed), "a whole number, 0 or more")


def _is_whole(value: object) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _check(name: str, kind: Any, value: Any) -> None:
    """One value against a type; types other than those of numbers, texts and tuples of numbers are not looked at."""
    if kind is float:
        arguments.number(name, value)
    elif kind is int:
        if not _is_whole(value):
            raise InvalidInput(name, arguments.shown(value), "a whole number")
    elif kind is str:
        arguments.of_kind(name, value, str)
    elif _holds_numbers(kind):
        _check_row(name, get_args(kind), value)


def _check_row(name: str, parts: tuple[Any, ...], value: Any) -> None:
    """A tuple, list or array of as many values as ``parts`` says, or of any number where they end in an ellipsis."""
    if get_origin(parts[0]) is tuple:  # a map: too many values to look at one by one
        _check_map(name, value)
        return
    count = None if parts[-1] is Ellipsis else len(parts)
    allowed = f"{count or 'a list of'} {'whole ' if parts[0] is int else ''}numbers"
    is_row = isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim == 1)
    if not is_row or count not in (None, len(value)):
        raise InvalidInput(name, arguments.shown(value), allowed)
    for each in value:
        _check(f"each of {name}", parts[0], each)


def _check_map(name: str, value: Any) -> None:
    """Rows of numbers, all of one length."""
    allowed = "rows of numbers, all of one length"
    lengths = [np.size(row) for row in value] if isinstance(value, tuple | list) else []
    for row, length in enumerate(lengths):
        if length != lengths[0]:
            raise InvalidInput(name, f"{length} long in row {row} and {lengths[0]} in row 0", allowed)
    if arguments.real_array(name, value).ndim != 2:
        raise InvalidInput(name, arguments.shown(value), allowed)


def _holds_numbers(kind: Any) -> bool:
    """Whether a type is that of a number, or of numbers in tuples."""
    return kind in (float, int) or (get_origin(kind) is tuple and _holds_numbers(get_args(kind)[0]))
