"""What the service costs its callers: `python -m benchmarks.service [--output FOLDER] [--page docs/scale.md]`.

Uploads, one after the other, of 200-frame logs of 20×20 elements with forces: seconds to the answer and to the stored
fit by least squares; then fits of the same material, asked for one after the other: by `bayes`, and by `conjugate`,
which is a job with next to nothing to compute. Then look-ups on 32 connections, beside bare Starlette routes that
return the same bytes by the same uvicorn, without a log, on h11 and asyncio and on httptools and uvloop: requests a
second, CPU seconds a request of the server, and latencies, alone and where each asks the database. Last, the same
while uploads and fits go on, by the server and from a process for look-ups (STICTION_LOOKUP_PORT), in turn with the
bare route on the same core: what that has is the machine's own (`--only beside`). What answers look-ups has one core;
the callers, the workers and, beside a process for look-ups, the server share the others.
Writes service.json and service.png, or beside.json.
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

import httpx
import numpy as np
from matplotlib.figure import Figure

from benchmarks.pages import options, picture_folder, save, write
from benchmarks.service.http_load import (
    CALLERS,
    CONNECTIONS,
    Load,
    Target,
    child_listening,
    in_turn,
    leave_first_core,
    load,
    median,
    pin,
)
from benchmarks.service.postgresql import running_postgresql
from slipcore import GraspLog
from slipcore.contact import RampSchedule, tangential_ramp
from stiction_client import FrictionClient
from stiction_client.container import encode

MATERIAL = "benchmark"
LOOK_UP = f"/v1/materials/{MATERIAL}/friction?v=0.001&fn=0.05&quantile=0.05"
NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
UPLOADS = 30
MOST_BESIDE = 300
"""Logs made before look-ups are measured beside their uploads: to make them takes the same cores."""

FAST = "bare Starlette, httptools and uvloop"
BARE = """
import sys, uvicorn
from starlette.applications import Starlette
from starlette.responses import Response
from starlette.routing import Route
body = sys.stdin.buffer.read()
async def answer(request): return Response(body, media_type="application/json")
routes = [Route("/v1/materials/{name}/friction", answer)]
options = {"http": sys.argv[2], "loop": sys.argv[3], "server_header": False, "access_log": False}
uvicorn.run(Starlette(routes=routes), port=int(sys.argv[1]), **options)
"""


@dataclass(frozen=True, slots=True)
class Requests:
    """Seconds to the answer, and to the end of the job, of requests of one kind."""

    what: str
    accepted: list[float]
    fitted: list[float]


@contextmanager
def running(command: list[str], port: int, given: bytes | None = None, **environment: str) -> Iterator[int]:
    """A server process of its own, once it listens: its id."""
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | environment,
    )
    assert process.stdin is not None
    process.stdin.write(given or b"")
    process.stdin.close()
    try:
        while True:
            assert process.poll() is None, f"{command} ended"
            try:
                socket.create_connection(("127.0.0.1", port), 1.0).close()
                break
            except OSError:
                time.sleep(0.05)
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def free_port() -> int:
    """One that nothing listens on now."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


def grasp(seed: int) -> GraspLog:
    """A log of 200 frames of 20×20 elements with forces."""
    schedule = RampSchedule(rest=0.3, press=1.0, settle=0.4, shear=4.0, hold=0.95)
    log = tangential_ramp(points=20, schedule=schedule, marker_noise=1e-6, force_noise=2e-3, seed=seed)
    assert len(log) == 200, len(log)
    return replace(log, normal=None, truth=None)


def content(seed: int) -> bytes:
    """The same as a file."""
    return encode(grasp(seed))


def uploads(url: str, bodies: list[bytes]) -> Requests:
    """Grasp logs one after the other, each awaited to its stored fit."""

    def ask(client: httpx.Client, body: bytes) -> str:
        answer = client.post("/v1/grasp-logs", params={"material": MATERIAL}, content=body, headers=NPZ)
        return str(answer.raise_for_status().json()["job"]["id"])

    return requests(url, "upload, then fit by ols", ask, bodies)


def fits(url: str, method: str, count: int, where: str = "") -> Requests:
    """Fits of the material, each with another seed."""

    def ask(client: httpx.Client, seed: int) -> str:
        answer = client.post(f"/v1/materials/{MATERIAL}/fits", json={"method": method, "seed": seed})
        return str(answer.raise_for_status().json()["id"])

    return requests(url, f"fit by {method}{where}", ask, list(range(count)))


