import gzip
from collections.abc import Callable
from typing import Any

import httpx
import pytest

Wait = Callable[[httpx.Client, str], dict[str, Any]]


def test_a_new_material_is_there_from_then_on(client: httpx.Client) -> None:
    made = client.post("/v1/materials", json={"name": "card board", "description": "brown"})
    assert made.status_code == httpx.codes.CREATED
    assert made.headers["location"] == "/v1/materials/card%20board"
    assert client.get(made.headers["location"]).json() == made.json()
    assert made.json() | {"created_at": None} == {
        "name": "card board",
        "aliases": [],
        "description": "brown",
        "created_at": None,
        "grasp_logs": 0,
        "withdrawn_grasp_logs": 0,
        "models": {},
        "recommended": None,
    }
    assert made.json() in client.get("/v1/materials?search=card&limit=1000").json()["items"]


def test_a_second_material_of_that_name_is_refused(client: httpx.Client, material: str) -> None:
    response = client.post("/v1/materials", json={"name": material})
    assert response.status_code == httpx.codes.CONFLICT
    assert response.json()["type"] == "/problems/material-exists"
    assert response.json()["value"] == material


@pytest.mark.parametrize(
    ("body", "name"),
    [
        ({"name": ""}, "name"),
        ({"name": " paper"}, "name"),
        ({"name": "paper "}, "name"),
        ({"name": "x" * 99 + " "}, "name"),
        ({"name": "a/b"}, "name"),
        ({"name": "ü"}, "name"),
        ({"name": "paper\n"}, "name"),
        ({"name": "x" * 101}, "name"),
        ({"name": 5}, "name"),
        ({}, "name"),
        ({"name": "ok", "description": "x" * 10_001}, "description"),
        ({"name": "ok", "colour": "red"}, "colour"),
    ],
)
def test_a_material_that_cannot_be_is_refused_by_name(client: httpx.Client, body: object, name: str) -> None:
    response = client.post("/v1/materials", json=body)
    assert response.status_code == httpx.codes.UNPROCESSABLE_ENTITY
    problem = response.json()
    assert (problem["type"], problem["name"]) == ("/problems/invalid-request", name)
    assert problem["allowed"]
    assert problem["detail"] == f"{name} is {problem['value']}; allowed: {problem['allowed']}"


def test_a_method_that_is_not_taken_is_answered_with_those_that_are(client: httpx.Client) -> None:
    answer = client.delete("/v1/materials")
    assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD, POST")
    assert answer.json()["detail"] == "method is DELETE; allowed: GET, HEAD, POST"
    assert answer.json()["allowed"] == "GET, HEAD, POST"


def test_every_wrong_value_is_listed(client: httpx.Client) -> None:
    problem = client.post("/v1/materials", json={"name": "", "description": 1}).json()
    assert [entry["name"] for entry in problem["errors"]] == ["name", "description"]


