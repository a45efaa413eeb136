"""Rows of the sensitivity page: one default each, measured at half of its value and at one and a half of it."""

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields
from importlib import reload
from types import ModuleType

import numpy as np

import estimators
import estimators.defaults
import slipcore.calibration.defaults
import slipcore.contact.defaults
import slipcore.defaults
import slipcore.forces.defaults
from estimators import change_alarm, change_detector, grasp_design, population, recognition
from slipcore import METHODS, CheckOptions, PatchOptions, SampleOptions
from slipcore.contact.elasticity import bonded_layer
from slipcore.contact.scene import explain
from slipcore.contact.tiers import beam_lattice
from slipcore.errors import SlipcoreError
from slipcore.options import Option, Options, describe_options
from stiction_client import ControlSettings, InvalidArgument
from stiction_client.controller.settings import Gain, gains

FACTORS = (0.5, 1.5)
REFUSALS = (SlipcoreError, estimators.EstimatorError, estimators.NotConverged, InvalidArgument)
DEAD = 1e-3
"""Relative change below which a default has no effect to speak of."""
MODULES = (
    slipcore.defaults,
    slipcore.calibration.defaults,
    slipcore.contact.defaults,
    slipcore.forces.defaults,
    estimators.defaults,
)
READ_ONCE = (recognition, change_alarm, change_detector, population, grasp_design, explain, beam_lattice)
"""Modules that read a table as they are imported."""
Key = tuple[str, str]
"""A table's qualified name, and that of one of its entries."""
Known = frozenset[Key]


@dataclass(frozen=True, slots=True)
class Row:
    """One default: ``changes`` of each measure at half of its value and at one and a half of it; or why none."""

    table: str
    name: str
    default: float
    unit: str
    changes: dict[str, tuple[float, float]]
    failed: str = ""

    @property
    def largest(self) -> float:
        """Largest change of any measure."""
        return max((abs(value) for pair in self.changes.values() for value in pair), default=float("nan"))


def neighbours(value: float, option: Option | Gain) -> Iterator[float]:
    """Half and one and a half of a value, in its range; a whole number moves by one at least."""
    for factor in FACTORS:
        moved: float = factor * value
        if isinstance(value, int):
            moved = min(round(moved), value - 1) if factor < 1.0 else max(round(moved), value + 1)
        bounded = min(max(moved, option.low), option.high)
        yield int(bounded) if isinstance(value, int) else bounded


def rows(
    label: str,
    kind: type[Options] | type[ControlSettings],
    measure: Callable[[str, float], Mapping[str, float]],
    start: Mapping[str, float],
    known: Known = frozenset(),
) -> Iterator[Row]:
    """A row for each default of a table that is not ``known``; ``measure`` takes a name and a value."""
    ranges = gains() if kind is ControlSettings else describe_options(kind)
    for entry in fields(kind):
        if entry.default is MISSING or (label, entry.name) in known:
            continue
        option, found, failed = ranges[entry.name], [], ""
        for value in neighbours(entry.default, option):
            try:
                found.append(measure(entry.name, value))
            except REFUSALS as error:
                failed = f"{value:g}: {type(error).__name__}"
        changes = {key: tuple(each[key] - start[key] for each in found) for key in start} if len(found) == 2 else {}
        yield Row(label, entry.name, entry.default, option.unit, changes, failed)


@contextmanager
def changed(table: Options, name: str, value: float) -> Iterator[None]:
    """One entry of a table with another value; tables are frozen so that nothing but this changes them.

    Modules that read a table once, as they are imported, are read anew: their names are to be asked of the module. They
    have their own back afterwards: what was made of a class before is of the same one still.
    """
    before, own = getattr(table, name), [(module, dict(vars(module))) for module in READ_ONCE]
    _put(table, name, value)
    for module in READ_ONCE:
        reload(module)
    try:
        yield
    finally:
        _put(table, name, before)
        for module, names in own:
            vars(module).update(names)


def _put(table: Options, name: str, value: float) -> None:
    object.__setattr__(table, name, value)
    bonded_layer._influence.cache_clear()
    bonded_layer.radial_functions.cache_clear()


def qualified(module: ModuleType, label: str) -> str:
    """A table's name with its package's, which tells two of one name apart."""
    return f"{module.__name__.removesuffix('.defaults')}.{label}"


