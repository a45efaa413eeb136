"""Ingest under full load: `python -m benchmarks.service.ingest [--logs N] [--uploads N] [--page docs/scale.md]`.

As many 200-frame logs of 20×20 elements with forces as can be taken in, with one worker process and with two, on SQLite
and on PostgreSQL: logs a second from the first upload to the last stored fit. Then the resident memory of server and
worker over many uploads of small logs of a hundred materials, with its slope. Server, workers, database and callers
share the machine. Writes ingest.json and ingest.png.
"""

import os
import time
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import httpx
import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from benchmarks.pages import options, picture_folder, save, table, write
from benchmarks.service.__main__ import MATERIAL, NPZ, content, serving
from benchmarks.service.postgresql import running_postgresql
from slipcore.contact import RampSchedule, tangential_ramp
from stiction_client.container import encode

CALLERS = 2
MATERIALS = 100
SHORT = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.2)
UNDER_WAY = 20
"""Jobs that may wait while memory is looked at: what waits is not what leaks."""

BLOCKS = 10
MIB = 2**20


@dataclass(frozen=True, slots=True)
class Sustained:
    """Logs a second from the first upload to the last fit, and how many uploads a second were accepted meanwhile."""

    database: str
    workers: int
    rate: float
    accepted: float


@dataclass(frozen=True, slots=True)
class Memory:
    """Resident bytes of the processes of one kind after so many uploads, with the slope in the latter two thirds:
    bytes an upload, and half the width of its 95 % interval (of a line through the means of ten blocks).
    """

    process: str
    uploads: list[int]
    resident: list[int]
    slope: float
    half_width: float


@contextmanager
def database_url(engine: str) -> Iterator[dict[str, str]]:
    """The setting that leads to a database of this kind."""
    if engine == "SQLite":
        yield {}
        return
    with running_postgresql() as server:
        yield {"STICTION_DATABASE_URL": server.create()}


def sustained(engine: str, workers: int, bodies: list[bytes]) -> Sustained:
    """Take the logs in as fast as it goes."""
    with (
        database_url(engine) as where,
        serving(STICTION_WORKERS=str(workers), **where) as (url, _, _),
        httpx.Client(base_url=url, timeout=600.0) as client,
        ThreadPoolExecutor(CALLERS) as callers,
    ):
        begin = time.perf_counter()
        jobs = list(callers.map(lambda body: upload(client, body, MATERIAL), bodies))
        accepted = time.perf_counter() - begin
        for job in jobs:
            finish(client, job)
        seconds = time.perf_counter() - begin
    return Sustained(engine, workers, len(bodies) / seconds, len(bodies) / accepted)


def upload(client: httpx.Client, body: bytes, material: str) -> str:
    """The id of the job."""
    answer = client.post("/v1/grasp-logs", params={"material": material}, content=body, headers=NPZ)
    return str(answer.raise_for_status().json()["job"]["id"])


def finish(client: httpx.Client, job: str) -> None:
    """Wait for its end."""
    while (state := client.get(f"/v1/jobs/{job}?wait=10").raise_for_status().json())["finished_at"] is None:
        pass
    assert state["status"] == "done", state


def small_logs(count: int) -> Iterator[bytes]:
    """82 frames of 8×8, each with noise of its own."""
    log = tangential_ramp(points=8, pitch=1.5e-3, schedule=SHORT, marker_noise=1e-7, force_noise=1e-6, seed=1)
    assert log.force is not None
    generator = np.random.default_rng(1)
    for _ in range(count):
        force = log.force + generator.normal(0.0, 2e-4, log.force.shape)
        yield encode(replace(log, force=force, normal=None, truth=None))


def memory(uploads: int, every: int) -> list[Memory]:
    """Look at the processes once in so many uploads."""
    counts: list[int] = []
    seen: dict[str, list[int]] = {"server": [], "worker": []}
    with serving() as (url, _, server), httpx.Client(base_url=url, timeout=600.0) as client:
        for k in range(MATERIALS):
            client.post("/v1/materials", json={"name": f"material {k}"}).raise_for_status()
        under_way: deque[str] = deque()
        for k, body in enumerate(small_logs(uploads), 1):
            under_way.append(upload(client, body, f"material {k % MATERIALS}"))
            if len(under_way) > UNDER_WAY:
                finish(client, under_way.popleft())
            if k % every == 0:
                counts.append(k)
                seen["server"].append(resident(server))
                seen["worker"].append(sum(resident(child) for child in children(server)))
        for job in under_way:
            finish(client, job)
    return [Memory(name, counts, found, *slope(counts, found)) for name, found in seen.items()]


def resident(process: int) -> int:
    """Bytes in memory; none of a process that is gone."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    except FileNotFoundError:
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def children(process: int) -> list[int]:
    """Those of a process, whichever of its threads has begun them."""
    found: Iterable[Path] = Path(f"/proc/{process}/task").glob("*/children")
    return [int(child) for path in found for child in path.read_text(encoding="ascii").split()]


def slope(counts: list[int], found: list[int]) -> tuple[float, float]:
    """Of the latter two thirds, and half the width of its 95 % interval."""
    third = len(counts) // 3
    means = [
        [float(np.mean(part)) for part in np.array_split(np.array(values[third:], dtype=float), BLOCKS)]
        for values in (counts, found)
    ]
    line = stats.linregress(*means)
    return float(line.slope), float(line.stderr * stats.t.ppf(0.975, BLOCKS - 2))


def draw(rates: list[Sustained], memories: list[Memory]) -> Figure:
    """Rates as bars, memory over the uploads."""
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.bar([f"{one.database}\n{one.workers} workers" for one in rates], [one.rate for one in rates])
    left.set(ylabel="logs a second", title="200 frames of 20×20 with forces")
    for one in memories:
        right.plot(one.uploads, np.array(one.resident) / MIB, label=one.process)
    right.set(xlabel="uploads", ylabel="resident MiB", ylim=(0.0, None), title="memory")
    right.legend(loc="center right")
    return figure


def tables(rates: list[Sustained], memories: list[Memory]) -> dict[str, str]:
    """The same as Markdown."""
    first = [(one.database, one.workers, one.rate, one.accepted) for one in rates]
    second = [
        (
            one.process,
            one.uploads[-1],
            f"{one.resident[len(one.resident) // 3] / MIB:.0f} MiB",
            f"{one.resident[-1] / MIB:.0f} MiB",
            f"{1000 * one.slope / MIB:.2f} ± {1000 * one.half_width / MIB:.2f} MiB",
        )
        for one in memories
    ]
    return {
        "sustained ingest": table(("database", "workers", "logs/s to the fit", "uploads/s accepted"), first),
        "memory": table(("process", "uploads", "after a third", "at the end", "growth in 1,000 uploads"), second),
    }


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--logs", type=int, default=40, help="logs of each measurement of the rate")
    parser.add_argument("--uploads", type=int, default=10_000, help="uploads while memory is looked at, 300 or more")
    arguments = parser.parse_args()
    pictures = picture_folder(arguments)
    bodies = [content(1000 + k) for k in range(arguments.logs)]
    rates = [sustained(engine, workers, bodies) for engine in ("SQLite", "PostgreSQL") for workers in (1, 2)]
    memories = memory(arguments.uploads, max(1, arguments.uploads // 300))
    made = tables(rates, memories)
    print("\n\n".join(made.values()))
    save(draw(rates, memories), pictures / "ingest.png")
    numbers = {"sustained": [asdict(one) for one in rates], "memory": [asdict(one) for one in memories]}
    write(numbers, made, arguments, "ingest.json")


if __name__ == "__main__":
    main()
