"""Odd questions get right answers: refused by name, never a failure of the service."""

import base64
import json
from collections.abc import Callable
from typing import Any

import httpx
import numpy as np
import pytest

from db.blobs import BlobStore
from db.database import Database
from db.errors import NotFound
from db.repositories import materials
from service.formats.assemble import as_array
from slipcore.errors import InvalidInput

Reach = Callable[..., Any]
ONLY_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
NPZ = {"content-type": "application/vnd.stiction.grasp-log+npz"}
ASKED = {"material": "paper", "tangential_load": 1.0, "contact_area": 1e-4}
SAMPLES: dict[str, Any] = {
    "friction_coefficient": [0.4],
    "tangential_velocity": [0.001],
    "normal_force": [0.05],
    "tangential_force": [0.02],
    "time": [1.0],
    "element": [1],
    "weight": [1.0],
    "element_area": 1e-6,
}


@pytest.fixture
def local(reach: Reach) -> Any:
    client = reach("auto", "127.0.0.1", "127.0.0.1")
    client.request("POST", "/v1/materials", json={"name": "paper"}).raise_for_status()
    return client


@pytest.mark.parametrize(
    "moment",
    [
        "0001-01-01T00:00:00+23:59",
        "9999-12-31T23:59:59-23:59",
        "2026-02-30T00:00:00+00:00",
        "2026-01-01T25:00:00+00:00",
        "2026-01-01",
        "\ud800",
        "\0",
        True,
        [[]] * 3,
    ],
)
def test_a_cursor_with_an_impossible_date_is_refused(local: Any, moment: Any) -> None:
    cursor = base64.urlsafe_b64encode(json.dumps(["-created_at", moment, "0" * 32]).encode()).decode()
    for path in ("/v1/grasp-logs", "/v1/jobs", "/v1/materials?sort=-created_at"):
        answer = local.get(path + ("&" if "?" in path else "?") + f"cursor={cursor}")
        assert (answer.status_code, answer.json()["name"]) == (422, "cursor"), path


@pytest.mark.parametrize("name", ["\ud800", "paper\0", "\udfff x", "\0"])
def test_text_that_no_database_takes_is_no_name(local: Any, name: str) -> None:
    cases = (
        ("POST", "/v1/materials", {"name": name}),
        ("POST", "/v1/materials", {"name": "felt", "description": name}),
        ("PATCH", "/v1/materials/paper", {"name": name}),
        ("POST", "/v1/materials/paper/merges", {"source": name}),
        ("POST", "/v1/materials/paper/epochs", {"reason": "coated", "first_grasp_log": name}),
        ("POST", "/v1/grasp-force", ASKED | {"material": name}),
        ("POST", "/v1/recognise", {"samples": SAMPLES, "materials": [name]}),
        ("POST", "/v1/recognise", {"grasp_log": name}),
    )
    for method, path, body in cases:
        content = json.dumps(body)  # a lone surrogate as an escape, as a caller may write it
        answer = local.request(method, path, content=content, headers={"content-type": "application/json"})
        assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-request"), path


def test_a_code_point_beyond_unicode_is_refused(
    local: Any, members: dict[str, Any], repack: Callable[..., bytes]
) -> None:
    for code in (0x110000, 0xFFFFFFFF):
        text = np.frombuffer(np.array([code], "<u4").tobytes(), "<U1").reshape(())
        answer = local.request("POST", "/v1/grasp-logs", content=repack(members | {"sensor": text}), headers=NPZ)
        assert (answer.status_code, answer.json()["name"]) == (422, "sensor")
        assert hex(code) in answer.json()["value"]


@ONLY_SQLITE
def test_a_missing_file_is_named(local: Any, content: bytes, blobs: BlobStore) -> None:
    log = local.request("POST", "/v1/grasp-logs", content=content, headers=NPZ).raise_for_status().json()
    blobs.path(log["sha256"]).unlink()
    answer = local.get(f"/v1/grasp-logs/{log['id']}/file")
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/file-missing")
    assert answer.json()["value"] == log["sha256"]


NUMBERS = (
    ("/v1/grasp-force", ASKED, ("tangential_load", "contact_area", "slip_probability", "tangential_velocity")),
    ("/v1/grasp-force", ASKED, ("normal_force_limit",)),
    ("/v1/materials/paper/fits", {}, ("seed",)),
    ("/v1/recognise", {"grasp_log": "x"}, ("unknown",)),
)


@ONLY_SQLITE
@pytest.mark.parametrize("value", [True, False, "1", [1], {"a": 1}])
def test_what_is_no_number_is_not_taken_for_one(local: Any, value: Any) -> None:
    for path, body, names in NUMBERS:
        for name in names:
            answer = local.request("POST", path, json=body | {name: value})
            assert (answer.status_code, answer.json()["name"]) == (422, name), answer.text
    for name, entry in SAMPLES.items():
        wrong = [value] if isinstance(entry, list) else value
        answer = local.request("POST", "/v1/recognise", json={"samples": SAMPLES | {name: wrong}})
        assert answer.status_code == httpx.codes.UNPROCESSABLE_ENTITY
        assert answer.json()["name"].startswith(f"samples.{name}")


@ONLY_SQLITE
def test_a_truth_value_is_no_number_in_a_query(local: Any) -> None:
    for query in ("v=true&fn=1", "fn=true", "fn=1&quantile=true", "fn=True"):
        assert local.get(f"/v1/materials/paper/friction?{query}").status_code == httpx.codes.UNPROCESSABLE_ENTITY
    for path in ("/v1/jobs?limit=true", "/v1/jobs/x?wait=true", "/v1/materials?limit=true"):
        assert local.get(path).status_code == httpx.codes.UNPROCESSABLE_ENTITY
    for query in ("scale=true", "frame_rate=true"):
        answer = local.request("POST", f"/v1/grasp-logs?{query}", content=b"x", headers={"content-type": "text/csv"})
        assert answer.status_code == httpx.codes.UNPROCESSABLE_ENTITY


