"""What calls ask of the service and how they wait, without anything that carries it."""

import json
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest

from stiction_client import ConnectionFailed, InvalidArgument, ProblemError, UnexpectedAnswer, calls, problems
from stiction_client.calls import CachedModel
from stiction_client.exchange import Ended, Pause, Request, advance
from stiction_client.records import Material

JOB = {
    "id": "j1",
    "kind": "fit",
    "status": "queued",
    "stage": None,
    "reason": None,
    "seconds": {},
    "grasp_log": None,
    "material": "paper",
    "model_version": None,
    "created_at": "2026-01-01T00:00:00+00:00",
    "finished_at": None,
}


def answer(body: Any = None, status: int = 200, **headers: str) -> httpx.Response:
    told = {name.replace("_", "-"): value for name, value in headers.items()}
    request = httpx.Request("GET", "http://service/v1")
    if isinstance(body, bytes):
        return httpx.Response(status, content=body, headers=told, request=request)
    return httpx.Response(status, json=body, headers=told, request=request)


def problem(kind: str, status: int, **more: Any) -> httpx.Response:
    return answer({"type": f"/problems/{kind}", "status": status, "detail": "so it is", **more}, status)


def first(call: Any) -> Request:
    step = advance(call, None)
    assert isinstance(step, Request)
    return step


@pytest.mark.parametrize(
    ("call", "method", "path"),
    [
        (lambda: calls.material("a b/c"), "GET", "/v1/materials/a%20b%2Fc"),
        (lambda: calls.grasp_log("1f"), "GET", "/v1/grasp-logs/1f"),
        (lambda: calls.job("j1"), "GET", "/v1/jobs/j1"),
        (lambda: calls.cancel("j1"), "POST", "/v1/jobs/j1/cancel"),
        (lambda: calls.owners("paper"), "GET", "/v1/materials/paper/owners"),
        (lambda: calls.add_owner("paper", "key:1"), "PUT", "/v1/materials/paper/owners/key%3A1"),
        (lambda: calls.remove_owner("paper", "key:1"), "DELETE", "/v1/materials/paper/owners/key%3A1"),
        (lambda: calls.calibrations("left"), "GET", "/v1/sensors/left/calibrations"),
    ],
)
def test_what_is_harmless_twice_is_asked_without_a_body(call: Callable[[], Any], method: str, path: str) -> None:
    assert first(call()) == Request(method, path)


@pytest.mark.parametrize(
    ("call", "method", "path", "body"),
    [
        (lambda: calls.rename_material("a", "b"), "PATCH", "/v1/materials/a", {"name": "b"}),
        (lambda: calls.withdraw("1f", "slipped"), "PUT", "/v1/grasp-logs/1f/withdrawal", {"reason": "slipped"}),
        (lambda: calls.describe_sensor("s", {"thickness": 2e-3}), "PUT", "/v1/sensors/s", {"thickness": 2e-3}),
    ],
)
def test_what_says_how_things_are_is_harmless_twice_too(
    call: Callable[[], Any], method: str, path: str, body: dict[str, Any]
) -> None:
    assert first(call()) == Request(method, path, json=body)


@pytest.mark.parametrize(
    ("call", "path", "body"),
    [
        (lambda: calls.merge_materials("a", "b"), "/v1/materials/a/merges", {"source": "b"}),
        (
            lambda: calls.begin_epoch("a", "new", None),
            "/v1/materials/a/epochs",
            {"reason": "new", "first_grasp_log": None},
        ),
        (
            lambda: calls.calibrate_sensor("s", {"1f": 5.0, "2f": None}),
            "/v1/sensors/s/calibrations",
            {"presses": [{"grasp_log": "1f", "known_force": 5.0}, {"grasp_log": "2f", "known_force": None}]},
        ),
    ],
)
def test_what_would_be_done_again_is_sent_once(call: Callable[[], Any], path: str, body: dict[str, Any]) -> None:
    assert first(call()) == Request("POST", path, json=body, is_repeatable=False)


