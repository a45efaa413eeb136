"""A log with its slip state for Rerun: an .rrd with its blueprint (docs/exports.md).

``/sensor/map``: the stick–slip map as a segmented image; on it ``/sensor/arrows``: tangential force (or displacement)
of each element, and ``/sensor/patches``: the regime of each contact patch at its place. ``/slip/stick_ratio``,
``/force/normal`` and ``/force/tangential``: numbers over time.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from service.exports import DetectedLog
from service.exports.scene import COLOURS, arrows, normal_force, patches_at, tangential_force
from service.formats.lattice import cell_size, columns_and_rows, lattice_axes
from slipcore.frames import FloatArray
from slipcore.slip_state import element_states

APPLICATION, TIME = "stiction", "time"
STATES = ("no contact", "sticks", "slips")
STICK, SLIP = COLOURS[1].tolist(), COLOURS[2].tolist()
SERIES = {"slip/stick_ratio": STICK, "force/normal": STICK, "force/tangential": SLIP}
"""Numbers over time, and their colours."""


def write(recordings: Sequence[DetectedLog], path: Path) -> None:
    """Write the one recording."""
    (recording,) = recordings
    stream = rr.RecordingStream(APPLICATION, recording_id=recording.name)
    stream.save(path, default_blueprint=_blueprint(recording.name))
    classes = [rr.AnnotationInfo(k, name, COLOURS[k].tolist()) for k, name in enumerate(STATES)]
    stream.log("sensor", rr.AnnotationContext(classes), static=True)
    _log_numbers(stream, recording)
    _log_frames(stream, recording)
    stream.flush()


def _blueprint(name: str) -> rrb.Blueprint:
    plots = rrb.Vertical(
        rrb.TimeSeriesView(origin="/slip", name="Stick ratio (1: all sticks)"),
        rrb.TimeSeriesView(origin="/force", name="Force, N"),
    )
    contact = rrb.Spatial2DView(origin="/sensor", name=f"Stick–slip map of {name}")
    return rrb.Blueprint(rrb.Horizontal(contact, plots), rrb.TimePanel(timeline=TIME), collapse_panels=True)


def _log_numbers(stream: rr.RecordingStream, recording: DetectedLog) -> None:
    """Those that are known; NaN leaves a gap in a line."""
    log = recording.log
    numbers = (recording.history.stick_ratio, normal_force(log), tangential_force(log))
    for (entity, colour), values in zip(SERIES.items(), numbers, strict=True):
        if np.isfinite(values).any():
            stream.log(entity, rr.SeriesLines(colors=colour, names=entity.rpartition("/")[2]), static=True)
            times = rr.TimeColumn(TIME, duration=log.time)
            rr.send_columns(entity, [times], rr.Scalars.columns(scalars=values), recording=stream)


def _log_frames(stream: rr.RecordingStream, recording: DetectedLog) -> None:
    log, history = recording.log, recording.history
    states, drawn = element_states(history.contact, history.slip), arrows(recording)
    axes, size = lattice_axes(log.position), cell_size(log.position)
    middles = np.stack(np.meshgrid(*(np.arange(count) + 0.5 for count in log.grid), indexing="ij")[::-1], axis=-1)
    for k, time in enumerate(log.time):
        touching = history.contact[k]
        vectors = (drawn.end[k] - drawn.begin[k])[touching][:, :2] @ axes / size
        stream.set_time(TIME, duration=float(time))
        stream.log("sensor/map", rr.SegmentationImage(states[k]))
        stream.log("sensor/arrows", rr.Arrows2D(origins=middles[touching], vectors=vectors, colors=[0, 0, 0, 255]))
        stream.log("sensor/patches", _patches(recording, k))


def _patches(recording: DetectedLog, frame: int) -> rr.Points2D:
    found = list(patches_at(recording.history, frame))
    centres: FloatArray = np.array([(x, y) for x, y, _ in found]).reshape(-1, 2)
    places = columns_and_rows(recording.log.position, centres) + 0.5
    return rr.Points2D(places, labels=[regime for *_, regime in found], radii=0.15, colors=[0, 0, 0, 255])
