"""A whole step of method ``strain_rate`` in one call: observe, decide, and what follows."""

import numpy as np

from slipcore.compilation import compiled
from slipcore.detection.shared.decision import apply_decision
from slipcore.detection.shared.observe import observe
from slipcore.detection.shared.records import Decision, FrameArrays, Memory, Sensor, named
from slipcore.detection.strain_rate.step import step_strain_rate
from slipcore.frames import FloatArray


@compiled
def run_strain_rate(
    sensor: Sensor, last: FrameArrays, frame: FrameArrays, before: Memory, after: Memory, velocity: FloatArray
) -> tuple[float, int, int]:
    """Fill the memory ``after`` and ``velocity``; marker noise, m (NaN if unknown), and how many elements touch and
    slip. What it is given may be plain tuples of the same entries.
    """
    sensor, last, frame, before, after = named(sensor, last, frame, before, after)
    shape = after.probability.shape
    surface = observe(sensor, frame, before, after)
    decision = Decision(np.empty(shape, np.bool_), np.empty(shape))
    interval = frame.time - last.time
    step_strain_rate(sensor, frame.displacement, surface, interval, before.elements, after.elements, decision)
    touching, slipping = apply_decision(sensor.position, last, frame, surface.stays, decision, before, after, velocity)
    return surface.marker_noise, touching, slipping
