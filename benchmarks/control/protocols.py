"""Grip control by protocols that others use: `python -m benchmarks.control.protocols [--seeds 3] [--page PAGE]`.

The strategies of benchmarks/control do two protocols of SimReady (nvidia.github.io/simready-foundation, benchmark
tests), and a test of critical friction: how slippery an object may be that they are told is of rubber on paper, or
learn nothing of, before a lift of 1 N loses it. Writes control_protocols.json.
"""

import numpy as np

from benchmarks.control.__main__ import episode
from benchmarks.control.episodes import Task
from benchmarks.control.outcomes import HELD
from benchmarks.control.strategies import STRATEGIES
from benchmarks.control.tasks import PROTOCOLS, slippery
from benchmarks.pages import options, table, write

FRICTIONS = tuple(round(0.025 * step, 3) for step in range(2, 19))
"""Of the critical-friction test, from 0.05 to what strategies are told."""


def main() -> None:
    """Run and write."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="episodes of each strategy with each protocol")
    arguments = parser.parse_args()
    rows = [row(name, arguments.seeds) for name in STRATEGIES]
    columns = ["held, slip in mm", *(task.name for task in PROTOCOLS), "critical friction", "worst"]
    tables = {"control protocols": table(columns, rows)}
    print(tables["control protocols"])
    write({"seeds": arguments.seeds, "rows": rows}, tables, arguments, "control_protocols.json")


def row(name: str, seeds: int) -> list[object]:
    """One strategy: how often it held, and let go when told to; and the critical friction, median and largest."""
    critical = [critical_friction(name, seed) for seed in range(seeds)]
    return [name, *(_protocol(name, task, seeds) for task in PROTOCOLS), float(np.median(critical)), max(critical)]


def _protocol(name: str, task: Task, seeds: int) -> str:
    episodes = [episode(task, name, seed) for seed in range(seeds)]
    slipped = [float(each.slipped[-1].max()) for each in episodes]
    passed = sum(slip < HELD and each.freed for slip, each in zip(slipped, episodes, strict=True))
    return f"{passed}/{seeds}, {1e3 * max(slipped):.1f}"


def critical_friction(name: str, seed: int) -> float:
    """The least friction of an object that a strategy still lifts, by bisection; NaN where it lifts none."""
    low, high = -1, len(FRICTIONS) - 1
    if not lifts(name, FRICTIONS[high], seed):
        return float("nan")
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if lifts(name, FRICTIONS[middle], seed) else (middle, high)
    return FRICTIONS[high]


def lifts(name: str, friction: float, seed: int) -> bool:
    """Whether a strategy lifts an object of this friction."""
    return bool(episode(slippery(friction), name, seed).slipped[-1].max() < HELD)


if __name__ == "__main__":
    main()
