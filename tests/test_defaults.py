"""Numbers that change results stand in the packages' tables, where they have a unit, a range and a source."""

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from types import ModuleType

import pytest

import estimators.defaults
import slipcore.contact.defaults
import slipcore.defaults
from slipcore import METHODS, CheckOptions, SampleOptions
from slipcore.options import Options, describe_options

ROOT = Path(__file__).parents[1]
MODULES = (slipcore.defaults, slipcore.contact.defaults, estimators.defaults)
ROOMS = ("slipcore/detection", "slipcore/contact", "slipcore/checks", "estimators")
BASES = {Options, slipcore.defaults.ContactOptions}
KINDS = [SampleOptions, CheckOptions, slipcore.defaults.PatchOptions, *(method.options for method in METHODS.values())]
KINDS += [type(table) for module in MODULES for table in module.TABLES]

NOT_TUNED = {
    "slipcore/contact/elasticity/fields.py": "weights of a linear interpolation",
    "estimators/likelihoods/kernels.py": "series of the logarithm and exponential, layout of a double",
}
"""Files whose numbers are mathematics."""

LAYOUT = {
    "slipcore/detection/filter/state.py": {
        "ROWS",
        "POSE",
        "LOADING",
        "FRICTION",
        "FOLLOWING",
        "REFERENCE",
        "STILL",
        "CORRECTION",
        "LAST_OFFSETS",
        "OFFSET_FRAMES",
        "NOISE_OF_PLACE",
    },
    "slipcore/detection/strain_rate/step.py": {"ROWS"},
    "slipcore/contact/solver/tangent_space.py": {"OUTSIDE", "STICK", "SLIP"},
    "slipcore/detection/shared/contact.py": {"CURVATURE_NOISE"},
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
        if isinstance(node, ast.Assign) and is_plain(node.value):
            found |= {name.id for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)}
    return found


def bare_numbers(source: str) -> list[str]:
    """Decimals inside of functions and classes that no plain formula has: other than whole numbers of quarters."""
    bodies = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return [
        f"line {number.lineno}: {number.value}"
        for body in bodies
        for number in numbers(body)
        if isinstance(number.value, float) and not (number.value <= 1e6 and (4.0 * number.value).is_integer())
    ]


def sources() -> Iterator[tuple[str, str]]:
    """Every file of these rooms but the tables and what has no tuning, with its text."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            name = str(path.relative_to(ROOT))
            if path.name != "defaults.py" and "/reference/" not in name and name not in NOT_TUNED:
                yield name, path.read_text(encoding="utf-8")


def test_no_number_that_changes_results_stands_outside_of_the_tables() -> None:
    found = {name: bare_constants(text) for name, text in sources()}
    assert {name: names for name, names in found.items() if names} == LAYOUT
    assert {name: told for name, text in sources() if (told := bare_numbers(text))} == {}


@pytest.mark.parametrize(
    "text", ["LIMIT = 3", "NEAR, FAR = 1.0, -2.0", "def f(x):\n    return x > 1e-3", "class A:\n    b: float = 0.1"]
)
def test_a_bare_number_is_found(text: str) -> None:
    assert bare_constants(text) or bare_numbers(text)
