"""What faults of real sensors cost: `python -m benchmarks.detector.faults [--scenes SET] [--page docs/detector.md]`.

Each fault is put into scenes that are observed with 1 µm and 2 mN of white noise, by default those of an independent
solver, which nothing was chosen on. F1 of method "filter" with forces, from displacement alone and with the object's
pose, and of the paper's method with forces beside it; and under each noise what forces that contradict the motion cost
on the set ``scoring``. Writes detector_faults.json.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from benchmarks.detector.accuracy import FORCE_NOISE, NOISES, score
from benchmarks.detector.scenes import PITCH, Case, cases, observed
from benchmarks.pages import options, picture_folder, table, write
from service.slip_benchmark.faults import (
    Fault,
    changed_forces,
    correlated,
    crosstalk,
    dome_forces,
    faded,
    frozen,
    hysteresis,
    lagging,
    late,
    lost,
    pose_noise,
    rounded,
    shake,
    smoothed,
    smoothed_then_noisy,
    stuck,
    tilted,
)
from slipcore import GraspLog, SlipHistory, detect_slip

MARKER_NOISE = 1e-6
INPUTS = ("force", "displacement", "motion")
Judge = Callable[[Case, GraspLog, SlipHistory], float]


@dataclass(frozen=True, slots=True)
class Cost:
    """Mean F1 over the scenes under a fault."""

    fault: str
    force: float
    displacement: float
    motion: float
    strain_rate: float


LOST = "a tenth of the markers lost"
SMOOTHED_THEN_NOISY = "smoothing over 1 element, then 0.5 µm of noise"

FAULTS: dict[str, Fault] = {
    "none": lambda log, _: log,
    "common shake, 3 µm": shake(3e-6),
    "common shake, 10 µm": shake(1e-5),
    "noise of the pose, 3 µm": pose_noise(3e-6),
    "noise of the pose, 10 µm": pose_noise(1e-5),
    "correlated noise (0.9), 3 µm": correlated(3e-6),
    "correlated noise (0.9), 10 µm": correlated(1e-5),
    "rounding to 5 µm": rounded(5e-6),
    "rounding to 20 µm": rounded(2e-5),
    "smoothing over ½ element": smoothed(0.5),
    "smoothing over 1 element": smoothed(1.0),
    SMOOTHED_THEN_NOISY: smoothed_then_noisy(1.0, 5e-7),
    LOST: lost(0.1),
    "5 % of the markers freeze": frozen(0.05),
    "5 % of the markers lag by 0.1 s": lagging(0.05, 0.1),
    "hysteresis of 5 µm": hysteresis(5e-6),
}

FORCE_FAULTS: dict[str, Fault] = {
    "none": lambda log, _: log,
    "forces tilted by 5°": tilted(5.0),
    "forces tilted by 15°": tilted(15.0),
    "forces of a dome of 20°": dome_forces(20.0),
    "crosstalk of 10 %": crosstalk(0.1),
    "crosstalk of 30 %": crosstalk(0.3),
    "normal gain falls to a half": faded(slice(2, 3)),
    "tangential gain falls to a half": faded(slice(0, 2)),
    "forces 0.1 s late": late(0.1),
    "forces 0.5 s late": late(0.5),
    "forces freeze at half of the time": changed_forces(stuck),
    "sign turned": changed_forces(np.negative),
    "rows for columns": changed_forces(lambda force: force.swapaxes(1, 2).copy()),
}
"""Faults of forces alone; the lattices are square."""

CALIBRATED: dict[str, dict[str, float]] = {
    "correlated noise (0.9), 3 µm": {"displacement_floor": float(np.hypot(3e-6, MARKER_NOISE))},
    "correlated noise (0.9), 10 µm": {"displacement_floor": float(np.hypot(1e-5, MARKER_NOISE))},
    SMOOTHED_THEN_NOISY: {"marker_kernel": PITCH, "smoothing_noise": 3e-3},
}
"""Faults of which the detector may be told, and what: the noise, m, or the kernel, m, and the noise after it."""

CONTRADICTING = (
    "none",
    "crosstalk of 10 %",
    "crosstalk of 30 %",
    "forces 0.1 s late",
    "forces 0.5 s late",
    "forces freeze at half of the time",
)
"""Faults of forces that the motion contradicts."""

COLUMNS = (
    "fault",
    "filter, forces",
    "filter, displacement alone",
    "filter, forces and object motion",
    "strain_rate, forces",
)


def measure(scenes: list[Case], faults: dict[str, Fault]) -> Iterator[Cost]:
    """What each fault costs."""
    for name, fault in faults.items():
        filtered = {inputs: mean_f1(scenes, fault, inputs, "filter") for inputs in INPUTS}
        yield Cost(name, **filtered, strain_rate=mean_f1(scenes, fault, "force", "strain_rate"))
        if name in CALIBRATED:
            told = {inputs: mean_f1(scenes, fault, inputs, "filter", **CALIBRATED[name]) for inputs in INPUTS}
            yield Cost(f"{name}, calibrated", **told, strain_rate=np.nan)
        if name == LOST:
            for row, judge in (("filled", _filled), ("of observed ones", _observed)):
                judged = {inputs: mean_f1(scenes, fault, inputs, "filter", judge=judge) for inputs in INPUTS}
                yield Cost(
                    f"{name}, {row}", **judged, strain_rate=mean_f1(scenes, fault, "force", "strain_rate", judge=judge)
                )


def contradicted(scenes: Sequence[Case]) -> dict[str, dict[float, float]]:
    """Mean F1 from displacement alone, and with forces that have a fault, under each noise, m."""
    found = {"displacement alone": {noise: _under(scenes, "none", "displacement", noise) for noise in NOISES}}
    for name in CONTRADICTING:
        found[name] = {noise: _under(scenes, name, "force", noise) for noise in NOISES}
    return found


def _under(scenes: Sequence[Case], fault: str, inputs: str, noise: float) -> float:
    of_force = FORCE_NOISE if noise else 0.0
    return mean_f1(scenes, FORCE_FAULTS[fault], inputs, "filter", noise=(noise, of_force))


def _filled(case: Case, log: GraspLog, history: SlipHistory) -> float:
    return score(case, log, history.filled()).f1


def _observed(case: Case, log: GraspLog, history: SlipHistory) -> float:
    assert log.truth is not None
    assert log.observed is not None
    truth = replace(log.truth, contact=log.truth.contact & log.observed)
    return score(case, replace(log, truth=truth), history).f1


def _all(case: Case, log: GraspLog, history: SlipHistory) -> float:
    return score(case, log, history).f1


def mean_f1(
    scenes: Sequence[Case],
    fault: Fault,
    inputs: str,
    method: str,
    *,
    noise: tuple[float, float] = (MARKER_NOISE, FORCE_NOISE),
    judge: Judge = _all,
    **known: float,
) -> float:
    """Mean F1 over scenes that are seen with ``noise``, m and N, and a fault; ``known``: what the method is told."""
    found = []
    for seed, case in enumerate(scenes):
        log = fault(observed(case.log, *noise, inputs, seed), np.random.default_rng(1000 + seed))
        found.append(judge(case, log, detect_slip(log, method, sensor_model=None, **known)))
    return float(np.mean(found))


def main() -> None:
    """Measure, print and store."""
    parser = options(__doc__)
    parser.add_argument("--scenes", default="reference", choices=("reference", "tuning", "scoring"))
    arguments = parser.parse_args()
    slipping = [case for case in cases(arguments.scenes) if not case.name.startswith("press")]
    if not slipping:
        raise SystemExit(f"no scenes of the set {arguments.scenes} are there")
    picture_folder(arguments)
    costs = {"faults": list(measure(slipping, FAULTS)), "force faults": list(measure(slipping, FORCE_FAULTS))}
    found = contradicted([case for case in cases("scoring") if not case.name.startswith("press")])
    made = {name: table(COLUMNS, [tuple(asdict(row).values()) for row in rows]) for name, rows in costs.items()}
    columns = ("forces", *(f"{1e6 * noise:g} µm" for noise in NOISES))
    made["contradicting forces"] = table(columns, [(name, *row.values()) for name, row in found.items()])
    print("\n\n".join(made.values()))
    numbers: dict[str, object] = {name: [asdict(row) for row in rows] for name, rows in costs.items()}
    numbers["contradicting forces"] = {name: list(row.values()) for name, row in found.items()}
    write(numbers, made, arguments, "detector_faults.json")


if __name__ == "__main__":
    main()
