import asyncio
import errno
import html
import json
import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fastapi.exceptions import RequestValidationError
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartParser

from estimators.method_names import METHODS
from service.domain.uploads import upload
from service.formatting import further_warning
from service.http.problem_meanings import MEANINGS
from service.http.problems import PROBLEM_TYPES
from service.http.schemas.planning import NewGraspForce
from service.web import forms
from slipcore import GraspLog
from stiction_client import container
from tests.service.web.conftest import HOSTILE, HTML, OWN

ON_SQLITE = pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
DOCS = Path(__file__).parents[3] / "docs"


@ON_SQLITE
def test_a_form_stores_a_log_and_leads_to_it(client: httpx.Client, content: bytes, wait: Any) -> None:
    data = {"material": "sent by form", "create": "true", "sensor": "tac 1", "format": "", "scale": ""}
    answer = client.post("/upload", data=data, files={"file": ("grasp.npz", content)}, headers=HTML)
    assert answer.status_code == 303, answer.text
    log = client.get(f"/v1{answer.headers['location'].replace('logs', 'grasp-logs')}").json()
    assert (log["material"], log["sensor"]) == ("sent by form", "tac 1")
    assert wait(client, log["job"]["id"])["status"] == "done"
    again = client.post("/upload", data=data, files={"file": ("grasp.npz", content)}, headers=HTML)
    assert again.headers["location"] == answer.headers["location"]


@ON_SQLITE
def test_the_form_shows_a_mapping_that_can_be_used(client: httpx.Client) -> None:
    example = re.search(r'name="mapping".*placeholder="([^"]*)"', client.get("/upload", headers=HTML).text)
    assert example is not None
    rows = [f"{k / 30},{m},{0.01 * k},0,0.1,0,-1" for k in range(3) for m in range(64)]
    table = "time,marker,dx,dy,fx,fy,fz\n" + "\n".join(rows)
    data = {"mapping": html.unescape(example[1])}
    answer = client.post("/upload", data=data, files={"file": ("grasp.csv", table.encode())}, headers=HTML)
    assert answer.status_code == 303, answer.text


@ON_SQLITE
@pytest.mark.parametrize(
    ("data", "file", "told"),
    [
        ({}, b"no log at all", "The format is not supported"),
        ({"format": "application/vnd.stiction.grasp-log+npz"}, b"no log at all", "The grasp log is not valid"),
        ({}, b"", "“File” is missing or empty"),
        ({"material": "nobody knows it"}, b"x", "No such material"),
        ({"material": "<b>", "create": "true"}, b"x", "“Name of the material” is &lt;b&gt;"),
        ({"scale": "-1"}, b"x", "“Scale of tracked markers, m per pixel” is -1"),
        ({"detector": "magic"}, b"x", "“Detector of slip” is magic"),
        ({"matreial": "paper"}, b"x", "matreial"),
        ({}, b"x" * (4 * 2**20), "The body is too large"),
    ],
)
def test_a_refused_upload_is_told_above_its_form(
    client: httpx.Client, data: dict[str, str], file: bytes, told: str
) -> None:
    answer = client.post("/upload", data=data, files={"file": ("grasp", file)}, headers=HTML)
    assert answer.status_code in {404, 413, 415, 422}
    assert told in answer.text
    assert '<form id="upload"' in answer.text
    assert "<details open>" in answer.text  # where a format or a mapping can be given
    kept = {name: text for name, text in data.items() if name in {"scale"}}
    assert all(f'value="{text}"' in answer.text for text in kept.values())


@ON_SQLITE
def test_a_field_that_is_sent_twice_is_refused_by_name(client: httpx.Client, content: bytes) -> None:
    """The last scale had counted, without a word."""
    files = {"file": ("grasp.npz", content)}
    answer = client.post("/upload", data={"scale": ["1e-4", "2e-4"]}, files=files, headers=HTML)
    assert answer.status_code == 400
    assert "the form has the field scale 2 times" in answer.text
    answer = client.post("/materials", data={"name": ["cork", "felt"]}, headers=HTML)
    assert (answer.status_code, "the field name 2 times" in answer.text) == (400, True)