@pytest.mark.parametrize("value", [[1.0, True], [[0.5, 1], [False, 2]], [None, True, 1.0], [[[1]], [[True]]]])
def test_a_truth_value_among_the_numbers_of_a_json_log_is_refused(value: Any) -> None:
    with pytest.raises(InvalidInput, match="truth values"):
        as_array("time", value)


def test_masks_and_numbers_of_a_json_log_are_read_as_before() -> None:
    assert as_array("contact", [[True, False]]).dtype == np.bool_
    assert as_array("time", [0, 1.5]).tolist() == [0.0, 1.5]
    assert np.isnan(as_array("force", [None, 1.0])[0])


@pytest.mark.parametrize("name", ["\ud800", "paper\0"])
def test_a_name_that_no_database_takes_is_not_found(database: Database, name: str) -> None:
    """However it comes in: a live stream names its material, too."""
    with database.read() as session, pytest.raises(NotFound):
        materials.find_id(session, name)


@ONLY_SQLITE
@pytest.mark.parametrize("force", [5e-324, 1e-300, 0.0, 1e5, 1e308])
def test_a_known_force_that_no_press_has_is_refused_by_name(local: Any, force: float) -> None:
    presses = [{"grasp_log": "x", "known_force": force}]
    answer = local.request("POST", "/v1/sensors/finger/calibrations", json={"presses": presses})
    assert answer.status_code == httpx.codes.UNPROCESSABLE_ENTITY
    assert answer.json()["name"].endswith("known_force")


@pytest.mark.parametrize(
    "body",
    [
        {"samples": {"time": ["a"] * 20_000}},
        {"samples": {"kind": [{}] * 20_000}},
        {"materials": [0] * 20_000},
    ],
)
def test_a_body_of_nothing_but_errors_is_refused_by_few_of_them(local: Any, body: dict[str, Any]) -> None:
    """A single one of 1 MB had 250,000 made and told, and nobody was answered for 13 s."""
    answer = local.request("POST", "/v1/recognise", json=body)
    assert answer.status_code == httpx.codes.UNPROCESSABLE_ENTITY
    assert len(answer.json()["errors"]) < 20
    assert len(answer.content) < 10_000


@pytest.mark.parametrize("place", [lambda fields: fields, lambda fields: {"samples": fields}])
def test_an_object_of_more_fields_than_any_has_is_refused_as_a_whole(local: Any, place: Any) -> None:
    answer = local.request("POST", "/v1/recognise", json=place({f"field {number}": 0 for number in range(101)}))
    assert answer.status_code == httpx.codes.BAD_REQUEST
    assert "more than 100 fields" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("fields", "padding", "told"), [(101, 5000, "more than 100 fields"), (90, 0, "more than 500 fields together")]
)
@ONLY_SQLITE
def test_objects_in_lists_have_few_fields_too(local: Any, fields: int, padding: int, told: str) -> None:
    """Each that is unknown was an error apart: 6,500 in one press took a tenth of a second of everybody's time."""
    press = {f"f{number}": 0 for number in range(fields)}
    body = {"presses": [press] * (1 if padding else 32), "note": "x" * padding}
    answer = local.request("POST", "/v1/sensors/none/calibrations", json=body)
    assert (answer.status_code, told in answer.json()["detail"]) == (httpx.codes.BAD_REQUEST, True)


@pytest.mark.parametrize("padding", [0, 5000])
@pytest.mark.parametrize(
    "twice", ['{"description": "a", "d\\u0065scription": "b"}', '[{"a:b": [{"\\u00fc": "\\\\", "\\u00fc": "\\":"}]}]']
)
@ONLY_SQLITE
def test_a_field_that_stands_twice_is_refused_by_name(local: Any, padding: int, twice: str) -> None:
    headers = {"content-type": "application/json"}
    answer = local.request("POST", "/v1/materials", content=twice + " " * padding, headers=headers)
    name = "description" if "description" in twice else "\\xfc"
    told = f"POST /v1/materials: an object of the body has the field '{name}' more than once"
    assert (answer.status_code, answer.json()["detail"]) == (httpx.codes.BAD_REQUEST, told)


@ONLY_SQLITE
def test_a_long_body_with_colons_and_quotes_in_its_text_has_each_field_once(local: Any) -> None:
    body = {"name": "felt", "description": '": \\ "' * 700}
    assert local.request("POST", "/v1/materials", json=body).status_code == httpx.codes.CREATED


@ONLY_SQLITE
def test_of_many_wrong_values_the_first_are_told(local: Any) -> None:
    body = {"presses": [{"x": 0}] * 30}
    answer = local.request("POST", "/v1/sensors/none/calibrations", json=body)
    assert (answer.status_code, len(answer.json()["errors"])) == (httpx.codes.UNPROCESSABLE_ENTITY, 20)


@ONLY_SQLITE
def test_lists_of_any_depth_are_looked_through(local: Any) -> None:
    headers = {"content-type": "application/json"}
    for depth in (500, 30_000):
        answer = local.request("POST", "/v1/recognise", content="[" * depth + "]" * depth, headers=headers)
        assert answer.status_code in {httpx.codes.BAD_REQUEST, httpx.codes.UNPROCESSABLE_ENTITY}


def test_some_unknown_fields_are_named_one_by_one(local: Any) -> None:
    answer = local.request("POST", "/v1/recognise", json={"log": "x", "sample": 1})
    assert {each["name"] for each in answer.json()["errors"]} == {"log", "sample"}
