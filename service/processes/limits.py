"""What a process takes of the machine, and how much memory and how many files it may (Linux; elsewhere unlimited)."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path


def cpu_seconds(process_id: int) -> float | None:
    """CPU time that a process has taken with all its threads, s; None where it is not known, or once it is gone."""
    try:
        stat = Path(f"/proc/{process_id}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    user, system = stat.rpartition(")")[2].split()[11:13]  # the name before may hold spaces
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


@contextmanager
def memory(budget: int) -> Iterator[None]:
    """Let this process take so many bytes beside what it had the first time; who asks for more gets a ``MemoryError``.

    Memory that earlier work has freed and the process keeps counts as taken.
    """
    if sys.platform != "linux":
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    limit = _own_bytes() + budget
    resource.setrlimit(resource.RLIMIT_DATA, (limit if before[1] < 0 else min(limit, before[1]), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def open_files(wanted: int) -> int:
    """Let this process have so many files open, or as many as the machine allows it; returns how many it may have.

    Shells and systemd begin with 1,024 and let a process raise that itself.
    """
    if sys.platform != "linux":
        return wanted
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    return wanted if soft == resource.RLIM_INFINITY else max(soft, most)


def require(amount: int) -> None:
    """Raise the ``MemoryError`` of ``memory`` now where so many bytes cannot be had: before any of them are written."""
    if sys.platform != "linux":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_DATA)
    if 0 <= limit < _private_bytes() + amount:
        raise MemoryError(f"{amount} bytes are more than this process may have")


@cache
def _own_bytes() -> int:
    """Bytes of private memory at the first call."""
    return _private_bytes()


def _private_bytes() -> int:
    """Bytes of private memory, as RLIMIT_DATA counts them."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData:"))
