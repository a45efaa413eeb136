"""The queue of ingests, simulated: `python -m benchmarks.service.queue [--output FOLDER] [--page docs/scale.md]`.

What a log and a fit cost in CPU is measured first, then days of arrivals are simulated event by event: at random or in
bursts, with so many workers, and with a fit after each log, as the pipeline has it, or one for all logs of a material
that are in the queue. A fit whose material got further samples under it is done again, as in the pipeline. Writes
queue.json and queue.png. Tests hold the simulation against Erlang's formula and that of Pollaczek and Khinchine.
"""

import heapq
import math
import time
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import asdict, dataclass
from itertools import product

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import estimators
import slipcore
from benchmarks.pages import options, picture_folder, save, table, write
from estimators import Moments
from service.jobs.fit_material import MOST_REPEATS
from slipcore.contact import RampSchedule, tangential_ramp

Array = NDArray[np.float64]
Work = Generator[float, float, None]
"""A job: yields the seconds that it needs next, and is sent the time at which they are over."""

DAY = 86400.0
MATERIALS, BURST = 10, 50
ARRIVALS = 20_000
OVERHEAD = 0.04
"""s of an ingest that are no computing: two waits for the disk, and the way between processes."""


@dataclass(frozen=True, slots=True)
class Costs:
    """Seconds: of an ``ingest`` without its fit, and of a fit, ``fit`` + ``fit_per_log`` · logs of the material."""

    ingest: float
    fit: float
    fit_per_log: float


@dataclass(frozen=True, slots=True)
class Outcome:
    """A scenario, the share of their time that the workers are busy, and percentiles in s: of the wait for a worker,
    and from arrival to the fit that has the log in it.
    """

    grasps_a_day: float
    arrivals: str
    workers: int
    logs_of_a_material: int
    refits: str
    busy: float
    wait_p50: float
    wait_p99: float
    fitted_p50: float
    fitted_p99: float
    fits_per_log: float


def simulate(arrivals: Array, job: Callable[[int], Work], workers: int) -> tuple[Array, float]:
    """First come, first served: seconds that each job waited for a worker, and seconds that workers were busy.

    ``arrivals`` [n] s, growing; ``job(k)`` is the work of the k-th.
    """
    waits, busy, free, k = np.empty(len(arrivals)), 0.0, workers, 0
    waiting: deque[int] = deque()
    events: list[tuple[float, int, Work]] = []

    def go_on(work: Work, moment: float, number: int, is_new: bool = False) -> bool:
        """Whether there is more of the job to do; then its next part is begun."""
        nonlocal busy
        try:
            seconds = next(work) if is_new else work.send(moment)
        except StopIteration:
            return False
        busy += seconds
        heapq.heappush(events, (moment + seconds, number, work))
        return True

    while k < len(arrivals) or events:
        if events and (k == len(arrivals) or events[0][0] <= arrivals[k]):
            moment, number, work = heapq.heappop(events)
            free += not go_on(work, moment, number)
        else:
            moment = float(arrivals[k])
            waiting.append(k)
            k += 1
        while free and waiting:
            first = waiting.popleft()
            waits[first] = moment - arrivals[first]
            free -= go_on(job(first), moment, first, is_new=True)
    return waits, busy


