"""Compiled loops over the elements of one frame, on plain arrays: what makes a step take microseconds.

They follow the stages: surface and noise, contact, a method's own memory, the answer. Fields are [n, m], what a kernel
writes is handed to it as its last arguments, and nothing else is written to.
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit
from numba.np.unsafe.ndarray import to_fixed_tuple


def forget_stale_kernels(folder: Path) -> None:
    """Delete cached kernels older than any source under a folder: numba looks only at the file a kernel is in."""
    newest = max(source.stat().st_mtime for source in (*folder.rglob("*.py"), folder.parent / "defaults.py"))
    for cached in folder.rglob("__pycache__/*.nb[ic]"):
        with suppress(FileNotFoundError):  # another process that starts now forgets them, too
            if cached.stat().st_mtime < newest:
                cached.unlink()


forget_stale_kernels(Path(__file__).parents[1])

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(function: Kernel) -> Kernel:
    """Compile a kernel at its first call and keep it beside the package; a division by zero is as IEEE 754 has it."""
    kernel: Any = njit(cache=True, error_model="numpy")(function)
    return cast("Kernel", kernel)


unpack: Any = to_fixed_tuple
"""``unpack(array, size)``: its values as arguments, in compiled code; ``size`` is a constant there."""
