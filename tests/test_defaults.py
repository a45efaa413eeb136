"""Numbers that change results stand in the packages' tables, where they have a unit, a range and a source."""

import ast
import re
from collections.abc import Iterator
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import pytest

import estimators.defaults
import slipcore.calibration.defaults
import slipcore.contact.defaults
import slipcore.defaults
import slipcore.forces.defaults
from benchmarks.defaults import rows
from slipcore import METHODS, CheckOptions, SampleOptions
from slipcore.options import Options, describe_options

ROOT = Path(__file__).parents[1]
MODULES = (
    slipcore.defaults,
    slipcore.calibration.defaults,
    slipcore.contact.defaults,
    slipcore.forces.defaults,
    estimators.defaults,
)
PACKAGES = ("slipcore", "estimators")
BASES = {Options, slipcore.defaults.ContactOptions}
KINDS = [SampleOptions, CheckOptions, slipcore.defaults.PatchOptions, *(method.options for method in METHODS.values())]
KINDS += [type(table) for module in MODULES for table in module.TABLES]

NOT_TUNED = {
    "slipcore/contact/elasticity/fields.py": "weights of a linear interpolation",
    "slipcore/contact/elasticity/fourier.py": "sines and cosines of fifths of a turn",
    "slipcore/warm_up.py": "a log to compile kernels with, of which no result is kept",
    "slipcore/elementary.py": "series of the logarithm and exponential, layout of a double",
    "estimators/likelihoods/kernels.py": "series of the logarithm and exponential, layout of a double",
}
"""Files whose numbers are mathematics."""

LAYOUT = {
    "slipcore/lanes.py": {"BYTES"},
    "slipcore/notebook.py": {"WIDTH", "HEIGHT"},
    "slipcore/detection/filter/state.py": {"ROWS", "POSE"},
    "slipcore/detection/strain_rate/step.py": {"ROWS"},
    "estimators/linear/grasp_statistics.py": {"POOLED", "UNKNOWN", "ALIKE", "ALONE"},
    "estimators/linear/few_columns.py": {"TURNS"},
    "estimators/linear/lasting_errors.py": {"TOGETHER"},
    "estimators/linear/within_places.py": {"SPARE"},
    "slipcore/contact/solver/tangent_space.py": {"FIELDS"},
    "slipcore/detection/filter/slip_limit.py": {"SCRATCH_ROWS", "_BLOCK"},
    "slipcore/detection/shared/contact.py": {"CURVATURE_NOISE"},
    "slipcore/detection/shared/lasting_noise.py": {"SPREAD", "STEP", "TURNING", "ROWS", "OF_STENCIL", "OF_QUARTILE"},
    "slipcore/patch/regions.py": {"NOWHERE"},
    "slipcore/surface/turning.py": {"SUMS"},
    "estimators/sampling/proposal.py": {"TINY"},
}
"""Names of rows, states and mathematical constants."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_default_has_a_unit_a_source_and_a_value_in_its_range(kind: type[Options]) -> None:
    described = describe_options(kind)
    assert described
    for entry in fields(kind):
        option = described[entry.name]
        assert option.unit
        assert option.source
        assert option.low < option.high
        assert entry.name == "force_noise" or option.low <= entry.default <= option.high


def test_the_page_has_every_default_as_it_is() -> None:
    page = (ROOT / "docs/defaults.md").read_text(encoding="utf-8")
    told = {tuple(line[2:-2].split(" | ", 6)) for line in page.splitlines() if line.count("|") > 7 and "`" in line}
    assert told == set(rows()), "renew it: python -m benchmarks.defaults --page docs/defaults.md"


@pytest.mark.parametrize("module", MODULES)
def test_every_table_is_listed(module: ModuleType) -> None:
    tables = {kind for kind in vars(module).values() if isinstance(kind, type) and issubclass(kind, Options)}
    assert tables - BASES <= set(KINDS)


def numbers(node: ast.AST) -> Iterator[ast.Constant]:
    """The numbers in a piece of code, but for truth values."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and type(part.value) in (int, float):
            yield part


def is_plain(value: ast.expr) -> bool:
    """Whether an expression is made of numbers alone."""
    allowed = (ast.Constant, ast.Tuple, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop, ast.expr_context)
    return any(numbers(value)) and all(isinstance(part, allowed) for part in ast.walk(value))


def bare_constants(source: str) -> set[str]:
    """Names at a module's top that are given plain numbers."""
    found: set[str] = set()
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None and is_plain(node.value):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return found


def bare_numbers(source: str) -> list[str]:
    """Decimals that no plain formula has, other than whole numbers of quarters; without ``bare_constants``."""
    parts = [node for node in ast.parse(source).body if not is_plain(getattr(node, "value", None) or ast.Pass())]
    return [
        f"line {number.lineno}: {number.value}"
        for part in parts
        for number in numbers(part)
        if isinstance(number.value, float) and not (number.value <= 1e6 and (4.0 * number.value).is_integer())
    ]


