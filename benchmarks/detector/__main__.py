"""What the slip detector costs and how well it finds slip: `python -m benchmarks.detector [--output FOLDER]`.

Every method streams logs of 20×20 markers through `SlipDetector.step`, frame by frame as a live sensor would,
and takes them as one batch through `detect_slip`. Logs are a simulated ramp with noise, one whose contact covers the
sensor, with forces and from displacement alone, and each real Tac3D recording that is found. Then every method is
scored on scenes with truth (benchmarks/detector/accuracy.py). Prints tables and writes detector.json, detector.png,
detector_accuracy.json, detector_accuracy.png, detector_reliability.json and .png (is a reported probability the share
that slips?) and detector_conditions.json (benchmarks/detector/conditions.py).
`--only accuracy --page docs/detector.md` renews the tables of scores there.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from matplotlib.figure import Figure

from benchmarks import pages
from benchmarks.detector import accuracy as detector_accuracy
from benchmarks.detector import conditions as detector_conditions
from benchmarks.detector.scenes import cases, observed
from service.formats import tac3d
from service.slip_benchmark.running import NEEDS_FORCES
from slipcore import METHODS, GraspLog, SlipDetector, detect_slip
from slipcore.contact import RampSchedule, tangential_ramp

FRAMES = 250
TARGET = 1e-3
RECORDINGS = Path(".cache/tac3d/PyTac3D/example_data")


@dataclass(frozen=True, slots=True)
class Cost:
    """Seconds (median, 99th percentile and each of a stream's steps, median batch), and what the detector said."""

    log: str
    method: str
    frames: int
    median: float
    p99: float
    batch: float
    slipping: float
    noise: float
    steps: list[float]


def logs(recordings: Path) -> Iterator[tuple[str, GraspLog]]:
    """The simulated ramps, and the real recordings that are there; normals are left to the detector."""
    schedule = RampSchedule(rest=0.5, press=1.0, settle=0.5, shear=5.3, hold=1.0)
    ramp = tangential_ramp(schedule=schedule, marker_noise=1e-6, force_noise=2e-3)
    assert len(ramp) == FRAMES
    yield "simulated ramp", replace(ramp, normal=None, object_pose=None)
    schedule = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.3)
    covered = tangential_ramp(schedule=schedule, pitch=0.2e-3, marker_noise=1e-6, force_noise=2e-4)
    covered = replace(covered, normal=None, object_pose=None)
    yield "all elements touch", covered
    yield "all elements touch, displacement alone", replace(covered, force=None)
    for path in sorted(recordings.glob("*/*/3D_Positions.npy")):
        yield path.parent.name, tac3d.read(path.parent)


def stream(log: GraspLog, method: str) -> list[float]:
    """Seconds of each step of one stream."""
    detector, seconds = SlipDetector(log.position, log.element_area, method), []
    for frame in log.frames():
        start = perf_counter()
        detector.step(frame.time, frame.displacement, frame.force, frame.object_pose, frame.normal)
        seconds.append(perf_counter() - start)
    return seconds


def batch(log: GraspLog, method: str) -> float:
    """Seconds of one batch."""
    start = perf_counter()
    detect_slip(log, method)
    return perf_counter() - start


def measure(name: str, log: GraspLog, method: str, repeats: int) -> Cost:
    """Stream and batch in turns, after one of each to warm up."""
    stream(log, method)
    runs = [(stream(log, method), batch(log, method)) for _ in range(repeats)]
    steps = np.concatenate([seconds for seconds, _ in runs])
    history = detect_slip(log, method)
    return Cost(
        log=name,
        method=method,
        frames=len(log),
        median=float(np.median(steps)),
        p99=float(np.percentile(steps, 99)),
        batch=float(np.median([seconds for _, seconds in runs])),
        slipping=np.count_nonzero(history.slip) / max(1, np.count_nonzero(history.contact)),
        noise=history.noise,
        steps=[float(s) for s in np.median([seconds for seconds, _ in runs], axis=0)],
    )