def requests(url: str, what: str, ask: Callable[[httpx.Client, Any], str], bodies: list[Any]) -> Requests:
    """What ``ask`` sends, and the job that it tells, one after the other."""
    accepted, fitted = [], []
    with httpx.Client(base_url=url, timeout=60.0) as client:
        for body in bodies:
            begin = time.perf_counter()
            job = ask(client, body)
            accepted.append(time.perf_counter() - begin)
            while (state := client.get(f"/v1/jobs/{job}", params={"wait": 10.0}).json())["finished_at"] is None:
                pass
            assert state["status"] == "done", state
            fitted.append(time.perf_counter() - begin)
    return Requests(what, accepted, fitted)


def beside(work: Callable[[], object], measured: Callable[[], list[list[Load]]]) -> list[list[Load]]:
    """A measurement while other work goes on."""
    done = Event()

    def go_on() -> None:
        while not done.is_set():
            work()

    thread = Thread(target=go_on)
    thread.start()
    try:
        return measured()
    finally:
        done.set()
        thread.join()


@contextmanager
def ready(folder: Path, **settings: str) -> Iterator[tuple[str, int, int]]:
    """A service on a data folder, once it is ready: its URL, port and process."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    command = [sys.executable, "-m", "service.cli", "serve", "--port", str(port), "--data-folder", str(folder)]
    with running(command, port, STICTION_RATE_LIMIT="0", **settings) as process:
        while httpx.get(f"{url}/readyz").status_code != httpx.codes.OK:
            time.sleep(0.05)
        yield url, port, process


@contextmanager
def informed(**settings: str) -> Iterator[tuple[str, int, int]]:
    """A service with one worker that is ready and knows the material: its URL, port and process."""
    with tempfile.TemporaryDirectory() as folder, ready(Path(folder), **settings) as (url, port, process):
        FrictionClient(url).create_material(MATERIAL)
        uploads(url, [content(seed) for seed in range(3)])
        yield url, port, process


@contextmanager
def serving(**settings: str) -> Iterator[tuple[str, int, int]]:
    """The same, with a core of its own."""
    with informed(**settings) as (url, port, process):
        pin(process)
        yield url, port, process


def measure() -> tuple[list[Requests], list[Load]]:
    """A service on SQLite with a bare server beside it; then services that ask the database each time."""
    with serving() as (url, port, process):
        found = [
            uploads(url, [content(100 + k) for k in range(UPLOADS)]),
            fits(url, "bayes", UPLOADS // 3),
            fits(url, "conjugate", UPLOADS),
        ]
        loads = looked_up(url, port, process)
    uncached = {"STICTION_LOOKUP_SECONDS": "0"}
    with serving(**uncached) as (_, port, process):
        loads.append(load(Target("look-up, asking SQLite", port, process, LOOK_UP)))
    with (
        running_postgresql() as server,
        serving(STICTION_DATABASE_URL=server.create(), **uncached) as (url, port, process),
    ):
        found.append(fits(url, "conjugate", UPLOADS, where=" on PostgreSQL"))
        loads.append(load(Target("look-up, asking PostgreSQL", port, process, LOOK_UP)))
    return found, loads


def looked_up(url: str, port: int, process: int) -> list[Load]:
    """Look-ups of a model in memory, and of the same bytes from a bare route."""
    answer = httpx.get(url + LOOK_UP).raise_for_status()
    with bare(answer.content, "h11", "asyncio") as slow, bare(answer.content) as quick:
        targets = [
            Target(FAST, *quick, LOOK_UP),
            Target("look-up", port, process, LOOK_UP),
            Target("look-up, not modified", port, process, LOOK_UP, f"If-None-Match: {answer.headers['etag']}"),
            Target("bare Starlette, h11 and asyncio", *slow, LOOK_UP),
        ]
        return [median(runs) for runs in in_turn(targets)]


def looked_up_beside() -> list[list[Load]]:
    """Look-ups while one log after the other is uploaded and fitted, and a bare route beside the same uploads."""
    return [*beside_of_the_server(made_logs(300)), *beside_of_a_process(made_logs(300 + MOST_BESIDE))]


def beside_of_the_server(bodies: list[bytes]) -> list[list[Load]]:
    """Look-ups of the server itself; the bare route shares its core with it."""
    with serving() as (url, port, process):
        return beside_uploads(url, bodies, Target("look-up", port, process, LOOK_UP), "on the server's core")


def beside_of_a_process(bodies: list[bytes]) -> list[list[Load]]:
    """Look-ups from a process for them, which has a core of its own, as the bare route has then."""
    port = free_port()
    with informed(STICTION_LOOKUP_PORT=str(port)) as (url, _, server):
        httpx.get(f"http://127.0.0.1:{port}{LOOK_UP}", timeout=60.0).raise_for_status()  # waits for its start
        process = child_listening(server, port)
        pin(process)
        target = Target("look-up, from a process for look-ups", port, process, LOOK_UP)
        return beside_uploads(url, bodies, target, "on that core")


def made_logs(first_seed: int) -> list[bytes]:
    """As many as are uploaded beside look-ups at most."""
    return [content(first_seed + k) for k in range(MOST_BESIDE)]


def beside_uploads(url: str, bodies: list[bytes], target: Target, where: str) -> list[list[Load]]:
    """What look-ups take while one log after the other is uploaded and fitted, and a bare route of the same answer."""
    left, answer = iter(bodies), httpx.get(f"http://127.0.0.1:{target.port}{LOOK_UP}").raise_for_status()
    with bare(answer.content) as quick:
        targets = [target, Target(f"bare Starlette, {where}", *quick, LOOK_UP)]
        return beside(lambda: uploads(url, [next(left)]), lambda: in_turn(targets, 3, 5.0))


@contextmanager
def bare(body: bytes, parser: str = "httptools", loop: str = "uvloop") -> Iterator[tuple[int, int]]:
    """A server of one route that always gives the same answer: its port and process."""
    port = free_port()
    with running([sys.executable, "-c", BARE, str(port), parser, loop], port, body) as process:
        pin(process)
        yield port, process


def draw(found: list[Requests], loads: list[Load]) -> Figure:
    """Uploads in their order, and latencies of look-ups."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for entry in found:
        left.plot(1e3 * np.array(entry.fitted), "o-", markersize=3, label=f"{entry.what}: to the stored fit")
    left.plot(1e3 * np.array(found[0].accepted), "o-", markersize=3, label="upload: to the answer")
    left.set(xlabel="request", ylabel="ms", yscale="log", title="200 frames of 20×20 with forces")
    left.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)
    place = np.arange(len(loads))
    right.barh(place - 0.2, [1e3 * one.p50 for one in loads], 0.4, label="p50")
    right.barh(place + 0.2, [1e3 * one.p99 for one in loads], 0.4, label="p99")
    right.set_yticks(place, [one.what for one in loads], fontsize=8)
    right.set(xlabel="ms", xscale="log", title=f"{CONNECTIONS} connections")
    right.legend(fontsize=8)
    return figure


