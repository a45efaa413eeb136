"""A job under way: its stores, the claim to it, and the seconds of its stages."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter

from db.blobs import BlobStore
from db.database import Database
from db.records import Claim, Job
from db.repositories import jobs
from service.observability import logs, traces


class InsufficientData(Exception):
    """The data do not allow what the job is for; the message says why."""


@dataclass(frozen=True, slots=True)
class Run:
    """One job under way: the stores, the claim to it, and the seconds of the stages done."""

    database: Database
    blobs: BlobStore
    claim: Claim
    job: Job
    seconds: dict[str, float] = field(default_factory=dict)
    others_tell: bool = True
    """Whether the other materials of its sensor show how much grasps of one may differ."""

    @property
    def total(self) -> float:
        """Seconds of all stages done."""
        return round(sum(self.seconds.values()), 6)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Say that the job is in this stage, and take its time; raises ``ClaimLost`` where it is not ours any more."""
        logs.note(stage=name)
        with self.database.write(durable=False) as session:
            jobs.start_stage(session, self.claim, name, self.seconds)
        with self.timed(name), traces.span(name):
            yield

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Take the time of a stage."""
        begin = perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - begin
