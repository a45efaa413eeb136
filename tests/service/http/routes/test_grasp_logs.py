import hashlib
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from service import formats
from slipcore import LOOKAHEAD, GraspLog, collect_samples, contact_friction, detect_slip
from slipcore.contact.tiers.ramp import tangential_ramp
from stiction_client.container import CONTENT_TYPE, encode
from tests.service.stored import wait_for_empty_spool

Upload = Callable[..., httpx.Response]
Wait = Callable[[httpx.Client, str], dict[str, Any]]


def test_an_uploaded_log_is_described(
    client: httpx.Client, fitted: dict[str, Any], content: bytes, ramp: GraspLog
) -> None:
    assert fitted["sha256"] == hashlib.sha256(content).hexdigest()
    assert (fitted["bytes"], fitted["format"], fitted["material"]) == (len(content), "npz", "fitted")
    assert (fitted["sensor"], fitted["frames"], fitted["grid"]) == (ramp.sensor, len(ramp), [14, 14])
    assert fitted["duration"] == ramp.time[-1] - ramp.time[0]
    assert client.get("/v1/materials/fitted").json()["grasp_logs"] == 1


def test_what_was_found_is_what_the_numerics_find(client: httpx.Client, fitted: dict[str, Any], ramp: GraspLog) -> None:
    history = detect_slip(ramp, lookahead=LOOKAHEAD)
    samples = collect_samples(ramp, history)
    found = fitted["detection"]
    assert (found["method"], found["samples"]) == (history.method, len(samples))
    assert found["noise"] == history.noise
    assert found["stick_ratio_min"] == np.nanmin(history.stick_ratio)
    assert found["contact_frames"] == int(history.contact.any(axis=(1, 2)).sum())
    assert found["findings"] == []
    assert found["velocity_is_relative"] is False
    contact = contact_friction(history.time, history.patches)
    assert contact is not None
    assert found["contact_friction"] == asdict(contact) | {"high": None}
    assert found["events"] == {kind: len(getattr(history.events, kind)) for kind in found["events"]}
    stored = client.get(f"/v1/grasp-logs/{fitted['id']}/samples").json()
    for name, values in stored.items():
        np.testing.assert_array_equal(values, getattr(samples, name))
    events = client.get(f"/v1/grasp-logs/{fitted['id']}/events").json()
    for kind, listed in events.items():
        np.testing.assert_array_equal(listed["element"], getattr(history.events, kind).element)
        np.testing.assert_array_equal(listed["time"], getattr(history.events, kind).time)


def test_a_log_without_the_objects_motion_tells_nothing_of_velocity(
    client: httpx.Client, ramp: GraspLog, upload: Upload, wait: Wait
) -> None:
    client.post("/v1/materials", json={"name": "unposed"}).raise_for_status()
    accepted = upload(client, encode(replace(ramp, object_pose=None)), material="unposed")
    assert wait(client, accepted.json()["job"]["id"])["status"] == "done"
    stored = client.get(accepted.headers["location"]).json()
    assert stored["detection"]["velocity_is_relative"] is True
    samples = client.get(f"/v1/grasp-logs/{stored['id']}/samples").json()
    assert set(samples["velocity_is_relative"]) == {True}
    models = client.get("/v1/materials/unposed").json()["models"]
    assert not any(model["identifiable"][1] for model in models.values())
    asked = {v: client.get(f"/v1/materials/unposed/friction?v={v}&fn=0.05").json() for v in ("0", "0.001")}
    assert asked["0.001"]["support"] == "not identified"
    assert "the object's motion is unknown" in asked["0.001"]["advice"]
    assert "motion" not in asked["0"]["advice"]
    page = client.get("/materials/unposed", headers={"accept": "text/html"}).text
    assert "Velocities: the object&#39;s motion is unknown" in page
    assert "relative to what seems to stick" in client.get(f"/logs/{stored['id']}").text
    answer = client.post("/v1/recognise", json={"samples": samples, "materials": ["unposed"]})
    assert answer.json()["candidates"][0]["probability"] > 0.5


def test_what_makes_a_log_doubtful_is_kept_with_it(
    client: httpx.Client, ramp: GraspLog, upload: Upload, wait: Wait
) -> None:
    doubtful = encode(replace(ramp, time=1e3 * ramp.time))
    accepted = upload(client, doubtful)
    wait(client, accepted.json()["job"]["id"])
    (finding,) = client.get(accepted.headers["location"]).json()["detection"]["findings"]
    assert (finding["name"], finding["severity"]) == ("slow frames", "note")
    assert "ms" in finding["remedy"]
    assert "s apart" in finding["evidence"]


def test_the_stick_ratio_is_null_without_contact(client: httpx.Client, fitted: dict[str, Any], ramp: GraspLog) -> None:
    answer = client.get(f"/v1/grasp-logs/{fitted['id']}/stick-ratio").json()
    ratio = detect_slip(ramp, lookahead=LOOKAHEAD).stick_ratio
    assert answer["time"] == ramp.time.tolist()
    assert answer["stick_ratio"] == [None if np.isnan(value) else value for value in ratio]
    assert answer["stick_ratio"][0] is None


def test_without_material_slip_is_only_detected(
    client: httpx.Client, content: bytes, upload: Upload, wait: Wait
) -> None:
    accepted = upload(client, content, sensor="left finger")
    job = wait(client, accepted.json()["job"]["id"])
    log = client.get(accepted.headers["location"]).json()
    assert (job["status"], job["material"], job["model_version"]) == ("done", None, None)
    assert list(job["seconds"]) == ["frames", "slip_state", "samples"]
    assert (log["material"], log["sensor"]) == (None, "left finger")
    assert log["detection"]["samples"] > 0


