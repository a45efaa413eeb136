"""How many logs an hour a campaign makes: `python -m benchmarks.contact.campaigns [--page docs/simulator.md]`.

One scene of 20 × 20 elements with as many seeds, by processes of this machine and by workers of a Dask cluster on it,
as NPZ and as one Parquet data set. What starts processes, and imports and compiles in them, is done before a clock
starts.
"""

import os
import time
from collections.abc import Iterator
from concurrent.futures import Executor, wait
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from benchmarks.pages import options, picture_folder, save, table, write
from service.jobs.campaign import FORMATS, RequestedAccuracy, run, workers
from slipcore.contact import Scene, simulate

SCENE = "table1_condition1"
PROCESSES, DASK_WORKERS = (1, 2), (1, 2, 4)
ASKED = 12_000
"""Logs an hour of 20 × 20 elements that two cores were asked to make."""


@dataclass(frozen=True, slots=True)
class Rate:
    """``logs`` made ``by`` so many ``workers`` in ``seconds`` by the clock."""

    by: str
    workers: int
    written_as: str
    logs: int
    seconds: float

    @property
    def per_hour(self) -> float:
        """Logs an hour."""
        return 3600.0 * self.logs / self.seconds


@contextmanager
def executor_of(by: str, count: int) -> Iterator[Executor]:
    """Workers that have simulated the scene once."""
    if by == "processes":
        with workers(count) as executor:
            yield warm(executor, count)
        return
    from distributed import LocalCluster

    cluster = LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None)  # type: ignore[no-untyped-call]
    with cluster, workers(1, cluster.scheduler_address) as executor:
        yield warm(executor, count)


def warm(executor: Executor, count: int) -> Executor:
    """Have each of so many workers compile what a simulation needs."""
    wait([executor.submit(simulate, Scene.from_toml(SCENE), seed=seed) for seed in range(4 * count)])
    return executor


def rates(logs: int) -> Iterator[Rate]:
    """Of so many logs each."""
    cases = [("processes", count) for count in PROCESSES] + [("Dask", count) for count in DASK_WORKERS]
    for by, count in cases:
        with executor_of(by, count) as executor:
            for written_as in FORMATS:
                with TemporaryDirectory() as folder:
                    began = time.perf_counter()
                    scenes, seeds = [Scene.from_toml(SCENE)], range(logs)
                    made = list(run(executor, scenes, seeds, Path(folder), RequestedAccuracy(), written_as))
                    seconds = time.perf_counter() - began
                assert not any(outcome.refused for outcome in made)
                yield Rate(by, count, written_as, logs, seconds)
                print(f"{by}, {count}, {written_as}: {3600.0 * logs / seconds:.0f} logs an hour", flush=True)


def draw(found: list[Rate]) -> Figure:
    """Logs an hour by what makes them, and what was asked of two cores."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for shift, written_as in enumerate(FORMATS):
        own = [rate for rate in found if rate.written_as == written_as]
        axes.bar([k + 0.4 * shift for k in range(len(own))], [rate.per_hour for rate in own], 0.4, label=written_as)
    names = [f"{rate.by}, {rate.workers}" for rate in found if rate.written_as == FORMATS[0]]
    axes.set_xticks([k + 0.2 for k in range(len(names))], names)
    axes.axhline(ASKED, color="0.4", ls="--", label="asked of two cores")
    axes.set(ylabel="logs an hour")
    figure.legend(loc="outside upper center", ncols=3, fontsize=8)
    return figure


def main() -> None:
    """Measure, write JSON, a picture and the page's table."""
    parser = options(__doc__)
    parser.add_argument("--logs", type=int, default=120, help="logs of each case")
    arguments = parser.parse_args()
    found = list(rates(arguments.logs))
    rows = [(rate.by, rate.workers, rate.written_as, rate.logs, rate.seconds, rate.per_hour) for rate in found]
    shown = table(("by", "workers", "written as", "logs", "s", "logs an hour"), rows)
    save(draw(found), picture_folder(arguments) / "campaign-rates.png")
    write(
        [asdict(rate) | {"cores": os.cpu_count()} for rate in found],
        {"campaign rates": shown},
        arguments,
        "campaign_rates.json",
    )
    print(shown)


if __name__ == "__main__":
    main()
