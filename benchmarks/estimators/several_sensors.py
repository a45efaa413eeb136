"""Materials recorded by several sensors, each with its gain: `python -m benchmarks.estimators.several_sensors`.

Grasps of the generator of `benchmarks.estimators.scatter` ("grasp and place"), whose friction each sensor shows times 1
plus its gain, drawn from a normal distribution. Each material is fitted as of grasps of known sensors, and once more as
if nobody knew whose they are. For each: the part of 95 % intervals that hold the law's friction at the working point;
of intervals of a contact that hold its friction in a new grasp by a new sensor; how much more often that lies below the
quantile of 1e-2 than it was asked to; and the width of the first. Then what is said of the gains, and the CPU time of a
fit.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from time import process_time

import numpy as np
from scipy import stats

import estimators
from benchmarks.estimators.scatter import CONTACT, KINDS, TRUTH, WORKING_POINT, factor, grasp
from estimators import FrictionModel, Moments

KIND = KINDS["grasp and place"]
CASES = ((1, 0.0, 6), (2, 0.0, 3), (2, 0.05, 3), (2, 0.1, 3), (3, 0.05, 3), (3, 0.1, 3), (6, 0.1, 3), (3, 0.1, 10))
"""Sensors, standard deviation of their gains, and grasps by each."""
ROW = np.array([1.0, *WORKING_POINT])
LAW = float(TRUTH @ ROW)
ASKED = 1e-2
SAID = {"sensor": "apart", "its": "agree", "a": "hidden"}
"""What the note on sensors says, by its first word."""


def material(sensors: int, spread: float, each: int, rng: np.random.Generator) -> list[Moments]:
    """Moments of so many grasps by each of so many sensors."""
    grasps = []
    for sensor, gain in enumerate(spread * rng.standard_normal(sensors)):
        for _ in range(each):
            seen = grasp(KIND, rng)
            shown = (1.0 + gain) * seen.friction_coefficient
            seen = replace(seen, friction_coefficient=shown, tangential_force=shown * seen.normal_force)
            grasps.append(Moments.from_samples(replace(seen, sensor=f"sensor {sensor}")))
    return grasps


def outcomes(model: FrictionModel, shown: np.ndarray) -> list[float]:
    """Whether the law's friction is held; the parts of what contacts have ``shown`` that are held, and that lie below
    the asked quantile, over what was asked; and the width of the first interval in parts of friction.
    """
    half = stats.t(model.degrees_of_freedom).ppf(0.975) * float(np.sqrt(ROW @ model.covariance @ ROW))
    expected = float(model.predict(*WORKING_POINT))
    low, high, least = (
        float(model.predict(*WORKING_POINT, level, of="contact", elements=CONTACT)) for level in (0.025, 0.975, ASKED)
    )
    held, slips = np.mean((shown >= low) & (shown <= high)), np.mean(shown < least) / ASKED
    return [float(abs(expected - LAW) <= half), float(held), float(slips), 2.0 * half / LAW]


def cell(case: tuple[int, float, int], seeds: int) -> str:
    """A row of the table."""
    sensors, spread, each = case
    found: dict[str, list[list[float]]] = {"known": [], "unknown": []}
    said, seconds = Counter[str](), 0.0
    for seed in range(seeds):
        rng = np.random.default_rng([seed, sensors, each])
        grasps = material(sensors, spread, each, rng)
        gains, own = 1.0 + spread * rng.standard_normal(2000), factor(KIND, rng.standard_normal(2000))
        error = np.hypot(KIND.between_places, KIND.within) / np.sqrt(CONTACT) * rng.standard_normal(2000)
        shown = gains * own * LAW + error
        begin = process_time()
        model = estimators.fit(grasps, method="hierarchical")
        seconds += process_time() - begin
        said[SAID[model.notes[0].split()[0]] if model.notes else "one"] += 1
        found["known"].append(outcomes(model, shown))
        unlabelled = estimators.fit([part.of_sensor("") for part in grasps], method="hierarchical")
        found["unknown"].append(outcomes(unlabelled, shown))
    means = [np.mean(found[name], axis=0) for name in ("known", "unknown")]
    told = [" ".join(f"{mean[column] * scale:.{digits}f}" for mean in means) for column, scale, digits in COLUMNS]
    notes = ", ".join(f"{name} {100.0 * count / seeds:.0f} %" for name, count in said.most_common())
    cells = [str(sensors), f"{spread:g}", str(each), *told, notes, f"{1e3 * seconds / seeds:.0f} ms"]
    return f"| {' | '.join(cells)} |"


COLUMNS: Sequence[tuple[int, float, int]] = ((0, 100.0, 0), (1, 100.0, 0), (2, 1.0, 2), (3, 1.0, 2))
"""Of ``outcomes``: which, times what, with how many digits."""


def main() -> None:
    """Run the campaign and print it as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    options = parser.parse_args()
    print(
        "| sensors | gains | grasps of each | law held, % | new sensor held, % | slips at 0.01 | width | says | CPU |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for case in CASES:
        print(cell(case, options.seeds), flush=True)


if __name__ == "__main__":
    main()
