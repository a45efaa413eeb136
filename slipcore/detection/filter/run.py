"""A whole step of method ``filter`` in one call: observe, decide, and what follows."""

import math

from slipcore.compilation import compiled
from slipcore.detection.filter.step import lasting_noise, step_filter
from slipcore.detection.filter.tuning import tuning_of
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.observe import observe
from slipcore.detection.shared.records import DetectorSetup, FrameArrays, Memory, Workspace, named
from slipcore.frames import FloatArray


@compiled
def run_filter(
    sensor: DetectorSetup,
    last: FrameArrays,
    frame: FrameArrays,
    before: Memory,
    after: Memory,
    room: Workspace,
    velocity: FloatArray,
) -> tuple[float, int, int]:
    """Fill the memory ``after`` and ``velocity``; marker noise, m (NaN if unknown), and how many elements touch and
    slip. What it is given may be plain tuples of the same entries.
    """
    sensor, last, frame, before, after, room = named(sensor, last, frame, before, after, room)
    has_force = observe(sensor, last, frame, before, after, room, False)
    step_filter(sensor, last, frame, before, after, room, has_force)
    touching, slipping = apply_decision(
        sensor.position, last, frame, room.decision, before, after, room.weight, velocity
    )
    shown, _, between_neighbours, step = room.surface.noise
    lasting = lasting_noise(shown, between_neighbours, step, tuning_of(sensor.settings))
    return math.hypot(shown, lasting), touching, slipping
