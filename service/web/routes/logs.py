"""One grasp log: what became of it, and the frames that its player shows."""

from functools import partial

from fastapi import APIRouter, Request, Response

from db.records import Detection, StoredGraspLog
from db.repositories import grasp_logs
from service.domain.errors import ResultsNotReady
from service.domain.materials.curate import counts_instead
from service.domain.resources.context import Context
from service.http.access import READ, CurrentPrincipal
from service.http.conditional import KEEP_AND_ASK, is_one_of, unchanged
from service.http.dependencies import CurrentContext
from service.http.fair_route import FairRoute
from service.http.long_answers import LONG_ANSWER
from service.web import reports
from service.web.derived import derive
from service.web.frames import write_frames
from service.web.rendering import render

router = APIRouter(include_in_schema=False, route_class=FairRoute)


@router.get("/logs/{id}", dependencies=[READ])
def show_log(context: CurrentContext, request: Request, id: str) -> Response:  # noqa: A002  (the path's own name)
    """State, findings and player of a log; raises ``NotFound``."""
    log = _find(context, id)
    is_kept = log.detection is not None and context.blobs.has(log.detection.history_blob)
    return render(request, "log.html", log=log, is_kept=is_kept, other=counts_instead(context, id))


@router.get("/logs/{id}/frames", dependencies=[READ, LONG_ANSWER])
async def read_frames(context: CurrentContext, request: Request, principal: CurrentPrincipal, id: str) -> Response:  # noqa: A002
    """What the player shows (``service.web.frames``), made in a reader's process; raises ``ResultsNotReady``."""
    log, detection = await context.threads.run(principal.share, _find_results, context, id)
    tag = f'"{detection.history_blob[:32]}{"" if log.has_file else "-"}"'
    if is_one_of(tag, request.headers.get("if-none-match", "")):
        return unchanged(tag)
    wanted = [detection.history_blob, *([log.sha256] if log.has_file else [])]
    history, *upload = await context.files(principal.share, wanted)
    write = partial(write_frames, history, upload[0] if upload else None)
    headers = {"ETag": tag, "Cache-Control": KEEP_AND_ASK}
    return await derive(context, principal, log.format, write, headers=headers, media_type="application/octet-stream")


@router.get("/logs/{id}/report", dependencies=[READ, LONG_ANSWER])
async def read_report(context: CurrentContext, principal: CurrentPrincipal, id: str) -> Response:  # noqa: A002
    """The log's report, as one file; raises ``ResultsNotReady``."""
    log, detection = await context.threads.run(principal.share, _find_results, context, id)
    if log.samples is None:
        raise ResultsNotReady(log.job.id, log.job.status)
    wanted = [detection.history_blob, log.samples.samples_blob, *([log.sha256] if log.has_file else [])]
    history, samples, *upload = await context.files(principal.share, wanted)
    write = partial(reports.write_log, log, history, samples, upload[0] if upload else None)
    return await reports.show(context, principal, log.format, write)


def _find_results(context: Context, log_id: str) -> tuple[StoredGraspLog, Detection]:
    """A log and what was detected in it."""
    log = _find(context, log_id)
    if log.detection is None:
        raise ResultsNotReady(log.job.id, log.job.status)
    return log, log.detection


def _find(context: Context, log_id: str) -> StoredGraspLog:
    with context.database.read() as session:
        return grasp_logs.get(session, log_id)