def tables(found: list[Requests], loads: list[Load]) -> dict[str, str]:
    """The same as Markdown."""
    first = ["| request | to the answer, median | to the stored fit, median | longest |", "|---|---|---|---|"]
    first += [
        f"| {e.what} | {1e3 * np.median(e.accepted):.0f} ms | {1e3 * np.median(e.fitted):.0f} ms "
        f"| {1e3 * max(e.fitted):.0f} ms |"
        for e in found
    ]
    bare_rate = next(each.rate for each in loads if each.what == FAST)
    head = f"| 32 connections of {CALLERS} | requests/s | of the first | CPU a request | p50 | p99 |"
    second = [head, "|---|---|---|---|---|---|"]
    second += [
        f"| {e.what} | {e.rate:.0f} | {e.rate / bare_rate:.2f} | {1e6 * e.cpu:.0f} µs | {1e3 * e.p50:.1f} ms "
        f"| {1e3 * e.p99:.1f} ms |"
        for e in loads
    ]
    return {"uploads": "\n".join(first), "look-ups": "\n".join(second)}


def table_beside(runs: list[list[Load]]) -> dict[str, str]:
    """Look-ups beside uploads as Markdown, with the ratio of their percentiles in each run."""
    rows = [
        f"| beside uploads and fits, {len(runs[0])} runs of each | requests/s | CPU a request | p50 | p99 | of p50 |"
    ]
    rows.append("|---|---|---|---|---|---|")
    for each in runs:
        e, ratios = median(each), ", ".join(f"{one.p99 / one.p50:.1f}" for one in each)
        times = f"{1e6 * e.cpu:.0f} µs | {1e3 * e.p50:.1f} ms | {1e3 * e.p99:.1f} ms"
        rows.append(f"| {e.what} | {e.rate:.0f} | {times} | {ratios} |")
    return {"look-ups beside uploads": "\n".join(rows)}


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--only", choices=("alone", "beside"), help="leave out the other")
    arguments = parser.parse_args()
    pictures = picture_folder(arguments)
    leave_first_core()
    if arguments.only != "alone":
        runs = looked_up_beside()
        made = table_beside(runs)
        print(*made.values())
        write([[asdict(one) for one in each] for each in runs], made, arguments, "beside.json")
    if arguments.only == "beside":
        return
    found, loads = measure()
    made = tables(found, loads)
    print("\n\n".join(made.values()))
    save(draw(found, loads), pictures / "service.png")
    numbers = {"uploads": [asdict(entry) for entry in found], "look-ups": [asdict(entry) for entry in loads]}
    write(numbers, made, arguments, "service.json")


if __name__ == "__main__":
    main()