def test_each_creation_and_fit_has_a_key_of_its_own() -> None:
    requests = [
        first(call) for call in (*(calls.fit("a", "ols", 3) for _ in range(2)), calls.create_material("a", "b"))
    ]
    assert [request.path for request in requests] == ["/v1/materials/a/fits"] * 2 + ["/v1/materials"]
    assert [request.json for request in requests] == [{"method": "ols", "seed": 3}] * 2 + [
        {"name": "a", "description": "b"}
    ]
    keys = {request.idempotency_key for request in requests}
    assert len(keys) == 3
    assert None not in keys
    assert all(request.is_repeatable for request in requests)


@pytest.mark.parametrize("name", ["", ".", "..", "..."])
def test_a_name_of_dots_alone_is_refused(name: str) -> None:
    with pytest.raises(InvalidArgument, match="name is '"):
        advance(calls.material(name), None)


@pytest.mark.parametrize("status", [429, 502, 503, 504])
def test_pauses_double_and_the_third_answer_counts(status: int) -> None:
    call = calls.job("j1")
    request, busy = first(call), problem("too-busy", status)
    assert advance(call, busy) == Pause(0.2)
    assert advance(call, None) == request
    assert advance(call, busy) == Pause(0.4)
    assert advance(call, None) == request
    with pytest.raises(ProblemError, match=rf"so it is \({status}, /problems/too-busy\)"):
        advance(call, busy)


def test_a_connection_that_breaks_is_tried_again_twice() -> None:
    call, broken = calls.job("j1"), ConnectionFailed("gone")
    request = first(call)
    steps = [advance(call, each) for each in (broken, None, broken, None)]
    assert steps == [Pause(0.2), request, Pause(0.4), request]
    with pytest.raises(ConnectionFailed, match="gone"):
        advance(call, broken)


@pytest.mark.parametrize(
    ("told", "pause"), [("3", 3.0), ("30", 30.0), ("-5", 0.0), ("nan", 0.2), ("Thu, 01 Jan 2026 00:00:00 GMT", 0.2)]
)
def test_a_service_says_itself_how_long_to_wait(told: str, pause: float) -> None:
    call = calls.job("j1")
    first(call)
    assert advance(call, answer({}, 503, retry_after=told)) == Pause(pause)


@pytest.mark.parametrize("told", ["30.1", "1e9", "inf"])
def test_more_than_half_a_minute_is_not_waited_for(told: str) -> None:
    call = calls.job("j1")
    first(call)
    refusal = {"type": "/problems/too-busy", "detail": "later"}
    with pytest.raises(ProblemError, match="later"):
        advance(call, answer(refusal, 503, retry_after=told))


@pytest.mark.parametrize(
    ("reply", "is_asked_again"),
    [
        (problem("too-busy", 503), True),
        (problem("quota-exceeded", 429), True),
        (problem("stopping", 503), False),
        (problem("too-busy", 502), False),
        (answer(b"proxy", 503), False),
        (answer({"type": "about:blank"}, 503), False),
        (answer([1], 429), False),
        (ConnectionFailed("gone"), False),
    ],
)
def test_a_merge_is_asked_for_again_only_where_nothing_was_done(reply: Any, is_asked_again: bool) -> None:
    call = calls.merge_materials("a", "b")
    first(call)
    if is_asked_again:
        assert isinstance(advance(call, reply), Pause)
    else:
        with pytest.raises((ProblemError, UnexpectedAnswer, ConnectionFailed)):
            advance(call, reply)


def test_a_list_is_asked_for_page_after_page_until_there_are_enough() -> None:
    call = calls.jobs("queued", 1500)
    request = first(call)
    assert (request.path, request.params) == ("/v1/jobs", {"status": "queued", "limit": 1000})
    step = advance(call, answer({"items": [JOB] * 1000, "next": "c1"}))
    assert isinstance(step, Request)
    assert step.params == {"status": "queued", "limit": 500, "cursor": "c1"}
    ended = advance(call, answer({"items": [JOB] * 500, "next": "c2"}))
    assert isinstance(ended, Ended)
    assert len(ended.result) == 1500


