"""Where compiled kernels are kept and until when they count, what is left out of them, and how they call each other."""

import importlib
import os
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numba import config, njit
from numba.core.caching import NullCache
from numba.np import arrayobj

from slipcore import compilation
from slipcore.compilation import address_of, borrowed, call_at, compiled

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


ROWS = """
import numpy as np

from slipcore.compilation import compiled


@compiled
def scaled(x: float) -> float:
    rows = np.zeros((2, 3))
    rows[1] = np.full(3, 2.0 * x)
    return rows[1, 2]
"""


def test_a_kernel_that_fills_rows_holds_no_text_of_unequal_shapes(package: Path) -> None:
    (package / "kernel.py").write_text(ROWS)
    assert run() == (2.0, 1)
    (kernel,) = (path.read_bytes() for path in package.rglob("*.nbc"))
    assert b"refuse" in kernel
    assert b"raise_with_shape_context" not in kernel
    assert b"unicode" not in kernel


@compiled
def fill_first(rows: np.ndarray, row: np.ndarray) -> float:
    rows[0] = row
    return float(rows.sum())


@njit  # type: ignore[untyped-decorator]
def fill_first_of_numba(rows: np.ndarray, row: np.ndarray) -> None:
    rows[0] = row


def test_arrays_of_unequal_shapes_are_still_refused_and_numbas_own_kernels_say_which() -> None:
    rows = np.zeros((2, 3))
    assert fill_first(rows, np.ones(3)) == 3.0
    with pytest.raises(ValueError, match="arrays of unequal shapes"):
        fill_first(rows, np.ones(2))
    with pytest.raises(ValueError, match=r"shape \(3,\) from input of shape \(2,\)"):
        fill_first_of_numba(rows, np.ones(2))


@pytest.mark.usefixtures("package")
def test_a_numba_that_says_unequal_shapes_in_another_way_compiles_as_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(arrayobj, "raise_with_shape_context")
    assert run() == (2.0, 1)
    assert not hasattr(arrayobj, "raise_with_shape_context")


@compiled
def fill_last(rows: np.ndarray, row: np.ndarray) -> float:
    rows[-1] = row
    return float(rows[-1].sum())


@njit  # type: ignore[untyped-decorator]
def fill_by(address: int, rows: np.ndarray, row: np.ndarray) -> float:
    return float(call_at(address, fill_first, (rows, row)))


def test_a_kernel_is_called_at_its_address_in_place_of_another_of_the_same_types() -> None:
    rows, row = np.zeros((2, 3)), np.full(3, 2.0)
    assert fill_by(address_of(fill_first, rows, row), rows, row) == 6.0
    assert fill_by(address_of(fill_last, rows, row), rows, 2.0 * row) == 12.0
    np.testing.assert_array_equal(rows, [[2.0] * 3, [4.0] * 3])


def test_what_a_kernel_raises_at_its_address_comes_to_who_called_it() -> None:
    rows, row = np.zeros((2, 3)), np.ones(2)
    with pytest.raises(ValueError, match="arrays of unequal shapes"):
        fill_by(address_of(fill_first, rows, row), rows, row)


def test_an_address_is_that_for_the_types_of_arguments() -> None:
    rows, row = np.zeros((2, 3)), np.ones(3)
    found = address_of(fill_first, rows, row)
    assert address_of(fill_first, 2.0 * rows, row) == found
    row.flags.writeable = False
    assert address_of(fill_first, rows, row) != found


def test_an_address_is_another_once_a_kernel_was_compiled_anew() -> None:
    @compiled
    def twice(x: float) -> float:
        return 2.0 * x

    kernel, found = cast("Any", twice), address_of(twice, 1.0)
    assert address_of(twice, 3.0) == found
    kernel._reset_overloads()
    kernel._cache = NullCache()
    assert address_of(twice, 3.0) != found
