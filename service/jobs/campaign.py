"""Simulate scenes with many seeds each, on the processors of this machine or on the workers of a Dask cluster.

A folder holds a campaign: ``campaign.json`` says what is simulated, and how; beside it stands one log for each scene
and seed, written whole or not at all. Whoever starts it again gets what is missing. Parquet files are one data set, in
folders named as Hive does, ``logs/scene=NAME/seed=0``.
"""

import hashlib
import json
import os
import re
import sys
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from db.errors import DriverMissing
from service.formats import writing
from service.observability import logs
from service.processes import spawned
from service.whole_files import write_whole
from slipcore.contact import Scene, simulate
from slipcore.contact.tiers.choice import check_request
from slipcore.errors import InvalidInput, SlipcoreError
from slipcore.frames import GraspLog

PLAN = "campaign.json"
CONNECT_SECONDS = 10.0
"""s that a Dask scheduler may take to answer."""
FORMATS = ("npz", "parquet")
PARQUET_END = b"PAR1"


@dataclass(frozen=True, slots=True)
class RequestedAccuracy:
    """What each log is simulated to, as ``slipcore.contact.simulate`` takes it: ``seconds`` in s.

    Raises ``InvalidInput``.
    """

    accuracy: float | None = None
    seconds: float | None = None
    tier: str | None = None

    def __post_init__(self) -> None:
        check_request(self.accuracy, self.seconds, self.tier)


@dataclass(frozen=True, slots=True)
class Outcome:
    """One log that is made, or why it could not be."""

    scene: str
    seed: int
    path: Path
    refused: str | None = None


@contextmanager
def workers(processes: int, dask_address: str | None = None) -> Iterator[Executor]:
    """So many processes of this machine, or all workers of a Dask scheduler.

    Raises ``DriverMissing`` without the library, ``InvalidInput`` for an address at which no scheduler answers.
    """
    if dask_address is not None:
        yield from _cluster(dask_address)
        return
    pool = ProcessPoolExecutor(processes, spawned.CONTEXT, spawned.start, (logs.current(),))
    try:
        yield pool
    except BaseException:  # nobody waits for what is under way
        spawned.kill(pool)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client
        from distributed.comm.addressing import get_address_host
    except ModuleNotFoundError as error:
        raise DriverMissing(address, error.name or str(error), "Dask cluster", "dask") from error
    try:
        get_address_host(address)  # before there is a client, whose end fails where it never began
        client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InvalidInput("Dask address", address, "one at which a scheduler answers") from error
    with client:
        yield client.get_executor(pure=False)  # type: ignore[no-untyped-call]


def run(
    executor: Executor,
    scenes: Sequence[Scene],
    seeds: Sequence[int],
    folder: Path,
    accuracy: RequestedAccuracy,
    written_as: str = "npz",
) -> Iterator[Outcome]:
    """Simulate each scene with each seed that the folder lacks; what is there comes first, the others as they are made.

    Logs are ``written_as`` one of ``FORMATS``. Raises ``InvalidInput`` for two scenes of one name, and for a folder
    that holds another campaign.
    """
    _write_plan(folder, scenes, accuracy, written_as)
    under_way: dict[Future[GraspLog], Outcome] = {}
    for scene in scenes:
        for seed in seeds:
            outcome = Outcome(scene.name, seed, folder / _place(scene, seed, written_as))
            if _is_whole(outcome.path, written_as):
                yield outcome
            else:
                under_way[executor.submit(simulate, scene, seed=seed, **asdict(accuracy))] = outcome
    for done in as_completed(list(under_way)):
        yield _kept(done, under_way.pop(done), written_as)


def _place(scene: Scene, seed: int, written_as: str) -> Path:
    name = _file_name(scene)
    if written_as == "parquet":
        return Path("logs", f"scene={name}", f"seed={seed}", "log.parquet")
    return Path(f"{name}-{seed}.npz")


def _is_whole(path: Path, written_as: str) -> bool:
    """Whether a log is there up to its end, by what its format ends with: a crash of the system may have cut it."""
    if not path.is_file():
        return False
    if written_as == "npz":
        return zipfile.is_zipfile(path)
    with path.open("rb") as stream:
        stream.seek(-min(len(PARQUET_END), path.stat().st_size), os.SEEK_END)
        return stream.read() == PARQUET_END


def _kept(done: Future[GraspLog], outcome: Outcome, written_as: str) -> Outcome:
    """The log, once it is written; what was refused is reported, and the others go on."""
    try:
        log = done.result()
    except SlipcoreError as error:
        return replace(outcome, refused=str(error))
    except Exception as error:  # its process died, or the cluster did
        return replace(outcome, refused=f"{type(error).__name__}: {error}")
    outcome.path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(outcome.path, lambda path: writing.write(log, path, written_as))
    return outcome


def _write_plan(folder: Path, scenes: Sequence[Scene], accuracy: RequestedAccuracy, written_as: str) -> None:
    """Write down what the folder holds; more scenes may come to it, but none may change."""
    if written_as not in FORMATS:
        raise InvalidInput("format", written_as, " or ".join(FORMATS))
    names = [_file_name(scene) for scene in scenes]
    for name in names:
        if names.count(name) > 1:
            raise InvalidInput("scenes", f"{name!r} twice", "scenes of different names")
    folder.mkdir(parents=True, exist_ok=True)
    path, asked = folder / PLAN, asdict(accuracy)
    new: dict[str, Any] = {"scenes": {}, "promise": asked, "format": written_as}
    known = _read_plan(path) if path.exists() else new
    if known["format"] != written_as:
        raise InvalidInput(f"campaign in {folder}", written_as, f"{known['format']}, or another folder")
    if known["promise"] != asked:
        raise InvalidInput(
            f"campaign in {folder}", _plan_text(asked), f"{_plan_text(known['promise'])}, or another folder"
        )
    for scene in scenes:
        digest = _digest(scene)
        if known["scenes"].setdefault(_file_name(scene), digest) != digest:
            raise InvalidInput("scene", f"another {scene.name!r} than that in {folder}", "the same, or another folder")
    write_whole(path, lambda path: path.write_text(json.dumps(known, indent=2), encoding="utf-8"))


def _digest(scene: Scene) -> str:
    """By which a scene is known again; maps and paths that are arrays count to their last digit."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):
        return hashlib.sha256(repr(scene).encode()).hexdigest()


def _read_plan(path: Path) -> dict[str, Any]:
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
        parts = {name: dict(known[name]) for name in ("scenes", "promise")}
        return parts | {"format": str(known.get("format", "npz"))}  # of a plan that names none
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidInput("campaign", f"{path}, damaged or of something else", "a folder of its own") from error


def _file_name(scene: Scene) -> str:
    return re.sub(r"\W+", "_", scene.name.strip().lower()) or "scene"


def _plan_text(accuracy: Mapping[str, object]) -> str:
    return ", ".join(f"{name} {value}" for name, value in accuracy.items() if value is not None) or "no accuracy"
