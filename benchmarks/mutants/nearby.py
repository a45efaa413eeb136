"""Which test files are about a module, as their names and imports tell: what its mutants are tried with first."""

import ast
from pathlib import Path


class Nearby:
    """The test files of a repository, and what each imports; ``paths`` are our modules."""

    def __init__(self, root: Path, paths: list[str]) -> None:
        self._root = root
        tests = [str(path.relative_to(root)) for path in sorted((root / "tests").rglob("test_*.py"))]
        self._imported = {path: _imported(root / path) for path in [*tests, *paths]}
        self._tests, self._paths = tests, paths

    def files(self, path: str) -> list[str]:
        """Test files about a module, the nearest first; then about those that import it; then those of its folder."""
        found = self._about(path)
        for user in self._paths:
            found += self._about(user) if self._imports(user, path) else []
        folder, beside = _folder(path), list[str]()
        while not beside:
            beside = [file for file in self._tests if file.startswith(f"{folder}/")]
            folder = folder.rpartition("/")[0]
        return list(dict.fromkeys(found + beside))

    def _about(self, path: str) -> list[str]:
        public = defined(self._root / path)
        scores = {file: self._score(file, path, public) for file in self._tests}
        return sorted((file for file, score in scores.items() if score > 0), key=lambda file: -scores[file])

    def _score(self, file: str, path: str, public: set[str]) -> int:
        """By its name, what it imports of the module, what of the packages around it, and whether it lies beside it."""
        package = f"tests/{path.partition('/')[0]}/"
        has_its_name = file.startswith(package) and Path(file).stem == f"test_{Path(path).stem}"
        imported = [name.rpartition(".") for name in self._imported[file]]
        around = sum(_module(path).startswith(f"{origin}.") and name in public for origin, _, name in imported)
        score = 2 * has_its_name + 2 * self._imports(file, path) + (around > 0)
        return score and 2 * score + file.startswith(f"{_folder(path)}/")

    def _imports(self, file: str, path: str) -> bool:
        module = _module(path)
        return any(name == module or name.rpartition(".")[0] == module for name in self._imported[file])


def _module(path: str) -> str:
    return path.removeprefix("clients/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _folder(path: str) -> str:
    """Where the tests of a module's folder are."""
    return f"tests/{Path(path).parent}".replace("clients/stiction_client", "clients")


def _imported(path: Path) -> set[str]:
    """Dotted names of the modules, functions and classes that a file imports."""
    found = set[str]()
    for node in ast.walk(ast.parse(path.read_bytes())):
        match node:
            case ast.Import(names=names):
                found |= {name.name for name in names}
            case ast.ImportFrom(module=str(module), names=names):
                found |= {f"{module}.{name.name}" for name in names}
    return found


def defined(path: Path) -> set[str]:
    """The public functions and classes of a module."""
    return {
        node.name
        for node in ast.parse(path.read_bytes()).body
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not node.name.startswith("_")
    }
