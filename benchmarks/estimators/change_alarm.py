"""False alarms and delays of the surface-change alarm: `python -m benchmarks.estimators.change_alarm`.

Grasps of one material have levels of friction that scatter by τ (normal, or log-normal with heavier tails), each with
the error of its own samples. Without a change: false alarms in 1,000 grasps after a reference, an alarm being answered
by a new beginning. With one: friction falls by 20 % after so many grasps; the part of the series that is found within
five grasps, and the median delay. The same by who knows level, scatter and size of the drop (Shiryaev–Roberts with
normal levels at the same rate, the quickest that there is but for one grasp: Pollak, 1985, Annals of Statistics
13:206). And the fall that five more grasps are said to show, at the end of the grasps before. Writes change_alarm.json.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from estimators.change_alarm import ChangeAlarm, noticeable
from estimators.defaults import ALARM

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


def known(kind: str, between: float, series: int) -> np.ndarray:
    """Grasps after a drop until the alarm of who knows all but when, [series]; infinite beyond twenty."""
    found, variance = np.full(series, np.inf), between**2 + ERROR**2
    for seed in range(series):
        evidence = 0.0
        told = levels(kind, between, 20, np.random.default_rng([seed, 2])) - DROP
        for count, level in enumerate(told, 1):
            evidence = (1.0 + evidence) * np.exp(((level - 1.0) ** 2 - (level - 1.0 + DROP) ** 2) / (2.0 * variance))
            if evidence >= 1.0 / ALARM.rate:
                found[seed] = count
                break
    return found


def falls(kind: str, between: float, before: int, series: int) -> float:
    """The least fall that would be noticed, after so many grasps (median)."""
    told = (levels(kind, between, before, np.random.default_rng([seed, 1])) for seed in range(series))
    return float(np.median([noticeable(ChangeAlarm(levels=tuple(x), variances=(ERROR**2,) * before)) for x in told]))


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
            late.append(known(kind, between, options.series))
            soon = [100.0 * float(np.mean(each <= SOON)) for each in late]
            middle = [float(np.median(each)) for each in late]
            fall = [falls(kind, between, before, options.series) for before in BEFORE]
            figures = {"false": quiet, "soon": soon, "median": middle, "noticeable": fall}
            rows.append({"kind": kind, "between": between, **figures})
            cells = " | ".join(f"{part:.0f}%, {delay:g}" for part, delay in zip(soon, middle, strict=True))
            told = " ".join(f"{part:.0%}" for part in fall)
            print(f"| {kind} | {between:g} | {quiet:.2f} | {cells} | {told} |", flush=True)
    (options.output / "change_alarm.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
