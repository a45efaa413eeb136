"""The two clients, one waiting and one awaiting: they carry out what ``calls`` describes."""

import asyncio
import math
import time
import zlib
from collections.abc import Mapping, Sequence
from contextlib import aclosing, closing
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx

from stiction_client import calls, head_timeout
from stiction_client.address import authorization, checked, service_address
from stiction_client.arguments import for_json, number
from stiction_client.container import GraspLogLike
from stiction_client.errors import AnswerTooLarge, ConnectionFailed
from stiction_client.exchange import Call, Ended, Pause, Reply, Request, T, advance
from stiction_client.model import FrictionModel
from stiction_client.records import AuditEntry, FrictionAnswer, GraspLogReceipt, Job, Material, NextGrasp, Recognition

TIMEOUT = 30.0
"""s to wait for more of a request to leave or for an answer to begin, and until that is whole."""

LONGEST_TIMEOUT = 86400.0
"""s that may be given."""

CONNECT_TIMEOUT = 5.0
"""s; a host that doesn't answer by then isn't there."""

JOB_TIMEOUT = 300.0
"""s; a fit of 200,000 samples takes seconds, a queue before it may take minutes."""

MOST_ANSWER_BYTES = 2**26
"""Bytes of an answer once it is unpacked; a page of a list has some MB."""

UNPACKED = "gzip"
"""How an answer may be packed: others unpack a few bytes to gigabytes at once, and stay as they are."""

GZIP = zlib.MAX_WBITS | 16
"""By which zlib knows that format."""


