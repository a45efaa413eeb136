"""A log with its slip state for Foxglove: an MCAP of three topics, as JSON of Foxglove's schemas (docs/exports.md).

``/slip/grid``: the stick–slip map; ``/slip/scene``: tangential force (or displacement) of each element as lines, and
the regime of each contact patch at its place; ``/slip/state``: numbers over time, to plot.
"""

import base64
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from service.exports import DetectedLog
from service.exports.scene import COLOURS, arrows, normal_force, patches_at, tangential_force
from service.formats.lattice import cell_size, lattice_axes
from service.formats.stiction_messages import nanoseconds
from slipcore.frames import GraspLog
from slipcore.slip_state import element_states

FRAME = "sensor"
"""The frame of reference: the sensor's, its z along the outward normal."""

CELL = np.dtype([("red", "u1"), ("green", "u1"), ("blue", "u1"), ("alpha", "u1"), ("state", "u1")])
"""Of the grid: a colour, and the state that it stands for, 0 no contact, 1 sticks, 2 slips."""

UINT8, LINE_LIST = 1, 2
"""Numbers of Foxglove's enumerations."""

NUMBER, TEXT, COUNT = {"type": "number"}, {"type": "string"}, {"type": "integer"}
Json = dict[str, Any]


def _object(**properties: Any) -> Json:
    return {"type": "object", "properties": properties}


def _list_of(items: Json) -> Json:
    return {"type": "array", "items": items}


TIME = _object(sec=COUNT, nsec=COUNT)
POINT = _object(x=NUMBER, y=NUMBER, z=NUMBER)
POSE = _object(position=POINT, orientation=_object(x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER))
COLOUR = _object(r=NUMBER, g=NUMBER, b=NUMBER, a=NUMBER)
GRID = _object(
    timestamp=TIME,
    frame_id=TEXT,
    pose=POSE,
    column_count=COUNT,
    cell_size=_object(x=NUMBER, y=NUMBER),
    row_stride=COUNT,
    cell_stride=COUNT,
    fields=_list_of(_object(name=TEXT, offset=COUNT, type=COUNT)),
    data=TEXT | {"contentEncoding": "base64"},
)
LINES = _object(
    type=COUNT,
    pose=POSE,
    thickness=NUMBER,
    scale_invariant={"type": "boolean"},
    points=_list_of(POINT),
    color=COLOUR,
    colors=_list_of(COLOUR),
    indices=_list_of(COUNT),
)
WORDS = _object(
    pose=POSE,
    billboard={"type": "boolean"},
    font_size=NUMBER,
    scale_invariant={"type": "boolean"},
    color=COLOUR,
    text=TEXT,
)
UNUSED = ("arrows", "cubes", "spheres", "cylinders", "triangles", "models")
"""Kinds of shapes that an entity may have, and ours has none of."""

ENTITY = _object(
    timestamp=TIME,
    frame_id=TEXT,
    id=TEXT,
    lifetime=TIME,
    frame_locked={"type": "boolean"},
    metadata=_list_of(_object(key=TEXT, value=TEXT)),
    lines=_list_of(LINES),
    texts=_list_of(WORDS),
    **{kind: _list_of(_object()) for kind in UNUSED},
)
DELETION = _object(timestamp=TIME, type=COUNT, id=TEXT)
SCENE = _object(deletions=_list_of(DELETION), entities=_list_of(ENTITY))
OR_NULL = {"type": ["number", "null"]}
STATE = _object(
    timestamp=TIME,
    stick_ratio=OR_NULL,
    macro_slip={"type": "boolean"},
    elements_in_contact=COUNT,
    elements_in_slip=COUNT,
    normal_force=OR_NULL,
    tangential_force=OR_NULL,
)
TOPICS = {
    "/slip/grid": ("foxglove.Grid", GRID),
    "/slip/scene": ("foxglove.SceneUpdate", SCENE),
    "/slip/state": ("stiction.SlipState", STATE),
}


def write(recordings: Sequence[DetectedLog], path: Path) -> None:
    """Write the one recording."""
    (recording,) = recordings
    streams = {"/slip/grid": _grids(recording), "/slip/scene": _scenes(recording), "/slip/state": _states(recording)}
    frames = zip(recording.log.time, *streams.values(), strict=True)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="stiction")
        channels = {topic: _channel(writer, topic) for topic in TOPICS}
        for number, (time, *messages) in enumerate(frames):
            moment = nanoseconds(time)
            for topic, message in zip(streams, messages, strict=True):
                content = json.dumps(message, allow_nan=False).encode()
                writer.add_message(channels[topic], moment, content, moment, number)
        writer.finish()  # type: ignore[no-untyped-call]