class Ingests:
    """The pipeline's jobs: a log's samples, then the fit of its material; ``fitted`` [n] tells when each is in one."""

    def __init__(
        self, costs: Costs, moments: Array, material: NDArray[np.int64], logs_before: int, coalesced: bool
    ) -> None:
        self._costs, self._material, self._coalesced = costs, material, coalesced
        self._logs_before = logs_before
        self._arrivals = [moments[material == number] for number in range(MATERIALS)]
        self._begun, self._covered = [0] * MATERIALS, [0] * MATERIALS
        self._came: list[list[int]] = [[] for _ in range(MATERIALS)]
        self._is_fitting = [False] * MATERIALS
        self.fitted = np.full(len(material), np.nan)
        self.fits = 0

    def job(self, k: int) -> Work:
        """The ingest of the k-th log."""
        material = int(self._material[k])
        self._begun[material] += 1
        moment = yield self._costs.ingest
        self._came[material].append(k)
        if self._coalesced and (self._is_fitting[material] or self._any_left(material, moment)):
            return  # whoever is at the fit does it once more, or the next one does it
        self._is_fitting[material] = True
        yield from self._fit(material)
        self._is_fitting[material] = False

    def _any_left(self, material: int, moment: float) -> bool:
        """Whether a log of the material waits for a worker or is being looked at."""
        arrived = int(np.searchsorted(self._arrivals[material], moment, side="right"))
        return arrived > self._begun[material] or self._begun[material] > len(self._came[material])

    def _fit(self, material: int) -> Work:
        came, tries = self._came[material], 0
        while True:
            count = len(came)
            moment = yield self._costs.fit + self._costs.fit_per_log * (self._logs_before + count)
            self.fits += 1
            tries += 1
            is_newest, is_last = count == len(came), tries > MOST_REPEATS and not self._coalesced
            if is_newest or is_last or self._coalesced:  # else it is not stored
                self.fitted[came[self._covered[material] : count]] = moment
                self._covered[material] = max(self._covered[material], count)
            if is_newest or is_last:
                return


def arrivals(rate: float, count: int, burst: int, generator: np.random.Generator) -> Array:
    """Moments [count] s at a mean ``rate`` 1/s: bursts of so many at once, themselves at random."""
    bursts = np.cumsum(generator.exponential(burst / rate, math.ceil(count / burst)))
    return np.repeat(bursts, burst)[:count]


def erlang_c_wait(rate: float, seconds: float, workers: int) -> float:
    """Mean wait in s of a queue M/M/c (Erlang 1917); ``seconds`` is the mean service."""
    offered = rate * seconds
    terms = [offered**k / math.factorial(k) for k in range(workers)]
    last = offered**workers / math.factorial(workers) * workers / (workers - offered)
    return last / (sum(terms) + last) * seconds / (workers - offered)


def pollaczek_khinchine_wait(rate: float, seconds: float, variance: float = 0.0) -> float:
    """Mean wait in s of a queue M/G/1 whose service has this mean and variance."""
    return rate * (seconds**2 + variance) / (2.0 * (1.0 - rate * seconds))


def measure() -> Costs:
    """CPU seconds, medians: a log of 200 frames of 20×20 with forces, and fits of 100 and of 1,000 logs."""
    schedule = RampSchedule(rest=0.3, press=1.0, settle=0.4, shear=4.0, hold=0.95)
    log = tangential_ramp(points=20, schedule=schedule, marker_noise=1e-6, force_noise=2e-3, seed=1)

    def detect() -> Moments:
        history = slipcore.detect_slip(log, lookahead=slipcore.LOOKAHEAD)
        return Moments.from_samples(slipcore.collect_samples(log, history))

    moments = detect()
    few, many = (cpu(lambda n=n: estimators.fit([moments] * n, method="ols")) for n in (100, 1000))  # type: ignore[misc]
    per_log = (many - few) / 900.0
    return Costs(cpu(detect) + OVERHEAD, max(few - 100.0 * per_log, 0.0), per_log)


def cpu(do: Callable[[], object], times: int = 7) -> float:
    """Median CPU seconds."""
    taken = []
    for _ in range(times):
        begin = time.process_time()
        do()
        taken.append(time.process_time() - begin)
    return float(np.median(taken))


