"""Which mutants are tried: drawn from every package in proportion to its lines of code."""

import hashlib
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from benchmarks.mutants.edits import Edit, code_lines, compiles, edits

PACKAGES = ("slipcore", "estimators", "db", "service", "clients/stiction_client")


def sources(root: Path, package: str) -> list[str]:
    """The modules of a package."""
    return [str(path.relative_to(root)) for path in sorted((root / package).rglob("*.py"))]


def lines_of(root: Path, packages: Sequence[str] = PACKAGES) -> dict[str, int]:
    """Lines of code of each package."""
    return {package: sum(code_lines(root / path) for path in sources(root, package)) for package in packages}


def shares(lines: dict[str, int], count: int) -> dict[str, int]:
    """``count`` divided in proportion, each share rounded up."""
    return {package: -(-count * own // sum(lines.values())) for package, own in lines.items()}


def draw(root: Path, count: int, seed: int, packages: Sequence[str] = PACKAGES) -> list[Edit]:
    """At least ``count`` edits; the same for a seed, and those of unchanged code stay while other code changes."""

    def rank(edit: Edit) -> str:
        return hashlib.sha256(f"{seed} {edit.key}".encode()).hexdigest()

    drawn: list[Edit] = []
    for package, share in shares(lines_of(root, packages), count).items():
        every = [edit for path in sources(root, package) for edit in edits(root, path)]
        drawn += islice((edit for edit in sorted(every, key=rank) if compiles(root, edit)), share)
    return sorted(drawn, key=rank)
