"""Take in a grasp log: stream it to disk, look whether it is one, store it with its ingest job."""

import asyncio
from collections.abc import AsyncIterator
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session
from starlette.requests import ClientDisconnect

from db.blobs import Spool
from db.errors import AlreadyExists
from db.records import NewGraspLog
from db.repositories import grasp_logs, jobs, materials
from service import formats
from service.context import Context
from service.formats import tracked_markers
from service.idempotency import Answer, Once, answer_once
from service.problems import (
    INVALID_GRASP_LOG,
    INVALID_REQUEST,
    UNSUPPORTED_FORMAT,
    UPLOAD_INTERRUPTED,
    UPLOAD_TOO_LARGE,
    Problem,
)
from service.schemas import GraspLogOut
from slipcore.errors import InvalidInput
from slipcore.methods import METHODS

CHUNK_BYTES = 2**20
"""Bytes gathered before a thread hashes and writes them: about a millisecond of work."""

LONGEST_SENSOR_NAME = 200


@dataclass(frozen=True, slots=True)
class Wish:
    """What the uploader says of a log: its material, sensor and detector, the content type of its bytes, and of
    tracked markers the scale (m per pixel) and frame rate (1/s).
    """

    material: str | None
    sensor: str | None
    detector: str
    content_type: str | None
    content_length: int | None
    scale: float | None = None
    frame_rate: float | None = None
    once: Once | None = None


async def upload(context: Context, chunks: AsyncIterator[bytes], wish: Wish) -> Answer:
    """Store a log and queue its ingest.

    Raises ``Problem`` for what cannot be taken, ``NotFound`` for an unknown material. Nothing stays of a log that is
    not taken.
    """
    _check_size(wish.content_length or 0, context.settings.max_upload_bytes)
    material_id = await asyncio.to_thread(_check, context, wish)
    with context.blobs.spool() as spool:
        await _receive(spool, _with_settings(chunks, wish), context.settings.max_upload_bytes)
        described = await asyncio.to_thread(_describe, spool, wish, material_id)
        once = wish.once and wish.once.about(spool.sha256)
        return await asyncio.to_thread(_store, context, spool, described, once)


def _check(context: Context, wish: Wish) -> int | None:
    """What can be told before the bytes are there; returns the material's key."""
    if wish.detector not in METHODS:
        raise Problem.wrong_value(INVALID_REQUEST, "detector", wish.detector, ", ".join(METHODS))
    if wish.material is None:
        return None
    with context.database.read() as session:
        return materials.find_id(session, wish.material)


def _check_size(size: int, limit: int) -> None:
    if size > limit:
        raise Problem.wrong_value(UPLOAD_TOO_LARGE, "body", f"{size} bytes or more", f"at most {limit} bytes")


async def _with_settings(chunks: AsyncIterator[bytes], wish: Wish) -> AsyncIterator[bytes]:
    """The body with the given scale and frame rate as its first lines, so that what is stored tells all."""
    settings = tracked_markers.settings_lines(wish.scale, wish.frame_rate)
    async for chunk in chunks:
        if settings and chunk:
            if chunk.startswith(b"PK"):
                allowed = "only beside a table of tracked markers: other formats are in SI units"
                raise Problem.wrong_value(INVALID_REQUEST, "scale, frame_rate", "given with a zip", allowed)
            yield settings
            settings = b""
        yield chunk


async def _receive(spool: Spool, chunks: AsyncIterator[bytes], limit: int) -> None:
    waiting = bytearray()
    try:
        async for chunk in chunks:
            _check_size(spool.size + len(waiting) + len(chunk), limit)
            waiting += chunk
            if len(waiting) >= CHUNK_BYTES:
                await asyncio.to_thread(spool.write, bytes(waiting))
                waiting.clear()
    except ClientDisconnect as error:
        raise Problem(UPLOAD_INTERRUPTED, f"the connection ended after {spool.size + len(waiting)} bytes") from error
    await asyncio.to_thread(spool.write, bytes(waiting))


def _describe(spool: Spool, wish: Wish, material_id: int | None) -> NewGraspLog:
    spool.flush()
    try:
        name = formats.identify(spool.path, wish.content_type)
        log = formats.read(spool.path, wish.content_type)
    except formats.UnsupportedFormat as error:
        raise Problem.wrong_value(UNSUPPORTED_FORMAT, error.name, error.value, error.allowed) from error
    except InvalidInput as error:
        raise Problem.wrong_value(INVALID_GRASP_LOG, error.name, error.value, error.allowed) from error
    return NewGraspLog(
        sha256=spool.sha256,
        bytes=spool.size,
        format=name,
        detector=wish.detector,
        material_id=material_id,
        sensor=_sensor_name(wish.sensor or log.sensor),
        frames=len(log),
        duration=float(log.time[-1] - log.time[0]),
        grid=log.grid,
    )


def _sensor_name(name: str) -> str:
    if not 0 < len(name) <= LONGEST_SENSOR_NAME or not name.isprintable():
        allowed = f"1 to {LONGEST_SENSOR_NAME} printable characters"
        raise Problem.wrong_value(INVALID_GRASP_LOG, "sensor", repr(name), allowed)
    return name


def _store(context: Context, spool: Spool, log: NewGraspLog, once: Once | None) -> Answer:
    """First the blob, durably, then the rows that refer to it."""
    spool.keep()
    queued: list[str] = []
    with context.database.write() as session:
        answer = answer_once(session, once, lambda: _accept(session, log, queued))
    for job_id in queued:
        context.jobs.submit(job_id)
    return answer


def _accept(session: Session, log: NewGraspLog, queued: list[str]) -> Answer:
    """Store a new log with its job; a known one whose job failed, which is our fault, gets another try."""
    if log.material_id is not None:  # it may have been merged into another while the log came in
        log = replace(log, material_id=materials.still(session, log.material_id))
    try:
        log_id, status = grasp_logs.add(session, log), 202
        queued.append(jobs.add(session, "ingest", "ols", material_id=log.material_id, grasp_log_id=log_id))
    except AlreadyExists:
        log_id, status = grasp_logs.find_id(session, log.sha256, log.material_id, log.detector), 200
        job = grasp_logs.get(session, log_id).job
        if job.status == "failed":
            jobs.requeue(session, job.id)
            queued.append(job.id)
    body = GraspLogOut.of(grasp_logs.get(session, log_id)).model_dump(mode="json")
    return Answer(status, f"/v1/grasp-logs/{log_id}", body)
