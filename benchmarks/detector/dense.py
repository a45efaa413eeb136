"""Dense sensors: `python -m benchmarks.detector.dense [--output FOLDER] [--page docs/dense.md]`.

The scene of Fig. 10 (shear, normal force raised, shear again) seen by sensors of 20 × 20 to 320 × 240 points, with 1 µm
of noise on each marker and the same noise of pressure on each element: 2 mN on one of the coarsest sensor. Each is
streamed frame by frame in a process of its own, which tells median step, peak memory and F1; then it is sent through
upload, job and results of a running service. Writes dense.json and a picture of the densest, prints tables.
"""

import multiprocessing
import resource
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import TypeVar

import numpy as np

from benchmarks.detector.scenes import simulated
from benchmarks.pages import options, picture_folder, save, table, write
from service.demo.server import running_server
from service.report.pictures import slip_over_time
from slipcore import GraspLog, SlipDetector, collect_history, detect_slip
from slipcore.contact.effects import ForceNoise, MarkerNoise, SensorSampling
from slipcore.contact.scene import Scene
from stiction_client import FrictionClient, container

SENSORS = ((20, 20), (100, 100), (200, 200), (320, 240))
WIDTH = 15e-3
"""m along the longer side; the gel of the 20 × 20 sensor."""
METHODS = ("filter", "strain_rate")
MIB = 2.0**20
Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True)
class Stream:
    """One sensor and method: seconds of a step (median) and of the batch, MiB at peak and of the log, and F1."""

    points: str
    method: str
    step: float
    batch: float
    peak: float
    log: float
    f1: float


@dataclass(frozen=True, slots=True)
class Passage:
    """One sensor through the service: MiB sent, seconds of upload, job and picture, and MiB and seconds of results."""

    points: str
    sent: float
    upload: float
    job: float
    samples: int
    results: float
    fetch: float
    picture: float


def dense_log(points: tuple[int, int]) -> GraspLog:
    """The scene as that sensor sees it."""
    pitch = WIDTH / max(points)
    scene = Scene.from_toml("fig10_normal_force_rises")
    kept = tuple(effect for effect in scene.effects if not isinstance(effect, SensorSampling))
    noise = MarkerNoise(1e-6), ForceNoise(2e-3 * (pitch / 0.75e-3) ** 2)
    return simulated(replace(scene, effects=(*kept, *noise, SensorSampling(points, pitch, 30.0))))


def stream(points: tuple[int, int], method: str) -> Stream:
    """Stream a log; meant for a fresh process, whose peak memory it tells."""
    log = replace(dense_log(points), object_pose=None)
    assert log.truth is not None
    detector, seconds, answers = SlipDetector(log.position, log.element_area, method), [], []
    for frame in log.frames():
        began = time.process_time()
        answers.append(detector.step(frame.time, frame.displacement, frame.force, normal=frame.normal))
        seconds.append(time.process_time() - began)
    history = collect_history(answers, detector.state)
    began = time.process_time()
    detect_slip(log, method)
    batch = time.process_time() - began
    true = log.truth.slip_contact_factor & log.truth.contact
    found = history.slip & log.truth.contact
    f1 = 2.0 * np.count_nonzero(true & found) / (np.count_nonzero(true) + np.count_nonzero(found))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    size = (log.displacement.nbytes + (0 if log.force is None else log.force.nbytes)) / MIB
    return Stream(f"{points[0]} × {points[1]}", method, float(np.median(seconds)), batch, peak, size, float(f1))


def pass_through(points: tuple[int, int], url: str, pictures: Path) -> Passage:
    """Upload, wait, fetch the results, draw."""
    log = dense_log(points)
    with TemporaryDirectory() as folder, FrictionClient(url, timeout=120.0) as client:
        path = Path(folder) / "dense.npz"
        path.write_bytes(_in_single_precision(log))
        receipt, upload = timed(lambda: client.upload(path, detector="filter"))
        _, job = timed(lambda: client.wait(receipt.job))
        results, fetch = timed(lambda: _fetch(url, receipt.id))
        history = detect_slip(log, "filter")
        title = f"{points[0]} × {points[1]} points: filter"
        _, picture = timed(lambda: save(slip_over_time(log, history, title), pictures / "dense.png"))
        sent = path.stat().st_size / MIB
    count, size = results
    return Passage(f"{points[0]} × {points[1]}", sent, upload, job, count, size / MIB, fetch, picture)


def _in_single_precision(log: GraspLog) -> bytes:
    """The log as a sensor sends it: in single precision, without normals and truth."""
    assert log.force is not None
    fields = {"displacement": log.displacement.astype(np.float32), "force": log.force.astype(np.float32)}
    kept = {name: getattr(log, name) for name in ("time", "position", "element_area", "sensor", "metadata")}
    return container.encode(SimpleNamespace(**kept, **fields, normal=None, object_pose=None, truth=None))


def timed(work: Callable[[], Answer]) -> tuple[Answer, float]:
    """An answer and the seconds that it took."""
    began = time.perf_counter()
    return work(), time.perf_counter() - began


def _fetch(url: str, log_id: str) -> tuple[int, int]:
    """Number of samples, and bytes of stick ratio, events and samples."""
    import httpx

    answers = [httpx.get(f"{url}/v1/grasp-logs/{log_id}/{what}", timeout=120.0).raise_for_status()
               for what in ("stick-ratio", "events", "samples")]  # fmt: skip
    return len(answers[-1].json()["time"]), sum(len(answer.content) for answer in answers)


def report(streams: list[Stream], passages: list[Passage]) -> dict[str, str]:
    """Two Markdown tables."""
    first = ("points", "method", "step, ms", "61 frames, s", "peak, MiB", "of it the log, MiB", "F1")
    second = ("points", "sent, MiB", "upload, s", "job, s", "samples", "results, MiB", "fetching them, s", "picture, s")
    return {
        "streams": table(first, [(s.points, s.method, 1e3 * s.step, s.batch, s.peak, s.log, s.f1) for s in streams]),
        "passages": table(second, [tuple(asdict(passage).values()) for passage in passages]),
    }


def main() -> None:
    """Measure, print and write."""
    arguments = options(__doc__).parse_args()
    pictures = picture_folder(arguments)
    streams = []
    for points in SENSORS:
        for method in METHODS:
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
                streams.append(process.submit(stream, points, method).result())
            print(streams[-1], flush=True)
    with TemporaryDirectory() as data, running_server(Path(data)) as url:
        pass_through(SENSORS[0], url, pictures)  # the worker's first job waits for its libraries
        passages = [pass_through(points, url, pictures) for points in SENSORS]
    made = report(streams, passages)
    print("\n\n".join(made.values()))
    numbers = {"streams": [asdict(s) for s in streams], "passages": [asdict(p) for p in passages]}
    write(numbers, made, arguments, "dense.json")


if __name__ == "__main__":
    main()