class FrictionClient:
    """A Stiction service over one kept-open connection; use it as a context manager, or ``close`` it.

    ``url`` and ``key``, sent as ``Authorization: Bearer``, are by default those of the environment, ``STICTION_URL``
    and ``STICTION_KEY``, or this machine's service without a key; ``timeout`` s holds for each wait; ``transport``
    replaces the network, as in tests. The head of an answer is whole ``timeout`` s after the request has left, and all
    of it as long after, or it counts as a broken connection; it has 64 MiB at most. Where the connection breaks or the
    service is busy or away (429; 502, 503, 504), a request is tried three times, not before the service asks for it;
    the service does it once: what would be done again is tried again only where it was not done (429, 503). Models are
    kept: one younger than ``stale_after`` s isn't asked for again, an older one isn't sent again unless it changed, and
    where the service can't be reached, or a proxy says so, the last one is used with a ``StaleModel`` warning.

    Every call raises ``ConnectionFailed``, ``ProblemError`` (the service refused) or ``UnexpectedAnswer``.
    """

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        transport: httpx.BaseTransport | None = None,
        *,
        timeout: float = TIMEOUT,
        stale_after: float = 0.0,
    ) -> None:
        self._kept: dict[str, calls.CachedModel] = {}
        self._names: calls.Names = set()
        self._stale_after = _stale_after(stale_after)
        self._http = httpx.Client(**_options(url, key, timeout), transport=transport)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def upload(
        self,
        log: GraspLogLike | Path | str,
        material: str | None = None,
        sensor: str | None = None,
        detector: str | None = None,
        scale: float | None = None,
        frame_rate: float | None = None,
        mapping: Mapping[str, Any] | str | None = None,
        rest: str | int | None = None,
    ) -> GraspLogReceipt:
        """Upload a grasp log: a record, a file, or a Tac3D recording folder.

        With ``material`` the service refits that material once the slip is detected; follow with ``wait``. The same
        content twice is one log. ``sensor`` and ``detector`` default to what the log and the service say.
        ``scale`` (m per pixel) and ``frame_rate`` (1/s) are for a table of tracked markers that does not state them,
        ``mapping`` (or the name of a preset) for a recording whose topics, fields or columns have names of their own,
        ``rest`` the frame of either in which nothing touches: "first", "least contact" or its number.
        """
        return self._run(calls.upload(log, material, sensor, detector, scale, frame_rate, mapping, rest))

    def grasp_log(self, id: str) -> GraspLogReceipt:  # noqa: A002 - the API's own name
        """A grasp log by its id, with what was detected."""
        return self._run(calls.grasp_log(id))

    def grasp_logs(self, material: str | None = None, limit: int | None = 100) -> list[GraspLogReceipt]:
        """The newest logs, newest first: of one ``material``, or all."""
        return self._run(calls.grasp_logs(material, limit))

    def create_material(self, name: str, description: str = "") -> Material:
        """Create a material; ``ProblemError`` of type "/problems/material-exists" where it is there."""
        return self._run(calls.create_material(name, description))

    def ensure_material(self, name: str, description: str = "") -> Material:
        """The material of this name, created where it isn't there (its description then stays as it was)."""
        return self._run(calls.ensure_material(name, description))

    def material(self, name: str) -> Material:
        """A material with its current models."""
        return self._run(calls.material(name))

    def materials(self) -> list[Material]:
        """All materials."""
        return self._run(calls.materials())

    def rename_material(self, name: str, new_name: str) -> Material:
        """Rename a material; the old name stays an alias of it."""
        return self._run(calls.rename_material(name, new_name))

    def merge_materials(self, name: str, source: str) -> Material:
        """Move the logs and names of ``source`` to the material ``name``, for good; its models are fitted again."""
        return self._run(calls.merge_materials(name, source))

    def begin_epoch(self, name: str, reason: str, first: GraspLogReceipt | str | None = None) -> Material:
        """Let all logs of a material before its ``first`` of a changed surface, or all until now, count no more."""
        return self._run(calls.begin_epoch(name, reason, None if first is None else _id(first)))

    def withdraw(self, log: GraspLogReceipt | str, reason: str) -> GraspLogReceipt:
        """Let a log count in no fit any more; it is kept, with the reason.

        Where it is a copy that a merge left behind, ``counts_instead`` names the log to withdraw.
        """
        return self._run(calls.withdraw(_id(log), reason))

    def model(self, name: str, method: str = "auto") -> FrictionModel:
        """The current model of a material, to be kept and evaluated here: of one method, or the recommended one.

        Raises ``NoModel`` where there is none.
        """
        return self._run(calls.model(name, method, self._kept, self._stale_after))

    def friction(
        self,
        name: str,
        v: float,
        fn: float,
        quantile: float | None = None,
        method: str | None = None,
        *,
        of: str | None = None,
        elements: int | None = None,
        sensor: str | None = None,
        element_area: float | None = None,
    ) -> FrictionAnswer:
        """Friction at velocity ``v`` m/s and ``fn`` N an element: the mean, or a quantile of what a new grasp shows.

        The quantile is ``of`` one "element", or of the mean over the ``elements`` of a "contact" (the default where
        these are given). Where the model knows the ``sensor`` that grasps, friction is as that one shows it. Elements
        are of ``element_area`` m², the model's where it is not given (``answer.element_area``).
        """
        asked = {"v": v, "fn": fn, "quantile": quantile, "method": method, "of": of, "elements": elements}
        return self._run(calls.friction(name, asked | {"sensor": sensor, "element_area": element_area}, self._names))

    def next_grasp(
        self,
        name: str,
        fn: float | None = None,
        v: float = 0.0,
        quantile: float = 1e-2,
        elements: int = 60,
        *,
        method: str | None = None,
        load: float = 0.0,
        drop_probability: float = 1e-3,
        sensor: str | None = None,
    ) -> NextGrasp:
        """What to record next, to know friction at ``fn`` N an element and ``v`` m/s best per second of robot time.

        Without ``fn`` in the middle of the data; ``quantile`` and ``elements`` as a planner asks for them. The contact
        bears ``load`` N meanwhile, which it drops with at most ``drop_probability``. ``sensor``: that grasps.
        """
        asked = {"fn": fn, "v": v, "quantile": quantile, "elements": elements, "method": method}
        bounds = {"load": load, "drop_probability": drop_probability, "sensor": sensor}
        return self._run(calls.next_grasp(name, asked | bounds, self._names))

    def recognise(
        self,
        grasp: Any,
        materials: Sequence[str] | None = None,
        method: str | None = None,
        *,
        sensor: str | None = None,
    ) -> Recognition:
        """Which material a grasp was of: a stored log (its receipt or id), or friction samples as slipcore gives them.

        ``materials``: which it may be, at most 100; without, all that have a model. Compared are the models of
        ``method``, or without one each material's recommended one, as the ``sensor`` shows them, without one a stored
        log's own.
        """
        return self._run(calls.recognise(grasp, materials, method, sensor))

    def fit(self, name: str, method: str = "auto", seed: int = 0) -> Job:
        """Fit a material over all its grasp logs; follow with ``wait``."""
        return self._run(calls.fit(name, method, seed))

    def job(self, id: str) -> Job:  # noqa: A002 - the API's own name
        """A job as it stands."""
        return self._run(calls.job(id))

    def jobs(self, status: str | None = None, limit: int | None = 100) -> list[Job]:
        """The newest jobs, newest first: of one ``status``, such as "failed", or all."""
        return self._run(calls.jobs(status, limit))

    def cancel(self, job: Job | GraspLogReceipt | str) -> Job:
        """End a job that nobody wants any more; ``ProblemError`` where it has ended otherwise."""
        return self._run(calls.cancel(_job_id(job)))

    def owners(self, name: str) -> list[str]:
        """Whose a material is: ``key:ID`` and ``group:NAME``; without any, the keys' scopes alone decide."""
        return self._run(calls.owners(name))

    def add_owner(self, name: str, owner: str) -> list[str]:
        """Let ``key:ID`` or ``group:NAME`` own a material, too, and get all its owners."""
        return self._run(calls.add_owner(name, owner))

    def remove_owner(self, name: str, owner: str) -> None:
        """Take a material from an owner."""
        self._run(calls.remove_owner(name, owner))

    def sensors(self) -> list[dict[str, Any]]:
        """All sensors: their ``name`` and ``gel``, None where nobody described it."""
        return self._run(calls.sensors())

    def describe_sensor(
        self,
        name: str,
        young_modulus: float,
        poisson_ratio: float,
        thickness: float | None = None,
        marker_depth: float = 0.0,
        relative_thickness: Sequence[Sequence[float]] | None = None,
    ) -> dict[str, Any]:
        """Describe a sensor's gel (Pa, m; thickness None or inf: a half-space); forces of its logs then follow.

        ``relative_thickness`` [n, m]: of one that is not alike thick everywhere, at each marker, over ``thickness``.
        """
        gel = _gel(young_modulus, poisson_ratio, thickness, marker_depth, relative_thickness)
        return self._run(calls.describe_sensor(name, gel))

    def calibrate_sensor(self, name: str, presses: Mapping[str, float | None]) -> dict[str, Any]:
        """Learn a sensor's faults from stored logs of a body pressed straight down, by which its later logs are then
        corrected; ``presses``: by the id of each log the normal force of the press, N, or None where it is unknown.
        """
        return self._run(calls.calibrate_sensor(name, presses))

    def calibrations(self, name: str) -> list[dict[str, Any]]:
        """The newest calibrations of a sensor, the last first."""
        return self._run(calls.calibrations(name))

    def audit(
        self, actor: str | None = None, action: str | None = None, subject: str | None = None, limit: int | None = 100
    ) -> list[AuditEntry]:
        """The newest entries of the audit trail: who changed what, when, and from where. Needs a key of scope admin."""
        return self._run(calls.audit(actor, action, subject, limit))

    def wait(self, job: Job | GraspLogReceipt | str, timeout: float = JOB_TIMEOUT) -> Job:
        """Wait until a job has ended and return it, whatever its end; ``JobTimedOut`` after ``timeout`` s.

        A refusal is an answer (the data do not allow a fit), so it isn't raised: read ``status`` and ``reason``, or
        call ``raise_for_status()`` on the result.
        """
        return self._run(calls.wait(_job_id(job), timeout))

    def _run(self, call: Call[T]) -> T:
        answer: Reply = None
        while not isinstance(step := advance(call, answer), Ended):
            answer = self._carry_out(step)
        return step.result

    def _carry_out(self, step: Request | Pause) -> Reply:
        if isinstance(step, Pause):
            time.sleep(step.seconds)
            return None
        try:
            answer = self._http.send(_http_request(self._http, step), stream=True)
            with closing(answer):
                content = _Content(answer)
                for part in answer.iter_bytes():
                    content.add(part)
            return content.whole()
        except httpx.RequestError as error:
            return _broken(step, error)
        except AnswerTooLarge as error:
            return error


