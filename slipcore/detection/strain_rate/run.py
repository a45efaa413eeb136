"""A whole step of method ``strain_rate`` in one call: observe, decide, and what follows."""

from slipcore.compilation import compiled
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.observe import observe
from slipcore.detection.shared.records import DetectorSetup, FrameArrays, Memory, Workspace, named
from slipcore.detection.strain_rate.step import step_strain_rate
from slipcore.frames import FloatArray


@compiled
def run_strain_rate(
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
    observe(sensor, last, frame, before, after, room, True)
    surface, interval = room.surface, frame.time - last.time
    step_strain_rate(sensor, frame.displacement, surface, interval, before.elements, after.elements, room.decision)
    touching, slipping = apply_decision(
        sensor.position, last, frame, room.decision, before, after, room.weight, velocity
    )
    return surface.noise[0], touching, slipping
