"""What a calibration mends: `python -m benchmarks.calibration [--seeds N] [--page docs/sensors.md]`.

Each fault is put into four grasps of friction 0.5 (a ball pressed with 4 to 14 N and sheared, closed form) and into
three presses of another ball, by which the sensor is calibrated. Error of the friction that the grasps' fit predicts at
the working load, β₂, and F1 of slip, before and after. Friction of a contact that pivots on a sensor that smooths, and
what single presses tell of all faults at once, too. Writes calibration.json and calibration.png.
"""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.calibration.patch_grasps import PIVOT, Setting, grasp
from benchmarks.calibration.presses import WHITE_SHARE, Faults, pressed
from benchmarks.detector.accuracy import mean_known
from benchmarks.pages import options, picture_folder, save, table, write
from estimators import TooFewSamples, fit
from slipcore import (
    ContactFriction,
    GraspLog,
    SensorModel,
    calibrate_sensor,
    collect_friction,
    contact_friction,
    detect_slip,
)
from slipcore.contact import RampSchedule, tangential_ramp

FRICTION, PIVOT_FRICTION = 0.5, 0.7
FORCES = (4.0, 7.0, 10.0, 14.0)
WORKING_LOAD = (2e-4, 0.06)
"""m/s and N of an element: in the middle of what the grasps have."""
SCHEDULE = RampSchedule(rest=0.5, press=0.7, settle=0.3, shear=3.0, hold=0.5)
PRESSED_WITH = 2.0
WHITE = Faults(marker_noise=1e-6, force_noise=2e-3)
RECOVERED = Faults(5e-3, (2e-5, 0.0, -1e-4), (0.08, -0.05), 1.0, 1.1, 3e-6, 0.9, 2e-3)
"""All at once, at sizes that real sensors have."""
RECOVERED_SEEDS = 40
FAULTS = {
    "none": WHITE,
    "offset of 5 mN": replace(WHITE, offset=5e-3),
    "drift of 1 mN/s": replace(WHITE, drift=(0.0, 5e-4, 1e-3)),
    "crosstalk of 8, −5 %": replace(WHITE, crosstalk=(0.08, -0.05)),
    "gain of 1.2": replace(WHITE, gain=1.2),
    "smoothing over 1 element": replace(WHITE, smoothing=1.0),
    "correlated noise (0.9), 3 µm": replace(WHITE, marker_noise=3e-6, memory=0.9),
    "correlated noise (0.9), 10 µm": replace(WHITE, marker_noise=1e-5, memory=0.9),
    "all but 10 µm": Faults(5e-3, (0.0, 5e-4, 1e-3), (0.08, -0.05), 1.0, 1.2, 3e-6, 0.9, 2e-3),
}


@dataclass(frozen=True, slots=True)
class Result:
    """Root mean square over the seeds of the error of friction and of β₂ 1/N, and mean F1; NaN where no fit was."""

    friction: float
    slope: float
    f1: float


@dataclass(frozen=True, slots=True)
class Row:
    """Of one fault, without and with the calibration."""

    fault: str
    before: Result
    after: Result


def grasps() -> list[GraspLog]:
    """Without fault."""
    return [
        tangential_ramp(
            friction=FRICTION, normal_force=force, points=20, pitch=1e-3, sphere_radius=40e-3, schedule=SCHEDULE
        )
        for force in FORCES
    ]


def measure(seeds: int) -> Iterator[Row]:
    """Each fault."""
    clean, ball = grasps(), pressed(PRESSED_WITH)
    for name, faults in FAULTS.items():
        found = []
        for seed in range(seeds):
            presses = [faults.put_into(ball, 1000 * seed + number) for number in range(3)]
            model = calibrate_sensor(presses, [PRESSED_WITH] * 3)
            logs = [faults.put_into(log, 1000 * seed + 100 + number) for number, log in enumerate(clean)]
            found.append([outcome(logs, None), outcome(logs, model)])
        before, after = (_over_seeds(np.array(part)) for part in zip(*found, strict=True))
        yield Row(name, before, after)


def outcome(logs: list[GraspLog], model: SensorModel | None) -> tuple[float, float, float]:
    """Error of friction at the working load, that of β₂, and F1; by the elements, whether they are believed or not.

    The errors are NaN where so little slip is found that there is no fit.
    """
    histories = [detect_slip(log, lookahead=2, sensor_model=model) for log in logs]
    used = logs if model is None else [model.apply(log).log for log in logs]
    samples = [collect_friction(log, history).elements for log, history in zip(used, histories, strict=True)]
    scores = [f1(log, history.slip) for log, history in zip(logs, histories, strict=True)]
    try:
        found = fit(samples, method="ols")
    except TooFewSamples:
        return np.nan, np.nan, float(np.mean(scores))
    return float(found.predict(*WORKING_LOAD)) - FRICTION, float(found.coefficients[2]), float(np.mean(scores))


def f1(log: GraspLog, slip: np.ndarray) -> float:
    """Of slip at the points in true contact."""
    assert log.truth is not None
    true, found = log.truth.slip_contact_factor & log.truth.contact, slip & log.truth.contact
    return float(2.0 * np.count_nonzero(true & found) / (np.count_nonzero(true) + np.count_nonzero(found)))


