"""Where compiled kernels are kept, and until when they count."""

import importlib
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config, njit

from slipcore import compilation
from slipcore.compilation import borrowed

KERNEL = """
from slipcore.compilation import compiled
from toy.constants import (
    FACTOR,
)


@compiled
def scaled(x: float) -> float:
    return FACTOR * x
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a kernel that takes a constant from another module."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(config, "CACHE_DIR", "")
    folder = tmp_path / "toy"
    folder.mkdir()
    for name, content in (("__init__", ""), ("kernel", KERNEL), ("constants", "FACTOR = 2.0\n"), ("other", "")):
        (folder / f"{name}.py").write_text(content)
    return folder


def run() -> tuple[float, int]:
    """What the kernel makes of 1.0 when its module is imported anew, and how often it was compiled for that."""
    for name in [name for name in sys.modules if name.split(".")[0] == "toy"]:
        del sys.modules[name]
    compilation.fingerprint.cache_clear()
    compilation._imports.cache_clear()
    importlib.invalidate_caches()
    kernel = importlib.import_module("toy.kernel").scaled
    return kernel(1.0), sum(kernel.stats.cache_misses.values())


def kept(folder: Path) -> list[str]:
    return sorted(path.suffix for path in folder.rglob("*.nb[ic]"))


def test_a_kernel_is_kept_beside_its_module_and_compiled_once(package: Path) -> None:
    assert run() == (2.0, 1)
    assert run() == (2.0, 0)
    assert kept(package / "__pycache__") == [".nbc", ".nbi"]


def test_one_folder_keeps_all_kernels_where_it_is_named(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    monkeypatch.setattr(config, "CACHE_DIR", str(home))  # as NUMBA_CACHE_DIR does at the start
    assert run() == (2.0, 1)
    assert run() == (2.0, 0)
    assert kept(home / "toy") == [".nbc", ".nbi"]
    assert kept(package) == []


def test_a_kernel_is_compiled_anew_once_a_file_that_it_imports_has_changed(package: Path) -> None:
    constants = package / "constants.py"
    before = constants.stat()
    run()
    constants.write_text("FACTOR = 3.0\n")
    os.utime(constants, ns=(before.st_atime_ns, before.st_mtime_ns))  # as in an image whose files all have one time
    assert run() == (3.0, 1)
    assert kept(package / "__pycache__") == [".nbc", ".nbi"]


def test_a_kernel_stays_when_a_file_that_it_does_not_import_has_changed(package: Path) -> None:
    run()
    (package / "other.py").write_text("FACTOR = 3.0\n")
    assert run() == (2.0, 0)


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_damaged_file_is_compiled_anew(package: Path, suffix: str) -> None:
    run()
    (damaged,) = (package / "__pycache__").glob(f"*.{suffix}")
    damaged.write_bytes(damaged.read_bytes()[:20])
    assert run() == (2.0, 1)
    assert run() == (2.0, 0)


@pytest.mark.usefixtures("package")
def test_a_folder_that_cannot_be_written_costs_time_and_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    home.write_text("no folder")
    monkeypatch.setattr(config, "CACHE_DIR", str(home))
    with pytest.warns(RuntimeWarning, match="allowed: NUMBA_CACHE_DIR names a folder that this user may write"):
        assert run() == (2.0, 1)


def test_the_fingerprint_covers_imports_of_imports(package: Path) -> None:
    (package / "constants.py").write_text("from toy import other\n\nFACTOR = other\n")
    before = compilation.fingerprint(package / "kernel.py")
    compilation.fingerprint.cache_clear()
    (package / "other.py").write_text("changed = True\n")
    assert compilation.fingerprint(package / "kernel.py") != before


@njit  # type: ignore[untyped-decorator]
def sum_of_borrowed(arrays: tuple[np.ndarray, tuple[np.ndarray, float]]) -> float:
    first, (second, number) = borrowed(arrays)
    return first[1:].sum() + second.sum() + number


def test_what_is_borrowed_is_the_same_and_still_belongs_to_who_lent_it() -> None:
    first, second = np.arange(3.0), np.ones((2, 2))
    second.flags.writeable = False
    owners = sys.getrefcount(first), sys.getrefcount(second)
    assert [sum_of_borrowed((first, (second, 0.5))) for _ in range(3)] == [7.5] * 3
    assert (sys.getrefcount(first), sys.getrefcount(second)) == owners