def draw(costs: list[Cost]) -> Figure:
    """Median cost of each frame along the stream, one panel a log."""
    names = list(dict.fromkeys(cost.log for cost in costs))
    figure = Figure(figsize=(7, 2.2 * len(names)), layout="constrained")
    for axes, name in zip(figure.subplots(len(names), squeeze=False)[:, 0], names, strict=True):
        for cost in (c for c in costs if c.log == name):
            axes.plot(1e6 * np.array(cost.steps), label=f"{cost.method}, median {1e6 * cost.median:.0f} µs", lw=0.8)
        axes.axhline(1e6 * TARGET, color="0.6", ls=":", label="target")
        axes.set(title=name, xlabel="frame", ylabel="µs a step", yscale="log")
        axes.legend(fontsize=8, loc="upper right")
    return figure


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"), help="folder for JSON and picture")
    parser.add_argument("--recordings", type=Path, default=RECORDINGS, help="folder of Tac3D recordings")
    parser.add_argument("--repeats", type=int, default=5, help="streams and batches of each log")
    parser.add_argument("--page", type=Path, help="page whose tables and pictures of accuracy are renewed")
    parser.add_argument("--only", choices=("cost", "accuracy"), help="leave out the other")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    if arguments.only != "accuracy":
        report_costs(arguments)
    if arguments.only != "cost":
        report_accuracy(arguments)


def report_accuracy(arguments: argparse.Namespace) -> None:
    """Score all methods on the unseen scenes."""
    output, pictures = arguments.output, pages.picture_folder(arguments)
    rows = [
        row
        for scenes in ("scoring", "reference")
        for inputs in detector_accuracy.INPUTS
        for noise in detector_accuracy.NOISES
        for row in detector_accuracy.measure(scenes, inputs, noise)
    ]
    print(detector_accuracy.table(rows))
    text = json.dumps(detector_accuracy.as_json(rows), indent=1)
    (output / "detector_accuracy.json").write_text(text, encoding="utf-8")
    pages.save(detector_accuracy.draw(rows), pictures / "detector_accuracy.png")
    calibrated = {
        inputs: detector_accuracy.reliability(
            (case, detect_slip(observed(case.log, 1e-6, detector_accuracy.FORCE_NOISE, inputs, seed=7)))
            for case in cases("scoring")
        )
        for inputs in detector_accuracy.INPUTS
    }
    (output / "detector_reliability.json").write_text(json.dumps(calibrated, indent=1), encoding="utf-8")
    pages.save(detector_accuracy.draw_reliability(calibrated), pictures / "detector_reliability.png")
    conditions = list(detector_conditions.measure())
    (output / "detector_conditions.json").write_text(json.dumps(conditions, indent=1), encoding="utf-8")
    print(detector_conditions.table(conditions))
    if arguments.page is not None:
        made = detector_accuracy.tables_of_unseen(rows) | {"conditions": detector_conditions.table(conditions)}
        pages.renew(arguments.page, made)


def report_costs(arguments: argparse.Namespace) -> None:
    """Time all methods."""
    costs = [
        measure(name, log, method, arguments.repeats)
        for name, log in logs(arguments.recordings)
        for method in METHODS
        if log.force is not None or method not in NEEDS_FORCES
    ]
    print("| log | method | frames | step median, µs | p99, µs | batch, ms | slipping | noise, µm |")
    print("|---|---|---|---|---|---|---|---|")
    for c in costs:
        print(
            f"| {c.log} | {c.method} | {c.frames} | {1e6 * c.median:.0f} | {1e6 * c.p99:.0f} | {1e3 * c.batch:.0f} "
            f"| {c.slipping:.0%} | {1e6 * c.noise:.2f} |"
        )
    text = json.dumps([asdict(cost) for cost in costs], indent=1)
    (arguments.output / "detector.json").write_text(text, encoding="utf-8")
    draw(costs).savefig(arguments.output / "detector.png", dpi=150)
    print(f"written: {arguments.output / 'detector.json'}, {arguments.output / 'detector.png'}")


if __name__ == "__main__":
    main()