@pytest.mark.parametrize("padding", ["", 5000 * " "], ids=["short", "long"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1"])
def test_a_body_is_utf_8_without_a_mark_however_long(client: httpx.Client, encoding: str, padding: str) -> None:
    content = ('{"name": "felt", "description": "weiß"}' + padding).encode(encoding)
    answer = client.post("/v1/materials", content=content, headers={"content-type": "application/json"})
    assert (answer.status_code, answer.json()["name"]) == (422, "body")
    assert "another encoding than UTF-8 without a byte order mark" in answer.json()["value"]


def test_names_differ_by_case(client: httpx.Client, material: str) -> None:
    assert client.post("/v1/materials", json={"name": material.upper()}).status_code == 201


@pytest.mark.parametrize(
    ("content", "content_type", "status", "kind"),
    [
        (b'{"name": ', "application/json", 422, "invalid-request"),
        (b'["paper"]', "application/json", 422, "invalid-request"),
        (b"\xff\xfe", "application/json", 422, "invalid-request"),
        (b"name=paper", "application/x-www-form-urlencoded", 415, "unsupported-format"),
        (b'{"name": "paper"}', "text/plain", 415, "unsupported-format"),
        (b'{"name": "' + b"x" * 70_000 + b'"}', "application/json", 413, "upload-too-large"),
    ],
)
def test_a_body_that_is_no_material_is_refused(
    client: httpx.Client, content: bytes, content_type: str, status: int, kind: str
) -> None:
    response = client.post("/v1/materials", content=content, headers={"content-type": content_type})
    assert response.headers["content-type"] == "application/problem+json"
    assert (response.status_code, response.json()["type"]) == (status, f"/problems/{kind}")


@pytest.mark.parametrize(
    ("method", "path"),
    [("GET", ""), ("GET", "/friction?fn=0.05"), ("GET", "/fits"), ("POST", "/fits")],
)
def test_an_unknown_material_is_named(client: httpx.Client, method: str, path: str) -> None:
    response = client.request(method, f"/v1/materials/felt{path}", json={} if method == "POST" else None)
    assert response.status_code == httpx.codes.NOT_FOUND
    problem = response.json()
    assert (problem["type"], problem["name"], problem["value"]) == ("/problems/unknown-material", "material", "felt")


def test_a_material_without_a_model_says_so(client: httpx.Client, material: str) -> None:
    response = client.get(f"/v1/materials/{material}/friction", params={"fn": 0.05})
    assert response.status_code == httpx.codes.CONFLICT
    assert response.json()["type"] == "/problems/no-model"
    assert client.get(f"/v1/materials/{material}/fits").json() == {"items": [], "next": None}


@pytest.mark.usefixtures("fitted")
def test_the_friction_of_a_fitted_material_is_its_truth(client: httpx.Client) -> None:
    mean = client.get("/v1/materials/fitted/friction", params={"v": 3e-4, "fn": 0.15}).json()
    assert mean["friction_coefficient"] == mean["mean"] == pytest.approx(0.4, abs=0.004)
    assert (mean["material"], mean["method"], mean["version"]) == ("fitted", "hierarchical", 1)
    assert mean["chosen_because"].startswith("hierarchical: ")
    larger = {"v": 3e-4, "fn": 0.45, "element_area": 3.0 * mean["element_area"]}
    assert client.get("/v1/materials/fitted/friction", params=larger).json()["mean"] == pytest.approx(mean["mean"])
    ols = client.get("/v1/materials/fitted/friction", params={"v": 3e-4, "fn": 0.15, "method": "ols"}).json()
    assert (ols["method"], ols["chosen_because"]) == ("ols", None)
    assert (mean["tangential_velocity"], mean["normal_force"], mean["quantile"]) == (3e-4, 0.15, None)
    assert (mean["within_domain"], mean["support"]) == (True, "not identified")  # by one grasp
    assert mean["warning"] == mean["advice"]
    assert "record more grasps" in mean["advice"]


@pytest.mark.usefixtures("fitted")
def test_what_to_record_next_is_told(client: httpx.Client) -> None:
    told = client.get("/v1/materials/fitted/next-grasp", params={"fn": 0.3, "quantile": 1e-3}).json()
    assert (told["material"], told["method"], told["support"]) == ("fitted", "hierarchical", "not identified")
    assert 0.0 < told["after"] < told["uncertainty"]
    assert told["normal_force"] > 0.0
    at = {"fn": 0.3, "quantile": 1e-3, "elements": 60}
    assert (
        told["conservative_friction"]
        == client.get("/v1/materials/fitted/friction", params=at).json()["friction_coefficient"]
    )
    too_much = client.get("/v1/materials/fitted/next-grasp", params={"load": 1e5})
    assert (too_much.status_code, too_much.json()["name"]) == (422, "load")


@pytest.mark.usefixtures("fitted")
def test_a_low_quantile_lies_below_the_mean_and_a_high_one_above(client: httpx.Client) -> None:
    answers = [
        client.get("/v1/materials/fitted/friction", params={"v": 1e-4, "fn": 0.1, "quantile": quantile}).json()
        for quantile in (0.05, 0.5, 0.95)
    ]
    low, middle, high = (answer["friction_coefficient"] for answer in answers)
    assert low < middle < high
    assert middle == pytest.approx(answers[0]["mean"], rel=1e-12)


@pytest.mark.usefixtures("fitted")
@pytest.mark.parametrize(
    ("query", "word"),
    [
        ({"fn": 50.0}, "normal force extrapolated to 50 N"),
        ({"fn": 0.1, "v": 3.0}, "tangential velocity extrapolated to 3 m/s"),
    ],
)
def test_a_question_outside_the_samples_is_answered_with_a_warning(
    client: httpx.Client, query: dict[str, float], word: str
) -> None:
    answer = client.get("/v1/materials/fitted/friction", params=query).json()
    assert answer["within_domain"] is False
    assert word in answer["warning"]


@pytest.mark.usefixtures("fitted")
@pytest.mark.parametrize(
    ("query", "name"),
    [
        ({"fn": 0.1, "quantile": 0.0}, "quantile"),
        ({"fn": 0.1, "quantile": 1.0}, "quantile"),
        ({"fn": 0.1, "quantile": 1.5}, "quantile"),
        ({"fn": 0.1, "quantile": "nan"}, "quantile"),
        ({"fn": 0.1, "v": -1e-3}, "v"),
        ({"fn": 0.1, "v": "inf"}, "v"),
        ({"fn": "nan"}, "fn"),
        ({"fn": "much"}, "fn"),
        ({}, "fn"),
        ({"fn": 0.1, "method": "guess"}, "method"),
    ],
)
def test_a_question_that_cannot_be_is_refused_by_name(client: httpx.Client, query: dict[str, Any], name: str) -> None:
    response = client.get("/v1/materials/fitted/friction", params=query)
    assert response.status_code == httpx.codes.UNPROCESSABLE_ENTITY
    problem = response.json()
    assert (problem["type"], problem["name"]) == ("/problems/invalid-request", name)
    assert problem["value"] == str(float(query[name]) if name == "quantile" else query.get(name, "missing"))
    assert problem["allowed"]


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ({"fn": -1}, "fn is -1; allowed: a number, 0 to 10000"),
        ({"fn": "1e5"}, "fn is 1e5; allowed: a number, 0 to 10000"),
        ({"fn": "nan"}, "fn is nan; allowed: a number, 0 to 10000"),
        ({"fn": 0.1, "quantile": "low"}, "quantile is low; allowed: a number, 1e-12 to 0.999999999999"),
        ({"fn": 0.1, "elements": 0}, "elements is 0; allowed: a whole number, 1 to 1000000000"),
        ({"fn": 0.1, "elements": 1.5}, "elements is 1.5; allowed: a whole number, 1 to 1000000000"),
    ],
)
def test_both_ends_of_a_range_are_told(client: httpx.Client, query: dict[str, Any], told: str) -> None:
    assert client.get("/v1/materials/fitted/friction", params=query).json()["detail"] == told