def _over_seeds(found: np.ndarray) -> Result:
    """Root mean square of the errors, where there was a fit, and the mean of F1; ``found`` [seeds, 3]."""
    error, slope = (math.sqrt(mean_known(list(errors**2))) for errors in found[:, :2].T)
    return Result(error, slope, float(found[:, 2].mean()))


def draw(rows: list[Row]) -> Figure:
    """Error of friction, and F1, before and after."""
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    places = np.arange(len(rows))[::-1]
    for shift, name, colour in ((0.2, "before", "tab:orange"), (-0.2, "after", "tab:blue")):
        results = [getattr(row, name) for row in rows]
        left.barh(places + shift, [100.0 * result.friction / FRICTION for result in results], 0.38, color=colour)
        right.barh(places + shift, [result.f1 for result in results], 0.38, color=colour, label=name)
    left.set_yticks(places, [row.fault for row in rows])
    left.set_xlabel("error of friction at the working load, %")
    right.set_xlabel("F1 of slip")
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def truth(faults: Faults) -> dict[str, float]:
    """What a calibration should find of the faults."""
    offset = faults.offsets((20, 20)).mean(axis=(0, 1))
    vectors = {"force_offset": offset, "force_drift": faults.drift, "crosstalk": faults.crosstalk}
    known = {
        f"{name}_{axis}": float(value)
        for name, given in vectors.items()
        for axis, value in zip("xyz", given, strict=False)
    }
    noise = 1.0 + WHITE_SHARE**2
    return known | {
        "inward_share": 0.0,
        "kernel_width": 1e-3 * faults.smoothing,
        "marker_noise": faults.marker_noise * np.sqrt(noise),
        "marker_noise_correlation": faults.memory / noise,
        "gain": 1.0 / faults.gain,
    }


def recovered(seeds: int) -> Iterator[tuple[object, ...]]:
    """Of each quantity what was put in, mean and scatter of what one press tells, and how many intervals hold it."""
    ball = pressed(PRESSED_WITH)
    models = [calibrate_sensor([RECOVERED.put_into(ball, 20_000 + seed)], [PRESSED_WITH]) for seed in range(seeds)]
    for name, true in truth(RECOVERED).items():
        found = [model[name] for model in models]
        values = [each.value for each in found]
        covered = sum(each.low <= true <= each.high for each in found)
        yield f"{name}, {found[0].unit}", true, float(np.mean(values)), float(np.std(values)), f"{covered} of {seeds}"


def pivots(width: float) -> tuple[float, ContactFriction, ContactFriction]:
    """Friction of a contact that pivots, without and with the kernel that three presses tell; ``width`` elements."""
    faults = replace(WHITE, smoothing=width)
    model = calibrate_sensor([faults.put_into(pressed(5.0), seed) for seed in range(3)])
    log = grasp(
        PIVOT, PIVOT_FRICTION, Setting(smoothing=width, marker_noise=WHITE.marker_noise, force_noise=WHITE.force_noise)
    )
    histories = [detect_slip(log, lookahead=2, sensor_model=each) for each in (None, model)]
    before, after = (contact_friction(log.time, history.patches) for history in histories)
    assert before is not None
    assert after is not None
    return model["kernel_width"].value, before, after


def pivot_cells(width: float) -> list[object]:
    """A row of the table of pivots."""
    kernel, *found = pivots(width)
    told = [f"{each.coefficient:.3f} ({each.low:.3f} to {each.high:.3f})" for each in found]
    return [width, 1e3 * kernel, *told]


RECOVERED_COLUMNS = ("quantity", "put in", "mean estimate", "standard deviation", "95 % intervals that hold it")
PIVOT_COLUMNS = ("smoothing, elements", "found, mm", "friction of the pivot (0.7)", "calibrated")
COLUMNS = ("fault", "error of μ", "calibrated", "error of β₂, 1/N", "calibrated", "F1", "calibrated")


def main() -> None:
    """Measure, print and store."""
    parser = options(__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    arguments = parser.parse_args()
    pictures = picture_folder(arguments)
    rows = list(measure(arguments.seeds))
    pairs = [[(getattr(row.before, n), getattr(row.after, n)) for n in ("friction", "slope", "f1")] for row in rows]
    cells = [
        [row.fault, *(value for pair in row_pairs for value in pair)]
        for row, row_pairs in zip(rows, pairs, strict=True)
    ]
    made = {"calibration": table(COLUMNS, cells)}
    made["pivots"] = table(PIVOT_COLUMNS, [pivot_cells(width) for width in (0.5, 1.0, 1.5, 2.0)])
    made["recovered"] = table(RECOVERED_COLUMNS, recovered(RECOVERED_SEEDS))
    print(*made.values(), sep="\n\n")
    save(draw(rows), pictures / "calibration.png")
    write([asdict(row) for row in rows], made, arguments, "calibration.json")


if __name__ == "__main__":
    main()
