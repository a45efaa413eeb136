"""The small changes that a program is tried with, as replacements of text in one file."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

SWAPS: dict[type[ast.AST], tuple[tuple[str, str], ...]] = {
    ast.Lt: (("<", "<="), ("<", ">=")),
    ast.LtE: (("<=", "<"), ("<=", ">")),
    ast.Gt: ((">", ">="), (">", "<=")),
    ast.GtE: ((">=", ">"), (">=", "<")),
    ast.Eq: (("==", "!="),),
    ast.NotEq: (("!=", "=="),),
    ast.Is: (("is", "is not"),),
    ast.IsNot: (("is not", "is"),),
    ast.In: (("in", "not in"),),
    ast.NotIn: (("not in", "in"),),
    ast.Add: (("+", "-"),),
    ast.Sub: (("-", "+"),),
    ast.Mult: (("*", "/"),),
    ast.Div: (("/", "*"),),
    ast.FloorDiv: (("//", "/"),),
    ast.Mod: (("%", "*"),),
    ast.Pow: (("**", "*"),),
    ast.BitAnd: (("&", "|"),),
    ast.BitOr: (("|", "&"),),
    ast.And: (("and", "or"),),
    ast.Or: (("or", "and"),),
}
"""What stands for an operator, and what it is replaced by."""

Place = tuple[int, int]
"""Line (from 1) and column (bytes, from 0), as ``ast`` counts."""


@dataclass(frozen=True, slots=True)
class Edit:
    """One replacement of text in a file."""

    path: str
    """Relative to the root of the repository."""

    start: Place
    end: Place
    new: str
    scope: str
    """The functions and classes around it, dotted; empty at the top of a module."""

    statement: str
    """The line that it begins in."""

    old: str
    nth: int = 0
    """Counts edits of the same words in the same line of the same scope."""

    @property
    def key(self) -> str:
        """What it is known by while other lines of the file come and go."""
        old, new = (" ".join(text.split()) for text in (self.old, self.new))
        return f"{self.path} | {self.scope} | {self.statement} | {old} → {new} | {self.nth}"

    def undone(self) -> "Edit":
        """The edit that changes nothing, for comparison."""
        return replace(self, new=self.old)

    def apply(self, source: bytes) -> bytes:
        """The source with the replacement made."""
        lines = source.splitlines(keepends=True)
        before, after = _offset(lines, self.start), _offset(lines, self.end)
        return source[:before] + self.new.encode() + source[after:]


def edits(root: Path, path: str) -> list[Edit]:
    """Every edit of a file, in the order of its lines."""
    source = (root / path).read_bytes()
    lines = source.splitlines(keepends=True)
    found: list[Edit] = []
    counts: dict[str, int] = {}
    for scope, node in _walk(ast.parse(source), ""):
        for start, end, new in _changes(node, lines):
            old = source[_offset(lines, start) : _offset(lines, end)].decode()
            edit = Edit(path, start, end, new, scope, lines[start[0] - 1].decode().strip(), old)
            nth = counts[edit.key] = counts.get(edit.key, -1) + 1
            found.append(Edit(path, start, end, new, scope, edit.statement, old, nth))
    return sorted(found, key=lambda edit: edit.start)


def compiles(root: Path, edit: Edit) -> bool:
    """Whether an edit leaves a program: ``break`` outside of a loop, say, does not."""
    try:
        compile(edit.apply((root / edit.path).read_bytes()), edit.path, "exec", dont_inherit=True)
    except SyntaxError:
        return False
    return True


def code_lines(path: Path) -> int:
    """Lines that are neither empty nor only a comment."""
    return sum(bool(line.strip()) and not line.lstrip().startswith("#") for line in path.read_text().splitlines())


def _walk(node: ast.AST, scope: str) -> Iterator[tuple[str, ast.AST]]:
    """All nodes that decide what the program does: without annotations, docstrings, and what only types need."""
    yield scope, node
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
        scope = f"{scope}.{node.name}".lstrip(".")
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns"}:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _is_for_types(child):
                yield from _walk(child, scope)


def _is_for_types(node: ast.AST) -> bool:
    match node:
        case ast.If(test=ast.Name(id="TYPE_CHECKING")):
            return True
        case ast.FunctionDef(decorator_list=[ast.Name(id="overload"), *_]):
            return True
        case ast.Call(func=ast.Name(id="TypeVar" | "cast" | "NewType" | "dataclass")):
            return True  # flags of a dataclass are what mypy looks at
    return False


def _changes(node: ast.AST, lines: list[bytes]) -> Iterator[tuple[Place, Place, str]]:
    match node:
        case ast.Compare():
            operands = [node.left, *node.comparators]
            for left, sign, right in zip(operands, node.ops, operands[1:], strict=False):
                yield from _swaps(lines, left, sign, right)
        case ast.BinOp(left=left, op=sign, right=right):
            yield from _swaps(lines, left, sign, right)
        case ast.AugAssign(target=left, op=sign, value=right):
            yield from _swaps(lines, left, sign, right)
        case ast.BoolOp(op=sign, values=[left, right, *_]):
            yield from _swaps(lines, left, sign, right)
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            yield _start(node), _start(operand), ""
        case ast.Constant(value=bool() | int() | float() as value):
            yield _start(node), _end(node), _other(value)
        case ast.If(test=test) | ast.IfExp(test=test):
            yield _start(test), _end(test), f"not ({_text(lines, test)})"
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield _start(value), _end(value), "None"
        case ast.Expr(value=ast.Call() | ast.Await()):
            yield _start(node), _end(node), "pass"
        case ast.Break():
            yield _start(node), _end(node), "continue"
        case ast.Continue():
            yield _start(node), _end(node), "break"


def _swaps(lines: list[bytes], left: ast.expr, sign: ast.AST, right: ast.expr) -> Iterator[tuple[Place, Place, str]]:
    """The operator between two operands, each with what takes its place."""
    begin = _offset(lines, _end(left))
    between = b"".join(lines)[begin : _offset(lines, _start(right))].decode()
    between = re.sub("#.*", lambda comment: " " * len(comment[0].encode()), between)
    for old, new in SWAPS.get(type(sign), ()):
        words = r"\s+".join(map(re.escape, old.split()))
        if found := re.search(rf"\b{words}\b" if old.isalpha() or " " in old else words, between):
            yield _place(lines, begin + found.start()), _place(lines, begin + found.end()), new


def _other(value: bool | float) -> str:
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    return repr(1.5 * value) if value else "1.0"


def _start(node: ast.expr | ast.stmt) -> Place:
    return node.lineno, node.col_offset


def _end(node: ast.expr | ast.stmt) -> Place:
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    return node.end_lineno, node.end_col_offset


def _text(lines: list[bytes], node: ast.expr) -> str:
    return b"".join(lines)[_offset(lines, _start(node)) : _offset(lines, _end(node))].decode()


def _offset(lines: list[bytes], place: Place) -> int:
    return sum(map(len, lines[: place[0] - 1])) + place[1]


def _place(lines: list[bytes], offset: int) -> Place:
    line = 0
    while offset >= len(lines[line]):
        offset -= len(lines[line])
        line += 1
    return line + 1, offset
