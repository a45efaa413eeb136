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
from slipcore.frames import FloatArray

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


def reforced(change: Callable[[FloatArray], FloatArray]) -> Fault:
    """With other forces, where there are any."""
    return lambda log, _: log if log.force is None else replace(log, force=change(log.force))


def tilted(angle: float) -> Fault:
    """Forces are told in a frame that is turned about y by an angle in degrees: all normals err by so much."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return reforced(lambda force: force @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]))


def domed(angle: float) -> Fault:
    """Forces on a dome are told as if it were flat: they are tilted outwards by an angle in degrees at its edge."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        if log.force is None:
            return log
        out = log.position[..., :2] - log.position[..., :2].mean(axis=(0, 1))
        far = np.hypot(*np.moveaxis(out, -1, 0))
        tilt, out = np.radians(angle) * far / far.max(), out / np.maximum(far, 1e-12)[..., None]
        radial, normal = (log.force[..., :2] * out).sum(axis=-1), log.force[..., 2]
        more = np.cos(tilt) * radial + np.sin(tilt) * normal - radial
        sideways = log.force[..., :2] + more[..., None] * out
        return replace(
            log, force=np.concatenate([sideways, (np.cos(tilt) * normal - np.sin(tilt) * radial)[..., None]], axis=-1)
        )

    return fault


def faded(components: slice) -> Fault:
    """The gain of some components falls evenly to a half from the first frame to the last."""

    def change(force: FloatArray) -> FloatArray:
        faint = force.copy()
        faint[..., components] *= np.linspace(1.0, 0.5, len(force))[:, None, None, None]
        return faint

    return reforced(change)


def late(time: float) -> Fault:
    """Forces are those of so many seconds before."""

    def fault(log: GraspLog, _: np.random.Generator) -> GraspLog:
        then = np.maximum(np.searchsorted(log.time, log.time - time, side="right") - 1, 0)
        return log if log.force is None else replace(log, force=log.force[then])

    return fault


def stuck(force: FloatArray) -> FloatArray:
    """Forces that stay as they are at half of the time."""
    half = len(force) // 2
    return np.concatenate([force[:half], np.broadcast_to(force[half], force[half:].shape)])


def crosstalk(share: float) -> Fault:
    """A share of each element's normal force appears along x as well."""
    return reforced(lambda force: force + share * np.stack([force[..., 2], *np.zeros((2, *force.shape[:3]))], axis=-1))


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

FORCE_FAULTS: dict[str, Fault] = {
    "none": lambda log, _: log,
    "forces tilted by 5°": tilted(5.0),
    "forces tilted by 15°": tilted(15.0),
    "forces of a dome of 20°": domed(20.0),
    "crosstalk of 10 %": crosstalk(0.1),
    "crosstalk of 30 %": crosstalk(0.3),
    "normal gain falls to a half": faded(slice(2, 3)),
    "tangential gain falls to a half": faded(slice(0, 2)),
    "forces 0.1 s late": late(0.1),
    "forces 0.5 s late": late(0.5),
    "forces freeze at half of the time": reforced(stuck),
    "sign turned": reforced(np.negative),
    "rows for columns": reforced(lambda force: force.swapaxes(1, 2).copy()),
}
"""Faults of forces alone; the lattices are square."""

CALIBRATED = {"correlated noise (0.9), 3 µm": 3e-6, "correlated noise (0.9), 10 µm": 1e-5}
"""Faults of which a calibration of the sensor tells the detector, by the noise in m."""

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
    costs = {"faults": list(measure(slipping, FAULTS)), "force faults": list(measure(slipping, FORCE_FAULTS))}
    made = {name: table(COLUMNS, [tuple(asdict(row).values()) for row in rows]) for name, rows in costs.items()}
    print("\n\n".join(made.values()))
    numbers = {name: [asdict(row) for row in rows] for name, rows in costs.items()}
    write(numbers, made, arguments, "detector_faults.json")


if __name__ == "__main__":
    main()