def test_all_of_a_list_is_asked_for_until_nothing_follows() -> None:
    call = calls.sensors()
    assert first(call).params == {"limit": 1000}
    assert isinstance(advance(call, answer({"items": [{"name": "a"}], "next": "c"})), Request)
    ended = advance(call, answer({"items": [{"name": "b"}]}))
    assert ended == Ended([{"name": "a"}, {"name": "b"}])


def test_materials_are_asked_for_in_pages_that_an_answer_holds() -> None:
    """A model has 0.5 kB of each sensor: 1,000 materials of 50 sensors had more than is taken of an answer."""
    assert first(calls.materials()).params == {"limit": 100}


@pytest.mark.parametrize("second", [{"items": [JOB], "next": "c1"}, {"items": [], "next": "c2"}])
def test_a_list_that_leads_in_a_circle_or_nowhere_is_left(second: dict[str, Any]) -> None:
    call = calls.jobs(None, 5000)
    first(call)
    advance(call, answer({"items": [JOB], "next": "c1"}))
    with pytest.raises(UnexpectedAnswer, match="the service's list at /v1/jobs does not end"):
        advance(call, answer(second))


def test_what_was_refused_is_told_with_all_that_the_service_said() -> None:
    call = calls.job("j1")
    first(call)
    with pytest.raises(problems.UnknownJob) as refusal:
        advance(call, problem("unknown-job", 404, name="job", value=3, allowed=None, owners=["a"], title="t"))
    error = refusal.value
    assert (error.type, error.status, error.detail) == ("/problems/unknown-job", 404, "so it is")
    assert (error.name, error.value, error.allowed, error.facts) == ("job", "3", None, {"owners": ["a"]})


def test_a_problem_without_detail_is_told_by_its_title() -> None:
    call = calls.job("j1")
    first(call)
    with pytest.raises(ProblemError, match=r"No such job \(404"):
        advance(call, answer({"type": "/problems/unknown-job", "title": "No such job"}, 404))


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (answer(b"<html>", 500), "answered 500 with '<html>', which is no problem"),
        (answer(b"<html>"), "answered 200 with '<html>', which is not JSON"),
        (answer(b"x" * 200), f"with {'x' * 80!r}, which is not JSON"),
        (answer(json.dumps(JOB).encode("utf-16")), "which is not JSON"),
        (answer(json.dumps(JOB).encode("utf-16-le")), "which is not JSON"),
        (answer(json.dumps({"type": "/problems/unknown-job"}).encode("utf-16"), 404), "which is no problem"),
        (answer({**JOB, "id": "j2"}), "its id is 'j2', asked 'j1'"),
        (answer({"id": "j1"}), "lacks or garbles"),
        (answer([]), "lacks or garbles"),
    ],
)
def test_what_no_service_answers_is_told_with_what_came(reply: httpx.Response, message: str) -> None:
    call = calls.job("j1")
    first(call)
    with pytest.raises(UnexpectedAnswer, match=message):
        advance(call, reply)


def test_nothing_may_be_the_answer() -> None:
    call = calls.remove_owner("paper", "key:1")
    first(call)
    assert advance(call, answer(b"", 204)) == Ended(None)


def samples(**changes: Any) -> Any:
    arrays = {name: np.arange(2.0) for name in calls.SAMPLE_ARRAYS}
    return SimpleNamespace(**(arrays | {"element_area": np.float64(1e-6)} | changes))


def test_a_grasp_is_told_by_its_log_or_its_samples() -> None:
    assert first(calls.recognise("1f", None, None, None)).json == {"grasp_log": "1f", "materials": None}
    body = first(calls.recognise(samples(), ("a", "b"), "ols", "left")).json
    assert body is not None
    assert (body["materials"], body["method"], body["sensor"]) == (["a", "b"], "ols", "left")
    assert body["samples"] == {name: [0.0, 1.0] for name in calls.SAMPLE_ARRAYS} | {"element_area": 1e-6}


