"""The steps of a compiled method over all frames of a log in one call: nothing comes from outside for a frame."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from slipcore.compilation import compiled
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.step import PROBABILITY, THRESHOLD, decide, look_back
from slipcore.detection.shared.answer import answer
from slipcore.detection.strain_rate.run import run_strain_rate
from slipcore.frames import BoolArray, FloatArray

Scalar = TypeVar("Scalar", bound=np.generic)


class Sensor(NamedTuple):
    """What stays the same over a log, as the compiled methods take it (see ``filter.run``)."""

    position: FloatArray
    rest_steps: FloatArray
    inverse_jacobian: FloatArray
    orientation: float
    touch: FloatArray
    settings: FloatArray


class Recording(NamedTuple):
    """The frames of a log, [t, ...]; each frame of a field that it does not have is empty."""

    time: FloatArray
    displacement: FloatArray
    force: FloatArray
    pose: FloatArray
    normal: FloatArray
    known: BoolArray


class Remembered(NamedTuple):
    """A detector's memory between two frames (see ``detector.Memory``)."""

    masks: BoolArray
    probability: FloatArray
    noise: FloatArray
    own: FloatArray
    numbers: FloatArray


class Answers(NamedTuple):
    """What is said of each frame: fields [t, n, m] and [t, n, m, 2], and how many elements touch and slip, [t]."""

    contact: BoolArray
    slip: BoolArray
    probability: FloatArray
    velocity: FloatArray
    touching: NDArray[np.int64]
    slipping: NDArray[np.int64]


@compiled
def fold(is_filter: bool, sensor: Sensor, log: Recording, start: Remembered, lookahead: int, answers: Answers) -> float:
    """Fill ``answers`` from the second frame on, by method "filter" or else "strain_rate"; marker noise at the end, m.

    ``start`` is the memory after the first frame. With a ``lookahead`` each frame is decided in the light of that many
    after it, for which the filter alone remembers enough.
    """
    frames, kept = len(log.time), max(lookahead + 1, 2)
    masks, likely, noises = twice(start.masks), twice(start.probability), twice(start.noise)
    numbers, owns = twice(start.numbers), np.empty((kept, *start.own.shape))
    owns[0] = start.own
    lattice = sensor.position, sensor.rest_steps, sensor.inverse_jacobian, sensor.orientation
    sigma = np.nan
    for k in range(1, frames):
        now, was = k % 2, 1 - k % 2
        seen = log.time[k], log.displacement[k], log.force[k], log.pose[k], log.normal[k], log.known[k]
        before = log.time[k - 1], log.displacement[k - 1], log.force[k - 1], log.pose[k - 1]
        memory = masks[was], likely[was], noises[was], owns[(k - 1) % kept], numbers[was]
        after = masks[now], likely[now], noises[now], owns[k % kept], numbers[now]
        given = (*lattice, sensor.touch, sensor.settings, *seen, *before, *memory, *after, answers.velocity[k])
        sigma, touching, slipping = run_filter(*given) if is_filter else run_strain_rate(*given)
        answers.contact[k], answers.slip[k], answers.probability[k] = masks[now, 0], masks[now, 1], likely[now]
        answers.touching[k], answers.slipping[k] = touching, slipping
        if 0 < lookahead < k:
            revise(sensor, log, owns, k - lookahead, k, answers)
    if lookahead > 0:
        for k in range(max(frames - lookahead, 1), frames):
            revise(sensor, log, owns, k, frames - 1, answers)
    return sigma


@compiled
def twice(field: NDArray[Scalar]) -> NDArray[Scalar]:
    """Room for a field of this frame and of the last, which the field given is."""
    both = np.empty((2, *field.shape), field.dtype)
    both[0] = field
    return both


@compiled
def revise(sensor: Sensor, log: Recording, owns: FloatArray, k: int, last: int, answers: Answers) -> None:
    """Say again what was said of frame ``k``, in the light of the filter's memories ``owns`` up to frame ``last``."""
    kept, shape = len(owns), answers.contact[k].shape
    posterior, earlier = owns[last % kept, PROBABILITY].copy(), np.empty(shape)
    for i in range(last - 1, k - 1, -1):
        look_back(owns[i % kept], owns[(i + 1) % kept], posterior, earlier)
        posterior, earlier = earlier, posterior
    slip, probability = np.empty(shape, np.bool_), np.empty(shape)
    decide(posterior, sensor.settings[THRESHOLD], slip, probability)
    contact, before = answers.contact[k], answers.contact[k - 1]
    answers.touching[k], answers.slipping[k] = answer(
        sensor.position, log.time[k] - log.time[k - 1], log.displacement[k - 1], log.displacement[k],
        log.pose[k - 1], log.pose[k], contact, contact & before, slip, probability,
        answers.slip[k - 1], answers.probability[k - 1], answers.slip[k], answers.probability[k], answers.velocity[k],
    )  # fmt: skip