@ON_SQLITE
@pytest.mark.parametrize("charset", ["undefined", "punycode", "utf-7", "unicode_escape", "idna"])
@pytest.mark.parametrize("place", ["field", "field name", "file name"])
@pytest.mark.parametrize("accepted", ["text/html", "application/json"])
def test_a_form_in_an_odd_charset_is_refused(client: httpx.Client, charset: str, place: str, accepted: str) -> None:
    odd = rb"\ud800" if charset == "unicode_escape" else b"+2AA-" if charset == "utf-7" else b"xn--\xff"
    field, name, file = (odd if place == each else b"x" for each in ("field", "field name", "file name"))
    begin = b'--X\r\nContent-Disposition: form-data; name="'
    body = (
        begin + name + b'"\r\n\r\n' + field + b"\r\n" + begin + b'file"; filename="' + file + b'"\r\n\r\nx\r\n--X--\r\n'
    )
    headers = OWN | {"accept": accepted, "content-type": f"multipart/form-data; boundary=X; charset={charset}"}
    answer = client.post("/upload", content=body, headers=headers)
    assert answer.status_code == 400, answer.text
    assert answer.headers["content-type"].startswith(("text/html", "application/problem+json"))
    assert "UTF-8" in answer.text


@ON_SQLITE
@pytest.mark.parametrize(
    ("said", "told"), [("; charset=punycode", "UTF-8"), (';charset="UTF-7"', "UTF-8"), (";" * 2000, "1024 characters")]
)
def test_no_text_is_read_of_a_form_whose_type_is_refused(
    client: httpx.Client, said: str, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The codec of punycode takes a minute for 1 MB."""
    monkeypatch.setattr(forms._FileParser, "parse", None)
    headers = OWN | HTML | {"content-type": f"multipart/form-data; boundary=X{said}"}
    answer = client.post("/upload", content=b"--X--", headers=headers)
    assert (answer.status_code, told in answer.text) == (400, True)


@ON_SQLITE
@pytest.mark.parametrize(
    ("more", "file"), [({}, b"no log at all"), ({"detector": "magic"}, b"x"), ({"sensor": "\x07"}, None)]
)
def test_a_refused_upload_makes_no_material_known(
    client: httpx.Client, content: bytes, more: dict[str, str], file: bytes | None
) -> None:
    data = {"material": "not to be", "create": "true", **more}
    sent = {"file": ("grasp.npz", content if file is None else file)}
    assert client.post("/upload", data=data, files=sent, headers=HTML).status_code in {415, 422}
    assert client.get("/v1/materials/not to be").status_code == 404


@ON_SQLITE
def test_an_upload_over_its_quota_makes_no_material_known(
    reach: Any, make: Callable[..., str], members: dict[str, Any], repack: Callable[..., bytes]
) -> None:
    caller = reach("keys", key=make("upload"), key_logs_a_day=1)
    statuses = []
    for name in ("first", "second"):
        file = repack(members | {"sensor": np.str_(name)})
        form = {"data": {"material": name, "create": "true"}, "files": {"file": ("log.npz", file)}}
        statuses.append((caller.request("POST", "/upload", **form), caller.get(f"/v1/materials/{name}")))
    assert [(sent.status_code, found.status_code) for sent, found in statuses] == [(303, 200), (429, 404)]


@ON_SQLITE
def test_a_material_that_another_made_known_meanwhile_takes_the_log(
    browser: Any, content: bytes, add: Callable[..., int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(upload, "_check", lambda *_: None)  # as it was before the other came
    add("made meanwhile")
    sent = {"data": {"material": "made meanwhile", "create": "true"}, "files": {"file": ("log.npz", content)}}
    answer = browser.request("POST", "/upload", **sent, headers=OWN)
    assert answer.status_code == 303, answer.text
    (log,) = browser.get("/v1/grasp-logs?material=made meanwhile").json()["items"]
    assert answer.headers["location"] == f"/logs/{log['id']}"


@ON_SQLITE
def test_who_may_only_read_uploads_nothing(reach: Any, make: Callable[..., str], content: bytes) -> None:
    caller = reach("keys", key=make("read"))
    caller.headers |= HTML
    answer = caller.request("POST", "/upload", files={"file": ("grasp.npz", content)})
    assert answer.status_code == 403
    assert "may only read" in caller.get("/upload").text


@ON_SQLITE
@pytest.mark.usefixtures("fitted")
def test_the_calculator_says_what_the_api_says(client: httpx.Client) -> None:
    asked = {"material": "fitted", "tangential_load": 1.5, "contact_area": 6e-5, "torque": 0.001, "fingers": 2}
    told = client.post("/v1/grasp-force", json=asked).json()
    page = client.get("/plan", params={**asked, "round_at": ""}, headers=HTML)
    assert page.status_code == 200
    shown = re.search(r"<strong>([\d.]+) N</strong> of each finger", page.text)
    assert shown is not None
    assert told["normal_force"] <= float(shown[1]) <= 1.01 * told["normal_force"]
    assert 'name="torque" inputmode="decimal" value="0.001"' in page.text


@pytest.mark.parametrize(
    ("warning", "further"),
    [
        (None, ""),
        ("3 logs are doubtful: withdraw them", ""),
        ("extrapolated; 3 logs are doubtful: withdraw them; ols says 0.2", "extrapolated; ols says 0.2"),
    ],
)
def test_the_calculator_warns_of_nothing_twice(warning: str | None, further: str) -> None:
    assert further_warning(warning, "3 logs are doubtful: withdraw them") == further


@ON_SQLITE
def test_the_calculator_asks_for_the_recommended_model_unless_told_otherwise(browser: Any) -> None:
    form = browser.get("/plan").text
    assert [method for method in METHODS if f">{method}</option>" not in form] == ["conjugate"]
    assert re.findall("<option selected>(.*?)</option>", form)[-1:] == ["auto"]
    assert "<option selected>robust</option>" in browser.get("/plan?method=robust").text
    unlisted = browser.get("/plan?method=conjugate").text
    assert re.findall("<option[^>]* selected>(.*?)</option>", unlisted)[-1:] == ["conjugate, which is not for planning"]
    assert "<option selected>auto</option>" not in unlisted


@ON_SQLITE
def test_of_several_wrong_values_each_is_told_once(browser: Any, elements: Any) -> None:
    asked = {"tangential_load": "-1", "contact_area": "6e-5", "round_at": "0", "material": "paper"}
    told = elements(browser.get("/plan", params=asked).text).text
    assert told.count("“Load of all fingers together, N” is -1; allowed: a number, 0 to 1e6") == 1
    assert told.count("“Round fingertip: force under which it has that area, N” is 0") == 1


@ON_SQLITE
def test_the_calculator_shows_all_that_it_was_asked(browser: Any, elements: Any) -> None:
    asked = dict.fromkeys(NewGraspForce.model_fields, "1") | {"method": "ols", "of": "element", "sensor": "left"}
    found = elements(browser.get("/plan", params=asked | {"tangential_load": ""}).text).found
    assert {given["name"] for tag, given in found if tag in {"input", "select"}} >= asked.keys()
    shown = {given.get("value") for tag, given in found if tag == "input"}
    assert shown == {"", "1", "left"}
    assert [given for tag, given in found if tag == "details"] == [{"open": None}]
    folded = elements(browser.get("/plan?material=paper&method=auto&torque=1").text).found
    assert [given for tag, given in folded if tag == "details"] == [{}]


@ON_SQLITE
@pytest.mark.usefixtures("fitted")
@pytest.mark.parametrize(("load", "limit", "held"), [(1.5, "", True), (9, "0.1", False)])
def test_the_calculator_draws_the_forces_of_all_probabilities(
    client: httpx.Client, elements: Any, load: float, limit: str, held: bool
) -> None:
    asked = {"material": "fitted", "tangential_load": load, "contact_area": 6e-5, "normal_force_limit": limit}
    page = elements(client.get("/plan", params=asked, headers=HTML).text)
    tags = [tag for tag, given in page.found if tag in {"polyline", "circle"}]
    assert tags == ["polyline"] + ["circle"] * held
    (line,) = [given["points"] for tag, given in page.found if tag == "polyline"]
    assert bool(line) == held
    assert held or "no force holds" in page.text
    assert not [tag for tag, _ in elements(client.get("/plan", headers=HTML).text).found if tag == "svg"]


@ON_SQLITE
@pytest.mark.parametrize(
    ("query", "status", "told"),
    [
        (
            "material=fitted&tangential_load=x&contact_area=6e-5",
            422,
            "“Load of all fingers together, N” is x; allowed:",
        ),
        ("material=fitted&tangential_load=1&contact_area=", 422, "“Contact area of one finger, m²” is missing"),
        ("material=nobody&tangential_load=1&contact_area=6e-5", 404, "No such material"),
        ("material=never+held&tangential_load=1&contact_area=6e-5", 409, "no fitted model yet"),
        ("material=fitted&tangential_load=9&contact_area=6e-5&normal_force_limit=0.1", 409, "No normal force holds"),
    ],
)
def test_a_question_without_an_answer_stays_in_its_form(
    client: httpx.Client, fitted: Any, query: str, status: int, told: str
) -> None:
    assert fitted["material"] == "fitted"
    client.post("/v1/materials", json={"name": "never held"})
    answer = client.get(f"/plan?{query}", headers=HTML)
    assert answer.status_code == status
    assert told in answer.text
    assert 'name="tangential_load" inputmode="decimal" value="' in answer.text
    is_marked = 'aria-invalid="true" aria-describedby="tangential_load-allowed"' in answer.text
    assert is_marked == ("tangential_load=x" in query)


@ON_SQLITE
@pytest.mark.parametrize("typed", HOSTILE)
def test_what_a_form_was_sent_comes_back_as_text(browser: Any, elements: Callable[..., Any], typed: str) -> None:
    for path in ("/plan", "/upload", "/jobs"):
        answer = browser.get(path, params={"material": typed, "tangential_load": typed[:100], "status": typed[:100]})
        assert elements(answer.text).foreign() == []


@ON_SQLITE
def test_jobs_are_listed_with_their_state_and_reason(
    client: httpx.Client, fitted: Any, elements: Any, links_of_list: Any
) -> None:
    assert f"/logs/{fitted['id']}" in links_of_list(client, "/jobs")
    page = elements(client.get("/jobs", headers=HTML).text)
    assert any("data-refresh" in given for _, given in page.found)
    assert f"/logs/{fitted['id']}" not in client.get("/jobs?status=failed", headers=HTML).text


@ON_SQLITE
def test_each_type_of_problem_has_a_page_at_its_address(browser: Any, elements: Callable[..., Any]) -> None:
    everything = elements(browser.get("/problems").text).text
    for kind in PROBLEM_TYPES.values():
        answer = browser.get(kind.uri, headers={"accept": "*/*"})
        page = elements(answer.text).text
        meaning = MEANINGS[kind.name].when.replace("`", "")  # set as code
        assert (answer.status_code, kind.title in page, meaning in page, "`" in page) == (200, True, True, False)
        assert kind.title in everything
    assert "<code>largest_load</code>" in browser.get("/problems/no-feasible-force").text
    assert browser.get("/problems/nothing").status_code == 404


def test_the_pages_of_problems_say_what_the_documentation_says() -> None:
    rows = re.findall(
        r"^\| `/problems/([\w-]+)` \| [^|]+ \| (.*) \| (.*?) ?\|$", (DOCS / "problems.md").read_text(), re.M
    )
    said = {name: tuple(re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text).strip() for text in row) for name, *row in rows}
    assert said == {name: tuple(meaning) for name, meaning in MEANINGS.items()}
    assert {*said} == {*PROBLEM_TYPES}


@ON_SQLITE
def test_a_problem_names_an_address_that_is_there(browser: Any) -> None:
    told = json.loads(browser.get("/v1/materials/nobody").text)
    assert browser.get(told["type"]).status_code == 200


@pytest.mark.parametrize("path", ["/login", "/materials"])
@pytest.mark.parametrize("parts", [1, 40], ids=["one file", "many files"])
def test_a_form_without_a_file_is_not_read_beyond_its_bound(browser: Any, path: str, parts: int) -> None:
    """Whoever sends it: it is parsed before anybody is asked for a key."""
    sent = 2_000_000 // parts
    files = [("file", (f"{part}.bin", b"x" * sent)) for part in range(parts)]
    answer = browser.request("POST", path, files=files, headers=OWN)
    assert answer.status_code == 413


@ON_SQLITE
def test_the_file_of_a_form_is_written_beside_the_blobs_only(
    browser: Any, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Where there is room for it, and nobody else may read."""
    displacement = np.tile(ramp.displacement, (8, 1, 1, 1))
    time = (ramp.time[1] - ramp.time[0]) * np.arange(len(displacement))
    content = container.encode(GraspLog(time, ramp.position, displacement, ramp.element_area))
    assert len(content) > MultiPartParser.spool_max_size
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    answer = browser.request("POST", "/upload", files={"file": ("log.npz", content)}, headers=OWN)
    assert answer.status_code == 303, answer.text


@pytest.mark.parametrize("body", [b"no parts", b"--x\r\nContent-Disposition: form-data\r\n\r\n1\r\n--x--"])
def test_a_broken_form_is_refused(browser: Any, body: bytes) -> None:
    headers = {**OWN, "content-type": "multipart/form-data; boundary=x"}
    assert browser.request("POST", "/upload", content=body, headers=headers).status_code == 400


def test_who_leaves_in_the_middle_of_a_form_is_no_error_of_the_service(
    browser: Any, caplog: pytest.LogCaptureFixture
) -> None:
    begun = b'--x\r\nContent-Disposition: form-data; name="file"; filename="log.npz"\r\n\r\nPK'
    messages = iter([{"type": "http.request", "body": begun, "more_body": True}, {"type": "http.disconnect"}])
    sent: list[Any] = []

    async def receive() -> Any:
        return next(messages)

    async def send(message: Any) -> None:
        sent.append(message)

    headers = browser.headers | OWN | {"content-type": "Multipart/Form-Data; boundary=x"}
    scope = {"type": "http", "method": "POST", "path": "/upload", "query_string": b"", "scheme": "http"}
    scope["headers"] = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    asyncio.run(
        browser.app({**scope, "client": (browser.address, 50000), "server": (browser.server, 80)}, receive, send)
    )
    assert sent[0]["status"] == httpx.codes.BAD_REQUEST
    assert not [record for record in caplog.records if record.exc_info]


def test_a_form_whose_file_cannot_be_written_is_no_error_of_the_service(
    browser: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def write(_: UploadFile, __: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(UploadFile, "write", write)
    files = {"file": ("log.npz", b"x" * 100)}
    answer = browser.request("POST", "/upload", files=files, headers=OWN)
    assert answer.status_code == 503


def test_a_form_tells_both_ends_of_a_range_as_the_api_does() -> None:
    fields = {"material": "paper", "tangential_load": "-1", "contact_area": "large"}
    with pytest.raises(RequestValidationError) as refused:
        forms.checked(NewGraspForce, fields)
    told = {each["loc"]: each["range"] for each in refused.value.errors()}
    assert told == {
        ("form", "tangential_load"): "a number, 0 to 1e6",
        ("form", "contact_area"): "a number, 1e-12 to 1",
    }
