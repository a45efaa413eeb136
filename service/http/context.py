"""What the server has to work with beside the use cases' part."""

from dataclasses import dataclass, field

from service.domain.context import Context
from service.jobs.scrub import Scrub
from service.observability.store_watch import StoreWatch
from service.stream.sessions import Streams


@dataclass(frozen=True, slots=True)
class ServerContext(Context):
    """The open stores, the running jobs, the live streams, and what looks after the stores."""

    streams: Streams = field(default_factory=Streams)
    scrub: Scrub | None = None
    watch: StoreWatch | None = None