def _channel(writer: Writer, topic: str) -> int:
    name, schema = TOPICS[topic]
    text = json.dumps({"title": name, **schema}).encode()
    return writer.register_channel(topic, "json", writer.register_schema(name, "jsonschema", text))


def _timestamp(time: float) -> Json:
    seconds, rest = divmod(nanoseconds(time), 10**9)
    return {"sec": seconds, "nsec": rest}


def _point(values: NDArray[np.float64]) -> Json:
    return dict(zip("xyz", np.round(values, 9).tolist(), strict=True))


def _pose(position: NDArray[np.float64], rotation: Rotation | None = None) -> Json:
    turned = Rotation.identity() if rotation is None else rotation
    return {"position": _point(position), "orientation": dict(zip("xyzw", turned.as_quat().tolist(), strict=True))}


def _grids(recording: DetectedLog) -> Iterator[Json]:
    log = recording.log
    packed = np.empty(recording.history.contact.shape, CELL)
    packed["state"] = element_states(recording.history.contact, recording.history.slip)
    for k, name in enumerate(("red", "green", "blue", "alpha")):
        packed[name] = COLOURS[packed["state"], k]
    fixed = {
        "frame_id": FRAME,
        **_lattice(log),
        "column_count": log.grid[1],
        "row_stride": log.grid[1] * CELL.itemsize,
        "cell_stride": CELL.itemsize,
        "fields": [{"name": name, "offset": k, "type": UINT8} for k, name in enumerate(CELL.names or ())],
    }
    for time, frame in zip(log.time, packed, strict=True):
        yield {"timestamp": _timestamp(time), **fixed, "data": base64.b64encode(frame.tobytes()).decode()}


def _lattice(log: GraspLog) -> Json:
    """Where the corner of the grid is, how it is turned, and the size of its cells."""
    axes = np.vstack([lattice_axes(log.position), np.zeros(2)])
    normal = np.cross(axes[:, 0], axes[:, 1])
    rotation = Rotation.from_matrix(np.column_stack([axes, normal]))
    size = cell_size(log.position)
    corner = log.position[0, 0] - 0.5 * axes @ size
    return {"pose": _pose(corner, rotation), "cell_size": {"x": size[0], "y": size[1]}}


def _scenes(recording: DetectedLog) -> Iterator[Json]:
    drawn = arrows(recording)
    note = [{"key": "longest line", "value": f"{drawn.longest:.4g} {drawn.unit} of {drawn.what}"}]
    return (_scene(recording, drawn.begin[k], drawn.end[k], k, note) for k in range(len(recording.log)))


def _scene(
    recording: DetectedLog, begin: NDArray[np.float64], end: NDArray[np.float64], k: int, note: list[Json]
) -> Json:
    touching = recording.history.contact[k]
    points = np.stack([begin[touching], end[touching]], axis=1).reshape(-1, 3)
    black = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 1.0}
    lines = {
        "type": LINE_LIST,
        "pose": _pose(np.zeros(3)),
        "thickness": 2.0,
        "scale_invariant": True,
        "points": [_point(point) for point in points],
        "color": black,
        "colors": [],
        "indices": [],
    }
    words = [
        {"billboard": True, "font_size": 14.0, "scale_invariant": True, "color": black, "text": regime}
        | {"pose": _pose(np.array([x, y, float(recording.log.position[..., 2].max())]))}
        for x, y, regime in patches_at(recording.history, k)
    ]
    entity = {
        "timestamp": _timestamp(recording.log.time[k]),
        "frame_id": FRAME,
        "id": "contact",
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": note,
        "lines": [lines],
        "texts": words,
        **{kind: [] for kind in UNUSED},
    }
    return {"deletions": [], "entities": [entity]}


def _states(recording: DetectedLog) -> Iterator[Json]:
    log, history = recording.log, recording.history
    pressing, shearing = normal_force(log), tangential_force(log)
    for k, time in enumerate(log.time):
        yield {
            "timestamp": _timestamp(time),
            "stick_ratio": _or_none(history.stick_ratio[k]),
            "macro_slip": bool(history.macro_slip[k]),
            "elements_in_contact": int(history.contact[k].sum()),
            "elements_in_slip": int((history.contact[k] & history.slip[k]).sum()),
            "normal_force": _or_none(pressing[k]),
            "tangential_force": _or_none(shearing[k]),
        }


def _or_none(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