def sources() -> Iterator[tuple[str, str]]:
    """Every file of these packages but the tables and what has no tuning, with its text."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            name = str(path.relative_to(ROOT))
            if path.name != "defaults.py" and "/reference/" not in name and name not in NOT_TUNED:
                yield name, path.read_text(encoding="utf-8")


def test_no_number_that_changes_results_stands_outside_of_the_tables() -> None:
    found = {name: bare_constants(text) for name, text in sources()}
    assert {name: names for name, names in found.items() if names} == LAYOUT
    assert {name: told for name, text in sources() if (told := bare_numbers(text))} == {}


CLIENT = ROOT / "clients/stiction_client"

CLIENT_OTHER = {
    "address.py": "what an address may be",
    "calls.py": "waiting and retrying, which change no answer",
    "exchange.py": "waiting and retrying, which change no answer",
    "client.py": "waiting and retrying, which change no answer",
    "stream.py": "waiting and retrying, which change no answer",
    "container.py": "the format's layout",
    "contacts.py": "permitted ranges, and means of Hertz's pressure",
    "controller/settings.py": "the gains, each with its range, unit and reason",
    "defaults.py": "the table",
    "controller/records.py": "permitted ranges",
    "elementwise.py": "how many quantiles are remembered, which changes no answer",
    "holding.py": "from how many entries on arrays shrink, and what is next to 0, which change no answer",
    "linear_friction.py": "permitted ranges",
    "model.py": "the file format's name and version",
    "json_values.py": "rounding that a model may have when it is read, which changes no answer",
    "planner.py": "permitted ranges, and the default bound, an argument of the call",
}
"""Modules of the client that have numbers of their own, with what these are."""


def client_sources() -> Iterator[tuple[str, str]]:
    """Every module of the client but those that describe other tools' formats and scenes."""
    for path in sorted(CLIENT.rglob("*.py")):
        name = str(path.relative_to(CLIENT))
        if name.split("/")[0] not in {"exports", "mujoco_scene"}:
            yield name, path.read_text(encoding="utf-8")


def test_the_clients_numbers_that_change_results_stand_in_its_table() -> None:
    found = {name: bare_constants(text) for name, text in client_sources()}
    assert {name for name, names in found.items() if names} <= set(CLIENT_OTHER)
    assert set(CLIENT_OTHER) <= set(found)


def test_each_number_of_the_clients_table_has_its_unit_and_reason() -> None:
    body = ast.parse((CLIENT / "defaults.py").read_text(encoding="utf-8")).body
    kinds = [node for node in body if isinstance(node, ast.Assign)]
    for node in kinds:
        told = body[body.index(node) + 1]
        assert isinstance(told, ast.Expr)
        assert isinstance(told.value, ast.Constant)
        assert str(told.value.value).startswith(("-, ", "N "))
    assert len(kinds) == 21


READERS = ROOT / "service/formats"
READERS_CONSTANTS = {
    "frame_table.py": {"MOST_STATES"},
    "rest.py": {"NEIGHBOUR", "IRREGULAR"},
    "tac3d.py": {"REST_TOLERANCE"},
    "tracked_markers.py": {"ASSUMED_WIDTH"},
}
"""What changes the log that is read from a file; a reader's other constants are limits and formats' layout."""


@pytest.mark.parametrize(("file", "names"), READERS_CONSTANTS.items())
def test_each_number_of_a_reader_that_changes_its_log_has_its_unit_and_reason(file: str, names: set[str]) -> None:
    body = ast.parse((READERS / file).read_text(encoding="utf-8")).body
    told = {
        node.targets[0].id: ast.literal_eval(after.value)
        for node, after in pairwise(body)
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    }
    for name in names:
        assert re.match(r"(-, |m; |m that )", told[name]), name
        assert len(told[name]) > 60, "a reason"


@pytest.mark.parametrize(
    "text",
    [
        "LIMIT = 3",
        "LIMIT: float = 3.0",
        "NEAR, FAR = 1.0, -2.0",
        "SPEEDS = 5e-4 * np.arange(4)",
        "def f(x):\n    return x > 1e-3",
        "class A:\n    b: float = 0.1",
    ],
)
def test_a_bare_number_is_found(text: str) -> None:
    assert bare_constants(text) or bare_numbers(text)


def test_every_default_is_read() -> None:
    code = [path for package in (*PACKAGES, "service") for path in (ROOT / package).rglob("*.py")]
    read = {
        word
        for path in code
        for word in re.findall(
            r"self\.(\w+)" if path.name == "defaults.py" else r"(\w+)", path.read_text(encoding="utf-8")
        )
    }
    assert {
        f"{kind.__name__}.{entry.name}" for kind in KINDS for entry in fields(kind) if entry.name not in read
    } == set()
