"""The copy of the repository that mutants live in: the checkout itself is never touched."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.mutants.edits import Edit

ROOT = Path(__file__).parents[2]
COVERED = ("slipcore", "estimators", "db", "service", "clients")


class ScratchCopy:
    """A folder with the tracked files of the checkout, what coverage saw of them, and compiled kernels."""

    def __init__(self, work: Path, checkout: Path = ROOT) -> None:
        self._checkout = checkout
        self.root, self.covered, self.kernels = work / "copy", work / "covered", work / "kernels"
        self.data, self.durations = work / "coverage.sqlite3", work / "durations.json"
        self._tests = work / "tests.json"
        self._stamp = 0
        """Of the last change, in whole seconds: bytecode is known by these and the size alone."""

    def refresh(self) -> None:
        """Make the copy what the checkout is now; what was compiled stays."""
        listed = subprocess.check_output(
            ["git", "ls-files", "-zco", "--exclude-standard"], cwd=self._checkout, text=True
        )
        files = {name for name in listed.split("\0") if name and (self._checkout / name).is_file()}
        for path in [path for path in self.root.rglob("*.py") if str(path.relative_to(self.root)) not in files]:
            path.unlink()
        for name in files:
            target = self.root / name
            if not target.exists() or target.read_bytes() != (self._checkout / name).read_bytes():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(self._checkout / name, target)
        recordings = self.root / ".cache"
        if not recordings.exists() and (self._checkout / ".cache" / "tac3d").exists():
            recordings.mkdir()
            (recordings / "tac3d").symlink_to(self._checkout / ".cache" / "tac3d")

    def environment(self, kernels: Path | None = None) -> dict[str, str]:
        """Variables with which Python finds the packages of the copy, not those of the checkout, and pytest takes its
        options from us alone. Bytecode is kept: to compile all modules and tests anew takes longer than many tests.
        """
        path = os.pathsep.join([str(self.root), str(self.root / "clients")])
        return os.environ | {
            "PYTHONPATH": path,
            "PYTEST_ADDOPTS": "",
            "PYTHONDONTWRITEBYTECODE": "",
            "NUMBA_CACHE_DIR": str(kernels or self.kernels),
            "TEST_DURATIONS": str(self.durations),
        }

    def cover(self, tests: list[str]) -> None:
        """Run the tests once with coverage, to know which of them run which line, and how long each takes."""
        command = [sys.executable, "-m", "pytest", "-q", "-m", "not long", "-n", "2", *tests]
        command += ["-p", "benchmarks.mutants.recorder", "--cov", "--cov-append", "--cov-context=test", "--cov-report="]
        environment = self.environment() | {"COVERAGE_FILE": str(self.data)}
        subprocess.run(command, cwd=self.root, env=environment, check=False)
        self.keep()

    def collected(self) -> list[str]:
        """The names of all tests, found once."""
        if not self._tests.exists():
            command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", "not long", "-p", "no:xdist"]
            environment, copy = self.environment(), self.root
            lines = subprocess.run(
                command, cwd=copy, env=environment, check=True, capture_output=True, text=True
            ).stdout
            self._tests.write_text(json.dumps([line for line in lines.splitlines() if "::" in line]))
        return list(json.loads(self._tests.read_text()))

    def keep(self) -> None:
        """Remember the sources that coverage tells of."""
        shutil.rmtree(self.covered, ignore_errors=True)
        for package in COVERED:
            shutil.copytree(self.root / package, self.covered / package)

    @contextmanager
    def changed(self, edit: Edit) -> Iterator[None]:
        """The copy with an edit made, and its own folder of kernels: what it compiles is thrown away."""
        path, own = self.root / edit.path, self.kernels.with_name("kernels-of-mutant")
        source, times = path.read_bytes(), path.stat()
        shutil.rmtree(own, ignore_errors=True)
        self.kernels.mkdir(exist_ok=True)
        shutil.copytree(self.kernels, own, copy_function=os.link)
        try:
            path.write_bytes(edit.apply(source))
            self._stamp = max(self._stamp + 1, int(time.time()))
            os.utime(path, (self._stamp, self._stamp))
            yield
        finally:
            path.write_bytes(source)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            shutil.rmtree(own)
