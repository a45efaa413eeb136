"""Which tests run a piece of code, from the contexts that coverage recorded.

A line that is run at import (a constant, a default value) is reached by the tests of the lines that use the name which
it binds. A function of which no line was seen (compiled code is not traced) is reached by the tests of its callers.
"""

import ast
import sqlite3
import sys
from collections import defaultdict
from difflib import SequenceMatcher
from pathlib import Path

from coverage.numbits import numbits_to_nums

from benchmarks.mutants.edits import Edit

Line = tuple[str, int]


class Reach:
    """Tests by the lines that they run, and lines by the names that they use."""

    def __init__(self, data: Path, covered: Path, root: Path, paths: list[str]) -> None:
        self._tests = {path: _moved(lines, covered / path, root / path) for path, lines in _contexts(data).items()}
        self._trees = {path: ast.parse((root / path).read_bytes()) for path in paths}
        self._uses = _uses(self._trees)

    def of(self, edit: Edit) -> set[str]:
        """The tests that run the changed code, directly or through what uses it."""
        found, waiting, seen = set[str](), [(edit.path, edit.start[0])], set[Line]()
        while waiting:
            path, line = place = waiting.pop()
            if place in seen:
                continue
            seen.add(place)
            own, names = self._here(path, line)
            found |= own
            if not own:
                waiting += [use for name in names for use in self._uses[name] if use not in seen]
        return found

    def _here(self, path: str, line: int) -> tuple[set[str], set[str]]:
        """The tests that run a line or, for what is run at import, its function; and the names that lead to it."""
        around = [node for node in ast.walk(self._trees[path]) if _first(node) <= line <= _last(node)]
        functions = [node for node in around if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
        if not functions:
            return set(), set().union(*map(_bound, around))
        function = max(functions, key=_first)
        first, last = function.body[0].lineno, _last(function)
        statement = max((node for node in around if isinstance(node, ast.stmt)), key=_first)
        own = self._tests_at(path, _first(statement), _last_of_header(statement)) if line >= first else set()
        return own or self._tests_at(path, first, last), {function.name, *_class_of(function, around)}

    def _tests_at(self, path: str, first: int, last: int) -> set[str]:
        lines = self._tests.get(path, {})
        return set().union(*(lines.get(line, ()) for line in range(first, last + 1)))


def _contexts(data: Path) -> dict[str, dict[int, set[str]]]:
    """Of each file and line: the tests that ran it."""
    found: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
    query = """SELECT file.path, context.context, line_bits.numbits FROM line_bits
        JOIN file ON file.id = file_id JOIN context ON context.id = context_id WHERE context.context <> ''"""
    connection = sqlite3.connect(data)
    for path, context, bits in connection.execute(query):
        for line in numbits_to_nums(bits):
            found[_relative(path)][line].add(context.rpartition("|")[0])
    connection.close()
    return found


def _relative(path: str) -> str:
    """A file of ours from the root of the repository, wherever that was."""
    parts = Path(path).parts
    first = next(i for i, part in enumerate(parts) if part in {"slipcore", "estimators", "db", "service", "clients"})
    return "/".join(parts[first:])


def _moved(lines: dict[int, set[str]], before: Path, now: Path) -> dict[int, set[str]]:
    """The same for the source as it is now; a new line is in no test."""
    if not (before.exists() and now.exists()):
        return {}
    if before.read_bytes() == now.read_bytes():
        return lines
    matcher = SequenceMatcher(None, before.read_text().splitlines(), now.read_text().splitlines(), autojunk=False)
    moved = {b + i + 1: a + i + 1 for a, b, size in matcher.get_matching_blocks() for i in range(size)}
    return {new: lines[old] for new, old in moved.items() if old in lines}


def _uses(trees: dict[str, ast.Module]) -> dict[str, list[Line]]:
    """Where each name is used: read, called, given by keyword, or taken as an attribute."""
    found: dict[str, list[Line]] = defaultdict(list)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            match node:
                case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name):
                    found[name].append((path, node.lineno))
                case ast.keyword(arg=str(name)):
                    found[name].append((path, node.value.lineno))
    return found


def _bound(node: ast.AST) -> set[str]:
    match node:
        case ast.Assign(targets=targets):
            return {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}
        case ast.AnnAssign(target=ast.Name(id=name)) | ast.ClassDef(name=name):
            return {name}
    return set()


def _class_of(function: ast.FunctionDef | ast.AsyncFunctionDef, around: list[ast.AST]) -> set[str]:
    """A method that Python calls by itself is led to by the name of its class."""
    return {node.name for node in around if isinstance(node, ast.ClassDef)} if function.name.startswith("__") else set()


def _first(node: ast.AST) -> int:
    """The line that a node begins in, with its decorators."""
    if not isinstance(node, (ast.stmt, ast.expr)):
        return sys.maxsize
    return min([node.lineno, *(decorator.lineno for decorator in getattr(node, "decorator_list", ()))])


def _last(node: ast.AST) -> int:
    return getattr(node, "end_lineno", 0)


def _last_of_header(statement: ast.stmt) -> int:
    """The last line before the statements inside of one."""
    body = getattr(statement, "body", None)
    return max(statement.lineno, body[0].lineno - 1) if body else _last(statement)
