import asyncio
import gzip
import inspect
import json
import math
import zlib
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest

import stiction_client
from stiction_client import (
    AnswerTooLarge,
    AsyncFrictionClient,
    ConnectionFailed,
    ContactFriction,
    Finding,
    FrictionClient,
    GraspLogReceipt,
    InvalidArgument,
    JobCancelled,
    JobFailed,
    JobRefused,
    JobTimedOut,
    NoModel,
    ProblemError,
    StaleModel,
    UnexpectedAnswer,
    calls,
    container,
    exchange,
)

Ask = Callable[..., Any]
Service = Callable[..., Any]


def problem(status: int = 404, **fields: Any) -> httpx.Response:
    body = {"type": "/problems/unknown-material", "title": "No such material", "status": status, "detail": "no 'x'"}
    return httpx.Response(status, json=body | fields, headers={"Content-Type": "application/problem+json"})


def public_methods(kind: type) -> dict[str, inspect.Signature]:
    return {
        name: inspect.signature(member)
        for name, member in inspect.getmembers(kind, inspect.isfunction)
        if not name.startswith("_")
    }


def test_both_clients_offer_the_same_calls() -> None:
    assert public_methods(FrictionClient) == public_methods(AsyncFrictionClient)


def test_everything_public_is_there() -> None:
    for name in stiction_client.__all__:
        assert hasattr(stiction_client, name)
    with pytest.raises(AttributeError, match="'stiction_client' has no attribute 'Friction'"):
        stiction_client.Friction  # noqa: B018


