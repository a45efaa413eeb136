"""Draws of a posterior as ArviZ takes them; it is loaded when they are asked for."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

InferenceData = Any
"""``arviz.InferenceData``, in whose place ArviZ 1 has ``xarray.DataTree``."""


def inference_data(draws: Mapping[str, NDArray[np.float64]]) -> InferenceData:
    """The draws [k] of each parameter as one chain; raises ``ModuleNotFoundError`` where ArviZ is not installed."""
    try:
        arviz = import_module("arviz")
    except ModuleNotFoundError as error:
        error.add_note("arviz comes with the extra `notebook` of stiction")
        raise
    posterior = {name: values[None] for name, values in draws.items()}
    if hasattr(arviz, "InferenceData"):
        return arviz.from_dict(posterior=posterior)
    return arviz.from_dict({"posterior": posterior})
