"""False alarms and delays of the surface-change alarm: `python -m benchmarks.estimators.change_alarm`.

Grasps of one material have levels of friction that scatter by τ (normal, or log-normal with heavier tails), each with
the error of its own samples. Without a change: false alarms in 1,000 grasps after a reference, an alarm being answered
by a new beginning. With one: friction falls by 20 % after so many grasps; the part of the series that is found within
five grasps, and the median delay. Writes change_alarm.json.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from estimators.change_alarm import ChangeAlarm

KINDS = ("normal", "Student-t, 5 degrees")
BETWEEN = (0.02, 0.05, 0.07, 0.1, 0.15)
BEFORE = (5, 10, 30)
ERROR, DROP, SOON = 0.01, 0.2, 5
QUIET = 200
"""Grasps of a series without a change."""


def levels(kind: str, between: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Friction of grasps as parts of the law's, with the error of their samples."""
    score = rng.standard_normal(count)
    if kind != KINDS[0]:
        score = rng.standard_t(5.0, count) / np.sqrt(5.0 / 3.0)
    return 1.0 + between * score + ERROR * rng.standard_normal(count)


def false_alarms(kind: str, between: float, series: int) -> float:
    """Alarms in 1,000 grasps of surfaces that stay as they are."""
    alarms = 0
    for seed in range(series):
        alarm = ChangeAlarm.init()
        for level in levels(kind, between, QUIET, np.random.default_rng([seed, 0])):
            alarm = alarm.step(float(level), ERROR**2)
            if alarm.changed:
                alarms, alarm = alarms + 1, ChangeAlarm.init()
    return 1000.0 * alarms / (series * QUIET)


def delays(kind: str, between: float, before: int, series: int) -> np.ndarray:
    """Grasps after a drop until the alarm, [series]; infinite where it is not found within twenty."""
    found = np.full(series, np.inf)
    for seed in range(series):
        told = levels(kind, between, before + 20, np.random.default_rng([seed, 1]))
        told[before:] *= 1.0 - DROP
        alarm = ChangeAlarm.init()
        for count, level in enumerate(told):
            alarm = alarm.step(float(level), ERROR**2)
            if alarm.changed and count >= before:
                found[seed] = count - before + 1
                break
            if alarm.changed:
                alarm = ChangeAlarm.init()
    return found


def main() -> None:
    """Run the campaign and print it as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"))
    parser.add_argument("--series", type=int, default=100)
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    for kind in KINDS:
        for between in BETWEEN:
            quiet = false_alarms(kind, between, options.series)
            late = [delays(kind, between, before, options.series) for before in BEFORE]
            soon = [100.0 * float(np.mean(each <= SOON)) for each in late]
            middle = [float(np.median(each)) for each in late]
            rows.append({"kind": kind, "between": between, "false": quiet, "soon": soon, "median": middle})
            cells = " | ".join(f"{part:.0f}%, {delay:g}" for part, delay in zip(soon, middle, strict=True))
            print(f"| {kind} | {between:g} | {quiet:.2f} | {cells} |", flush=True)
    (options.output / "change_alarm.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
