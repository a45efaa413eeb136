"""End-to-end latency of the live stream: many sensors at once against a real server.

    python -m benchmarks.service.stream --connections 20 --rate 30 --seconds 20
    python -m benchmarks.service.stream --connections 1 --watchers 0 10
    python -m benchmarks.service.stream --connections 1 --watchers 0 10 0 10 --lookups 50

Each connection sends frames of a simulated grasp (20×20 markers with forces) at its rate, all out of step, and notes
how long after its sending a frame is answered. Watchers read what the dashboard shows of the first connection. Beside
them a planner may look friction up, so many times a second. Server, its detectors and these clients share the machine.
"""

import argparse
import asyncio
import itertools
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import msgspec
import numpy as np
from numpy.typing import NDArray
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosedOK

from service.stream.watching import READ_TOGETHER
from slipcore import GraspLog
from slipcore.contact import tangential_ramp
from stiction_client import FrictionClient

MATERIAL = "looked up"


async def sensor(
    url: str, log: GraspLog, rate: float, seconds: float, late: float, opened: asyncio.Future[str]
) -> list[float]:
    """Latencies of one connection, s; the first that is open says its session to who waits for it (``opened``)."""
    await asyncio.sleep(late)
    async with connect(url, compression=None) as stream:
        opening = {"type": "open", "position": log.position.tobytes(), "grid": log.grid, "element_area": 1e-6}
        await stream.send(msgspec.msgpack.encode(opening))
        session = msgspec.msgpack.decode(await stream.recv(decode=False))["session"]
        if not opened.done():
            opened.set_result(session)
        sent: dict[int, float] = {}
        latencies: list[float] = []
        frames = int(rate * seconds)

        async def listen() -> None:
            while len(latencies) < frames:
                answer = msgspec.msgpack.decode(await stream.recv(decode=False))
                latencies.append(time.perf_counter() - sent[answer["number"]])
                assert answer["type"] == "state", answer

        listener = asyncio.create_task(listen())
        begin = time.perf_counter()
        for k in range(frames):
            await asyncio.sleep(max(begin + k / rate - time.perf_counter(), 0.0))
            frame = {"type": "frame", "number": k, "time": k / rate}
            frame["displacement"] = log.displacement[k % len(log)].astype("<f4").tobytes()
            frame["force"] = log.force[k % len(log)].astype("<f4").tobytes()
            sent[k] = time.perf_counter()
            await stream.send(msgspec.msgpack.encode(frame))
        await listener
        await stream.send(msgspec.msgpack.encode({"type": "finish"}))
    return latencies[int(2 * rate) :]  # the first two seconds compile and warm up


async def watch(port: int, opened: asyncio.Future[str]) -> int:
    """How many frames one watcher gets, who reads as the dashboard's page does."""
    frames = 0
    url = f"ws://127.0.0.1:{port}/live/{await opened}/frames"
    async with connect(url, compression=None) as stream:
        with suppress(ConnectionClosedOK):  # the session has ended
            while await stream.recv(decode=False):
                frames += 1
                if frames % READ_TOGETHER == 0:
                    await stream.send("")
    return frames


async def look_up(port: int, rate: float, seconds: float) -> list[float]:
    """Seconds that each look-up of one planner took; they begin evenly, a late one delays none."""
    path, asked = f"/v1/materials/{MATERIAL}/friction", {"v": 0.001, "fn": 0.05, "quantile": 0.01}
    latencies: list[float] = []
    if not rate:
        return latencies

    async def once(client: httpx.AsyncClient) -> None:
        begin = time.perf_counter()
        (await client.get(path, params=asked)).raise_for_status()
        latencies.append(time.perf_counter() - begin)

    async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}") as client, asyncio.TaskGroup() as group:
        await once(client)  # loads what a quantile needs
        latencies.clear()
        begin = time.perf_counter()
        for k in range(int(rate * seconds)):
            await asyncio.sleep(max(begin + k / rate - time.perf_counter(), 0.0))
            group.create_task(once(client))
    return latencies


async def measure(
    port: int, connections: int, watchers: int, rate: float, seconds: float, lookups: float
) -> dict[str, Any]:
    """Quantiles of all latencies, ms, and how many frames a second each watcher saw."""
    log = tangential_ramp(points=20, pitch=1e-3, marker_noise=1e-6, force_noise=1e-3, seed=1)
    url = f"ws://127.0.0.1:{port}/v1/stream"
    lateness = np.linspace(0.0, 1.0 / rate, connections, endpoint=False)
    opened: asyncio.Future[str] = asyncio.get_running_loop().create_future()
    watching = [asyncio.create_task(watch(port, opened)) for _ in range(watchers)]
    planner = asyncio.create_task(look_up(port, lookups, seconds))
    parts = await asyncio.gather(*(sensor(url, log, rate, seconds, late, opened) for late in lateness))
    latencies = np.concatenate(parts)
    shown = [await each / seconds for each in watching]
    found: dict[str, Any] = quantiles("", latencies) | quantiles("lookup_", np.array(await planner))
    found |= {"watchers": watchers, "shown_a_second": [round(min(shown), 1), round(max(shown), 1)] if shown else []}
    return {"connections": connections, "rate": rate, "frames": len(latencies), **found}


def quantiles(name: str, latencies: NDArray[np.float64]) -> dict[str, float]:
    """Of latencies, s, in ms; none of none."""
    wanted = (50, 90, 99, 99.9) if len(latencies) else ()
    return {f"{name}p{q:g}_ms": round(1e3 * float(np.percentile(latencies, q)), 2) for q in wanted}


def cpu_seconds(pid: int) -> float:
    """Processor time of a process and its children, s."""
    used = 0.0
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        if pid in (int(status.parent.name), int(fields[1])):
            used += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return used


def main() -> None:
    """Start a server, load it and print what was measured as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connections", type=int, nargs="+", default=[20])
    parser.add_argument("--watchers", type=int, nargs="+", default=[0])
    parser.add_argument("--lookups", type=float, default=0.0, help="a second, of friction, beside the streams")
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    chosen = parser.parse_args()
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    with tempfile.TemporaryDirectory() as folder, Path(folder, "server.log").open("wb") as log:
        settings = {"STICTION_DATA_FOLDER": folder, "STICTION_PORT": str(port)}
        command = [sys.executable, "-m", "service.cli", "serve"]
        server = subprocess.Popen(command, env=os.environ | settings, stdout=log, stderr=log)
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{port}") as client:
                while not _is_up(client):
                    time.sleep(0.1)
            if chosen.lookups:
                fit_material(port)
            for connections, watchers in itertools.product(chosen.connections, chosen.watchers):
                before = cpu_seconds(server.pid)
                found = asyncio.run(measure(port, connections, watchers, chosen.rate, chosen.seconds, chosen.lookups))
                used = (cpu_seconds(server.pid) - before) / chosen.seconds
                load = os.getloadavg()[0] / (os.cpu_count() or 1)
                print(json.dumps(found | {"cores_of_the_service": round(used, 2), "load_per_core": round(load, 2)}))
        finally:
            server.terminate()
            server.wait()


def fit_material(port: int) -> None:
    """Let the service know friction that can be looked up."""
    with FrictionClient(f"http://127.0.0.1:{port}") as client:
        client.create_material(MATERIAL)
        client.wait(client.upload(tangential_ramp(points=14, seed=1), material=MATERIAL).job)


def _is_up(client: httpx.Client) -> bool:
    try:
        return client.get("/readyz").is_success
    except httpx.TransportError:
        return False


if __name__ == "__main__":
    main()
