"""Requests of many connections at once to a server on this machine, and what they cost it.

By wrk, a compiled load generator, where it is installed (`apt-get install wrk`), on a core of its own; else by callers
in Python, which take as much of the machine as a quick server does and so level what they compare.
"""

import asyncio
import os
import shutil
import subprocess
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

CONNECTIONS = 32
WRK = shutil.which("wrk")
CALLERS = "wrk, on a core of its own" if WRK else "callers in Python"
CORES = sorted(os.sched_getaffinity(0))
ON_LAST_CORE = ["taskset", "-c", str(CORES[-1])]
"""How the load generator is started."""

LISTENS = "0A"
"""State of a socket in /proc/net/tcp."""

REPORT = """
done = function(summary, latency)
  local wrong = summary.errors.status + summary.errors.connect + summary.errors.read + summary.errors.timeout
  io.write(string.format("REPORT %d %d %d %d %d\\n", summary.requests, summary.duration,
    latency:percentile(50), latency:percentile(99), wrong))
end
"""
"""For wrk, whose own units are µs."""


@dataclass(frozen=True, slots=True)
class Load:
    """Requests of one server: requests a second, CPU seconds of its process a request, latencies in s."""

    what: str
    rate: float
    cpu: float
    p50: float
    p99: float


@dataclass(frozen=True, slots=True)
class Target:
    """What is asked of whom: the port and process of a server, an address on it, and one header more."""

    what: str
    port: int
    process: int
    path: str
    header: str = ""


def load(target: Target, seconds: float = 3.0) -> Load:
    """All connections at once, after a first moment that is not counted."""
    _ask(target, 0.5)
    before = cpu_seconds(target.process)
    count, taken, p50, p99 = _ask(target, seconds)
    return Load(target.what, count / taken, (cpu_seconds(target.process) - before) / count, p50, p99)


def in_turn(targets: list[Target], rounds: int = 5, seconds: float = 3.0) -> list[list[Load]]:
    """Each target once a round, so that all see the same hours of the machine; the rounds of each."""
    runs = [[load(target, seconds) for target in targets] for _ in range(rounds)]
    return [list(each) for each in zip(*runs, strict=True)]


def median(runs: list[Load]) -> Load:
    """The medians of several runs of one target."""
    names = ("rate", "cpu", "p50", "p99")
    return Load(runs[0].what, *(float(np.median([getattr(run, name) for run in runs])) for name in names))


def leave_first_core() -> None:
    """Keep this process, and all that it starts from now on, off the core that ``pin`` gives to a server."""
    if len(CORES) > 1:
        os.sched_setaffinity(0, CORES[1:])


def pin(process: int) -> None:
    """Give the first core to all threads of a server, where there are others for the callers and its workers."""
    if len(CORES) > 1:
        for thread in Path(f"/proc/{process}/task").iterdir():
            os.sched_setaffinity(int(thread.name), CORES[:1])


def child_listening(process: int, port: int) -> int:
    """The child of a process that listens at a port; raises ``StopIteration`` where none does."""
    lines = Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]
    sockets = {
        f"socket:[{inode}]"
        for _, address, _, state, *_, inode in (line.split()[:10] for line in lines)
        if state == LISTENS and address.endswith(f":{port:04X}")
    }
    children = " ".join(file.read_text() for file in Path(f"/proc/{process}/task").glob("*/children")).split()
    return next(int(each) for each in children if sockets & _files(each))


def _files(process: str) -> set[str]:
    return {os.readlink(file) for file in Path(f"/proc/{process}/fd").iterdir()}


def cpu_seconds(process: int) -> float:
    """Processor time that a process has taken, without its children."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _ask(target: Target, seconds: float) -> tuple[int, float, float, float]:
    """Requests, s, and the median and the 99th percentile of their latencies in s."""
    return _ask_by_wrk(target, seconds) if WRK else asyncio.run(_ask_by_python(target, seconds))


def _ask_by_wrk(target: Target, seconds: float) -> tuple[int, float, float, float]:
    with tempfile.NamedTemporaryFile("w", suffix=".lua") as script:
        script.write(REPORT)
        script.flush()
        command = [*ON_LAST_CORE, WRK or "wrk", "-t1", f"-c{CONNECTIONS}", f"-d{max(1, round(seconds))}s"]
        command += ["-s", script.name, *(["-H", target.header] if target.header else [])]
        url = f"http://127.0.0.1:{target.port}{target.path}"
        told = subprocess.run(
            [*command, url], check=True, capture_output=True, text=True, preexec_fn=before_all_others
        ).stdout
    report = next(line for line in told.splitlines() if line.startswith("REPORT"))
    count, taken, p50, p99, wrong = (int(word) for word in report.split()[1:])
    assert wrong == 0, told
    return count, 1e-6 * taken, 1e-6 * p50, 1e-6 * p99


def before_all_others() -> None:
    """Let this process have its core whenever it wants it, where that may be asked for (Linux, CAP_SYS_NICE).

    Else what it tells is how long it waits for the workers that share its core: 3 ms at a time even at niceness -15.
    """
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))


async def _ask_by_python(target: Target, seconds: float) -> tuple[int, float, float, float]:
    begin, latencies = time.perf_counter(), list[float]()
    await asyncio.gather(*(_ask_on_one(target, begin + seconds, latencies) for _ in range(CONNECTIONS)))
    p50, p99 = np.percentile(latencies, [50, 99])
    return len(latencies), time.perf_counter() - begin, float(p50), float(p99)


async def _ask_on_one(target: Target, end: float, latencies: list[float]) -> None:
    reader, writer = await asyncio.open_connection("127.0.0.1", target.port)
    header = f"{target.header}\r\n" if target.header else ""
    request = f"GET {target.path} HTTP/1.1\r\nHost: localhost\r\n{header}\r\n".encode()
    while (begin := time.perf_counter()) < end:
        writer.write(request)
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        assert head.startswith((b"http/1.1 200", b"http/1.1 304")), head
        if b"content-length: " in head:
            await reader.readexactly(int(head.split(b"content-length: ")[1].split(b"\r\n")[0]))
        latencies.append(time.perf_counter() - begin)
    writer.close()
