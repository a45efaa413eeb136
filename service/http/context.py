"""What the server has to work with beside the use cases' part."""

from dataclasses import dataclass, field

from service.domain.resources.context import Context
from service.jobs.scrub import Scrub
from service.observability.store_watch import StoreWatch
from service.processes.fair_queue import AdaptiveShareQueue, FairQueue, UnboundedFairQueue
from service.stream.sessions import Streams

LONG_ANSWERS = 16
"""With arrays, 8 MB each of 10⁶ frames, or with a file made for them, at once."""

ROUTES_AT_ONCE = 4
"""Answered in threads, one of each client: they share one interpreter, and more would only wait for it."""


LONG_BODIES = 4
"""Of JSON, parsed and being answered at once, one of each client: up to 20 MB each."""


def _room_for_answers() -> FairQueue:
    return AdaptiveShareQueue(LONG_ANSWERS, "answered")


def _turns_of_routes() -> FairQueue:
    return UnboundedFairQueue(ROUTES_AT_ONCE, "answered", share=1)


def _turns_of_bodies() -> FairQueue:
    return UnboundedFairQueue(LONG_BODIES, "parsed", share=1)


@dataclass(frozen=True, slots=True)
class ServerContext(Context):
    """The open stores, the running jobs, the live streams, room for long answers, turns for routes that are answered in
    threads and for long bodies, and what looks after the stores.
    """

    streams: Streams = field(default_factory=Streams)
    answers: FairQueue = field(default_factory=_room_for_answers)
    turns: FairQueue = field(default_factory=_turns_of_routes)
    long_bodies: FairQueue = field(default_factory=_turns_of_bodies)
    scrub: Scrub | None = None
    watch: StoreWatch | None = None