@pytest.mark.parametrize(
    ("relative", "told"), [([1, 0], [True, False]), ([0, 0], None), (True, True), (False, None), (None, None)]
)
def test_that_velocities_are_relative_is_told_where_any_is(relative: Any, told: Any) -> None:
    body = first(calls.recognise(samples(velocity_is_relative=relative), None, None, None)).json
    assert body is not None
    assert body["samples"].get("velocity_is_relative") == told


@pytest.mark.parametrize("name", calls.SAMPLE_ARRAYS)
def test_samples_that_are_not_finite_are_refused_by_name(name: str) -> None:
    with pytest.raises(InvalidArgument, match=f"{name} is not finite; allowed: finite numbers"):
        first(calls.recognise(samples(**{name: np.array([0.0, np.nan])}), None, None, None))


@pytest.mark.parametrize(("mapping", "told"), [(None, None), ("digit", "digit"), ({"time": "t"}, '{"time": "t"}')])
def test_an_upload_says_what_is_known_of_the_file_and_no_more(mapping: Any, told: Any, tmp_path: Any) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"a,b")
    request = first(calls.upload(path, "paper", None, None, 0.0, 60.0, mapping, 0))
    known = {"material": "paper", "scale": 0.0, "frame_rate": 60.0, "rest": 0}
    assert request.params == (known if told is None else {**known, "mapping": told})
    assert (request.content, request.content_type) == (b"a,b", "application/octet-stream")


def test_a_job_is_asked_for_with_the_time_that_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(calls, "time", SimpleNamespace(monotonic=lambda: clock.now))
    call = calls.wait("j1", 3.0)
    request = first(call)
    assert (request.params, request.wait_seconds) == ({"wait": 2.0}, 2.0)
    clock.now = 102.0  # the service has kept its answer back, so that none is waited for
    assert advance(call, answer(JOB)) == Pause(0.0)
    step = advance(call, None)
    assert isinstance(step, Request)
    assert step.wait_seconds == pytest.approx(1.0)
    clock.now = 102.9
    assert advance(call, answer(JOB)) == Pause(0.0)
    step = advance(call, None)
    assert isinstance(step, Request)
    assert step.wait_seconds == pytest.approx(0.1)
    assert advance(call, answer(JOB)) == Pause(pytest.approx(0.1))
    clock.now = 103.0
    step = advance(call, None)
    assert isinstance(step, Request)
    assert step.wait_seconds == 0.0
    with pytest.raises(calls.JobTimedOut, match="job j1: still queued after 3 s"):
        advance(call, answer(JOB))


@pytest.mark.parametrize("status", ["done", "failed", "refused", "cancelled"])
def test_a_job_that_has_ended_is_not_waited_for(status: str) -> None:
    call = calls.wait("j1", 0.0)
    assert first(call).wait_seconds == 0.0
    ended = advance(call, answer({**JOB, "status": status}))
    assert isinstance(ended, Ended)
    assert ended.result.status == status


@pytest.mark.parametrize(("stale_after", "age", "is_asked"), [(0.0, 0.0, True), (5.0, 4.9, False), (5.0, 5.0, True)])
def test_a_model_is_asked_for_again_once_it_is_as_old_as_it_may_get(
    monkeypatch: pytest.MonkeyPatch, stale_after: float, age: float, is_asked: bool
) -> None:
    model: Any = SimpleNamespace(outdated=True)  # which nothing is compared with
    material = Material("paper", "", "now", 3, {"ols": model}, "ols")
    monkeypatch.setattr(calls, "time", SimpleNamespace(monotonic=lambda: 100.0 + age))
    step = advance(calls.model("paper", "auto", {"paper": CachedModel(material, '"tag"', 100.0)}, stale_after), None)
    if is_asked:
        assert isinstance(step, Request)
        assert (step.path, step.tag) == ("/v1/materials/paper", '"tag"')
    else:
        assert step == Ended(model)
