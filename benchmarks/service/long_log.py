"""What a long log of few elements costs: `python -m benchmarks.service.long_log [--frames N] [--page docs/scale.md]`.

A million frames of 2×2 elements, of which nothing touches or all do, press after press: CPU time of this process in
each stage of a job, from the file to what is stored, and the most memory that it had. Writes long_log.json.
"""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

import slipcore
from benchmarks.pages import options, picture_folder, table, write
from benchmarks.service.ingest import SHORT
from service import formats
from service.domain.models.stored_results import encode_history, encode_samples, summarise_history, summarise_samples
from slipcore import GraspLog
from slipcore.contact import tangential_ramp
from stiction_client import container

FRAMES = 1_000_000
CORNERS = {"nothing touches": slice(0, 2), "all touch": slice(5, 9, 3)}
"""Rows and columns of a 14×14 ramp: in its corner, and about its middle."""

STAGES = ("frames", "slip_state", "samples", "stored")
GIB = 2**30


@dataclass(frozen=True, slots=True)
class Cost:
    """CPU seconds of each stage, and bytes of this process at their most so far."""

    log: str
    touches: int
    memory: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


def long_log(frames: int, part: slice) -> GraspLog:
    """These rows and columns of a ramp, pressed and sheared over and over."""
    ramp = tangential_ramp(points=14, pitch=0.9e-3, schedule=SHORT, marker_noise=1e-7, force_noise=1e-6, seed=1)
    assert ramp.force is not None
    times = -(-frames // len(ramp))
    displacement, force = (
        np.tile(f[:, part, part], (times, 1, 1, 1))[:frames] for f in (ramp.displacement, ramp.force)
    )
    time = ramp.time[1] * np.arange(frames)
    return GraspLog(time, ramp.position[part, part], displacement, element_area=ramp.element_area, force=force)


def cost(name: str, path: Path) -> Cost:
    """Take a log through the stages of a job, as ``service.jobs.pipeline`` does."""
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(stage: str) -> Iterator[None]:
        began = process_time()
        yield
        seconds[stage] = process_time() - began

    with timed("frames"):
        log = formats.read(path)
    with timed("slip_state"):
        history = slipcore.detect_slip(log, lookahead=slipcore.LOOKAHEAD)
    with timed("samples"):
        found = slipcore.collect_friction(log, history)
        slipcore.check_log(log, history, found.elements)
    with timed("stored"):
        encode_history(history), encode_samples(found.samples)
        summarise_history(history, 0.0, ""), summarise_samples(found.samples, None, "")
    memory = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return Cost(name, len(history.patches), memory, seconds)


def main() -> None:
    """Measure, print, write."""
    parser = options(__doc__)
    parser.add_argument("--frames", type=int, default=FRAMES, help="of each log")
    arguments = parser.parse_args()
    picture_folder(arguments)
    costs = []
    with TemporaryDirectory() as folder:
        for name, part in CORNERS.items():
            path = Path(folder, f"{name}.npz")
            container.write(long_log(1000, part), path)
            cost(name, path)  # compiles or loads the kernels
            container.write(long_log(arguments.frames, part), path)
            costs.append(cost(name, path))
    rows = [
        (one.log, one.touches, *(one.seconds[s] for s in STAGES), sum(one.seconds.values()), one.memory / GIB)
        for one in costs
    ]
    columns = (f"{arguments.frames:,} frames of 2×2", "touches", *(f"{stage}, s" for stage in STAGES), "all, s", "GiB")
    made = {"long log": table(columns, rows)}
    print(made["long log"])
    write([asdict(one) for one in costs], made, arguments, "long_log.json")


if __name__ == "__main__":
    main()