def scenario(costs: Costs, grasps: float, burst: int, workers: int, logs: int, coalesced: bool) -> Outcome:
    """Simulate until the queue has run empty; the first tenth is left out of the percentiles."""
    generator = np.random.default_rng(1)
    moments = arrivals(grasps / DAY, ARRIVALS, burst, generator)
    ingests = Ingests(costs, moments, generator.integers(0, MATERIALS, ARRIVALS), logs, coalesced)
    waits, busy = simulate(moments, ingests.job, workers)
    assert not np.isnan(ingests.fitted).any()
    settled = slice(ARRIVALS // 10, None)
    fitted = (ingests.fitted - moments)[settled]
    return Outcome(
        grasps,
        "at random" if burst == 1 else f"{burst} at once",
        workers,
        logs,
        "one for all that wait" if coalesced else "after each log",
        busy / (workers * max(moments[-1], np.max(ingests.fitted))),
        *np.percentile(waits[settled], [50, 99]),
        *np.percentile(fitted, [50, 99]),
        ingests.fits / ARRIVALS,
    )


def draw(outcomes: list[Outcome]) -> Figure:
    """How long it takes to the fit, by the logs that a material has."""
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    for axes, pattern in zip(figure.subplots(1, 2, sharey=True), ("at random", f"{BURST} at once"), strict=True):
        chosen = [one for one in outcomes if one.arrivals == pattern]
        for (grasps, workers, refits), style in zip(
            sorted({(o.grasps_a_day, o.workers, o.refits) for o in chosen}),
            ("o-C0", "s--C0", "o-C1", "s--C1", "o-C2", "s--C2", "o-C3", "s--C3"),
            strict=False,
        ):
            these = [o for o in chosen if (o.grasps_a_day, o.workers, o.refits) == (grasps, workers, refits)]
            label = f"{grasps:,.0f} a day, {workers} workers, {refits}"
            axes.plot([o.logs_of_a_material for o in these], [o.fitted_p99 for o in these], style, label=label, ms=4)
        axes.set(xscale="log", yscale="log", xlabel="logs of each material", title=f"logs come {pattern}")
    figure.axes[0].set_ylabel("to the fit, 99th percentile (s)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7)
    return figure


def tables(costs: Costs, outcomes: list[Outcome]) -> dict[str, str]:
    """As Markdown: the two ways to refit beside each other."""
    what = ("busy", "wait p99", "to the fit p50 / p99")
    columns = (
        "grasps a day",
        "they come",
        "workers",
        "logs of a material",
        *what,
        *(f"one for all: {w}" for w in what),
    )
    shown = [one for one in outcomes if one.logs_of_a_material > 100]
    rows = [
        (*_case(each), *_figures(each), *_figures(merged)) for each, merged in zip(shown[::2], shown[1::2], strict=True)
    ]
    measured = [(f"{1e3 * costs.ingest:.0f} ms", f"{1e3 * costs.fit:.1f} ms + {1e6 * costs.fit_per_log:.0f} µs · logs")]
    return {
        "costs of the queue": table(("ingest without fit", "fit by moments"), measured),
        "queue": table(columns, rows),
    }


def _case(one: Outcome) -> tuple[object, ...]:
    return f"{one.grasps_a_day:,.0f}", one.arrivals, one.workers, f"{one.logs_of_a_material:,}"


def _figures(one: Outcome) -> tuple[str, ...]:
    if one.busy > 0.98:
        return "100 %", "grows", "grow"
    return f"{100 * one.busy:.1f} %", f"{one.wait_p99:.2g} s", f"{one.fitted_p50:.2g} / {one.fitted_p99:.2g} s"


def main() -> None:
    """Measure, simulate, print, write."""
    arguments = options(__doc__).parse_args()
    pictures = picture_folder(arguments)
    costs = measure()
    sizes = [(1e3, 1), (1e5, 1), (1e6, 2), (1e6, 4)]
    cases = product(sizes, (1, BURST), (100, 1000, 10_000), (False, True))
    outcomes = [scenario(costs, *size[:1], burst, size[1], logs, merged) for size, burst, logs, merged in cases]
    made = tables(costs, outcomes)
    print("\n\n".join(made.values()))
    save(draw(outcomes), pictures / "queue.png")
    write({"costs": asdict(costs), "outcomes": [asdict(each) for each in outcomes]}, made, arguments, "queue.json")


if __name__ == "__main__":
    main()
