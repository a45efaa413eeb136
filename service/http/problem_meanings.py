"""What each type of problem means, and what to do about it: the texts of docs/problems.md, which a test compares."""

from typing import NamedTuple


class ProblemMeaning(NamedTuple):
    """When a problem comes, and what to do about it; the latter may go without saying."""

    when: str
    remedy: str


MEANINGS: dict[str, ProblemMeaning] = {
    "bad-request": ProblemMeaning(
        "The request cannot be understood as HTTP for this service.",
        "Mend the request.",
    ),
    "upload-interrupted": ProblemMeaning(
        "The connection ended before the whole body was there. Nothing is stored.",
        "Send it again.",
    ),
    "key-required": ProblemMeaning(
        "No access key was sent.",
        "`Authorization: Bearer KEY` (api.md).",
    ),
    "invalid-key": ProblemMeaning(
        "The access key is unknown, revoked, expired or garbled.",
        "Ask for a new one.",
    ),
    "insufficient-scope": ProblemMeaning(
        "The key may do less than this; `detail` says what it is for and what is needed.",
        "Use a key with that scope.",
    ),
    "cross-site-request": ProblemMeaning(
        "A request without a key would change something or open a stream, and a browser sent it for a "
        "page of another site (`Sec-Fetch-Site`, `Origin`).",
        "Ask from the service's own pages or from a program; send a key.",
    ),
    "not-owner": ProblemMeaning(
        "The material has owners (`owners` lists them), and the key is none of them.",
        "Let one of them, or an admin, add the key or its group (api.md).",
    ),
    "unknown-route": ProblemMeaning(
        "There is nothing under this path.",
        "See api.md.",
    ),
    "unknown-material": ProblemMeaning(
        "No material has this name or alias.",
        "`POST /v1/materials` first; `stiction upload --create` and the form of an upload can make it, too.",
    ),
    "unknown-alias": ProblemMeaning(
        "The material has no such alias (its own name is none).",
        "",
    ),
    "unknown-owner": ProblemMeaning(
        "The material has no such owner.",
        "",
    ),
    "unknown-calibration": ProblemMeaning(
        "The sensor has no calibration of this version.",
        "`GET /v1/sensors/{name}/calibrations` lists them.",
    ),
    "unknown-sensor": ProblemMeaning(
        "No sensor has this name: no log came from it, and nobody described it.",
        "",
    ),
    "unknown-grasp-log": ProblemMeaning(
        "No grasp log has this id.",
        "",
    ),
    "unknown-job": ProblemMeaning(
        "No job has this id.",
        "",
    ),
    "method-not-allowed": ProblemMeaning(
        "The path exists but not for this method; `Allow` lists those it takes.",
        "",
    ),
    "material-exists": ProblemMeaning(
        "A material of this name, or with such an alias, is there already.",
        "Use it, or choose another name.",
    ),
    "no-model": ProblemMeaning(
        "The material has no model by this method yet.",
        "Upload logs with slip and forces, or ask for a fit; look at the jobs' `reason`.",
    ),
    "no-feasible-force": ProblemMeaning(
        "No normal force holds the load; `largest_load` is the most that is held, at `normal_force` N; "
        "`cause` says whether physics, the limit, the range of the data (up to `largest_observed` N an element) "
        "or ignorance is why; `least_slip_probability` is the least with which a force holds (client.md).",
        "Do not lift it so: more contact area, more fingers; or record what the cause asks for.",
    ),
    "job-ended": ProblemMeaning(
        "The job has ended, so it cannot be cancelled any more.",
        "Look at its `status`.",
    ),
    "not-ready": ProblemMeaning(
        "The log's job has not got to this result, or failed before it.",
        "Look at the job; ask again once it is done.",
    ),
    "request-timeout": ProblemMeaning(
        "The body came too slowly: less than 10 kB/s beyond 20 s of patience. Nothing is stored.",
        "Send it over a better connection.",
    ),
    "file-deleted": ProblemMeaning(
        "The log is known, but its upload was old and is deleted.",
        "Send the same file again, which brings it back.",
    ),
    "precondition-failed": ProblemMeaning(
        "What is to be changed is not as `If-Match` says. Nothing is done.",
        "Read it again, and decide anew.",
    ),
    "upload-too-large": ProblemMeaning(
        "The body is larger than the service takes, or unpacks to more or to too many times its size (settings.md).",
        "Cut the recording.",
    ),
    "unsupported-format": ProblemMeaning(
        "The content type, content encoding or the file itself is none that the service reads, or its "
        "library is not installed (`allowed` names the extra that brings it).",
        "See formats.md.",
    ),
    "misdirected-request": ProblemMeaning(
        "A request without a key from this machine names another host: a web page may have made its name lead here.",
        "Ask `localhost` or `127.0.0.1`; send a key.",
    ),
    "invalid-grasp-log": ProblemMeaning(
        "The file is of a known format, but its content cannot be a grasp log: wrong shapes, numbers "
        "that are not finite, time that runs backwards, a single frame, absurd units, a truncated file.",
        "`name`, `value` and `allowed` say what is wrong.",
    ),
    "invalid-samples": ProblemMeaning(
        "Friction samples from which nothing follows: too few, or of no slip.",
        "`detail` says what is wrong.",
    ),
    "invalid-request": ProblemMeaning(
        "A parameter or a field of the body is missing, unknown or outside its range, or a parameter stands twice.",
        "`name`, `value` and `allowed` say what is wrong.",
    ),
    "idempotency-key-reused": ProblemMeaning(
        "Something else was asked under this `Idempotency-Key`. Nothing is done.",
        "Use a new key for a new request.",
    ),
    "too-many-requests": ProblemMeaning(
        "One key, or one address, asks more often than is set (settings.md).",
        "Try again after `Retry-After` seconds.",
    ),
    "quota-exceeded": ProblemMeaning(
        "One key has as many jobs queued, or logs or changes of the last day, as it may (settings.md).",
        "Try again after `Retry-After` seconds.",
    ),
    "headers-too-large": ProblemMeaning(
        "The headers have more than 16 kB.",
        "Send fewer.",
    ),
    "file-damaged": ProblemMeaning(
        "A stored file has other bytes than those that it was stored with (operations.md); nothing of it is sent.",
        "Send the same upload again, or take the file from a backup.",
    ),
    "internal-error": ProblemMeaning(
        "A defect of the service.",
        "Its log has the traceback.",
    ),
    "too-many-connections": ProblemMeaning(
        "`STICTION_MAX_CONNECTIONS` are busy already, or those of one address.",
        "Try again after `Retry-After` seconds, and keep connections open in place of making new ones.",
    ),
    "too-many-uploads": ProblemMeaning(
        "Too many files wait to be read already, or the server found no room for this one within 30 s "
        "(settings.md, `STICTION_READERS` and `STICTION_READING_BYTES`); or as many answers with long arrays or "
        "with files made for them are being sent as may be; or the machine is so busy that reading the file took four "
        "times what it may of CPU.",
        "Try again after `Retry-After` seconds, with fewer requests at once.",
    ),
    "stopping": ProblemMeaning(
        "The server was told to stop, and the request was not done within `STICTION_SHUTDOWN_SECONDS`. "
        "What it was to store may be stored.",
        "Ask again; an upload of the same content is stored once.",
    ),
    "workers-not-ready": ProblemMeaning(
        "Of `/readyz`: the workers are still warming up, or they take no jobs any more because the "
        "database is of a newer version.",
        "Wait; or run the newer version.",
    ),
    "file-missing": ProblemMeaning(
        "A file that a row refers to is not where files are kept: somebody or something deleted it.",
        "Restore it from a backup, or send the same upload again; `stiction db check` lists all that are missing.",
    ),
    "storage-unavailable": ProblemMeaning(
        "The database or the blob folder cannot be used now: locked, full or nearly so "
        "(`STICTION_LEAST_FREE_BYTES`), gone.",
        "Try again after `Retry-After` seconds.",
    ),
    "storage-quota-exceeded": ProblemMeaning(
        "One key has as many bytes of uploads stored as it may (settings.md).",
        "Ask for a larger quota, or for old uploads to be deleted.",
    ),
}
"""By the last part of the type's URI."""
