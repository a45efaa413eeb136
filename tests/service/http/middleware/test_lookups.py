from collections.abc import Callable
from typing import Any

import httpx
import pytest

from db.database import Database
from db.records import NewModel
from db.repositories import access_keys, friction_models, jobs, materials
from service.domain.access import keys
from service.domain.models.model_cache import ModelCache
from service.http.middleware import lookups
from service.http.middleware.lookups import Lookups
from service.http.routes import materials as route

pytestmark = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
PATH = "/v1/materials/copy%20paper/friction?"


@pytest.fixture
def client(reach: Callable[..., Any], database: Database) -> Any:
    """Of a service that has a model of "copy paper" in memory once it was asked for it."""
    covariance = ((1e-4, 0.0, 0.0), (0.0, 1e-4, 0.0), (0.0, 0.0, 1e-4))
    ranges: dict[str, Any] = {"tangential_velocity": (0.0, 0.01), "normal_force": (0.01, 0.1), "element_area": 1e-6}
    freedom: dict[str, Any] = {
        "degrees_of_freedom": 11.0,
        "scatter_degrees_of_freedom": None,
        "identifiable": (True,) * 3,
    }
    more: dict[str, Any] = {"diagnostics": {}, "cost_seconds": 0.0, "monte_carlo_error": 0.0} | ranges | freedom
    with database.write() as session:
        material = materials.create(session, "copy paper", "").id
        for method in ("ols", "bayes"):
            model = NewModel(method, (0.4, 0.1, -0.3), covariance, 0.02, 9, **more)
            job = jobs.add(session, "fit", method, material_id=material)
            friction_models.add(session, material, job, model)
    return reach("open", lookup_seconds=60.0)


def told(answer: httpx.Response) -> tuple[int, Any, dict[str, str]]:
    body = answer.json()
    body.pop("request_id", None)
    return (
        answer.status_code,
        repr(body).encode(),
        {k: v for k, v in answer.headers.items() if k not in {"x-request-id", "content-length"}},
    )


async def no_answer(*_: object) -> None:
    """Instead of the shortest way."""


def both_ways(client: Any, queries: str, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any, Any]]:
    """Each query with its answer by the shortest way, where it gives one, and by the route."""
    asked = ["", *queries.split()]
    client.get(f"{PATH}fn=0.05")
    client.get(f"{PATH}fn=0.05&method=bayes")
    short = [told(client.get(PATH + query)) for query in asked]
    monkeypatch.setattr(Lookups, "_answer", no_answer)
    return list(zip(asked, short, [told(client.get(PATH + query)) for query in asked], strict=True))


SIMPLE = """
fn=0.05
v=0&fn=0.05&quantile=0.05
fn=1e-3&v=1e-5
method=bayes&fn=0.05
fn=10000
fn=5e3&quantile=0.999
fn=0.05&quantile=1e-12
fn=0&v=1000
fn=0.05&quantile=0.05&elements=60
fn=0.05&quantile=0.05&of=contact&elements=60
fn=0.05&quantile=0.05&of=element
"""
OTHER = """
fn=0.05&x=%00
fn=0.05&of=contact
fn=0.05&of=grasp
fn=0.05&elements=0
fn=0.05&elements=1.5
v=0
fn=
fn=x
fn=-1
fn=10001
fn=1e9
fn=nan
fn=inf
fn=0.05&fn=0.06
fn=0.05&method=ols&method=bayes
method=auto&fn=0.05
method=robust&fn=0.05
method=&fn=0.05
fn=.05
fn=+1
fn=%200.05
fn=%30.05
fn=0.05&x=1
fn=1_0
fn=0.05&elements=1_0
fn=0.05&
&fn=0.05
FN=1&fn=0.05
fn=0.05&quantile=
fn=0.05&quantile=1
fn=0.05&quantile=1e-13
fn=1_0
fn=5E-2
fn=0.05;v=1
v=1001&fn=0.05
fn=0.05&v=1&v=2
fn=٠
"""