def of_tables(
    module: ModuleType, names: Sequence[str], measure: Callable[[], dict[str, float]], known: Known = frozenset()
) -> list[Row]:
    """Rows of all entries of some tables, or of single ones by "TABLE.entry", but for those that are ``known``."""
    found: list[Row] = []
    start: dict[str, float] = {}
    for name in names:
        label, _, entry = name.partition(".")
        table, told = getattr(module, label), qualified(module, label)
        left = {entry} if entry else set(describe_options(type(table)))
        if all((told, each) in known for each in left):
            continue
        start = start or measure()

        def with_value(name: str, value: float, table: Options = table) -> dict[str, float]:
            with changed(table, name, value):
                return measure()

        found += rows(told, type(table), with_value, start, known | others(type(table), told, left))
    return found


def others(kind: type[Options], label: str, names: Collection[str]) -> Known:
    """The entries of a table that are none of these."""
    return frozenset((label, name) for name in describe_options(kind) if name not in names)


def table_of(found: list[Row]) -> str:
    """A Markdown table of what counts, the most sensitive first, and below it the names of the rest."""
    measures = next((list(row.changes) for row in found if row.changes), [])
    lines = [
        "| of | default | value | " + " | ".join(f"{name}, half | {name}, one and a half" for name in measures) + " |",
        "|---|---|---|" + "---|---|" * len(measures),
    ]
    ordered = sorted(found, key=lambda row: -np.nan_to_num(row.largest, nan=np.inf))
    for row in (row for row in ordered if not row.largest < DEAD):
        cells = [f"{value:+.3f}" for name in measures for value in row.changes.get(name, ())]
        cells = cells or [row.failed] + [""] * (2 * len(measures) - 1)
        lines.append(f"| {row.table} | `{row.name}` | {row.default:g} {row.unit} | " + " | ".join(cells) + " |")
    return "\n".join(lines + _without_effect(found))


def _without_effect(found: list[Row]) -> list[str]:
    """A second table, of the defaults that change nothing to speak of."""
    quiet: dict[str, dict[str, None]] = {}
    for row in (row for row in found if row.largest < DEAD):
        quiet.setdefault(row.table, {})[f"`{row.name}`"] = None
    lines = [f"| {label} | {', '.join(names)} |" for label, names in quiet.items()]
    return ["", f"| of | less than {DEAD:g} by either |", "|---|---|", *lines] if lines else []


def tables_of_options() -> dict[str, type[Options]]:
    """Those of every method, of what callers may choose, and of every table, by the names that pages call them by."""
    kinds: dict[str, type[Options]] = {method: described.options for method, described in METHODS.items()}
    kinds |= {kind.__name__: kind for kind in (CheckOptions, PatchOptions, SampleOptions)}
    for module in MODULES:
        tables = [(label, table) for label, table in vars(module).items() if label.isupper()]
        kinds |= {qualified(module, label): type(table) for label, table in tables if isinstance(table, Options)}
    return kinds


def every() -> dict[Key, tuple[float, str]]:
    """Value and unit of each default: of every table, every method, what callers may choose, and grip control."""
    found: dict[Key, tuple[float, str]] = {}
    for label, kind in tables_of_options().items():
        units = describe_options(kind)
        found |= {(label, entry.name): (entry.default, units[entry.name].unit) for entry in fields(kind)}
    given = {entry.name: entry.default for entry in fields(ControlSettings) if entry.default is not MISSING}
    return found | {("ControlSettings", name): (value, gains()[name].unit) for name, value in given.items()}


def rows_on(page: str, part: str) -> list[Row]:
    """The rows that a page has of a part, to three digits, of defaults that are what they were."""
    found = re.search(rf"<!-- table {re.escape(part)} -->\n(.*?)<!-- end -->", page, re.DOTALL)
    text, now = found[1] if found else "", every()
    measures = re.findall(r" (\w[\w ]*), half \|", text)
    kept: list[Row] = []
    for label, name, shown, cells in re.findall(r"^\| (\S+) \| `(\w+)` \| (.*?) \| (.*) \|$", text, re.MULTILINE):
        if shown == "{:g} {}".format(*now.get((label, name), (math.nan, ""))):
            texts = [cell.strip() for cell in cells.split("|")]
            failed = texts[0] if ":" in texts[0] else ""
            values = [] if failed else [float(each) for each in texts]
            pairs = zip(measures, zip(values[::2], values[1::2], strict=True), strict=not failed)
            kept.append(Row(label, name, *now[label, name], dict(pairs), failed))
    listed = re.findall(r"^\| (\S+) \| ((?:`\w+`(?:, )?)+) \|$", text, re.MULTILINE)
    quiet = [(label, name) for label, names in listed for name in re.findall(r"\w+", names)]
    still = dict.fromkeys(measures, (0.0, 0.0))
    return kept + [Row(*key, *now[key], dict(still)) for key in quiet if key in now]
