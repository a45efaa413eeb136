from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from slipcore import GraspLog
from stiction_client.container import encode
from tests.service.stored import stored_files, wait_for_empty_spool
from tests.service.web.conftest import HTML

ON_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)


@pytest.fixture
def page_of(client: httpx.Client, elements: Callable[..., Any]) -> Callable[[str], Any]:
    """The elements of a page of the server that all tests share."""

    def read(path: str) -> Any:
        answer = client.get(path, headers=HTML)
        assert answer.status_code == 200, answer.text
        return elements(answer.text)

    return read


@ON_SQLITE
def test_a_log_that_went_all_the_way_has_a_player_with_frames(
    client: httpx.Client, fitted: Any, page_of: Callable[[str], Any]
) -> None:
    page = page_of(f"/logs/{fitted['id']}")
    (player,) = [given for tag, given in page.found if given.get("class") == "player"]
    answer = client.get(player["data-frames"])
    assert answer.status_code == 200
    assert len(answer.content) > fitted["frames"] * 64 * 5
    again = client.get(player["data-frames"], headers={"if-none-match": answer.headers["etag"]})
    assert again.status_code == 304
    assert "done" in page.text
    contact = fitted["detection"]["contact_friction"]
    assert "Friction of the whole contact" in page.text
    assert contact["reason"] in page.text


@ON_SQLITE
def test_a_log_and_its_material_have_a_report_that_loads_nothing(
    client: httpx.Client, fitted: Any, elements: Callable[..., Any], page_of: Callable[[str], Any]
) -> None:
    for path in (f"/logs/{fitted['id']}", "/materials/fitted"):
        assert f"{path}/report" in [given.get("href") for _, given in page_of(path).found]
        answer = client.get(f"{path}/report")
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-type"] == "text/html; charset=utf-8"
        assert answer.headers["content-security-policy"].startswith("default-src 'none'; style-src 'unsafe-inline'")
        page = elements(answer.text)
        assert [tag for tag, _ in page.found if tag in {"script", "img", "link"}] == []
        assert "What to do next" in page.text
        assert "svg" in {tag for tag, _ in page.found}
    wait_for_empty_spool(client)


@ON_SQLITE
@pytest.mark.parametrize(
    "path", ["/logs/{id}/frames", "/v1/grasp-logs/{id}/file", "/v1/grasp-logs/{id}/file?format=parquet"]
)
@pytest.mark.parametrize(("asked", "status"), [("bytes=999999999-", 416), ("bytes=5-2", 400)])
def test_a_range_that_a_file_does_not_have_is_a_problem_and_leaves_no_file(
    client: httpx.Client, fitted: Any, path: str, asked: str, status: int
) -> None:
    answer = client.get(path.format(id=fitted["id"]), headers={"range": asked})
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")
    assert answer.json()["status"] == status
    assert (status == 416) == answer.headers.get("content-range", "").startswith("bytes */")
    wait_for_empty_spool(client)


@ON_SQLITE
@pytest.mark.parametrize("asked", ["lines=1-2", "bytes=1_0-2_0", "bytes=+1-+5", "bytes=a-b", "bytes=,", "all of it"])
def test_a_range_that_says_nothing_of_bytes_is_ignored(
    client: httpx.Client, fitted: Any, content: bytes, asked: str
) -> None:
    answer = client.get(f"/v1/grasp-logs/{fitted['id']}/file", headers={"range": asked})
    assert (answer.status_code, answer.content) == (200, content)


@ON_SQLITE
def test_a_range_of_a_file_is_sent(client: httpx.Client, fitted: Any, content: bytes) -> None:
    answer = client.get(f"/v1/grasp-logs/{fitted['id']}/file", headers={"range": "bytes=2-5"})
    assert (answer.status_code, answer.content) == (206, content[2:6])


@ON_SQLITE
def test_what_makes_a_log_doubtful_stands_on_its_page(
    client: httpx.Client, ramp: GraspLog, upload: Any, wait: Any, fitted: Any, page_of: Callable[[str], Any]
) -> None:
    accepted = upload(client, encode(replace(ramp, time=1e3 * ramp.time))).json()
    wait(client, accepted["job"]["id"])
    told = page_of(f"/logs/{accepted['id']}").text
    assert "slow frames" in told
    assert "not ms" in told
    assert "doubtful" not in page_of(f"/logs/{fitted['id']}").text


