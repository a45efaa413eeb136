"""What the server has to work with beside the use cases' part."""

from dataclasses import dataclass, field

from service.domain.context import Context
from service.jobs.scrub import Scrub
from service.observability.store_watch import StoreWatch
from service.processes.fair_queue import FairQueue, OpenEndedQueue
from service.stream.sessions import Streams

LONG_ANSWERS = 16
"""With arrays, 8 MB each of 10⁶ frames, or with a file made for them, at once."""


def _room_for_answers() -> FairQueue:
    return OpenEndedQueue(LONG_ANSWERS, "answered")


@dataclass(frozen=True, slots=True)
class ServerContext(Context):
    """The open stores, the running jobs, the live streams, room for long answers, and what looks after the stores."""

    streams: Streams = field(default_factory=Streams)
    answers: FairQueue = field(default_factory=_room_for_answers)
    scrub: Scrub | None = None
    watch: StoreWatch | None = None