def test_both_ends_of_a_range_are_told_of_bodies_and_lists(client: httpx.Client) -> None:
    asked = {"material": "fitted", "tangential_load": 1e7, "contact_area": True, "fingers": 0}
    told = client.post("/v1/grasp-force", json=asked).json()["errors"]
    assert {each["name"]: each["allowed"] for each in told} == {
        "tangential_load": "a number, 0 to 1e6",
        "contact_area": "a number, 1e-12 to 1",
        "fingers": "a whole number, 1 to 100",
    }
    assert "limit is 1001; allowed: a whole number, 1 to 1000" in client.get("/v1/jobs?limit=1001").text


def test_a_fit_on_request_is_a_new_current_version(client: httpx.Client, fitted: dict[str, Any], wait: Wait) -> None:
    before = client.get("/v1/materials/fitted/fits", params={"method": "bayes"}).json()["items"]
    asked = client.post("/v1/materials/fitted/fits", json={"method": "bayes", "seed": 3})
    assert asked.status_code == httpx.codes.ACCEPTED
    job = asked.json()
    assert asked.headers["location"] == f"/v1/jobs/{job['id']}"
    assert (job["kind"], job["material"], job["grasp_log"]) == ("fit", "fitted", None)
    done = wait(client, job["id"])
    assert (done["status"], done["model_version"]) == ("done", len(before) + 1)
    models = client.get("/v1/materials/fitted/fits").json()["items"]
    assert [model["method"] for model in models if model["current"]] == ["bayes", "ols", "hierarchical"]
    bayes = client.get("/v1/materials/fitted").json()["models"]["bayes"]
    assert bayes == models[0]
    assert bayes["coefficients"][0] == pytest.approx(0.4, abs=0.004)
    assert bayes["n"] == fitted["detection"]["samples"]


def test_a_fit_without_samples_is_refused_with_the_reason(client: httpx.Client, material: str, wait: Wait) -> None:
    job = wait(client, client.post(f"/v1/materials/{material}/fits", json={}).json()["id"])
    assert (job["status"], job["stage"], job["model_version"]) == ("refused", "friction_model", None)
    assert job["reason"] == "no grasp log of this material has friction samples yet"


def test_head_is_get_without_the_body(client: httpx.Client, material: str) -> None:
    for path in ("/v1/materials", f"/v1/materials/{material}", "/v1/materials/felt"):
        get, head = client.get(path), client.head(path)
        assert head.status_code == get.status_code
        assert head.content == b""
        assert head.headers["content-length"] == get.headers["content-length"] == str(len(get.content))
        assert head.headers["content-type"] == get.headers["content-type"]


@pytest.mark.usefixtures("fitted")
@pytest.mark.parametrize(
    ("query", "name"),
    [
        ({"fn": 0.1, "quantile": 1e-300}, "quantile"),
        ({"fn": 1e308}, "fn"),
        ({"fn": 0.1, "v": 1e155, "quantile": 0.05}, "v"),
    ],
)
def test_a_question_that_no_number_answers_is_refused(client: httpx.Client, query: dict[str, float], name: str) -> None:
    answer = client.get("/v1/materials/fitted/friction", params=query)
    assert answer.status_code == 422
    assert answer.json()["name"] == name


@pytest.mark.parametrize("description", ["\\ud800", "\\u0000"])
def test_a_description_that_no_database_holds_is_refused(client: httpx.Client, description: str) -> None:
    body = '{"name": "odd", "description": "' + description + '"}'
    answer = client.post("/v1/materials", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422
    assert answer.json()["name"] == "description"


@pytest.mark.parametrize("cut", [None, -9])
def test_json_that_is_packed_is_refused_as_that(client: httpx.Client, cut: int | None) -> None:
    """It was told as JSON in another encoding than UTF-8."""
    headers = {"content-type": "application/json", "content-encoding": "gzip"}
    packed = gzip.compress(b'{"name": "paper"}')[:cut]
    response = client.post("/v1/materials", content=packed, headers=headers)
    told = response.json()
    assert (response.status_code, told["type"]) == (415, "/problems/unsupported-format")
    assert (told["name"], told["value"]) == ("content encoding", "gzip")
    plain = client.post("/v1/materials", json={"name": "not packed"}, headers={"content-encoding": "Identity"})
    assert plain.status_code in {201, 409}