@ON_SQLITE
def test_the_detector_that_ran_is_told_where_a_log_has_forces_alone(
    client: httpx.Client, ramp: GraspLog, upload: Any, wait: Any, fitted: Any, page_of: Callable[[str], Any]
) -> None:
    accepted = upload(client, encode(replace(ramp, displacement=None)), detector="filter").json()
    wait(client, accepted["job"]["id"])
    assert "forces_only; asked for: filter" in page_of(f"/logs/{accepted['id']}").text
    assert "asked for" not in page_of(f"/logs/{fitted['id']}").text
    assert "forces_only" in client.get(f"/logs/{accepted['id']}/report").text
    wait_for_empty_spool(client)


@ON_SQLITE
def test_a_material_with_a_model_shows_its_sections_coefficients_and_logs(
    fitted: Any, page_of: Callable[[str], Any]
) -> None:
    page = page_of("/materials/fitted?fn=0.1&v=0.001&method=ols")
    tags = [tag for tag, _ in page.found]
    assert tags.count("svg") == 8  # two sections, four densities and two pairs of coefficients
    assert tags.count("polyline") == 6
    assert "per newton (1/N)" in page.text
    assert f"/logs/{fitted['id']}" in [given.get("href") for _, given in page.found]
    assert page.foreign() == []


@ON_SQLITE
@pytest.mark.parametrize("query", ["fn=-1", "fn=x", "v=1e9", "method=none", "cursor=x"])
def test_a_material_is_not_shown_where_nothing_can_be(client: httpx.Client, fitted: Any, query: str) -> None:
    answer = client.get(f"/materials/{fitted['material']}?{query}", headers=HTML)
    assert answer.status_code == 422
    assert "not allowed" in answer.text


@ON_SQLITE
def test_what_a_sensor_is_named_is_text(
    client: httpx.Client, content: bytes, upload: Any, page_of: Callable[[str], Any], material: str
) -> None:
    name = "<img src=x onerror=alert(1)> شبكة 🧤"
    log = upload(client, content, material=material, sensor=name).json()
    for path in (f"/logs/{log['id']}", f"/materials/{material}"):
        page = page_of(path)
        assert page.foreign() == []
        assert name[:40] in page.text


@ON_SQLITE
def test_a_log_whose_slip_history_is_missing_says_so(
    client: httpx.Client,
    repack: Any,
    members: Any,
    upload: Any,
    wait: Any,
    page_of: Callable[[str], Any],
) -> None:
    other = repack({**members, "time": members["time"] + 5.0})  # a history of its own
    before = stored_files(client)
    log = upload(client, other).json()
    wait(client, log["job"]["id"])
    assert "Stick–slip map" in str(page_of(f"/logs/{log['id']}").found)
    hidden = [(path, path.read_bytes()) for path in map(Path, stored_files(client) - before)]
    assert hidden
    for path, _ in hidden:
        path.unlink()
    try:
        page = page_of(f"/logs/{log['id']}")
        assert "is missing" in page.text
        assert client.get(f"/logs/{log['id']}/frames").json()["type"] == "/problems/file-missing"
    finally:
        for path, held in hidden:
            path.write_bytes(held)


@ON_SQLITE
@pytest.mark.parametrize("path", ["/logs/nothing", "/logs/" + "0" * 32, "/materials/nothing"])
def test_what_is_not_there_is_told_by_a_page(client: httpx.Client, path: str) -> None:
    answer = client.get(path, headers=HTML)
    assert answer.status_code == 404
    assert "No such" in answer.text


@ON_SQLITE
def test_a_material_says_which_of_its_logs_have_reconstructed_forces(
    client: httpx.Client, ramp: GraspLog, upload: Any, wait: Any, fitted: Any, page_of: Callable[[str], Any]
) -> None:
    told = replace(ramp, metadata={"force": "reconstructed"})
    client.post("/v1/materials", json={"name": "by displacement"})
    accepted = upload(client, encode(told), material="by displacement").json()
    wait(client, accepted["job"]["id"])
    note = "1 of 1 log has forces reconstructed from displacement, as sure as the description of the sensor's gel"
    text = page_of("/materials/by displacement").text
    assert note in text
    assert text.count("forces reconstructed") - text.count(note) == 1  # in the row of the log
    assert client.get("/v1/materials/by displacement/friction", params={"v": 0.0, "fn": 0.1}).json()["notes"] == [note]
    assert "forces reconstructed" not in page_of(f"/materials/{fitted['material']}").text
    wait_for_empty_spool(client)
