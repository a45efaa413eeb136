"""What faults of real sensors cost: `python -m benchmarks.detector_faults [--scenes SET] [--page docs/detector.md]`.

Each fault is put into scenes that are observed with 1 µm and 2 mN of white noise, by default those of an independent
solver, which nothing was chosen on. F1 of method "filter" with forces, from displacement alone and with the object's
pose, and of the paper's method with forces beside it. Writes detector_faults.json.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter

from benchmarks.detector_accuracy import FORCE_NOISE, score
from benchmarks.detector_scenes import Case, cases, observed
from benchmarks.pages import options, picture_folder, table, write
from slipcore import GraspLog, detect_slip

MARKER_NOISE = 1e-6
INPUTS = ("force", "displacement", "motion")
Fault = Callable[[GraspLog, np.random.Generator], GraspLog]


@dataclass(frozen=True, slots=True)
class Cost:
    """Mean F1 over the scenes under a fault."""

    fault: str
    force: float
    displacement: float
    motion: float
    strain_rate: float


def moved(log: GraspLog, by: np.ndarray) -> GraspLog:
    """With something added to the displacement."""
    return replace(log, displacement=log.displacement + by)


def shake(size: float) -> Fault:
    """All markers move alike, as under a camera that shakes: white, ``size`` m along x and along y."""
    return lambda log, rng: moved(log, size * rng.standard_normal((len(log), 1, 1, 3)) * [1.0, 1.0, 0.0])


def pose_noise(size: float) -> Fault:
    """The given pose is off by white noise of ``size`` m, and the same at 3 mm from its middle."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        if log.object_pose is None:
            return log
        noise = size * rng.standard_normal(log.object_pose.shape) * [1.0, 1.0, 1.0 / 3e-3]
        return replace(log, object_pose=log.object_pose + noise)

    return fault


def correlated(size: float, memory: float = 0.9) -> Fault:
    """Each coordinate errs by an autoregressive process of standard deviation ``size`` m."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        noise = size * rng.standard_normal(log.displacement.shape)
        for k in range(1, len(log)):
            noise[k] = memory * noise[k - 1] + np.sqrt(1.0 - memory**2) * noise[k]
        return moved(log, noise)

    return fault


def rounded(step: float) -> Fault:
    """Displacement is told in steps, m."""
    return lambda log, _: replace(log, displacement=step * np.round(log.displacement / step))


def smoothed(width: float) -> Fault:
    """Displacement and forces are smoothed by a Gaussian kernel, standard deviation in elements."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        over = (0.0, width, width, 0.0)
        force = None if log.force is None else gaussian_filter(log.force, over, mode="nearest")
        return replace(log, displacement=gaussian_filter(log.displacement, over, mode="nearest"), force=force)

    return fault


def lost(share: float) -> Fault:
    """A share of the markers is lost from the beginning, and said to be."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        seen = rng.random(log.grid) >= share
        return replace(log, observed=np.broadcast_to(seen, log.displacement.shape[:3]).copy())

    return fault


def frozen(share: float) -> Fault:
    """A share of the markers stays where it was at half of the time."""

    def fault(log: GraspLog, rng: np.random.Generator) -> GraspLog:
        displacement, still, half = log.displacement.copy(), rng.random(log.grid) < share, len(log) // 2
        displacement[half:, still] = displacement[half, still]
        return replace(log, displacement=displacement)

    return fault


def hysteresis(size: float) -> Fault:
    """A marker follows its place only beyond ``size`` m: the play operator, along each axis."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        displacement = log.displacement.copy()
        for k in range(1, len(log)):
            displacement[k] = np.clip(displacement[k - 1], displacement[k] - size, displacement[k] + size)
        return replace(log, displacement=displacement)

    return fault


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
    "a tenth of the markers lost": lost(0.1),
    "5 % of the markers freeze": frozen(0.05),
    "hysteresis of 5 µm": hysteresis(5e-6),
}


CALIBRATED = {"correlated noise (0.9), 3 µm": 3e-6, "correlated noise (0.9), 10 µm": 1e-5}
"""Faults of which a calibration of the sensor tells the detector, by the noise in m."""

COLUMNS = (
    "fault",
    "filter, forces",
    "filter, displacement alone",
    "filter, forces and object motion",
    "strain_rate, forces",
)


def measure(scenes: list[Case]) -> Iterator[Cost]:
    """What each fault costs."""
    for name, fault in FAULTS.items():
        filtered = {inputs: _mean(scenes, fault, inputs, "filter") for inputs in INPUTS}
        yield Cost(name, **filtered, strain_rate=_mean(scenes, fault, "force", "strain_rate"))
        if name in CALIBRATED:
            known = {"displacement_floor": float(np.hypot(CALIBRATED[name], MARKER_NOISE))}
            told = {inputs: _mean(scenes, fault, inputs, "filter", **known) for inputs in INPUTS}
            yield Cost(f"{name}, calibrated", **told, strain_rate=np.nan)


def _mean(scenes: list[Case], fault: Fault, inputs: str, method: str, **known: float) -> float:
    found = []
    for seed, case in enumerate(scenes):
        log = fault(observed(case.log, MARKER_NOISE, FORCE_NOISE, inputs, seed), np.random.default_rng(1000 + seed))
        found.append(score(case, log, detect_slip(log, method, sensor_model=None, **known)).f1)
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
    rows = list(measure(slipping))
    made = {"faults": table(COLUMNS, [tuple(asdict(row).values()) for row in rows])}
    print(made["faults"])
    write([asdict(row) for row in rows], made, arguments, "detector_faults.json")


if __name__ == "__main__":
    main()
