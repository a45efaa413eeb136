"""The bounds that the pages for operators and clients promise are those that the service keeps."""

import math
import re
from pathlib import Path

import pytest

from db import defaults
from service.cli import exit_codes
from service.demo import inputs
from service.domain.jobs import await_job
from service.domain.logs import same_grasp
from service.domain.materials import curate, ownership
from service.domain.resources import receive
from service.domain.uploads import accept
from service.formats import (
    archive,
    assemble,
    frame_table,
    json_log,
    npy,
    presets,
    reading,
    tac3d,
    tracked_markers,
    unpack,
)
from service.http import bodies, context, errors
from service.http import sessions as cookies
from service.http.middleware import authentication, request_middleware
from service.http.protocol import connections, joined_writes, websockets
from service.http.schemas import common
from service.jobs import fit_material, process_executor, webhook
from service.observability import access_log
from service.processes import fair_queue, fair_threads
from service.slip_benchmark import kinds
from service.stream import (
    broadcast,
    connection,
    detector_session,
    detectors,
    grip,
    messages,
    observing,
    reconstructing,
    sessions,
    sockets,
    watching,
)
from service.stream import errors as ends
from service.web import comparison, frames, grasp_effects, posterior, samples
from stiction_client import client, exchange
from stiction_client.exports import coulomb, mujoco

DOCS = Path(__file__).parents[2] / "docs"
(PILLARS, *_), (TAXELS, *_) = presets.papillarray(0), presets.uskin(0)
PRESSURES, ARMS = grip.CONTACT_RANGES["pressure_square"], grip.CONTACT_RANGES["torque_arm"]
WORDS = dict(enumerate(("one", "two", "three", "four", "five", "six", "seven", "eight", "nine"), 1))