@pytest.mark.parametrize("queries", [SIMPLE, OTHER], ids=["simple", "other"])
def test_the_shortest_way_says_what_the_route_says(client: Any, queries: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for query, short, long in both_ways(client, queries, monkeypatch):
        assert short == long, query
        assert short[0] == 200 or query not in SIMPLE.split(), query


def test_a_simple_question_does_not_reach_the_route(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []
    original = route.look_up
    monkeypatch.setattr(route, "look_up", lambda *given: asked.append(given) or original(*given))  # type: ignore[func-returns-value]
    first, *again = [client.get(f"{PATH}fn=0.05&quantile=0.05") for _ in range(3)]
    assert len(asked) == 1
    assert all(answer.content == first.content for answer in again)
    same = client.get(f"{PATH}fn=0.05", headers={"If-None-Match": first.headers["etag"]})
    assert (same.status_code, same.content) == (304, b"")
    assert client.request("HEAD", f"{PATH}fn=0.05").content == b""
    assert client.request("POST", f"{PATH}fn=0.05").status_code == 405


def test_a_model_that_changed_is_read_without_the_route(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    client.get(f"{PATH}fn=0.05")
    monkeypatch.setattr(route, "look_up", lambda *_: pytest.fail("the route was asked"))
    client.app.state.context.models.seen()
    assert client.get(f"{PATH}fn=0.05").status_code == 200


def test_what_cannot_be_read_anew_is_refused_by_the_route(client: Any, database: Database) -> None:
    client.get(f"{PATH}fn=0.05")
    with database.write() as session:
        materials.rename(session, materials.find_id(session, "copy paper"), "paper")
        materials.remove_alias(session, materials.find_id(session, "paper"), "copy paper")
    client.app.state.context.models.seen()
    assert client.get(f"{PATH}fn=0.05").status_code == 404


def test_the_shortest_way_is_counted_as_the_route(client: Any) -> None:
    for _ in range(3):
        client.get(f"{PATH}fn=0.05")
    counted = client.app.state.metrics.requests.labels("GET", "/v1/materials/{name}/friction", "200")
    assert sum(bucket.get() for bucket in counted._buckets) == 3


def answers_kept(layer: Any) -> dict[Any, Any]:
    """Of the layer that answers look-ups, whatever surrounds it."""
    while not isinstance(layer, Lookups):
        layer = layer.app
    return layer._kept


def test_the_answers_kept_are_bounded(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookups, "MOST_RESPONSES", 3)
    values = [client.get(f"{PATH}fn=0.0{number}").json()["normal_force"] for number in range(10)]
    assert values == [number / 100.0 for number in range(10)]
    kept = answers_kept(client.app.middleware_stack)
    assert 0 < len(kept) <= 3


def test_the_shortest_way_leads_through_the_gate(
    reach: Callable[..., Any], client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    stranger = reach("keys", lookup_seconds=60.0)
    stranger.app.state.context = client.app.state.context
    client.get(f"{PATH}fn=0.05")
    assert stranger.get(f"{PATH}fn=0.05").status_code == 401
    stranger.app.state.context.models.seen()
    monkeypatch.setattr(ModelCache, "read", lambda *_: pytest.fail("the model was read for a stranger"))
    assert stranger.get(f"{PATH}fn=0.05").status_code == 401


def test_the_shortest_way_is_as_narrow_as_the_gate(reach: Callable[..., Any], client: Any) -> None:
    def shared(**given: Any) -> Any:
        caller = reach(lookup_seconds=60.0, **given)
        caller.app.state.context = client.app.state.context
        return caller

    client.get(f"{PATH}fn=0.05")
    misled = shared(server="127.0.0.1", address="127.0.0.1")
    assert misled.get(f"{PATH}fn=0.05", headers={"Host": "evil.example"}).status_code == 421
    assert misled.get(f"{PATH}fn=0.05", headers={"X-Forwarded-For": "10.0.0.1"}).status_code == 401
    assert misled.get(f"{PATH}fn=0.05", headers={"X": "x" * 20_000}).status_code == 431
    hasty = shared(access="open", rate_limit=2.0)
    assert [hasty.get(f"{PATH}fn=0.05").status_code for _ in range(3)] == [200, 200, 429]


def test_the_shortest_way_knows_a_key_that_was_used_a_moment_ago(
    reach: Callable[..., Any], client: Any, database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    key_id, key = keys.new_key()
    with database.write() as session:
        access_keys.add(session, key_id, "planner", "read", keys.digest(key))
    planner = reach("keys", key=key, lookup_seconds=60.0, rate_limit=3.0)
    planner.app.state.context = client.app.state.context
    client.get(f"{PATH}fn=0.05")
    assert planner.get(f"{PATH}fn=0.05").status_code == 200
    asked: list[object] = []
    monkeypatch.setattr(route, "look_up", lambda *given: asked.append(given))
    assert planner.get(f"{PATH}fn=0.05").status_code == 200
    assert asked == []
    assert planner.get(f"{PATH}fn=0.05", headers={"Authorization": f"Bearer {key[:-1]}x"}).status_code == 401
    assert [planner.get(f"{PATH}fn=0.05").status_code for _ in range(2)] == [200, 429]