def test_a_material_comes_with_its_models(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(answers.material)
    material = ask(server, "material", "paper 80.g")
    assert str(server.requests[0].url) == "http://stiction/v1/materials/paper%2080.g"
    assert (material.name, material.grasp_logs) == ("paper", 12)
    assert material.models["ols"].version == 3


def test_all_materials_are_listed(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(
        {"items": [answers.material] * 2, "next": "after those"}, {"items": [answers.material], "next": None}
    )
    assert [material.name for material in ask(server, "materials")] == ["paper"] * 3
    assert [request.url.params.get("cursor") for request in server.requests] == [None, "after those"]


def test_a_model_is_read_as_the_service_gave_it(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    model = ask(service(answers.material), "model", "paper")
    np.testing.assert_array_equal(model.coefficients, answers.model["coefficients"])
    np.testing.assert_array_equal(model.covariance, answers.model["covariance"])
    np.testing.assert_array_equal(model.identifiable, [True, True, False])
    assert (model.scale, model.n, model.degrees_of_freedom, model.element_area) == (0.021, 5120, 11.0, 1e-6)
    assert model.domain.normal_force == (0.002, 0.11)
    assert model.cost.seconds == 0.012


def test_no_degrees_of_freedom_means_a_normal_distribution(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    answers.material["models"]["ols"]["degrees_of_freedom"] = None
    assert ask(service(answers.material), "model", "paper").degrees_of_freedom == np.inf


@pytest.mark.parametrize(
    ("recommended", "method"), [({"method": "bayes", "because": "bayes: best"}, "bayes"), ("missing", "ols")]
)
def test_who_names_no_method_gets_the_recommended_model_or_least_squares_of_an_older_service(
    ask: Ask, service: Service, answers: SimpleNamespace, recommended: Any, method: str
) -> None:
    answers.material["models"]["bayes"] = answers.model | {"method": "bayes"}
    if recommended != "missing":
        answers.material["recommended"] = recommended
    model, named = (
        ask(service(answers.material), "model", "paper"),
        ask(service(answers.material), "model", "paper", "ols"),
    )
    assert (model.method, named.method) == (method, "ols")
    assert (model.chosen_because, named.chosen_because) == ("bayes: best" if method == "bayes" else None, None)


def test_models_that_are_kept_are_compared_once(service: Service, answers: SimpleNamespace) -> None:
    server = service(answers.material)
    with FrictionClient("http://stiction", stale_after=60.0, transport=httpx.MockTransport(server)) as client:
        assert client.model("paper") is client.model("paper")
        assert client.model("paper", "ols") is client.model("paper", "ols")
    assert len(server.requests) == 1


def test_a_model_says_that_another_of_the_same_logs_contradicts_it_and_so_does_a_grip_by_it(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    first = answers.model | {"outdated": False}
    other = first | {"method": "bayes", "coefficients": [0.3, -0.8, -0.35]}

    def told(other: dict[str, Any]) -> Any:
        return ask(
            service(answers.material | {"models": {"ols": first, other["method"]: other}}), "model", "paper", "ols"
        )

    grip = stiction_client.required_normal_force(told(other), 0.2, 0.05, contact_area=1e-4)
    assert "methods disagree by more than their intervals allow: bayes expects 0.299" in (grip.warning or "")
    independent = other | {"method": "conjugate", "diagnostics": {"assumes": "independent errors"}}
    for agreeing in (other | {"outdated": True}, other | {"coefficients": [0.409, -0.8, -0.35]}, independent):
        assert told(agreeing).diagnostics == first["diagnostics"]


def test_a_material_without_the_model_says_which_it_has(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    with pytest.raises(NoModel, match="'paper' has no fitted model of method 'bayes'; fitted: ols"):
        ask(service(answers.material), "model", "paper", method="bayes")


def test_friction_is_looked_up_with_what_was_given(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(answers.friction)
    answer = ask(server, "friction", "paper", 0.0, 0.05, quantile=0.05)
    assert dict(server.requests[0].url.params) == {"v": "0.0", "fn": "0.05", "quantile": "0.05"}
    assert (answer.friction_coefficient, answer.mean, answer.within_domain) == (0.36, 0.39, True)
    server.answers = [answers.friction | {"tangential_velocity": 1e-3, "method": "bayes"}]
    ask(server, "friction", "paper", 1e-3, 0.05, method="bayes")
    assert dict(server.requests[1].url.params) == {"v": "0.001", "fn": "0.05", "method": "bayes"}
    server.answers = [answers.friction]
    ask(server, "friction", "paper", 0.0, 0.05, sensor="left")
    assert server.requests[2].url.params["sensor"] == "left"


NEXT_GRASP = {
    "material": "paper",
    "method": "hierarchical",
    "version": 3,
    "normal_force": 0.05,
    "slip_length": 1e-3,
    "speed": 2e-3,
    "direction": 0.9,
    "seconds": 4.5,
    "uncertainty": 0.06,
    "after": 0.04,
    "conservative_friction": 0.31,
    "support": "not identified",
    "advice": "record more grasps",
    "notes": ["one sensor"],
}


def test_what_to_record_next_is_asked_for(ask: Ask, service: Service) -> None:
    server = service(NEXT_GRASP)
    answer = ask(server, "next_grasp", "paper", 0.05, load=1.0, sensor="left")
    assert server.requests[0].url.path == "/v1/materials/paper/next-grasp"
    asked = {"fn": "0.05", "v": "0.0", "quantile": "0.01", "elements": "60", "load": "1.0", "drop_probability": "0.001"}
    assert dict(server.requests[0].url.params) == asked | {"sensor": "left"}
    assert (answer.normal_force, answer.after, answer.support) == (0.05, 0.04, "not identified")
    assert (answer.beyond, answer.notes) == (None, ("one sensor",))


def test_a_material_is_created(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(httpx.Response(201, json=answers.material))
    assert ask(server, "create_material", "paper", description="80 g/m²").description == "80 g/m²"
    assert server.requests[0].read() == '{"name":"paper","description":"80 g/m²"}'.encode()


def test_ensuring_a_material_that_exists_returns_it(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(problem(409, type="/problems/material-exists"), answers.material)
    assert ask(server, "ensure_material", "paper").grasp_logs == 12
    assert [request.method for request in server.requests] == ["POST", "GET"]


def test_ensuring_a_material_passes_other_refusals_on(ask: Ask, service: Service) -> None:
    with pytest.raises(ProblemError, match="invalid-request"):
        ask(service(problem(422, type="/problems/invalid-request")), "ensure_material", "/")


def test_a_log_record_is_uploaded_as_its_container(
    ask: Ask, service: Service, answers: SimpleNamespace, log: Any
) -> None:
    server = service(httpx.Response(202, json=answers.grasp_log))
    receipt = ask(server, "upload", log, material="paper", detector="strain_rate")
    request = server.requests[0]
    assert request.headers["Content-Type"] == "application/vnd.stiction.grasp-log+npz"
    assert dict(request.url.params) == {"material": "paper", "detector": "strain_rate"}
    assert request.read() == container.encode(log)
    assert (receipt.id, receipt.grid, receipt.job.id, receipt.detection.samples) == ("g1", (20, 20), "j1", 1932)


def test_a_file_is_uploaded_as_it_is(ask: Ask, service: Service, answers: SimpleNamespace, tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    path.write_bytes(b"content")
    answers.grasp_log["detection"] = None
    server = service(answers.grasp_log)
    assert ask(server, "upload", path).detection is None
    assert server.requests[0].headers["Content-Type"] == "application/octet-stream"
    assert server.requests[0].read() == b"content"
    assert not server.requests[0].url.params


def test_a_recording_folder_is_uploaded_zipped(
    ask: Ask, service: Service, answers: SimpleNamespace, tmp_path: Path
) -> None:
    np.save(tmp_path / "index.npy", np.arange(3))
    server = service(answers.grasp_log)
    ask(server, "upload", str(tmp_path), sensor="left")
    assert server.requests[0].headers["Content-Type"] == "application/vnd.tac3d+zip"
    assert server.requests[0].read() == container.pack_folder(tmp_path)


def test_a_folder_without_fields_is_refused_here(ask: Ask, service: Service, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgument, match=r"without \.npy files"):
        ask(service({}), "upload", tmp_path)


def test_a_grasp_log_is_asked_for(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(answers.grasp_log)
    seen = ask(server, "grasp_log", "g1").detection
    assert (seen.events["onset"], seen.findings) == (181, None)  # of a service that does not look for any
    told = {"name": "no rest", "evidence": "e", "remedy": "r", "of a newer service": 1}
    newer = {**answers.grasp_log, "detection": {**answers.grasp_log["detection"], "findings": [told]}}
    assert ask(service(newer), "grasp_log", "g1").detection.findings == (Finding("no rest", "e", "r"),)
    contact = {"coefficient": 0.6, "low": 0.5, "high": None, "is_bound": True, "reason": "it held"}
    newer["detection"] = {**newer["detection"], "contact_friction": contact}
    assert ask(service(newer), "grasp_log", "g1").detection.contact_friction == ContactFriction(**contact)
    assert server.requests[0].url.path == "/v1/grasp-logs/g1"


def test_a_fit_is_asked_for(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service(httpx.Response(202, json=answers.job | {"status": "queued"}))
    job = ask(server, "fit", "paper", method="bayes", seed=7)
    assert not job.ended
    assert server.requests[0].read() == b'{"method":"bayes","seed":7}'


@pytest.mark.usefixtures("quick")
def test_waiting_asks_until_the_job_has_ended(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    running = answers.job | {"status": "running"}
    server = service(answers.job | {"status": "queued"}, running, running, answers.job)
    assert ask(server, "wait", "j1").status == "done"
    assert [request.url.path for request in server.requests] == ["/v1/jobs/j1"] * 4


@pytest.mark.parametrize("of", [stiction_client.Job, stiction_client.GraspLogReceipt])
def test_one_waits_for_a_job_or_for_an_upload(
    ask: Ask, service: Service, answers: SimpleNamespace, of: type[Any]
) -> None:
    record = answers.job if of is stiction_client.Job else answers.grasp_log
    assert ask(service(answers.job), "wait", of.from_json(record)).status == "done"


@pytest.mark.usefixtures("quick")
def test_waiting_ends_with_its_timeout(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    with pytest.raises(JobTimedOut, match=r"job j1: still running after 0\.01 s") as caught:
        ask(service(answers.job | {"status": "running"}), "wait", "j1", timeout=0.01)
    assert caught.value.job_id == "j1"


def test_polls_get_rarer_up_to_a_bound(answers: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stiction_client.calls.time", SimpleNamespace(monotonic=lambda: 0.0))
    call = stiction_client.calls.wait("j1", 1e6)
    running = httpx.Response(200, json=answers.job | {"status": "running"})
    steps = [exchange.advance(call, None)]
    for _ in range(30):
        steps.append(exchange.advance(call, running))
        steps.append(exchange.advance(call, None))
    pauses = [step.seconds for step in steps if isinstance(step, exchange.Pause)]
    expected = [min(0.05 * 1.5**k, 2.0) for k in range(30)]
    assert pauses == pytest.approx(expected, rel=1e-12)  # rounding: answers take no time on this clock


def test_the_end_of_a_job_is_an_answer_that_can_be_raised(answers: SimpleNamespace) -> None:
    done = stiction_client.Job.from_json(answers.job)
    assert done.raise_for_status() is done
    with pytest.raises(JobRefused, match="job j1: no slip"):
        stiction_client.Job.from_json(answers.job | {"status": "refused", "reason": "no slip"}).raise_for_status()
    with pytest.raises(JobFailed, match="job j1: failed"):
        stiction_client.Job.from_json(answers.job | {"status": "failed"}).raise_for_status()
    with pytest.raises(JobCancelled, match="job j1: cancelled"):
        stiction_client.Job.from_json(answers.job | {"status": "cancelled"}).raise_for_status()


def test_jobs_are_listed_and_cancelled(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service({"items": [answers.job]}, answers.job | {"status": "cancelled"})
    assert [job.id for job in ask(server, "jobs", status="failed", limit=5)] == ["j1"]
    cancelled = ask(server, "cancel", "j1")
    assert cancelled.ended
    assert [(request.method, str(request.url.raw_path, "ascii")) for request in server.requests] == [
        ("GET", "/v1/jobs?status=failed&limit=5"),
        ("POST", "/v1/jobs/j1/cancel"),
    ]


@pytest.mark.parametrize(("call", "item"), [("jobs", "job"), ("grasp_logs", "grasp_log")])
def test_a_list_without_a_limit_is_asked_for_to_its_end(
    ask: Ask, service: Service, answers: SimpleNamespace, call: str, item: str
) -> None:
    """Also where that is beyond a page, and beyond the hundred that are asked for by default."""
    entry = getattr(answers, item)
    server = service({"items": [entry] * 1000, "next": "more"}, {"items": [entry] * 200, "next": None})
    assert len(ask(server, call, limit=None)) == 1200
    asked = [dict(request.url.params) for request in server.requests]
    assert asked == [{"limit": "1000"}, {"limit": "1000", "cursor": "more"}]


@pytest.mark.parametrize("limit", [0, -1, 2.5, True, "5", math.nan])
@pytest.mark.parametrize("call", ["jobs", "grasp_logs", "audit"])
def test_a_limit_that_is_no_number_of_items_is_refused_unasked(
    ask: Ask, service: Service, call: str, limit: object
) -> None:
    server = service()
    with pytest.raises(InvalidArgument, match="limit"):
        ask(server, call, limit=limit)
    assert not server.requests


def test_the_key_is_sent_as_a_bearer_token(ask: Ask, service: Service) -> None:
    server = service({"items": []})
    ask(server, "materials", key="secret")
    ask(server, "materials")
    assert server.requests[0].headers["Authorization"] == "Bearer secret"
    assert "Authorization" not in server.requests[1].headers


def test_a_refusal_carries_all_that_the_service_said(ask: Ask, service: Service) -> None:
    refusal = problem(
        422, type="/problems/invalid-request", detail="quantile is 2", name="quantile", value="2", allowed="<1"
    )
    with pytest.raises(ProblemError) as caught:
        ask(service(refusal), "friction", "paper", 0.0, 0.1, quantile=2.0)
    error = caught.value
    assert (error.type, error.status, error.detail) == ("/problems/invalid-request", 422, "quantile is 2")
    assert (error.name, error.value, error.allowed) == ("quantile", "2", "<1")
    assert str(error) == "quantile is 2 (422, /problems/invalid-request)"


@pytest.mark.parametrize(
    "answer",
    [
        httpx.Response(502, html="<h1>Bad gateway</h1>"),
        httpx.Response(404, json={"detail": "Not Found"}),
        httpx.Response(500, json=["no"]),
        httpx.Response(200, text="hello"),
        httpx.Response(200, content=b"\xff\xfe\x00"),
        httpx.Response(301, headers={"Location": "http://elsewhere/"}),
        {"name": "paper"},
        {"items": [{"name": "paper"}]},
        [],
    ],
)
def test_an_answer_that_is_not_the_services_is_said_to_be_so(ask: Ask, service: Service, answer: Any) -> None:
    with pytest.raises(UnexpectedAnswer):
        ask(service(answer), "materials")


@pytest.mark.usefixtures("quick")
def test_harmless_requests_are_tried_again_when_the_connection_breaks(
    ask: Ask, service: Service, answers: SimpleNamespace, log: Any
) -> None:
    broken = httpx.ReadError("reset")
    server = service(broken, broken, answers.material)
    assert ask(server, "material", "paper").name == "paper"
    server = service(httpx.ConnectTimeout("slow"), answers.grasp_log)
    assert ask(server, "upload", log).id == "g1"


@pytest.mark.usefixtures("quick")
def test_a_connection_that_stays_broken_is_an_error(ask: Ask, service: Service) -> None:
    server = service(httpx.ConnectError("refused"))
    with pytest.raises(ConnectionFailed, match="GET /v1/materials: ConnectError: refused") as caught:
        ask(server, "materials")
    assert len(server.requests) == 3
    assert isinstance(caught.value.__cause__, httpx.ConnectError)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("method", "argument"), [("create_material", "paper"), ("fit", "paper")])
def test_what_would_happen_twice_is_sent_under_one_key(ask: Ask, service: Service, method: str, argument: str) -> None:
    server = service(httpx.ReadTimeout("slow"))
    for _ in range(2):
        with pytest.raises(ConnectionFailed):
            ask(server, method, argument)
    keys = [request.headers["idempotency-key"] for request in server.requests]
    assert len(keys) == 6
    assert len(set(keys[:3])) == len(set(keys[3:])) == 1
    assert keys[0] != keys[3]


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    "lost",
    [
        httpx.ReadError("reset"),
        httpx.Response(504, text=""),
        httpx.Response(502, text=""),
        httpx.Response(503, text="upstream connect error or disconnect/reset before headers"),
        httpx.Response(429, json={"type": "about:blank"}),
        problem(503, type="/problems/stopping"),
    ],
)
@pytest.mark.parametrize(
    ("method", "arguments"),
    [
        ("merge_materials", ("paper", "felt")),
        ("begin_epoch", ("paper", "wet")),
        ("calibrate_sensor", ("ball", {"g": 1.0})),
    ],
)
def test_what_may_have_been_done_and_would_be_done_again_is_not_sent_again(
    ask: Ask, service: Service, lost: Any, method: str, arguments: tuple[Any, ...]
) -> None:
    server = service(lost)
    with pytest.raises((ConnectionFailed, UnexpectedAnswer, ProblemError)):
        ask(server, method, *arguments)
    assert len(server.requests) == 1
    server = service(problem(503, type="/problems/storage-unavailable"))
    with pytest.raises(ProblemError):
        ask(server, method, *arguments)
    assert len(server.requests) == 3


def test_refusals_are_not_tried_again(ask: Ask, service: Service) -> None:
    server = service(problem(409, type="/problems/no-model"))
    with pytest.raises(ProblemError):
        ask(server, "materials")
    assert len(server.requests) == 1


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("status", "kind"), [(429, "too-many-requests"), (503, "storage-unavailable")])
def test_a_busy_service_is_asked_again(
    ask: Ask, service: Service, answers: SimpleNamespace, status: int, kind: str
) -> None:
    busy = problem(status, type=f"/problems/{kind}")
    server = service(busy, busy, answers.material)
    assert ask(server, "material", "paper").name == "paper"
    server = service(busy)
    with pytest.raises(ProblemError) as refusal:
        ask(server, "material", "paper")
    assert (len(server.requests), refusal.value.status) == (3, status)


@pytest.mark.parametrize(
    ("asked", "waited"), [("0.004", 0.004), ("-1", 0.0), ("nan", 1e-6), ("Sun, 22 Nov 2026 08:49:37 GMT", 1e-6)]
)
@pytest.mark.usefixtures("quick")
def test_a_busy_service_is_left_alone_as_long_as_it_asks(asked: str, waited: float) -> None:
    call = calls.material("paper")
    assert isinstance(exchange.advance(call, None), exchange.Request)
    busy = problem(503)
    busy.headers["Retry-After"] = asked
    assert exchange.advance(call, busy) == exchange.Pause(waited)
    assert isinstance(exchange.advance(call, None), exchange.Request)


def test_a_service_that_is_busy_for_long_is_not_waited_for(ask: Ask, service: Service) -> None:
    busy = problem(429, type="/problems/too-many-requests")
    busy.headers["Retry-After"] = "3600"
    server = service(busy)
    with pytest.raises(ProblemError):
        ask(server, "material", "paper")
    assert len(server.requests) == 1


class Tagged:
    """A service whose material has a tag; it can go away."""

    def __init__(self, material: dict[str, Any]) -> None:
        self.requests: list[httpx.Request] = []
        self.away = False
        self._material = material

    def __call__(self, request: httpx.Request) -> httpx.Response:
        if self.away:
            raise httpx.ConnectError("gone")
        self.requests.append(request)
        if request.headers.get("if-none-match") == '"a"':
            return httpx.Response(304, headers={"ETag": '"a"'})
        return httpx.Response(200, json=self._material, headers={"ETag": '"a"'})


def test_a_model_that_has_not_changed_is_not_sent_again(answers: SimpleNamespace) -> None:
    service = Tagged(answers.material)
    with FrictionClient("http://stiction", transport=httpx.MockTransport(service)) as client:
        first, again = client.model("paper"), client.model("paper")
    assert again is first
    assert [request.headers.get("if-none-match") for request in service.requests] == [None, '"a"']


def test_a_young_model_is_not_even_asked_for(answers: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    service, now = Tagged(answers.material), [100.0]
    monkeypatch.setattr(calls.time, "monotonic", lambda: now[0])
    with FrictionClient("http://stiction", transport=httpx.MockTransport(service), stale_after=60.0) as client:
        client.model("paper")
        now[0] += 59.0
        client.model("paper")
        assert len(service.requests) == 1
        now[0] += 2.0
        client.model("paper")
        assert len(service.requests) == 2


@pytest.mark.usefixtures("quick")
def test_away_from_the_service_the_last_model_is_used_with_a_warning(
    answers: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    service, now = Tagged(answers.material), [100.0]
    monkeypatch.setattr(calls.time, "monotonic", lambda: now[0])
    with FrictionClient("http://stiction", transport=httpx.MockTransport(service)) as client:
        first = client.model("paper")
        service.away, now[0] = True, 1000.0
        with pytest.warns(StaleModel, match=r"gone; going on with the model of 'paper' from 900 s ago") as warned:
            assert client.model("paper") is first
        assert warned[0].filename == __file__
        with pytest.raises(ConnectionFailed):
            client.model("another")


OF_STORE = {"type": "/problems/storage-unavailable", "title": "", "status": 503, "detail": "the database is away"}


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("status", "answer"),
    [(502, {"text": "<html>Bad Gateway</html>"}), (504, {"text": ""}), (503, {"text": "<html>"}),
     (503, {"headers": {"Content-Encoding": "br"}, "stream": httpx.ByteStream(b"page")}), (503, {"json": OF_STORE})],
    ids=["bad gateway", "gateway timeout", "a proxy's 503", "one that is packed", "the service's own 503"],
)  # fmt: skip
def test_behind_a_proxy_that_says_the_service_is_away_the_last_model_is_used(
    answers: SimpleNamespace, status: int, answer: dict[str, Any]
) -> None:
    asked: list[httpx.Request] = []

    def service(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(200, json=answers.material) if len(asked) == 1 else httpx.Response(status, **answer)

    with FrictionClient("http://stiction", transport=httpx.MockTransport(service)) as client:
        first = client.model("paper")
        with pytest.warns(StaleModel, match="going on with the model of 'paper'"):
            assert client.model("paper") is first
        assert len(asked) == 1 + exchange.ATTEMPTS
        with pytest.raises(ProblemError if "json" in answer else UnexpectedAnswer):
            client.model("another")


@pytest.mark.usefixtures("quick")
def test_a_refusal_is_no_absence(answers: SimpleNamespace) -> None:
    told = [httpx.Response(200, json=answers.material), httpx.Response(403, json=OF_STORE | {"status": 403})]
    with FrictionClient("http://stiction", transport=httpx.MockTransport(lambda _: told.pop(0))) as client:
        client.model("paper")
        with pytest.raises(ProblemError):
            client.model("paper")


@pytest.mark.parametrize("key", ["é", "a\nb", "a\0"])
@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
def test_a_key_that_no_header_can_hold_is_refused_and_not_shown(client: Callable[..., object], key: str) -> None:
    with pytest.raises(InvalidArgument, match="key is one with other characters; allowed: printable ASCII") as refused:
        client("http://stiction", key)
    assert key not in str(refused.value)


def test_a_key_that_is_no_text_is_named_by_its_type() -> None:
    with pytest.raises(InvalidArgument, match="key is of type int; allowed: printable ASCII"):
        FrictionClient("http://stiction", 3)  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [{"key": True}, {"key": b"stk_1"}, {"timeout": [1.0]}, {"stale_after": []}])
@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
def test_settings_of_a_wrong_kind_are_named(client: Callable[..., object], given: dict[str, Any]) -> None:
    with pytest.raises(InvalidArgument, match=f"^{next(iter(given))} is .*; allowed: "):
        client("http://stiction", **given)


def test_url_and_key_are_those_of_the_environment(
    answers: SimpleNamespace, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STICTION_URL", "http://elsewhere:9")
    monkeypatch.setenv("STICTION_KEY", "stiction_x")
    server = service(answers.material)
    with FrictionClient(transport=httpx.MockTransport(server)) as client:
        client.material("paper")
    assert server.requests[0].url.host == "elsewhere"
    assert server.requests[0].headers["authorization"] == "Bearer stiction_x"


def test_materials_are_renamed_and_merged_and_logs_withdrawn(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    server = service(answers.material)
    assert ask(server, "rename_material", "papre", "paper").name == "paper"
    assert (server.requests[0].method, json.loads(server.requests[0].content)) == ("PATCH", {"name": "paper"})
    server = service({"material": answers.material, "jobs": []})
    assert ask(server, "merge_materials", "paper", "papre").name == "paper"
    assert server.requests[0].url.path == "/v1/materials/paper/merges"
    server = service({"material": answers.material, "withdrawn": 3, "jobs": []})
    assert ask(server, "begin_epoch", "paper", "coated", answers.grasp_log["id"]).name == "paper"
    assert server.requests[0].url.path == "/v1/materials/paper/epochs"
    sent = {"reason": "coated", "first_grasp_log": answers.grasp_log["id"]}
    assert json.loads(server.requests[0].content) == sent
    server = service({"grasp_log": answers.grasp_log, "jobs": []})
    assert ask(server, "withdraw", answers.grasp_log["id"], "mislabelled").id == answers.grasp_log["id"]
    assert json.loads(server.requests[0].content) == {"reason": "mislabelled"}
    server = service({"grasp_log": answers.grasp_log, "jobs": [], "counts_instead": "7f"})
    assert ask(server, "withdraw", answers.grasp_log["id"], "mislabelled").counts_instead == "7f"


def test_a_sensor_is_described_and_calibrated(ask: Ask, service: Service) -> None:
    server = service({"items": [{"name": "tac 1", "gel": None}], "next": None})
    assert ask(server, "sensors") == [{"name": "tac 1", "gel": None}]
    server = service({"name": "tac 1", "calibration": None})
    assert ask(server, "describe_sensor", "tac 1", 2e5, 0.48, marker_depth=1e-3)["name"] == "tac 1"
    gel = {"young_modulus": 2e5, "poisson_ratio": 0.48, "thickness": None, "marker_depth": 1e-3}
    assert (server.requests[0].method, json.loads(server.requests[0].content)) == ("PUT", gel)
    server = service({"name": "tac 1", "calibration": None})
    ask(server, "describe_sensor", "tac 1", 2e5, 0.48, 4e-3, 1e-3, ((1, 0.9), (0.8, 1)))
    half_space = service({"name": "tac 1", "calibration": None})
    ask(half_space, "describe_sensor", "tac 1", 2e5, 0.48, math.inf, 1e-3)
    assert json.loads(half_space.requests[0].content) == gel
    uneven = gel | {"thickness": 4e-3, "relative_thickness": [[1.0, 0.9], [0.8, 1.0]]}
    assert json.loads(server.requests[0].content) == uneven
    server = service({"version": 2})
    assert ask(server, "calibrate_sensor", "tac 1", {"g1": 5.0, "g2": None}) == {"version": 2}
    presses = [{"grasp_log": "g1", "known_force": 5.0}, {"grasp_log": "g2", "known_force": None}]
    assert json.loads(server.requests[0].content) == {"presses": presses}
    server = service({"items": [{"version": 2}, {"version": 1}]})
    assert ask(server, "calibrations", "tac 1") == [{"version": 2}, {"version": 1}]
    assert server.requests[0].url.raw_path == b"/v1/sensors/tac%201/calibrations"


def test_the_newest_logs_of_a_material_are_asked_for(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    server = service({"items": [answers.grasp_log], "next": "more"})
    assert [log.id for log in ask(server, "grasp_logs", "paper", 1)] == [answers.grasp_log["id"]]
    assert dict(server.requests[0].url.params) == {"material": "paper", "limit": "1"}


def test_more_entries_than_a_page_holds_are_asked_for_in_pages(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    server = service({"items": [answers.job] * 1000, "next": "more"}, {"items": [answers.job] * 200, "next": "others"})
    assert len(ask(server, "jobs", None, 1200)) == 1200
    asked = [dict(request.url.params) for request in server.requests]
    assert asked == [{"limit": "1000"}, {"limit": "200", "cursor": "more"}]


def test_a_page_that_is_too_large_is_asked_for_in_halves(
    ask: Ask, service: Service, answers: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = httpx.Response(200, content=b" " * 100_000)
    server = service(whole, whole, {"items": [answers.material], "next": "more"}, whole, {"items": [], "next": None})
    monkeypatch.setattr(stiction_client.client, "MOST_ANSWER_BYTES", 50_000)
    assert len(ask(server, "materials")) == 1
    assert [dict(request.url.params) for request in server.requests] == [
        {"limit": "100"}, {"limit": "50"}, {"limit": "25"},
        {"limit": "25", "cursor": "more"}, {"limit": "12", "cursor": "more"},
    ]  # fmt: skip


def test_an_entry_that_is_too_large_by_itself_is_an_error(
    ask: Ask, service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = service(*[httpx.Response(200, content=b" " * 101)] * 7)
    monkeypatch.setattr(stiction_client.client, "MOST_ANSWER_BYTES", 100)
    with pytest.raises(AnswerTooLarge, match="limit=1 answered with more than 100 bytes"):
        ask(server, "materials")


@pytest.mark.parametrize("name", ["", ".", "..", "...", None, 5])
def test_a_name_that_leads_to_another_route_or_is_none_is_refused_here(ask: Ask, service: Service, name: Any) -> None:
    server = service({})
    with pytest.raises(InvalidArgument, match="name is"):
        ask(server, "material", name)
    assert not server.requests


@pytest.mark.parametrize("url", [3, b"http://a", ["http://a"]])
def test_an_address_is_text(url: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^address is .*; allowed: an object of str"):
        FrictionClient(url)


@pytest.mark.parametrize("wrong", ["v", "fn"])
def test_friction_is_asked_for_at_a_velocity_and_a_force(ask: Ask, service: Service, wrong: str) -> None:
    """What is not sent would be 0 to the service."""
    server = service({})
    with pytest.raises(InvalidArgument, match=f"^{wrong} is None; allowed: a number"):
        ask(server, "friction", "paper", **({"v": 0.0, "fn": 0.05} | {wrong: None}))
    assert not server.requests


@pytest.mark.parametrize("url", ["http://[::1", "http://\udcff", "http://a:b:c", f"http://{'a' * 100_000}"])
def test_an_address_that_is_none_is_refused_by_name(url: str) -> None:
    with pytest.raises(InvalidArgument, match=r"^address is 'http://.*; allowed: one such as http://127") as refused:
        FrictionClient(url)
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("htp://x", "it begins with neither http:// nor https://"),
        ("localhost:8000", "it begins with neither http:// nor https://"),
        ("127.0.0.1", "it begins with neither http:// nor https://"),
        ("http://", "it names no host"),
        ("https:///v1", "it names no host"),
        ("http://x:0", "its port is not 1 to 65535"),
        ("http://x:65536", "its port is not 1 to 65535"),
    ],
)
def test_an_address_of_no_service_is_refused_before_the_first_call(client: Any, url: str, why: str) -> None:
    """The first call had failed, as if the service were away."""
    with pytest.raises(InvalidArgument, match=f"^address is '{url}' \\({why}\\); allowed: one such as http://127"):
        client(url)


@pytest.mark.parametrize("url", ["HTTP://x", "https://x:65535/behind/a/proxy/", "http://[::1]:1"])
def test_an_address_of_a_service_is_taken_as_it_stands(url: str) -> None:
    asked: list[str] = []

    def service(request: httpx.Request) -> httpx.Response:
        asked.append(str(request.url))
        return httpx.Response(200, json={"items": [], "next": None})

    with FrictionClient(url, transport=httpx.MockTransport(service)) as client:
        assert client.materials() == []
    assert asked[0].startswith(str(httpx.URL(url.rstrip("/"))) + "/v1/materials")


@pytest.mark.parametrize("seconds", [-1.0, math.nan, "60", None, True])
@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
def test_an_age_of_models_is_a_time(client: Any, seconds: Any) -> None:
    with pytest.raises(InvalidArgument, match=r"^stale_after is .*; allowed: .*0 to inf s"):
        client("http://stiction", stale_after=seconds)
    with FrictionClient("http://stiction", stale_after=math.inf):
        pass


@pytest.mark.parametrize("actor", ["a" * 100_000, "\udcff"])
def test_what_fits_into_no_address_is_refused_by_name(ask: Ask, service: Service, actor: str) -> None:
    server = service({"items": []})
    with pytest.raises(InvalidArgument, match="address is '/v1/audit"):
        ask(server, "audit", actor)
    assert not server.requests


@pytest.mark.parametrize("name", ["a/b", "a?b", "a#b", "ä", "a%2fb"])
def test_a_name_stays_one_segment_of_the_path(ask: Ask, service: Service, answers: SimpleNamespace, name: str) -> None:
    server = service(answers.material | {"name": name})
    ask(server, "material", name)
    assert server.requests[0].url.raw_path.count(b"/") == 3
    assert server.requests[0].url.path == f"/v1/materials/{name}"
    assert not server.requests[0].url.query


def test_what_a_newer_service_adds_is_passed_over(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    assert ask(service(answers.job | {"priority": 3}), "job", "j1").id == "j1"


def test_a_grasp_is_recognised_by_its_log_or_by_its_samples(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    told = {"method": "ols", "candidates": [{"material": "paper", "version": 3, "probability": 0.9}], "unknown": 0.1}
    server = service(told)
    samples = SimpleNamespace(element_area=1e-6, **{name: np.ones(2) for name in stiction_client.calls.SAMPLE_ARRAYS})
    receipt = GraspLogReceipt.from_json(answers.grasp_log)
    for grasp in ("g1", receipt, samples):
        found = ask(server, "recognise", grasp, materials=["paper"])
        assert (found.probability, found.unknown, found.methods) == ({"paper": 0.9}, 0.1, {"paper": "ols"})
    sent = [json.loads(request.content) for request in server.requests]
    assert sent[0] == sent[1] == {"grasp_log": "g1", "materials": ["paper"]}
    ask(server, "recognise", "g1", method="ols")
    assert json.loads(server.requests[-1].content)["method"] == "ols"
    assert sent[2]["samples"]["weight"] == [1.0, 1.0]
    samples.velocity_is_relative = np.array([False, True])
    ask(server, "recognise", samples)
    assert json.loads(server.requests[-1].content)["samples"]["velocity_is_relative"] == [False, True]
    with pytest.raises(InvalidArgument, match="time is not finite"):
        ask(server, "recognise", SimpleNamespace(**vars(samples) | {"time": np.array([np.nan])}))


def test_who_waits_for_a_job_is_given_the_time_for_it(answers: SimpleNamespace) -> None:
    asked: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(200, json=answers.job)

    transport = httpx.MockTransport(answer)
    with stiction_client.FrictionClient("http://service", timeout=0.5, transport=transport) as client:
        client.wait("j1", timeout=1.0)
        client.job("j1")
    wait = float(asked[0].url.params["wait"])
    assert wait == pytest.approx(1.0, rel=0, abs=0.1)
    assert [each.extensions["timeout"]["read"] for each in asked] == [0.5 + wait, 0.5]


@pytest.mark.parametrize(
    "body", ["[" * 200_000, '{"items": ' + "9" * 5000 + "}", "no JSON"], ids=["nested", "long", "no"]
)
def test_what_is_no_json_is_no_answer(ask: Ask, service: Service, body: str) -> None:
    with pytest.raises(UnexpectedAnswer):
        ask(service(httpx.Response(200, text=body)), "friction", "paper", 0.0, 0.1)


@pytest.mark.parametrize(
    "change",
    [
        {"friction_coefficient": float("nan")},
        {"friction_coefficient": -3e9},
        {"friction_coefficient": True},
        {"mean": "x"},
        {"within_domain": "no"},
        {"normal_force": None},
    ],
)
def test_an_answer_that_is_no_friction_is_refused(
    ask: Ask, service: Service, answers: SimpleNamespace, change: dict[str, Any]
) -> None:
    """A planner divides by it."""
    with pytest.raises(UnexpectedAnswer, match=next(iter(change))):
        ask(service(httpx.Response(200, text=json.dumps(answers.friction | change))), "friction", "paper", 0.0, 0.1)


@pytest.mark.parametrize(
    "change",
    [
        {"tangential_velocity": 0.002},
        {"normal_force": 0.06},
        {"quantile": None},
        {"method": "bayes"},
        {"of": "element"},
        {"elements": 61},
        {"element_area": 2e-6},
    ],
)
def test_friction_that_was_not_asked_for_is_refused_by_name(
    ask: Ask, service: Service, answers: SimpleNamespace, change: dict[str, Any]
) -> None:
    """As a cache or proxy gives that keeps answers apart by path alone, or mixes up two connections."""
    v = np.float32(1e-3)  # sent as 0.001, which it is not exactly
    told = {"tangential_velocity": 1e-3, "of": "contact", "elements": 60, "element_area": 1e-6}
    question = {"quantile": 0.05, "method": "ols", "of": "contact", "elements": 60, "element_area": 1e-6}
    assert ask(service(answers.friction | told), "friction", "paper", v, 0.05, **question).elements == 60
    with pytest.raises(UnexpectedAnswer, match=f"another question: its {next(iter(change))} is"):
        ask(service(answers.friction | told | change), "friction", "paper", v, 0.05, **question)


def test_numbers_may_be_text_as_the_address_has_them(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    assert ask(service(answers.friction), "friction", "paper", "0.0", "5e-2", "0.05").normal_force == 0.05


def test_of_one_element_the_number_of_a_contact_s_is_not_told(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    told = answers.friction | {"of": "element", "elements": 1}
    assert ask(service(told), "friction", "paper", 0.0, 0.05, 0.05, of="element", elements=60).of == "element"


def test_who_leaves_the_method_to_the_service_takes_any(ask: Ask, service: Service, answers: SimpleNamespace) -> None:
    assert ask(service(answers.friction), "friction", "paper", 0.0, 0.05, 0.05, "auto").method == "ols"


def test_a_material_answers_to_its_aliases_and_to_no_other_name(
    ask: Ask, service: Service, answers: SimpleNamespace
) -> None:
    server = service(answers.friction, answers.material)
    assert ask(server, "friction", "paper 80.g", 0.0, 0.05, 0.05).material == "paper"
    assert [request.url.path.rpartition("/")[2] for request in server.requests] == ["friction", "paper 80.g"]
    other = answers.material | {"name": "steel", "aliases": ["glass"]}
    with pytest.raises(UnexpectedAnswer, match="another question: of material 'paper', asked 'glass'"):
        ask(service(answers.friction, other), "friction", "glass", 0.0, 0.05, 0.05)
    for call in ("material", "model"):
        with pytest.raises(UnexpectedAnswer, match="another question: its name is 'paper', asked 'glass'"):
            ask(service(answers.material), call, "glass")


@pytest.mark.parametrize("call", ["job", "wait", "cancel", "grasp_log"])
def test_an_answer_about_another_job_or_log_is_refused(
    ask: Ask, service: Service, answers: SimpleNamespace, call: str
) -> None:
    answer = answers.grasp_log if call == "grasp_log" else answers.job
    with pytest.raises(UnexpectedAnswer, match="another question: its id is"):
        ask(service(answer), call, "another")


@pytest.mark.parametrize("items", [0, 1])
def test_a_list_that_does_not_end_is_left(ask: Ask, service: Service, answers: SimpleNamespace, items: int) -> None:
    pages = [{"items": [answers.material] * items, "next": "again"} for _ in range(3)]
    with pytest.raises(UnexpectedAnswer, match="does not end"):
        ask(service(*pages), "materials")


@pytest.mark.parametrize("cursor", [{"a": 1}, [1], 3, True])
def test_a_cursor_that_is_no_text_is_refused(ask: Ask, service: Service, answers: SimpleNamespace, cursor: Any) -> None:
    with pytest.raises(UnexpectedAnswer, match="next"):
        ask(service({"items": [answers.material], "next": cursor}), "materials")


@pytest.mark.parametrize(
    ("call", "change"),
    [("material", {"name": 3.0}), ("material", {"grasp_logs": float("inf")}), ("job", {"id": 3.0})],
)
def test_numbers_for_names_and_infinite_counts_are_refused(
    ask: Ask, answers: SimpleNamespace, call: str, change: dict[str, Any]
) -> None:
    content = json.dumps(getattr(answers, call) | change)
    with pytest.raises(UnexpectedAnswer):
        ask(lambda _: httpx.Response(200, text=content), call, "paper")


@pytest.mark.parametrize("probability", [float("nan"), -0.1, 1.1, True, "0.5", None, 10**400])
@pytest.mark.parametrize("of", ["paper", "unknown"])
def test_what_is_no_probability_is_refused(ask: Ask, service: Service, of: str, probability: Any) -> None:
    """The likeliest material is chosen by it."""
    told = {"paper": 0.9, "unknown": 0.1} | {of: probability}
    candidate = {"material": "paper", "version": 3, "probability": told["paper"]}
    answer = json.dumps({"method": "ols", "candidates": [candidate], "unknown": told["unknown"]})
    with pytest.raises(UnexpectedAnswer, match="probability"):
        ask(service(httpx.Response(200, text=answer)), "recognise", "g1")


@pytest.mark.parametrize(
    "change",
    [
        {"normal_force": float("nan")},
        {"normal_force": 0.0},
        {"speed": "0.002"},
        {"slip_length": -1e-3},
        {"direction": float("inf")},
        {"seconds": True},
        {"conservative_friction": None},
        {"after": []},
    ],
)
def test_what_is_no_grasp_to_record_is_refused(ask: Ask, service: Service, change: dict[str, Any]) -> None:
    """A robot is to do it."""
    with pytest.raises(UnexpectedAnswer, match=next(iter(change))):
        ask(service(httpx.Response(200, text=json.dumps(NEXT_GRASP | change))), "next_grasp", "paper")


class Parts(httpx.SyncByteStream, httpx.AsyncByteStream):
    """Content that comes in parts, without end."""

    def __init__(self, part: Callable[[], bytes]) -> None:
        self._part, self.count, self.is_closed = part, 0, False

    def __iter__(self) -> Iterator[bytes]:
        while self.count < 1000:
            self.count += 1
            yield self._part()

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for part in iter(self):
            yield part

    def close(self) -> None:
        self.is_closed = True

    async def aclose(self) -> None:
        self.is_closed = True


@pytest.mark.parametrize("status", [200, 409])
def test_an_answer_without_end_is_left(ask: Ask, status: int) -> None:
    parts = Parts(lambda: b" " * 2**20)
    with pytest.raises(UnexpectedAnswer, match="more than 67108864 bytes"):
        ask(lambda _: httpx.Response(status, stream=parts), "material", "paper")
    assert (parts.count, parts.is_closed) == (65, True)


def test_an_answer_that_unpacks_to_too_much_is_left(ask: Ask) -> None:
    """Two MB of gzip had taken 8 GB of the client."""
    packed = gzip.compress(bytes(2**28))
    parts = Parts(iter([packed[begin : begin + 2**16] for begin in range(0, len(packed), 2**16)]).__next__)
    with pytest.raises(UnexpectedAnswer, match="more than 67108864 bytes"):
        ask(lambda _: httpx.Response(200, headers={"Content-Encoding": "gzip"}, stream=parts), "material", "paper")
    assert parts.count < 5


@pytest.mark.parametrize("encoding", ["deflate", "gzip, gzip", "br", "zstd"])
def test_an_answer_is_packed_as_it_was_asked_for(ask: Ask, answers: SimpleNamespace, encoding: str) -> None:
    asked: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        packed = zlib.compress(json.dumps(answers.material).encode())
        return httpx.Response(200, headers={"Content-Encoding": encoding}, stream=httpx.ByteStream(packed))

    with pytest.raises(UnexpectedAnswer, match=r"answered 200 with 'x.*, which is not JSON"):
        ask(answer, "material", "paper")
    assert asked[0].headers["accept-encoding"] == "gzip"
    packed = gzip.compress(json.dumps(answers.material).encode())
    told = httpx.Response(200, headers={"Content-Encoding": "gzip"}, stream=httpx.ByteStream(packed))
    assert ask(lambda _: told, "material", "paper").name == "paper"


@pytest.mark.parametrize("encoding", ["br", "deflate"])
def test_how_a_proxy_packs_nothing_does_not_matter(answers: SimpleNamespace, encoding: str) -> None:
    headers = {"Content-Encoding": encoding, "ETag": '"1"'}
    told = [httpx.Response(200, json=answers.material), httpx.Response(304, headers=headers)]
    with FrictionClient("http://stiction", transport=httpx.MockTransport(lambda _: told.pop(0))) as client:
        assert client.model("paper") is client.model("paper")


@pytest.mark.parametrize("timeout", [math.inf, math.nan, -1.0, 1e10, None, "5"])
@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
def test_a_timeout_is_a_time(client: Any, timeout: Any) -> None:
    """Others ended in errors of the system, at the first call."""
    with pytest.raises(InvalidArgument, match=r"timeout is .*; allowed: .*0 to 86400 s"):
        client("http://stiction", timeout=timeout)


@pytest.mark.usefixtures("quick")
def test_an_answer_that_drips_is_a_broken_connection(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each byte came in time, so that a planner waited for good."""
    seconds = [0.0]

    def drip() -> bytes:
        seconds[0] += 7.0
        return b" "

    clock = SimpleNamespace(monotonic=lambda: seconds[0], sleep=lambda _: None)
    monkeypatch.setattr(stiction_client.client, "time", clock)
    asked: list[Parts] = []

    def answer(_: httpx.Request) -> httpx.Response:
        asked.append(Parts(drip))
        return httpx.Response(200, stream=asked[-1])

    with pytest.raises(ConnectionFailed, match="was not whole in time"):
        ask(answer, "material", "paper")
    assert [(parts.count, parts.is_closed) for parts in asked] == [(5, True)] * 3


@pytest.mark.parametrize("charset", ["idna", "base64", "utf-99"])
def test_an_answers_charset_does_not_matter(ask: Ask, charset: str) -> None:
    told = {"Content-Type": f"application/json; charset={charset}"}
    with pytest.raises(UnexpectedAnswer, match="answered 400"):
        ask(lambda _: httpx.Response(400, headers=told, content=b"\xff\xff"), "material", "paper")


def test_a_client_asks_once_what_an_alias_names(answers: SimpleNamespace, service: Service) -> None:
    """A planner that looked up by an alias asked twice each time, and the second answer is no service's from memory."""
    server = service(answers.friction, answers.material, answers.friction)
    with FrictionClient("http://stiction", transport=httpx.MockTransport(server)) as client:
        for _ in range(3):
            assert client.friction("paper 80.g", 0.0, 0.05, 0.05).material == "paper"
    assert [request.url.path.rpartition("/")[2] for request in server.requests] == ["friction", "paper 80.g"] + [
        "friction"
    ] * 2


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(("cut", "told"), [(-9, "gzip stream without its end"), (2, "without its end")])
def test_a_packed_answer_without_its_end_is_a_broken_connection(
    ask: Ask, answers: SimpleNamespace, cut: int, told: str
) -> None:
    """It was told as one that is no JSON, or even taken for whole where only its check sum was missing."""
    packed, asked = gzip.compress(json.dumps(answers.material).encode()), list[httpx.Request]()

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return httpx.Response(200, headers={"Content-Encoding": "gzip"}, stream=httpx.ByteStream(packed[:cut]))

    with pytest.raises(ConnectionFailed, match=told):
        ask(answer, "material", "paper")
    assert len(asked) == 3


def refused_question(client: Any, name: str, *given: Any, timeout: float = 30.0) -> httpx.Request:
    """What a call asks first."""
    asked: list[httpx.Request] = []

    def refuse(request: httpx.Request) -> httpx.Response:
        asked.append(request)
        return problem()

    async def ask_and_wait() -> None:
        async with client("http://stiction", transport=httpx.MockTransport(refuse), timeout=timeout) as asking:
            await getattr(asking, name)(*given)

    with suppress(ProblemError):
        if client is AsyncFrictionClient:
            asyncio.run(ask_and_wait())
        else:
            with client("http://stiction", transport=httpx.MockTransport(refuse), timeout=timeout) as asking:
                getattr(asking, name)(*given)
    return asked[0]


@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("grasp_logs", (), {"limit": "100"}),
        ("grasp_logs", ("paper", 7), {"material": "paper", "limit": "7"}),
        ("jobs", (), {"limit": "100"}),
        ("audit", (), {"limit": "100"}),
        ("audit", ("key:1", "made", "paper"), {"limit": "100", "actor": "key:1", "action": "made", "subject": "paper"}),
        ("friction", ("paper", 1e-3, 0.05), {"v": "0.001", "fn": "0.05"}),
        (
            "next_grasp",
            ("paper",),
            {"v": "0.0", "quantile": "0.01", "elements": "60", "load": "0.0", "drop_probability": "0.001"},
        ),
        ("wait", ("1f",), {"wait": "2.0"}),
    ],
)
def test_what_is_not_given_is_asked_for_as_the_call_says(
    client: Any, name: str, given: tuple[Any, ...], told: dict[str, str]
) -> None:
    assert dict(refused_question(client, name, *given).url.params) == told


@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
@pytest.mark.parametrize(
    ("name", "given", "told"),
    [
        ("fit", ("paper",), {"method": "auto", "seed": 0}),
        ("create_material", ("paper",), {"name": "paper", "description": ""}),
        ("ensure_material", ("paper",), {"name": "paper", "description": ""}),
        ("begin_epoch", ("paper", "new"), {"reason": "new", "first_grasp_log": None}),
        ("recognise", ("1f",), {"grasp_log": "1f", "materials": None}),
        (
            "describe_sensor",
            ("left", 2e5, 0.48),
            {"young_modulus": 2e5, "poisson_ratio": 0.48, "thickness": None, "marker_depth": 0.0},
        ),
    ],
)
def test_what_is_not_given_is_sent_as_the_call_says(
    client: Any, name: str, given: tuple[Any, ...], told: dict[str, Any]
) -> None:
    assert json.loads(refused_question(client, name, *given).content) == told


@pytest.mark.parametrize("client", [FrictionClient, AsyncFrictionClient])
@pytest.mark.parametrize(("timeout", "connect"), [(30.0, 5.0), (5.0, 5.0), (0.5, 0.5)])
def test_each_wait_has_its_time_and_a_host_that_is_not_there_five_seconds(
    client: Any, timeout: float, connect: float
) -> None:
    told = refused_question(client, "material", "a", timeout=timeout).extensions["timeout"]
    assert told == {"connect": connect, "read": timeout, "write": timeout, "pool": timeout}
    kept_back = refused_question(client, "wait", "1f", 1.5, timeout=timeout).extensions["timeout"]
    assert kept_back["read"] == pytest.approx(timeout + 1.5, abs=0.1)
    assert kept_back["write"] == timeout


def test_an_answer_may_be_as_long_as_is_taken_and_no_byte_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stiction_client.client, "MOST_ANSWER_BYTES", 100)
    request = httpx.Request("GET", "http://stiction/a", extensions={"timeout": {"read": 5.0}})
    packed = gzip.compress(100 * b"a", mtime=0), gzip.compress(101 * b"a", mtime=0)
    headers = {"Content-Encoding": "gzip"}
    for whole, longer, more in ((100 * b"a", 101 * b"a", {}), (*packed, headers)):
        content = stiction_client.client._Content(
            httpx.Response(200, headers=more, stream=httpx.ByteStream(b""), request=request)
        )
        content.add(whole)
        assert content.whole().content == 100 * b"a"
        content = stiction_client.client._Content(
            httpx.Response(200, headers=more, stream=httpx.ByteStream(b""), request=request)
        )
        with pytest.raises(UnexpectedAnswer, match="http://stiction/a answered with more than 100 bytes"):
            content.add(longer)


@pytest.mark.parametrize("seconds", [5.0, 5.1])
def test_an_answer_is_whole_in_its_time(monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(stiction_client.client, "time", SimpleNamespace(monotonic=lambda: clock.now))
    request = httpx.Request("GET", "http://stiction/a", extensions={"timeout": {"read": 5.0}})
    content = stiction_client.client._Content(httpx.Response(200, stream=httpx.ByteStream(b""), request=request))
    clock.now += seconds
    if seconds > 5.0:
        with pytest.raises(httpx.ReadTimeout):
            content.add(b"a")
    else:
        content.add(b"a")
        assert content.whole().content == b"a"


@pytest.mark.parametrize("length", [80, 81])
def test_an_address_is_shown_whole_up_to_eighty_characters(length: int) -> None:
    url = "http://a:" + (length - 9) * "b"
    with pytest.raises(InvalidArgument) as refusal:
        FrictionClient(url)
    shown = f"address is '{url}' (" if length == 80 else f"address is '{url[:80]}'… (81 characters) ("
    assert str(refusal.value).startswith(shown)
    assert str(refusal.value).endswith("allowed: one such as http://127.0.0.1:8000, in UTF-8")


def test_a_tag_that_cannot_be_sent_back_is_none(answers: SimpleNamespace) -> None:
    """A proxy's: the next question had ended in an error of the address, whose it was not."""
    asked = list[str | None]()

    def answer(request: httpx.Request) -> httpx.Response:
        asked.append(request.headers.get("if-none-match"))
        return httpx.Response(200, json=answers.material, headers=[(b"ETag", b'"\xe9"')])

    with FrictionClient("http://stiction", transport=httpx.MockTransport(answer)) as client:
        client.model("paper")
        client.model("paper")
    assert asked == [None, ""]


@pytest.mark.parametrize(
    ("call", "arguments", "refused"),
    [
        ("describe_sensor", ("left", np.nan, 0.48), "young_modulus is nan; allowed: a finite number"),
        ("describe_sensor", ("left", 2e5, 0.48, 4e-3, 0.0, [[1.0, np.inf]]), "relative_thickness is inf"),
        ("calibrate_sensor", ("left", {"g1": np.nan}), "known_force is nan"),
        ("fit", ("paper", "ols", np.nan), "seed is nan"),
        ("recognise", ({"friction_coefficient": [0.4]},), "grasp is dict; allowed: a receipt"),
        ("upload", (None,), "log is NoneType; allowed: a grasp log, a file"),
        ("wait", ("j1", np.nan), "timeout is nan; allowed: a number of seconds"),
    ],
)
def test_what_cannot_be_sent_is_refused_by_name(
    ask: Ask, service: Service, call: str, arguments: tuple[Any, ...], refused: str
) -> None:
    server = service({})
    with pytest.raises(InvalidArgument, match=f"^{refused}"):
        ask(server, call, *arguments)
    assert not server.requests


def test_a_gel_is_described_by_the_numbers_of_an_array(ask: Ask, service: Service) -> None:
    server = service({})
    ask(server, "describe_sensor", "left", np.float32(2.5e5), np.float64(0.5), None, 0.0, np.full((1, 2), 0.5))
    gel = json.loads(server.requests[0].content)
    assert (gel["young_modulus"], gel["relative_thickness"]) == (250000.0, [[0.5, 0.5]])
