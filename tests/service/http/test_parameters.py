"""A parameter that a route does not know, or that stands twice, changes no answer without a word."""

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from service.app import create_app
from service.settings import Settings

ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
IDENTITY = {"{name}": "paper", "{alias}": "copy", "{owner}": "group:lab", "{version}": "1", "{id}": "0" * 32}


@cache
def described() -> list[tuple[str, str, list[str]]]:
    """Method and path of each operation, with the parameters of its query."""
    return [
        (method.upper(), path, [each["name"] for each in operation.get("parameters", []) if each["in"] == "query"])
        for path, operations in create_app(Settings()).openapi()["paths"].items()
        for method, operation in operations.items()
        if path.startswith("/v1/")
    ]


def placed(path: str) -> str:
    for name, text in IDENTITY.items():
        path = path.replace(name, text)
    return path


@ONLY_SQLITE
def test_an_unknown_parameter_is_refused_by_each_route_with_those_it_takes(reach: Callable[..., Any]) -> None:
    client = reach("open")
    for method, path, known in described():
        body = {} if method in {"GET", "DELETE"} else {"content": "{}", "headers": {"content-type": "application/json"}}
        answer = client.request(method, f"{placed(path)}?quantil=0.05", **body)
        told = answer.json()
        assert (answer.status_code, told["type"]) == (422, "/problems/invalid-request"), (method, path, told)
        assert (told["name"], told["value"]) == ("quantil", "unknown"), (method, path)
        assert sorted(told["allowed"].split(", ")) == (sorted(known) or ["no parameters"]), (method, path)


@ONLY_SQLITE
def test_a_parameter_that_stands_twice_is_refused(reach: Callable[..., Any]) -> None:
    client = reach("open")
    for method, path, known in described():
        for name in known:
            answer = client.request(method, f"{placed(path)}?{name}=1&{name}=1", headers={"content-type": "text/csv"})
            told = answer.json()
            assert answer.status_code == 422, path
            assert told["detail"] == f"{name} is given 2 times; allowed: once", path


NUMBERS = {
    "/v1/materials/paper/friction": ("fn", "v", "quantile", "elements"),
    "/v1/materials/paper/next-grasp": ("fn", "v", "quantile", "elements", "load", "drop_probability"),
    "/v1/materials/paper/fits": ("limit",),
    "/v1/jobs/0": ("wait",),
    "/v1/sensors": ("limit",),
    "/v1/grasp-logs": ("limit",),
}


@ONLY_SQLITE
@pytest.mark.parametrize("path", NUMBERS)
def test_a_number_in_which_something_was_lost_is_none(reach: Callable[..., Any], path: str) -> None:
    """Python reads 1_0 as 10."""
    for name in NUMBERS[path]:
        told = reach("open").get(f"{path}?{name}=1_0").json()
        assert told["detail"] == f"{name} is 1_0; allowed: a number"


@ONLY_SQLITE
def test_text_may_have_what_numbers_may_not(reach: Callable[..., Any]) -> None:
    for query in ("/v1/materials?search=a_b", "/v1/grasp-logs?sensor=a_b"):
        assert reach("open").get(query).status_code == 200


@ONLY_SQLITE
def test_who_may_not_ask_is_told_that_first(reach: Callable[..., Any]) -> None:
    assert reach("keys").get("/v1/materials?searhc=x").status_code == 401


@ONLY_SQLITE
@pytest.mark.parametrize("path", ["/healthz", "/metrics", "/"])
def test_probes_and_pages_pass_over_what_others_add_to_their_addresses(reach: Callable[..., Any], path: str) -> None:
    assert reach("open").get(f"{path}?utm_source=x").status_code == 200
