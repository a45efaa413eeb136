"""Forces frame by frame: a sphere that presses and is sheared, as it is seen at 30 frames a second.

Looks for the contact are taken to have a core of their own: each is there after as many seconds of frames as it took of
CPU, whatever else the machine does.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.forces.scenes import LATTICES, Truth, press, seen
from benchmarks.pages import table
from slipcore.forces import ForceStream, Gel, StreamedForces, reconstruct
from slipcore.frames import FloatArray

GEL = Gel(1e6, 0.49, 5e-3)
RATE = 30.0
LATTICE = LATTICES["20 × 20"]
CASES = (("with z", 1e-6), ("with z", 10e-6), ("in the plane", 1e-6))
DOWN, ACROSS, HOLD = 30, 60, 30
"""Frames of pressing, of shear, and of rest under load."""


@dataclass(frozen=True, slots=True)
class Score:
    """One sensor; errors are relative (tangential, normal) over frames that have forces, over the last second, and by
    ``reconstruct``.

    ``set_up`` s of CPU before the touch; ``step`` ms of CPU in the frames' thread, median and worst; ``beside`` ms of
    CPU a frame in the looks' thread; ``late`` s from the touch to the first forces; ``age`` s of contacts, median and
    worst.
    """

    seen: str
    noise: float
    set_up: float
    step: tuple[float, float]
    beside: float
    late: float
    age: tuple[float, float]
    resultant: tuple[float, float]
    field: tuple[float, float]
    resultant_at_end: tuple[float, float]
    field_at_end: tuple[float, float]
    resultant_of_log: tuple[float, float]
    field_of_log: tuple[float, float]


class Core(Executor):
    """Does at once what it is given, and says so once its ``clock`` s of frames went on by the time that it took."""

    def __init__(self) -> None:
        self.clock, self.spent = 0.0, 0.0
        self._doing: tuple[float, Future[Any], Any] | None = None

    def submit(self, do: Callable[..., Any], /, *_: Any, **__: Any) -> Future[Any]:
        """One thing after the other."""
        assert self._doing is None
        before, future = time.process_time(), Future[Any]()
        found = do()
        took = time.process_time() - before
        self.spent += took
        self._doing = self.clock + took, future, found
        return future

    def tick(self) -> None:
        """Another frame."""
        self.clock += 1.0 / RATE
        if self._doing is not None and self._doing[0] <= self.clock:
            (_, future, found), self._doing = self._doing, None
            future.set_result(found)


def measured(how: str, noise: float) -> Score:
    """Fed frame by frame once the stream is set up."""
    truth, core = _scene(), Core()
    log = seen(truth.log, noise, how == "with z", np.random.default_rng(29))
    stream = ForceStream(log.position, log.element_area, GEL, executor=core)
    _rest(stream, core, log.displacement[0].shape, noise, how == "with z")
    set_up, core.spent = core.spent, 0.0
    answers, steps = list[StreamedForces](), list[float]()
    for displacement in log.displacement:
        core.tick()
        before = time.process_time() - core.spent
        answers.append(stream.step(core.clock, displacement))
        steps.append(1e3 * (time.process_time() - core.spent - before))
    looks = 1e3 * core.spent
    known = np.array([answer.wait_for is None for answer in answers])
    batch = reconstruct(log, GEL, noise=noise)
    ages = [answer.age for answer in answers if answer.wait_for is None]
    resultant = np.stack([answer.forces.resultant for answer in answers])
    force = np.stack([answer.forces.force for answer in answers])
    assert truth.log.force is not None
    return Score(
        how, noise, set_up,
        (float(np.median(steps)), max(steps)), looks / len(log), float(np.argmax(known)) / RATE,
        (float(np.median(ages)), max(ages)),
        _errors(resultant[known], truth.total[known]), _errors(force[known], truth.log.force[known]),
        _errors(resultant[-HOLD:], truth.total[-HOLD:]), _errors(force[-HOLD:], truth.log.force[-HOLD:]),
        _errors(batch.resultant[known], truth.total[known]), _errors(batch.force[known], truth.log.force[known]),
    )  # fmt: skip


def _scene() -> Truth:
    down = [((k + 1) / DOWN, 0.0) for k in range(DOWN)]
    across = [(1.0, (k + 1) / ACROSS) for k in range(ACROSS)]
    return press("sphere", GEL, LATTICE, (1.6e-4, -2.6e-4), [*down, *across, *[(1.0, 1.0)] * HOLD])


def _rest(stream: ForceStream, core: Core, shape: tuple[int, ...], noise: float, with_depth: bool) -> None:
    """Frames until noise and response are known."""
    rng, waits = np.random.default_rng(31), True
    while waits:
        still = noise * rng.standard_normal(shape)
        still[..., 2] *= with_depth
        core.tick()
        waits = stream.step(core.clock, still).wait_for is not None


def _errors(found: FloatArray, true: FloatArray) -> tuple[float, float]:
    parts = (np.s_[..., :2], np.s_[..., 2])
    tangential, normal = (float(np.linalg.norm((found - true)[part]) / np.linalg.norm(true[part])) for part in parts)
    return tangential, normal


def stream_table(scores: Sequence[Score]) -> str:
    """Times, and errors tangential / normal in percent."""
    columns = ("seen", "noise, µm", "set-up, s of CPU", "a frame, ms of CPU (worst)",
               "looks beside it, ms of CPU a frame", "first forces after the touch, s", "age, s (worst)",
               "resultant", "field", "resultant, last second", "field, last second",
               "resultant, whole log", "field, whole log")  # fmt: skip
    rows = [
        (s.seen, f"{1e6 * s.noise:g}", s.set_up, f"{s.step[0]:.2g} ({s.step[1]:.2g})", s.beside,
         s.late, f"{s.age[0]:.2f} ({s.age[1]:.2f})",
         *(" / ".join(f"{100.0 * part:.2g}" for part in error)
           for error in (s.resultant, s.field, s.resultant_at_end, s.field_at_end, s.resultant_of_log, s.field_of_log)))
        for s in scores
    ]  # fmt: skip
    return table(columns, rows)