def power(number: float) -> str:
    """One of ten."""
    exponent = round(math.log10(number))
    assert number == float(f"1e{exponent}")
    return f"10{str(exponent).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


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
        f"for friction once in {detector_session.STRIDE} frames",
        f"with more than {await_job.LOOKERS} at once more seldom, down to every {await_job.MOST_LOOK_SECONDS:g} s.",
        f"logs of more than {reading.SHORT_BYTES // 2**20} MiB)",
        f"windows of {2**receive.WINDOW_LOG // 2**20} MiB at most",
        f"Headers have {connections.HEADER_SECONDS:g} s, from the connection",
        f"which may take {reading.MEMORY_BYTES // 2**30} GiB more and end after a minute without work",
        f"once that has taken {reading.LEAST_SECONDS:g} s of CPU and a second a MB",
        f"each of the [{sessions.MOST_SESSIONS} sessions](stream.md) may have a connection with "
        f"{connection.MOST_WAITING_IN} messages",
        f"*Queue*: {fair_queue.MOST_WAITING_OF_ONE} files of one key and {fair_queue.MOST_WAITING} in all wait for "
        f"{fair_queue.WAIT_SECONDS:g} s at most",
        f"Of `GET` and `HEAD` that go well {access_log.LOGGED_A_SECOND} a second have one",
        f"An entry is sent {webhook.SETTLED:g} to ",
        f"Pauses between attempts grow from {webhook.LOOK_SECONDS:g} s to {webhook.LONGEST_PAUSE / 60.0:g} min",
        f"which must be there within {webhook.TIMEOUT:g} s.",
        f"an entry of {WORDS[webhook.EXPIRED.days]} days is given up",
        f"those that have been there for {defaults.QUARANTINE_AGE.days} days",
        f"has an entry `quarantine.deleted` for each {defaults.HASHES_PER_QUERY} files or fewer",
    ),
    "stream.md": (
        f"A session outlives its connection by {sessions.RECONNECT_SECONDS:g} s;",
        f"(up to {sessions.ANSWERS_KEPT}, and {sessions.ANSWER_BYTES_KEPT // 1024} kB)",
        f"the detector works waits ({connection.MOST_WAITING_IN} frames), one that does not read its answers is "
        f"dropped ({connection.MOST_WAITING_OUT} answers).",
        f"Kept frames of one session may have {detectors.MAX_KEPT_BYTES // 2**20} MiB",
        f"no room for the {detector_session.WINDOW} frames that are looked at",
        f"looked for once in {detector_session.STRIDE} frames with forces",
        f"faster than {1e3 * observing.LEAST_SPEED:g} mm/s",
        f"or lists of numbers, at most {messages.DEEPEST} deep",
        f"(at most {detectors.MAX_MARKERS} markers)",
        f"names of at most {messages.MOST_MATERIALS}, each with a model",
        f"that the gripper is commanded, 0 to {power(detectors.MOST_COMMAND)} N",
        f"`pressure_square` ({PRESSURES[0]:g} to {power(PRESSURES[1])}) and "
        f"`torque_arm` ({power(ARMS[0])} to {ARMS[1]:g} m",
        f"At most {reconstructing.MOST_MARKERS} markers, and at most {reconstructing.MOST_NODES:,} elements' areas",
        *(
            f"| {code} | {told}"
            for code, told in {
                ends.FINISHED: "finished",
                ends.NOT_UNDERSTOOD: "a message that is none",
                ends.DETECTOR_LOST: "the detectors' process ended",
                ends.KEY_ENDED: "the access key was revoked or has expired, which is looked at every "
                f"{sockets.KEY_SECONDS:g} s",
                ends.UNKNOWN_SESSION: "no such session",
                ends.SLOW_READER: "answers wait to be read, too many",
                ends.IN_USE: "the session has a connection already, which did not let go of it within "
                f"{sessions.TAKE_OVER_SECONDS:g} s",
                ends.REFUSED: "what was asked cannot be",
                ends.TOO_MANY: f"{sessions.MOST_SESSIONS} sessions are open",
                ends.STORAGE_AWAY: "database or disk cannot be used now",
            }.items()
        ),
    ),
    "dashboard.md": (
        f"at most {watching.MOST_ON_THE_WAY} ahead of what was read, "
        f"and who reads nothing for {watching.READ_SECONDS:g} s is dropped.",
        f"A server has {broadcast.MOST_WATCHERS} watchers at most, and {broadcast.MOST_OF_ONE_OWNER} of one access key",
        f"is looked at every {sockets.KEY_SECONDS:g} s.",
        f"at most {broadcast.FRAMES_A_SECOND:g} times a second",
        f"those of the newest {grasp_effects.MOST_GRASPS} logs in three dimensions",
        f"each of the newest {grasp_effects.MOST_GRASPS} grasps",
        f"as ellipses of {100 * posterior.ELLIPSES[0]:g} and {100 * posterior.ELLIPSES[1]:g} %",
        f"with its {100 * posterior.INTERVAL:g} % interval, and β₀ together",
        f"of at most {samples.MOST_SAMPLES} of them",
        f"of up to {WORDS[comparison.MOST_COMPARED]} models in one picture",
        f"of a log with more than {1e-6 * frames.MOST_CELLS:g} million of these",
        "three materials of known friction ({:g}, {:g} and {:g})".format(*inputs.FRICTION.values()),
        f"each pressed with {inputs.NORMAL_FORCES[0]:g} to {inputs.NORMAL_FORCES[-1]:g} N",
        f"it ends after {cookies.LIFETIME.total_seconds() / 3600:g} hours",
        f"A key has at most {cookies.MOST_OF_A_KEY}; one more ends its oldest",
    ),
    "formats.md": (
        f"JSON, of at most {json_log.MAX_JSON_BYTES // 2**20} MiB",
        f"unpacked a log may have {npy.MAX_ARRAY_BYTES // 2**20} MiB ({assemble.MAX_CONTENT_BYTES // 2**20} MiB in",
        f"up to {unpack.MAX_CHUNK_BYTES // 2**20} MiB each and {unpack.MAX_UNPACKED_BYTES // 2**30} GiB in all",
        f"a table of contents of at most {archive.MAX_DIRECTORY_BYTES // 1024} KiB",
        f"at most {1e-6 * frame_table.MAX_ROWS:g} million rows",
        f"rows in any order; at most {1e-6 * tracked_markers.MAX_ROWS:g} million",
        f"assumed to span {1e3 * tracked_markers.ASSUMED_WIDTH:g} mm",
        f"a rest shape that changes by more than {1e3 * tac3d.REST_TOLERANCE:g} mm",
        f"the newest {same_grasp.MOST_LOGS:,} logs or {power(same_grasp.MOST_COMPARED)} frames",
        f"are in the other to {same_grasp.NOISE_SHARE:g} of its noise",
        f"or to {1e4 * same_grasp.ROUNDING_SHARE:g} · 10⁻⁴ of the largest",
        f"the presets' ({1e3 * PILLARS['pitch']:g} mm, {1e3 * TAXELS['pitch']:g} mm)",
        f"nine pillars, {1e3 * PILLARS['pitch']:g} mm apart",
        "of {} × {} taxels, {:g} mm apart".format(*TAXELS["grid"], 1e3 * TAXELS["pitch"]),
    ),
    "api.md": (
        f"at most `limit` entries (1 to {common.MOST}, usually {common.USUAL})",
        f"With `wait` (at most {await_job.MOST_SECONDS:g} s)",
        f"one has at most {curate.MOST_ALIASES} aliases",
        f"With more than {fit_material.SAMPLED_AT_INGEST} logs this fit by `auto`",
        f"A JSON body has at most {bodies.MAX_JSON_BYTES // 1024} kB",
        f"the headers have {request_middleware.MOST_HEADER_BYTES // 1024} kB",
    ),
    "jobs.md": (
        f"logs of more than a million element-frames or {accept.LONG_FRAMES:,} frames",
        f"a material has at most {curate.MOST_ALIASES} aliases and {ownership.MOST_OWNERS} owners",
        f"`auto` looks at the samples as well while there are at most {fit_material.SAMPLED_AT_INGEST} logs",
        f"the runner looks at the worker process's {WORDS[round(1.0 / process_executor.WATCH_SECONDS)]} times a second",
    ),
    "problems.md": (
        f"`errors` lists the first {errors.MOST_TOLD}",
        f"less than {1e-3 * request_middleware.SLOWEST_BODY:g} kB/s beyond {request_middleware.BODY_SECONDS:g} s",
        f"found no room for this one within {fair_queue.WAIT_SECONDS:g} s",
    ),
    "settings.md": (
        f"only where they change the same row, at most {defaults.LOCK_TIMEOUT:g} s",
        f"A store that does not answer within {defaults.OBJECT_STORE_TIMEOUT:g} s",
        f"A process opens {defaults.POOL_SIZE + defaults.POSTGRESQL_POOL_OVERFLOW} connections at most",
        f"once that is over {receive.EXPANSION_FROM // 2**20} MiB",
    ),
    "security.md": (
        f"at most {connections.RECEIVED_BYTES // 1024} KiB wait as bytes and "
        f"{websockets.PARSED_BYTES // 1024} KiB as messages",
        f"with {reading.MEMORY_BYTES // 2**30} GiB of address space",
        f"revoked within {WORDS[authentication.KEPT_SECONDS]} seconds",
    ),
    "cli.md": (
        f"| {exit_codes.FAILURE} | failure of Stiction itself",
        f"| {exit_codes.INPUT_REFUSED} | input refused",
        f"| {exit_codes.SERVICE_REFUSED} | the service can't be reached",
        f"| {exit_codes.NOT_FEASIBLE} | no normal force holds the load",
        f"| {exit_codes.INTERRUPTED} | interrupted (Ctrl-C)",
    ),
    "client.md": (
        f"requests wait at most {client.TIMEOUT:g} s (`timeout=`)",
        f"is tried {WORDS[exchange.ATTEMPTS]} times",
        f"not if that is later than in {exchange.LONGEST_RETRY:g} s",
        f"a conservative quantile of μ ({coulomb.QUANTILE:g} by default",
        f"a fingertip's {1e6 * coulomb.FINGERTIP:g} mm² unless given",
        f'impratio="{mujoco.IMPRATIO}" noslip_iterations="{mujoco.NOSLIP_ITERATIONS}"',
    ),
    "slip-benchmark.md": tuple(
        f"| `{kind.name}` | {told} | {kind.frame_rate:g} |"
        for kind, told in zip(
            kinds.KINDS.values(),
            (
                "displacement (x, y, z) and forces at {:g} mm, as Tac3D",
                "displacement and force of separate pillars at {:g} mm, as a PapillArray",
                "displacement in the plane at {:g} mm, and which markers touch; no forces",
                "displacement (x, y, z) at {:g} mm, no forces, as GelSight with depth",
            ),
            strict=True,
        )
        for told in (told.format(1e3 * kind.pitch),)
    ),
}
"""What the pages say, made of the numbers that the code goes by."""


@pytest.mark.parametrize(("page", "sentence"), [(page, each) for page, told in STATED.items() for each in told])
def test_a_bound_that_a_page_states_is_the_one_that_is_kept(page: str, sentence: str) -> None:
    text = re.sub(r"\s+", " ", (DOCS / page).read_text(encoding="utf-8"))
    assert sentence in text
