"""The bounds that the pages for operators and clients promise are those that the service keeps."""

import re
from pathlib import Path

import pytest

from service.domain import await_job
from service.formats import json_log
from service.http import authentication, bodies, connections, context, joined_writes, request_middleware
from service.processes import fair_queue, fair_threads
from service.stream import broadcast, connection, detectors, sessions, sockets, watching

DOCS = Path(__file__).parents[2] / "docs"
WORDS = dict(enumerate(("one", "two", "three", "four", "five", "six", "seven", "eight", "nine"), 1))

STATED = {
    "operations.md": (
        f"Headers have {connections.HEADER_SECONDS:g} s,",
        f"A body has {request_middleware.BODY_SECONDS:g} s and another second "
        f"for each {1e-3 * request_middleware.SLOWEST_BODY:g} kB that came.",
        f"the parts of a chunked body may have {request_middleware.MOST_HEADER_BYTES // 1024} KiB.",
        f"less than {1e-3 * joined_writes.SLOWEST_READ * joined_writes.UNREAD_SECONDS:g} kB, and not all, "
        f"is read in {joined_writes.UNREAD_SECONDS:g} s is ended",
        f"until all is sent, {context.LONG_ANSWERS} are sent at once",
        f"(`/problems/too-many-uploads`) after {fair_queue.WAIT_SECONDS:g} s.",
        f"at most {connections.RECEIVED_BYTES // 1024} KiB read and not parsed",
        f"is done in {fair_threads.SHORT_AT_ONCE} threads, of which one client has half.",
        f"has {WORDS[fair_threads.LONG_AT_ONCE]} more, one piece of each client at once.",
        f"are answered {WORDS[context.ROUTES_AT_ONCE]} at once, of each client one.",
        f"A request has {connections.MOST_HEADERS} headers and {connections.MOST_PARAMETERS} parameters at most,",
        f"as a WebSocket's do, {connections.OFFER_BYTES:,} bytes together",
        f"are looked up {WORDS[authentication.LOOKS_AT_ONCE]} at once, of each address two.",
        f"with more than {bodies.SHORT_JSON_BYTES // 1024} KiB of JSON",
        f"from its parsing to its answer, all together {WORDS[context.LONG_BODIES]}.",
        f"go to their detectors {WORDS[sessions.FRAMES_AT_ONCE]} at once, "
        f"of each client {WORDS[sessions.FRAMES_OF_ONE]}:",
        f"for friction once in {detectors.STRIDE} frames",
        f"with more than {await_job.LOOKERS} at once more seldom, down to every {await_job.MOST_LOOK_SECONDS:g} s.",
    ),
    "stream.md": (
        f"A session outlives its connection by {sessions.RECONNECT_SECONDS:g} s;",
        f"(up to {sessions.ANSWERS_KEPT}, and {sessions.ANSWER_BYTES_KEPT // 1024} kB)",
        f"the detector works waits ({connection.MOST_WAITING_IN} frames), one that does not read its answers is "
        f"dropped ({connection.MOST_WAITING_OUT} answers).",
        f"Kept frames of one session may have {detectors.MAX_KEPT_BYTES // 2**20} MiB",
    ),
    "dashboard.md": (
        f"at most {watching.MOST_ON_THE_WAY} ahead of what was read, "
        f"and who reads nothing for {watching.READ_SECONDS:g} s is dropped.",
        f"A server has {broadcast.MOST_WATCHERS} watchers at most, and {broadcast.MOST_OF_ONE_OWNER} of one access key",
        f"is looked at every {sockets.KEY_SECONDS:g} s.",
    ),
    "formats.md": (f"JSON, of at most {json_log.MAX_JSON_BYTES // 2**20} MiB",),
}
"""What the pages say, made of the numbers that the code goes by."""


@pytest.mark.parametrize(("page", "sentence"), [(page, each) for page, told in STATED.items() for each in told])
def test_a_bound_that_a_page_states_is_the_one_that_is_kept(page: str, sentence: str) -> None:
    text = re.sub(r"\s+", " ", (DOCS / page).read_text(encoding="utf-8"))
    assert sentence in text