class AsyncFrictionClient:
    """``FrictionClient`` for asyncio: the same calls with the same meaning, awaited."""

    def __init__(
        self,
        url: str | None = None,
        key: str | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
        *,
        timeout: float = TIMEOUT,
        stale_after: float = 0.0,
    ) -> None:
        self._kept: dict[str, calls.CachedModel] = {}
        self._names: calls.Names = set()
        self._stale_after = _stale_after(stale_after)
        self._http = httpx.AsyncClient(**_options(url, key, timeout), transport=transport)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the connection."""
        await self._http.aclose()

    async def upload(
        self,
        log: GraspLogLike | Path | str,
        material: str | None = None,
        sensor: str | None = None,
        detector: str | None = None,
        scale: float | None = None,
        frame_rate: float | None = None,
        mapping: Mapping[str, Any] | str | None = None,
        rest: str | int | None = None,
    ) -> GraspLogReceipt:
        """As ``FrictionClient.upload``."""
        return await self._run(calls.upload(log, material, sensor, detector, scale, frame_rate, mapping, rest))

    async def grasp_log(self, id: str) -> GraspLogReceipt:  # noqa: A002 - the API's own name
        """As ``FrictionClient.grasp_log``."""
        return await self._run(calls.grasp_log(id))

    async def grasp_logs(self, material: str | None = None, limit: int | None = 100) -> list[GraspLogReceipt]:
        """As ``FrictionClient.grasp_logs``."""
        return await self._run(calls.grasp_logs(material, limit))

    async def create_material(self, name: str, description: str = "") -> Material:
        """As ``FrictionClient.create_material``."""
        return await self._run(calls.create_material(name, description))

    async def ensure_material(self, name: str, description: str = "") -> Material:
        """As ``FrictionClient.ensure_material``."""
        return await self._run(calls.ensure_material(name, description))

    async def material(self, name: str) -> Material:
        """As ``FrictionClient.material``."""
        return await self._run(calls.material(name))

    async def materials(self) -> list[Material]:
        """As ``FrictionClient.materials``."""
        return await self._run(calls.materials())

    async def rename_material(self, name: str, new_name: str) -> Material:
        """As ``FrictionClient.rename_material``."""
        return await self._run(calls.rename_material(name, new_name))

    async def merge_materials(self, name: str, source: str) -> Material:
        """As ``FrictionClient.merge_materials``."""
        return await self._run(calls.merge_materials(name, source))

    async def begin_epoch(self, name: str, reason: str, first: GraspLogReceipt | str | None = None) -> Material:
        """As ``FrictionClient.begin_epoch``."""
        return await self._run(calls.begin_epoch(name, reason, None if first is None else _id(first)))

    async def withdraw(self, log: GraspLogReceipt | str, reason: str) -> GraspLogReceipt:
        """As ``FrictionClient.withdraw``."""
        return await self._run(calls.withdraw(_id(log), reason))

    async def model(self, name: str, method: str = "auto") -> FrictionModel:
        """As ``FrictionClient.model``."""
        return await self._run(calls.model(name, method, self._kept, self._stale_after))

    async def friction(
        self,
        name: str,
        v: float,
        fn: float,
        quantile: float | None = None,
        method: str | None = None,
        *,
        of: str | None = None,
        elements: int | None = None,
        sensor: str | None = None,
        element_area: float | None = None,
    ) -> FrictionAnswer:
        """As ``FrictionClient.friction``."""
        asked = {"v": v, "fn": fn, "quantile": quantile, "method": method, "of": of, "elements": elements}
        return await self._run(
            calls.friction(name, asked | {"sensor": sensor, "element_area": element_area}, self._names)
        )

    async def next_grasp(
        self,
        name: str,
        fn: float | None = None,
        v: float = 0.0,
        quantile: float = 1e-2,
        elements: int = 60,
        *,
        method: str | None = None,
        load: float = 0.0,
        drop_probability: float = 1e-3,
        sensor: str | None = None,
    ) -> NextGrasp:
        """As ``FrictionClient.next_grasp``."""
        asked = {"fn": fn, "v": v, "quantile": quantile, "elements": elements, "method": method}
        bounds = {"load": load, "drop_probability": drop_probability, "sensor": sensor}
        return await self._run(calls.next_grasp(name, asked | bounds, self._names))

    async def recognise(
        self,
        grasp: Any,
        materials: Sequence[str] | None = None,
        method: str | None = None,
        *,
        sensor: str | None = None,
    ) -> Recognition:
        """As ``FrictionClient.recognise``."""
        return await self._run(calls.recognise(grasp, materials, method, sensor))

    async def fit(self, name: str, method: str = "auto", seed: int = 0) -> Job:
        """As ``FrictionClient.fit``."""
        return await self._run(calls.fit(name, method, seed))

    async def job(self, id: str) -> Job:  # noqa: A002 - the API's own name
        """As ``FrictionClient.job``."""
        return await self._run(calls.job(id))

    async def jobs(self, status: str | None = None, limit: int | None = 100) -> list[Job]:
        """As ``FrictionClient.jobs``."""
        return await self._run(calls.jobs(status, limit))

    async def cancel(self, job: Job | GraspLogReceipt | str) -> Job:
        """As ``FrictionClient.cancel``."""
        return await self._run(calls.cancel(_job_id(job)))

    async def owners(self, name: str) -> list[str]:
        """As ``FrictionClient.owners``."""
        return await self._run(calls.owners(name))

    async def add_owner(self, name: str, owner: str) -> list[str]:
        """As ``FrictionClient.add_owner``."""
        return await self._run(calls.add_owner(name, owner))

    async def remove_owner(self, name: str, owner: str) -> None:
        """As ``FrictionClient.remove_owner``."""
        await self._run(calls.remove_owner(name, owner))

    async def sensors(self) -> list[dict[str, Any]]:
        """As ``FrictionClient.sensors``."""
        return await self._run(calls.sensors())

    async def describe_sensor(
        self,
        name: str,
        young_modulus: float,
        poisson_ratio: float,
        thickness: float | None = None,
        marker_depth: float = 0.0,
        relative_thickness: Sequence[Sequence[float]] | None = None,
    ) -> dict[str, Any]:
        """As ``FrictionClient.describe_sensor``."""
        gel = _gel(young_modulus, poisson_ratio, thickness, marker_depth, relative_thickness)
        return await self._run(calls.describe_sensor(name, gel))

    async def calibrate_sensor(self, name: str, presses: Mapping[str, float | None]) -> dict[str, Any]:
        """As ``FrictionClient.calibrate_sensor``."""
        return await self._run(calls.calibrate_sensor(name, presses))

    async def calibrations(self, name: str) -> list[dict[str, Any]]:
        """As ``FrictionClient.calibrations``."""
        return await self._run(calls.calibrations(name))

    async def audit(
        self, actor: str | None = None, action: str | None = None, subject: str | None = None, limit: int | None = 100
    ) -> list[AuditEntry]:
        """As ``FrictionClient.audit``."""
        return await self._run(calls.audit(actor, action, subject, limit))

    async def wait(self, job: Job | GraspLogReceipt | str, timeout: float = JOB_TIMEOUT) -> Job:
        """As ``FrictionClient.wait``."""
        return await self._run(calls.wait(_job_id(job), timeout))

    async def _run(self, call: Call[T]) -> T:
        answer: Reply = None
        while not isinstance(step := advance(call, answer), Ended):
            answer = await self._carry_out(step)
        return step.result

    async def _carry_out(self, step: Request | Pause) -> Reply:
        if isinstance(step, Pause):
            await asyncio.sleep(step.seconds)
            return None
        try:
            answer = await self._http.send(_http_request(self._http, step), stream=True)
            async with aclosing(answer):
                content = _Content(answer)
                async for part in answer.aiter_bytes():
                    content.add(part)
            return content.whole()
        except httpx.RequestError as error:
            return _broken(step, error)
        except AnswerTooLarge as error:
            return error


class _Content:
    """The content of an answer as it comes, within bounds, whoever answers.

    Raises ``AnswerTooLarge`` for more than is taken, ``httpx.ReadTimeout`` for what takes too long, and
    ``httpx.DecodingError`` for what is not packed as it says, or ends before that does.
    """

    def __init__(self, answer: httpx.Response) -> None:
        self._answer = answer
        self._content = bytearray()
        self._deadline = time.monotonic() + answer.request.extensions["timeout"]["read"]
        packed = answer.headers.pop("content-encoding", "").strip().lower()  # else it would come without its end, too
        is_packed = packed == UNPACKED and not answer.is_stream_consumed
        self._unpacker = zlib.decompressobj(GZIP) if is_packed else None
        self._has_begun = False

    def add(self, part: bytes) -> None:
        request = self._answer.request
        if self._unpacker is not None:
            self._has_begun |= bool(part)
            try:
                part = self._unpacker.decompress(part, MOST_ANSWER_BYTES + 1 - len(self._content))
            except zlib.error as error:
                raise httpx.DecodingError(f"the answer is no gzip stream: {error}", request=request) from error
        self._content += part
        if len(self._content) > MOST_ANSWER_BYTES:
            raise AnswerTooLarge(f"{request.url} answered with more than {MOST_ANSWER_BYTES} bytes")
        if time.monotonic() > self._deadline:
            raise httpx.ReadTimeout("the answer began, and was not whole in time", request=request)

    def whole(self) -> httpx.Response:
        """The answer with its content, unpacked."""
        status, headers, request = self._answer.status_code, self._answer.headers, self._answer.request
        if self._unpacker is not None and self._has_begun and not self._unpacker.eof:
            raise httpx.DecodingError("the answer is a gzip stream without its end", request=request)
        return httpx.Response(status, headers=headers, content=bytes(self._content), request=request)


def _stale_after(seconds: float) -> float:
    return number("stale_after", seconds, 0.0, math.inf, "s")


def _options(url: str | None, key: str | None, timeout: float) -> dict[str, Any]:
    authorized = authorization(key)
    timeout = number("timeout", timeout, 0.0, LONGEST_TIMEOUT, "s")
    return {
        "base_url": service_address(url),
        "headers": {"Accept-Encoding": UNPACKED} | authorized,
        "timeout": httpx.Timeout(timeout, connect=min(timeout, CONNECT_TIMEOUT)),
    }


def _http_request(http: httpx.Client | httpx.AsyncClient, request: Request) -> httpx.Request:
    given = {
        "Content-Type": request.content_type,
        "Idempotency-Key": request.idempotency_key,
        "If-None-Match": request.tag,
    }
    headers = {name: value for name, value in given.items() if value is not None}
    answered_within = (http.timeout.read or 0.0) + request.wait_seconds
    bounded = head_timeout.bounded_async if isinstance(http, httpx.AsyncClient) else head_timeout.bounded
    with checked(request.path):
        return http.build_request(
            request.method,
            request.path,
            params=dict(request.params),
            json=for_json("body", request.json),
            content=request.content,
            headers=headers,
            timeout=httpx.Timeout(**http.timeout.as_dict() | {"read": answered_within}),
            extensions={"trace": bounded(answered_within)},
        )


def _broken(request: Request, error: httpx.RequestError) -> ConnectionFailed:
    failure = ConnectionFailed(f"{request.method} {request.path}: {type(error).__name__}: {error}")
    failure.__cause__ = error
    return failure


def _id(log: GraspLogReceipt | str) -> str:
    return log if isinstance(log, str) else log.id


def _job_id(job: Job | GraspLogReceipt | str) -> str:
    if isinstance(job, GraspLogReceipt):
        return job.job.id
    return job.id if isinstance(job, Job) else job


def _gel(
    young_modulus: float,
    poisson_ratio: float,
    thickness: float | None,
    marker_depth: float,
    relative_thickness: Sequence[Sequence[float]] | None,
) -> dict[str, Any]:
    gel: dict[str, Any] = {
        "young_modulus": young_modulus,
        "poisson_ratio": poisson_ratio,
        "thickness": None if thickness == math.inf else thickness,  # JSON has no infinity
        "marker_depth": marker_depth,
    }
    if relative_thickness is not None:  # which older services do not know
        gel["relative_thickness"] = relative_thickness
    return gel