def test_the_detector_is_the_uploaders_choice(
    client: httpx.Client, content: bytes, material: str, upload: Upload, wait: Wait
) -> None:
    first = upload(client, content, material=material)
    other = upload(client, content, material=material, detector="strain_rate_literal")
    assert (first.status_code, other.status_code) == (202, 202)
    wait(client, other.json()["job"]["id"])
    assert client.get(other.headers["location"]).json()["detection"]["method"] == "strain_rate_literal"


def test_without_the_uploaders_choice_few_elements_are_looked_at_by_the_detector_for_few(
    client: httpx.Client, upload: Upload, wait: Wait
) -> None:
    content = encode(tangential_ramp(points=4, pitch=3.8e-3, normal_force=6.0, marker_noise=1e-6, seed=1))
    for choice, method in (({}, "coarse"), ({"detector": "coarse"}, "coarse"), ({"detector": "filter"}, "filter")):
        accepted = upload(client, content, **choice)
        assert accepted.status_code == (200 if choice == {"detector": "coarse"} else 202)
        wait(client, accepted.json()["job"]["id"])
        assert client.get(accepted.headers["location"]).json()["detection"]["method"] == method


def test_the_same_upload_twice_is_one_log(
    client: httpx.Client, content: bytes, material: str, upload: Upload, wait: Wait
) -> None:
    first = upload(client, content, material=material)
    wait(client, first.json()["job"]["id"])
    second = upload(client, content, material=material)
    assert (first.status_code, second.status_code) == (202, 200)
    assert second.headers["location"] == first.headers["location"]
    assert second.json()["job"]["status"] == "done"
    assert client.get(f"/v1/materials/{material}").json()["grasp_logs"] == 1
    fits = client.get(f"/v1/materials/{material}/fits").json()["items"]
    assert [(fit["method"], fit["version"]) for fit in fits] == [("ols", 1), ("hierarchical", 1)]


@pytest.mark.parametrize("path", ["", "/stick-ratio", "/events", "/samples"])
def test_an_unknown_log_is_named(client: httpx.Client, path: str) -> None:
    response = client.get(f"/v1/grasp-logs/nothing{path}")
    assert response.status_code == httpx.codes.NOT_FOUND
    assert response.json()["type"] == "/problems/unknown-grasp-log"


def test_results_that_are_not_there_yet_are_not_ready(reach: Callable[..., Any], content: bytes) -> None:
    """Where no worker takes jobs."""
    lab = reach("open")
    sent = lab.request("POST", "/v1/grasp-logs", content=content, headers={"content-type": CONTENT_TYPE})
    place = sent.raise_for_status().headers["location"]
    for part in ("stick-ratio", "events", "samples"):
        answer = lab.request("GET", f"{place}/{part}")
        assert answer.status_code == httpx.codes.CONFLICT
        assert answer.json()["type"] == "/problems/not-ready"
    assert lab.request("GET", place).json()["detection"] is None


@pytest.mark.parametrize("name", ["npz", "parquet", "mcap"])
def test_a_log_is_downloaded_in_each_format_bit_for_bit(
    client: httpx.Client, fitted: dict[str, Any], content: bytes, tmp_path: Path, name: str
) -> None:
    answer = client.get(f"/v1/grasp-logs/{fitted['id']}/file", params={"format": name})
    assert answer.headers["content-type"] == formats.FORMATS[name].content_type
    assert answer.headers["content-disposition"] == f'attachment; filename="{fitted["id"]}.{name}"'
    (tmp_path / "log").write_bytes(answer.content)
    assert formats.identify(tmp_path / "log") == name
    assert encode(formats.read(tmp_path / "log")) == content
    wait_for_empty_spool(client)


@pytest.mark.parametrize("name", ["npz", "parquet", "mcap"])
def test_a_download_that_broke_off_is_gone_on_with(client: httpx.Client, fitted: dict[str, Any], name: str) -> None:
    """Files that are made had the time of that in their tag, so that they came whole each time."""
    path = f"/v1/grasp-logs/{fitted['id']}/file?format={name}"
    whole = client.get(path)
    tag = whole.headers["etag"]
    assert tag == f'"{hashlib.sha256(whole.content).hexdigest()}"'
    part = client.get(path, headers={"Range": "bytes=100-", "If-Range": tag})
    assert (part.status_code, part.content) == (206, whole.content[100:])
    assert client.get(path, headers={"If-None-Match": tag}).status_code == httpx.codes.NOT_MODIFIED
    wait_for_empty_spool(client)


def test_a_log_with_the_grippers_force_is_returned_as_it_was_sent(
    client: httpx.Client, ramp: GraspLog, upload: Upload, wait: Wait
) -> None:
    log = replace(ramp, gripper_force=np.linspace(0.0, 9.0, len(ramp)), gripper_force_deviation=0.3, sensor="gripped")
    answer = upload(client, encode(log))
    assert client.get(f"{answer.headers['location']}/file").content == encode(log)
    wait(client, answer.json()["job"]["id"])
    wait_for_empty_spool(client)


def test_a_format_that_is_not_written_is_refused(client: httpx.Client, fitted: dict[str, Any]) -> None:
    answer = client.get(f"/v1/grasp-logs/{fitted['id']}/file", params={"format": "csv"})
    assert (answer.status_code, answer.json()["allowed"]) == (422, "npz, parquet, mcap")
    assert client.get("/v1/grasp-logs/nothing/file").json()["type"] == "/problems/unknown-grasp-log"
