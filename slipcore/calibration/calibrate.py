"""A sensor's faults from pure presses."""

from collections.abc import Callable, Sequence

import numpy as np

from slipcore.calibration.crosstalk import crosstalk, inward_share
from slipcore.calibration.defaults import ESTIMATE
from slipcore.calibration.estimate import Estimate, PressResult, joined
from slipcore.calibration.gain import gain
from slipcore.calibration.kernel import kernel_width, squared_width
from slipcore.calibration.marker_noise import marker_noise
from slipcore.calibration.model import AXES, SensorModel
from slipcore.calibration.press import InvalidPress, PressLog, check_kinds, find_press, known_forces, press_fault
from slipcore.calibration.zero import Zero, drifts, offsets
from slipcore.errors import InvalidInput, UnknownScale
from slipcore.frames import FloatArray, GraspLog


def calibrate_sensor(logs: Sequence[GraspLog], known_force: Sequence[float | None] | None = None) -> SensorModel:
    """What is wrong with a sensor, from logs of a body pressed straight down on it and lifted.

    ``known_force``: for each log the total normal force of its hold, N, or None: then what the log's gripper reports,
    if it does. Each quantity has its interval, or says why it is not identified.

    Raises ``InvalidInput`` for logs or forces of another kind or number and for logs of several sensors or lattices,
    ``UnknownScale`` for lengths that are not in metres, and ``InvalidPress`` for logs that are not pure presses, with
    what was seen in each.
    """
    check_kinds(logs)
    _check_alike(logs)
    known = known_forces(logs, known_force)
    presses = [find_press(log) for log in logs]
    faulty = {number: seen for number, press in enumerate(presses) if (seen := press_fault(press)) is not None}
    if faulty:
        raise InvalidPress(faulty)
    first = logs[0]
    return SensorModel(
        sensor=first.sensor,
        grid=first.grid,
        element_area=first.element_area,
        frame_interval=float(np.median(np.concatenate([np.diff(log.time) for log in logs]))),
        presses=len(logs),
        estimates=tuple(_estimates(presses, known)),
        offset=_offset(presses),
    )


def _check_alike(logs: Sequence[GraspLog]) -> None:
    for name in ("sensor", "grid"):
        values = sorted({str(getattr(log, name)) for log in logs})
        if len(values) > 1:
            raise InvalidInput("logs", f"of several {name}s: {', '.join(values)}", "one sensor at a time")
    if not all(log.is_scaled for log in logs):
        raise UnknownScale("a sensor is calibrated in metres, and the scale of a log is unknown")


def _estimates(presses: list[PressLog], known_force: Sequence[float | None]) -> list[Estimate]:
    tables = {
        "force_offset": ("N", AXES, [_of_zero(offsets, press) for press in presses]),
        "force_drift": ("N/s", AXES, [_of_zero(drifts, press) for press in presses]),
        "crosstalk": ("-", AXES[:2], [crosstalk(press) for press in presses]),
    }
    vectors = [
        joined(f"{name}_{axis}", unit, [row[number] for row in rows])
        for name, (unit, axes, rows) in tables.items()
        for number, axis in enumerate(axes)
    ]
    gains: list[PressResult] = [gain(press, force) for press, force in zip(presses, known_force, strict=True)]
    return [
        *vectors,
        joined("inward_share", "-", [inward_share(press) for press in presses]),
        kernel_width([squared_width(press) for press in presses]),
        *marker_noise(presses),
        joined("gain", "-", gains),
    ]


def _of_zero(quantity: Callable[[Zero | None], list[PressResult]], press: PressLog) -> list[PressResult]:
    return quantity(press.zero) if press.split is not None else ["the log has no forces"] * len(AXES)


def _offset(presses: list[PressLog]) -> FloatArray | None:
    """Of each element [n, m, 3] N: the mean over presses, weighted by their free frames."""
    known = [zero for press in presses if (zero := press.zero) is not None and zero.frames >= ESTIMATE.free_frames]
    if not known:
        return None
    return np.asarray(np.average([zero.offset for zero in known], axis=0, weights=[zero.frames for zero in known]))
