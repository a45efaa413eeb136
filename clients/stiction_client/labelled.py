"""Models as pandas, xarray and a notebook show them; the libraries are loaded when one is asked for."""

from collections.abc import Sequence
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pandas import DataFrame as DataFrame  # for the records whose methods return it
    from xarray import Dataset as Dataset

NAMES, UNITS = ("beta0", "beta1", "beta2"), ("1", "s/m", "1/N")
SYMBOLS = ("β₀ [-]", "β₁ [s/m]", "β₂ [1/N]", "σ [-]")

Row = tuple[float, float, float, float, bool]
"""Estimate, standard error, the ends of the 95 % interval, and whether the data determine it."""


def coefficient_table(rows: Sequence[Row], **about: object) -> "DataFrame":
    """A row for each coefficient and for σ; raises ``ModuleNotFoundError`` where pandas is not installed."""
    columns = ("estimate", "standard_error", "low", "high", "identifiable")
    names = (*NAMES, "sigma")[: len(rows)]
    made: DataFrame = _load("pandas").DataFrame(rows, columns=columns, index=names)
    made.insert(0, "unit", (*UNITS, "1")[: len(rows)])
    made.attrs.update(about)
    return made


def coefficient_dataset(
    coefficients: NDArray[np.float64],
    covariance: NDArray[np.float64],
    identifiable: NDArray[np.bool_],
    scale: float,
    **about: object,
) -> "Dataset":
    """Coefficients with their covariance; raises ``ModuleNotFoundError`` where xarray is not installed."""
    names = np.array(NAMES)
    variables = {
        "coefficients": ("coefficient", coefficients),
        "covariance": (("coefficient", "other"), covariance),
        "identifiable": ("coefficient", identifiable),
        "scale": ((), scale),
    }
    labels = {"coefficient": names, "other": names, "unit": ("coefficient", np.array(UNITS))}
    made: Dataset = _load("xarray").Dataset(variables, coords=labels, attrs=about)
    return made


def coefficient_html(title: str, rows: Sequence[Row], below: str) -> str:
    """A table of the coefficients, and a sentence below it; both are escaped."""
    head = "".join(f"<th>{name}</th>" for name in ("", "estimate", "95 % interval"))
    lines = "".join(
        f"<tr><th>{symbol}{'' if identifiable else ' †'}</th><td>{value:.4g}</td><td>{low:.4g} … {high:.4g}</td></tr>"
        for symbol, (value, _, low, high, identifiable) in zip(SYMBOLS, rows, strict=False)
    )
    note = "" if all(row[-1] for row in rows) else " † not determined by the data."
    return f"<div><strong>{escape(title)}</strong><table><tr>{head}</tr>{lines}</table>{escape(below)}.{note}</div>"


def _load(name: str) -> Any:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        error.add_note(f"{name} comes with the extra `notebook` of stiction-client")
        raise
