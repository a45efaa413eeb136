"""Run detectors on the inputs of a benchmark: those of this package, or any program. None is given the truth."""

import os
import re
import shlex
import shutil
import signal
import subprocess
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service import __version__, formats
from service.slip_benchmark import folder as files
from service.slip_benchmark.folder import SceneEntry, input_path, prediction_path, read_prediction
from service.whole_files import write_whole
from slipcore.defaults import METHOD_NAMES
from slipcore.errors import InvalidInput, SlipcoreError
from slipcore.frames import GraspLog
from slipcore.slip_state import SlipHistory

NEEDS_FORCES = ("force_ratio", "forces_only")
"""Detectors that see nothing where the sensor measures no forces: there is nothing to score."""
MOST_OUTPUT = 300
"""Letters of what a failed program said that are kept."""


@dataclass(frozen=True, slots=True)
class PredictionRun:
    """One method on one scene: ``seconds`` that it took, and why it has no prediction that can be scored
    (``refused``).
    """

    method: str
    scene: str
    seconds: float
    refused: str | None = None


@dataclass(frozen=True, slots=True)
class Program:
    """A program that is no part of this package: its ``command`` is given the paths of an input and of its prediction,
    and has ``limit`` s for a scene.
    """

    name: str
    command: str
    limit: float

    def check(self) -> None:
        """Raises ``InvalidInput`` for a name that is no plain folder's, or one of a detector, and an empty command."""
        if not re.fullmatch(r"\w[\w.+-]{0,60}", self.name) or self.name in METHOD_NAMES:
            raise InvalidInput("name", repr(self.name), "letters, digits, . + - and _, and no detector of this package")
        try:
            words = shlex.split(self.command)
        except ValueError as error:
            raise InvalidInput("external", repr(self.command), f"a command ({error})") from error
        if not words or shutil.which(words[0]) is None:
            raise InvalidInput("external", repr(self.command), "a command whose program is there")

    def predict(self, seen: Path, prediction: Path) -> None:
        """Let the program predict from a copy of the input, beside which no truth lies; raises ``InvalidInput``."""
        with TemporaryDirectory(prefix="stiction-") as room:
            given, made = Path(room) / "input.npz", Path(room) / "output.npz"
            shutil.copyfile(seen, given)
            self._run([*shlex.split(self.command), str(given), str(made)])
            if not made.is_file():
                raise InvalidInput(self.name, "done, without a prediction", "a program that writes the second path")
            write_whole(prediction, partial(shutil.copyfile, made))

    def _run(self, words: Sequence[str]) -> None:
        with subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True
        ) as running:
            try:
                _, output = running.communicate(timeout=self.limit)
            except subprocess.TimeoutExpired as error:
                os.killpg(running.pid, signal.SIGKILL)
                raise InvalidInput(
                    self.name, f"not done after {self.limit:g} s", "faster, or a longer --limit"
                ) from error
        if running.returncode != 0:
            shown = output.decode(errors="replace").strip()[-MOST_OUTPUT:] or "nothing"
            raise InvalidInput(self.name, f"ended by code {running.returncode}; it said: {shown}", "code 0")


def run(executor: Executor, folder: Path, detectors: Sequence[str], program: Program | None) -> Iterator[PredictionRun]:
    """Let each method predict each scene; what it said before is replaced.

    Raises ``InvalidInput`` for unknown detectors and a folder that does not hold all of its scenes.
    """
    for name in detectors:
        if name not in METHOD_NAMES:
            raise InvalidInput("detector", name, ", ".join(METHOD_NAMES))
    if program is not None:
        program.check()
    scenes = files.read_whole_benchmark(folder).scenes
    methods: list[str | Program] = [*dict.fromkeys(detectors), *([] if program is None else [program])]
    for method in methods:
        shutil.rmtree(folder / files.RESULTS / _name(method), ignore_errors=True)
    tasks = [executor.submit(predict, folder, scene, methods) for scene in scenes]
    ran: list[PredictionRun] = []
    for done in as_completed(tasks):
        ran += done.result()
        yield from done.result()
    for method in methods:
        _tell(folder, method, [each for each in ran if each.method == _name(method)])


def _name(method: str | Program) -> str:
    return method if isinstance(method, str) else method.name


def predict(folder: Path, scene: SceneEntry, methods: Sequence[str | Program]) -> list[PredictionRun]:
    """What each method says of a scene, written; what one refuses is reported, and what cannot be scored."""
    ran = []
    for method in methods:
        began, refused = perf_counter(), None
        seen, prediction = input_path(folder, scene.name), prediction_path(folder, _name(method), scene.name)
        try:
            if isinstance(method, str):
                _detect(method, seen, prediction)
            else:
                method.predict(seen, prediction)
                read_prediction(prediction, (scene.frames, *scene.elements))
        except (SlipcoreError, OSError) as error:
            refused = str(error)
        ran.append(PredictionRun(_name(method), scene.name, perf_counter() - began, refused))
    return ran


def _detect(method: str, seen: Path, prediction: Path) -> None:
    from slipcore import detect_slip  # compiled: who only reports results goes without

    log = formats.read(seen)
    if log.force is None and method in NEEDS_FORCES:
        raise InvalidInput("force", "missing", f"a sensor with forces, for detector {method}")
    history = detect_slip(log, method)
    members = {"slip": history.slip, "probability": history.probability, "macro_slip": history.macro_slip}
    files.write_arrays(prediction, members | _friction(log, history))


def _friction(log: GraspLog, history: SlipHistory) -> dict[str, NDArray[Any]]:
    """The median of the friction samples, with forces; nothing without any."""
    from slipcore import collect_samples

    if log.force is None:
        return {}
    samples = collect_samples(log, history).friction_coefficient
    return {"friction": np.array(np.median(samples))} if len(samples) else {}


def _tell(folder: Path, method: str | Program, ran: Sequence[PredictionRun]) -> None:
    """What was run, beside its results."""
    record = {
        "method": _name(method),
        "by": f"stiction {__version__}" if isinstance(method, str) else method.command,
        "seconds": sum(each.seconds for each in ran),
        "refused": {each.scene: each.refused for each in sorted(ran, key=lambda each: each.scene) if each.refused},
    }
    files.write_json(folder / files.RESULTS / _name(method) / files.RUN, record)
