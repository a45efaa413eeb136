"""Records as the tables of pandas and the labelled arrays of xarray; these are loaded when one is asked for."""

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pandas import DataFrame as DataFrame  # for the records whose methods return it
    from xarray import Dataset as Dataset

Array = NDArray[Any]
Variables = Mapping[str, tuple[tuple[str, ...], Array | None, str]]
"""By name: dimensions, values (None: there are none), and unit."""

AXES = {"axis": np.array(["x", "y", "z"]), "plane_axis": np.array(["x", "y"])}
"""Coordinates of vectors."""


def table(columns: Mapping[str, Array], **about: object) -> "DataFrame":
    """A table with ``about`` it in its ``attrs``; raises ``ModuleNotFoundError`` where pandas is not installed."""
    made: DataFrame = _load("pandas").DataFrame(columns)
    made.attrs.update(about)
    return made


def dataset(variables: Variables, coordinates: Variables, **about: object) -> "Dataset":
    """Labelled arrays with their units; raises ``ModuleNotFoundError`` where xarray is not installed."""
    xarray = _load("xarray")
    of = {
        name: (dims, values, {"units": unit}) for name, (dims, values, unit) in variables.items() if values is not None
    }
    labels = {name: (dims, values, {"units": unit}) for name, (dims, values, unit) in coordinates.items()}
    used = {dim for dims, *_ in of.values() for dim in dims}
    vectors = {name: values for name, values in AXES.items() if name in used}
    made: Dataset = xarray.Dataset(of, coords=labels | vectors, attrs=about)
    return made


def _load(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        error.add_note(f"{name} comes with the extra `notebook` of stiction")
        raise
