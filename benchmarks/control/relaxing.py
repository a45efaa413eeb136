"""What it is worth to relax a model's grip: `python -m benchmarks.control.relaxing [--seeds 6] [--page PAGE]`.

The controller with a model, right or wrong, does each task of benchmarks/control from the same seeds as it is, and
without relaxing under a load at rest (`relax_rate` at the least that it may be). Writes control_relaxing.json.
"""

import argparse
import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.control.__main__ import COLUMNS
from benchmarks.control.episodes import run, world_of
from benchmarks.control.outcomes import Outcome, outcome_of, scores
from benchmarks.control.strategies import with_model
from benchmarks.control.tasks import TASKS
from benchmarks.pages import options, table, write
from stiction_client.controller import gains

STILL = gains()["relax_rate"].low
"""1/s: a grip that is relaxed so slowly is not."""
FACTORS = {"known": 1.0, "model 40 % too high": 1.4, "model 40 % too low": 0.6}
"""Friction that the model has over the material's."""
VARIANTS = {
    f"{name}{suffix}": partial(with_model, factor, **changed)
    for name, factor in FACTORS.items()
    for suffix, changed in (("", {}), (", not relaxed", {"relax_rate": STILL}))
}


def main() -> None:
    """Run and write."""
    arguments = _arguments()
    found = [each for each in episodes(arguments.seeds, arguments.keep) if each.seed < arguments.seeds]
    rows = [scores(name, [each for each in found if each.strategy == name]) for name in VARIANTS]
    tables = {"control relaxing": table(list(COLUMNS.values()), [[row[key] for key in COLUMNS] for row in rows])}
    print(tables["control relaxing"])
    write({"seeds": arguments.seeds, "rows": rows}, tables, arguments, "control_relaxing.json")


def _arguments() -> argparse.Namespace:
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=6, help="episodes of each variant with each task")
    parser.add_argument("--keep", type=Path, help="file of outcomes, one a line; what it has is not run again")
    return parser.parse_args()


def episodes(seeds: int, keep: Path | None) -> Iterator[Outcome]:
    """Each task by each variant, from as many ``seeds``; what is kept first."""
    lines = [] if keep is None or not keep.exists() else keep.read_text(encoding="utf-8").splitlines()
    kept = [Outcome(*json.loads(line)) for line in lines]
    yield from kept
    done = {each[:3] for each in kept}
    for seed in range(seeds):
        for task in TASKS:
            world = world_of(task, seed)
            for name in VARIANTS:
                if (name, task.name, seed) in done:
                    continue
                each = [VARIANTS[name](task, world, finger) for finger in range(len(task.friction))]
                found = outcome_of(run(task, world, each, seed), name, seed)
                if keep is not None:
                    with keep.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(found) + "\n")
                yield found


if __name__ == "__main__":
    main()
