from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any
from urllib.parse import quote

import httpx
import numpy as np
import pytest
from sqlalchemy import update

from benchmarks.calibration.presses import Faults, pressed
from db.blobs import BlobStore
from db.database import Database
from db.records import Gel, NewCalibration
from db.repositories import calibrations, detections, grasp_logs, jobs, materials, runners, sensors
from db.tables import DetectionRow, JobRow
from service.domain.access import keys
from service.domain.sensors.calibrate import OFFSET, Correction, corrected, correction_findings
from service.domain.sensors.names import NAMELESS
from service.domain.sensors.reconstruct import RECONSTRUCTED
from service.jobs import pipeline
from service.stream import messages
from slipcore import GraspLog, calibrate_sensor, frames
from slipcore.defaults import METHOD_NAMES
from stiction_client import FrictionClient, calls
from stiction_client.container import encode

NPZ = "application/vnd.stiction.grasp-log+npz"
GEL = {
    "young_modulus": 2.5e5,
    "poisson_ratio": 0.48,
    "thickness": 4e-3,
    "marker_depth": 5e-4,
    "relative_thickness": None,
}


@pytest.mark.parametrize("name", ["Gel Sight", "a/b", "hand/left/", "?#%2F"])
def test_a_sensor_is_described_before_or_after_its_first_log(client: httpx.Client, name: str) -> None:
    path = f"/v1/sensors/{quote(name, safe='')}"
    unknown = client.get(path)
    assert (unknown.status_code, unknown.json()["type"]) == (404, "/problems/unknown-sensor")
    thick = client.put(path, json={"young_modulus": 1e6, "poisson_ratio": 0.49})
    assert thick.json()["gel"] == {
        "young_modulus": 1e6,
        "poisson_ratio": 0.49,
        "thickness": None,
        "marker_depth": 0.0,
        "relative_thickness": None,
    }
    assert client.put(path, json=GEL).json() == {"name": name, "gel": GEL, "calibration": None}
    assert client.get(path).json()["gel"] == GEL
    assert {"name": name, "gel": GEL, "calibration": None} in client.get("/v1/sensors").json()["items"]
    told = client.get("/v1/audit", params={"subject": name}).json()["items"]
    assert [entry["action"] for entry in told] == ["sensor.described"] * 2
    assert told[0]["details"] == GEL


def test_a_gel_that_is_not_alike_thick_has_a_map(client: httpx.Client) -> None:
    """It is what the sensor's logs are looked at by, so one with another map is another description."""
    uneven = GEL | {"relative_thickness": [[1.0, 0.9, 0.8], [1, 0.95, 0.9]]}
    described = client.put("/v1/sensors/dome", json=uneven)
    assert described.json()["gel"] == uneven
    assert client.put("/v1/sensors/dome", json=uneven).json() == described.json()
    changes = client.get("/v1/audit", params={"subject": "dome"}).json()["items"]
    assert [entry["details"] for entry in changes] == [uneven]
    assert client.put("/v1/sensors/dome", json=GEL).json()["gel"] == GEL


def test_a_list_of_sensors_comes_in_parts(client: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {f"part {k}" for k in range(5)}
    for name in names:
        client.put(f"/v1/sensors/{name}", json=GEL).raise_for_status()
    whole = client.get("/v1/sensors").json()
    assert whole["next"] is None
    first = client.get("/v1/sensors", params={"limit": 2})
    assert first.json()["items"] == whole["items"][:2]
    assert client.get(first.links["next"]["url"]).json()["items"] == whole["items"][2:4]
    assert client.get("/v1/sensors", params={"limit": 0}).status_code == 422
    monkeypatch.setattr(calls, "PAGE", 2)
    with FrictionClient(str(client.base_url)) as caller:
        found = caller.sensors()
    assert found == whole["items"]
    assert names <= {each["name"] for each in found}


@pytest.mark.parametrize(
    "change",
    [
        {"young_modulus": 0.25},
        {"poisson_ratio": 0.51},
        {"thickness": 0.0},
        {"marker_depth": 4e-3},
        {"marker_depth": -1e-3},
        {"hardness": 20.0},
        {"young_modulus": None},
        {"relative_thickness": [[1.0, 0.9]]},
        {"relative_thickness": [[1.0, 0.9], [1.0]]},
        {"relative_thickness": [[1.0, 0.9], [1.0, 0.2]]},
        {"relative_thickness": [[1.0, 1.0], [1.0, 0.9]], "thickness": None},
        {"relative_thickness": [[1.0, 1.0], [1.0, 0.9]], "marker_depth": 3.8e-3},
    ],
)
def test_an_impossible_gel_is_refused(client: httpx.Client, change: dict[str, Any]) -> None:
    refused = client.put("/v1/sensors/other", json=GEL | change)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/invalid-request")


@pytest.mark.parametrize("name", [*NAMELESS, "x/calibrations", "x/calibrations/3"])
def test_a_name_that_is_not_one_sensors_is_not_described(client: httpx.Client, name: str) -> None:
    """All logs that name none would be reconstructed, or corrected, by one sensor's gel or faults."""
    refused = client.put(f"/v1/sensors/{name}", json=GEL)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/invalid-request")
    assert refused.json()["detail"].startswith(f"sensor is {name!r}; allowed: a name ")


def test_logs_that_name_no_sensor_calibrate_none(client: httpx.Client, ball: GraspLog, upload: Any) -> None:
    log = upload(client, encode(FAULTS.put_into(ball, 14)), sensor=frames.UNNAMED).raise_for_status().json()["id"]
    refused = client.post(f"/v1/sensors/{frames.UNNAMED}/calibrations", json={"presses": [{"grasp_log": log}]})
    assert refused.json()["detail"].startswith("sensor is 'unknown'; allowed: a name of one sensor")
    assert messages.UNNAMED in NAMELESS


def test_each_press_counts_once_and_withdrawn_ones_do_not(client: httpx.Client, ball: GraspLog, upload: Any) -> None:
    """The intervals of one press that was named 32 times were narrower by a factor of five."""
    content = encode(FAULTS.put_into(ball, 15))
    first, same = (upload(client, content, sensor="one", detector=each).json()["id"] for each in METHOD_NAMES[:2])
    path = "/v1/sensors/one/calibrations"
    for logs in ((first, first), (first, same)):
        refused = client.post(path, json={"presses": [{"grasp_log": log} for log in logs]})
        assert f"{logs[1]}, with the content of {first}; allowed: each press once" in refused.json()["detail"]
    client.put(f"/v1/grasp-logs/{same}/withdrawal", json={"reason": "wet"}).raise_for_status()
    refused = client.post(path, json={"presses": [{"grasp_log": same}]})
    assert f"{same}, withdrawn; allowed: a log that is not withdrawn" in refused.json()["detail"]


def test_one_key_describes_a_sensor_for_all_and_only_an_admin_does_so_again(
    reach: Callable[..., Any], make: Callable[..., str]
) -> None:
    first, other, admin = (reach(key=make(scope)) for scope in ("upload", "upload", "admin"))
    path = "/v1/sensors/shared"
    assert first.request("PUT", path, json=GEL).status_code == httpx.codes.OK
    assert other.request("PUT", path, json=GEL).status_code == httpx.codes.OK  # as it is already
    for caller in (first, other):
        refused = caller.request("PUT", path, json=GEL | {"poisson_ratio": 0.0})
        assert (refused.status_code, refused.json()["type"]) == (403, "/problems/insufficient-scope")
    assert admin.request("GET", path).json()["gel"] == GEL
    softer = GEL | {"young_modulus": 2e5}
    assert admin.request("PUT", path, json=softer).json()["gel"] == softer


def test_a_log_that_is_sent_again_once_its_sensor_is_described_anew_is_looked_at_again(
    client: httpx.Client, material: str, ramp: GraspLog, upload: Any, wait: Any
) -> None:
    few = ramp.displacement[60::15, 2:6, 2:6]  # 2 frames, 16 markers: forces of more take seconds
    content = encode(GraspLog(ramp.time[60::15], ramp.position[2:6, 2:6], few, ramp.element_area))

    def sent(gel: dict[str, float] | None) -> tuple[bool, list[str]]:
        """Whether there is something to do, and what is found then."""
        if gel is not None:
            client.put(f"/v1/sensors/{material}", json=gel).raise_for_status()
        log = upload(client, content, material=material, sensor=material).raise_for_status().json()
        wait(client, log["job"]["id"])
        found = client.get(f"/v1/grasp-logs/{log['id']}").json()["detection"]["findings"]
        return log["job"]["status"] == "queued", [each["name"] for each in found]

    assert sent(None)[0]
    assert sent(None)[0] is False
    is_new, found = sent(GEL)
    assert is_new
    assert "reconstructed forces" in found
    assert sent(GEL) == (False, found)  # described as it was
    assert sent(GEL | {"young_modulus": 1e6})[0]


def test_models_of_a_log_that_is_looked_at_again_are_outdated_meanwhile(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    lab = reach("open")
    lab.request("POST", "/v1/materials", json={"name": "paper"})

    def upload() -> Any:
        query, headers = {"material": "paper", "sensor": "gel"}, {"content-type": NPZ}
        answer = lab.request("POST", "/v1/grasp-logs", params=query, content=content, headers=headers)
        return answer.raise_for_status().json()

    log = upload()["id"]
    with database.write() as session:
        claim = jobs.claim(session, runners.add(session, "host:1"))
    assert claim is not None
    pipeline.run_job(database, blobs, claim)
    by_gel = {"name": RECONSTRUCTED, "evidence": "", "remedy": ""}
    with database.write() as session:  # as if it had come without forces
        session.execute(update(DetectionRow).where(DetectionRow.grasp_log_id == log).values(findings=[by_gel]))
    assert upload()["job"]["status"] == "done"
    lab.request("PUT", "/v1/sensors/gel", json=GEL).raise_for_status()
    again = upload()
    assert (again["id"], again["job"]["status"], again["detection"]) == (log, "queued", None)
    with database.read() as session:
        models = materials.get(session, "paper").models
    assert [stored.outdated for stored in models] == [True, True]
    answer = lab.request("GET", "/v1/materials/paper/friction", params={"fn": 0.05}).raise_for_status().json()
    assert "the model is outdated" in answer["warning"]


def lab_that_sends(reach: Callable[..., Any], content: bytes, key: str = "") -> Callable[..., httpx.Response]:
    lab = reach("open", key=key)

    def send(**query: str) -> httpx.Response:
        answer: httpx.Response = lab.request(
            "POST", "/v1/grasp-logs", params=query, content=content, headers={"content-type": NPZ}
        )
        return answer

    return send


def run_next(database: Database, blobs: BlobStore) -> None:
    with database.write() as session:
        claim = jobs.claim(session, runners.add(session, "host:1"))
    assert claim is not None
    pipeline.run_job(database, blobs, claim)


def test_another_sensor_of_a_stored_log_is_taken_over_and_the_log_looked_at_again(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes
) -> None:
    reach("open").request("POST", "/v1/materials", json={"name": "paper"})
    send = lab_that_sends(reach, content)
    log = send(material="paper", sensor="left").json()
    run_next(database, blobs)
    assert send(material="paper").json()["sensor"] == "left"
    again = send(material="paper", sensor="right")
    told = again.json()
    assert (again.status_code, told["id"], told["sensor"]) == (200, log["id"], "right")
    assert (told["job"]["status"], told["detection"]) == ("queued", None)
    with database.read() as session:
        assert [stored.outdated for stored in materials.get(session, "paper").models] == [True, True]
    run_next(database, blobs)
    assert send(material="paper", sensor="right").json()["job"]["status"] == "done"
    entries = reach("open").get("/v1/audit?action=grasp_log.uploaded").json()["items"]
    changes = [entry["details"] for entry in entries if "sensor" in entry["details"]]
    assert [(each["sensor_before"], each["sensor"]) for each in changes] == [("left", "right")]


@pytest.mark.parametrize("status", ["failed", "cancelled", "queued"])
def test_what_was_found_by_the_sensor_before_is_looked_for_anew_however_the_job_ended(
    reach: Callable[..., Any],
    database: Database,
    blobs: BlobStore,
    content: bytes,
    status: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The job stops in its fit, when samples are stored."""
    reach("open").request("POST", "/v1/materials", json={"name": "paper"})
    send = lab_that_sends(reach, content)
    log = send(material="paper", sensor="left").json()["id"]
    with monkeypatch.context() as stopped, suppress(InterruptedError):
        stopped.setattr(pipeline, "fit_material", stop)
        run_next(database, blobs)
    ended = {} if status == "queued" else {"reason": "x", "finished_at": datetime.now(UTC)}
    with database.write() as session:
        session.execute(update(JobRow).values(status=status, runner_id=None, **ended))
    assert reach("open").get(f"/v1/grasp-logs/{log}").json()["detection"] is not None
    again = send(material="paper", sensor="right").json()
    assert (again["sensor"], again["job"]["status"], again["detection"]) == ("right", "queued", None)
    run_next(database, blobs)
    assert send(material="paper", sensor="right").json()["job"]["status"] == "done"


def stop(*_: object) -> None:
    raise InterruptedError


def test_a_sensor_is_not_changed_while_its_job_runs(
    reach: Callable[..., Any], database: Database, content: bytes
) -> None:
    send = lab_that_sends(reach, content)
    send(sensor="left").raise_for_status()
    assert send(sensor="middle").json()["sensor"] == "middle"
    with database.write() as session:
        jobs.claim(session, runners.add(session, "host:1"))
    refused = send(sensor="right")
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/not-ready")
    assert send().json()["sensor"] == "middle"


def test_another_keys_log_keeps_its_sensor(reach: Callable[..., Any], make: Callable[..., str], content: bytes) -> None:
    first, other, admin = (lab_that_sends(reach, content, make(scope)) for scope in ("upload", "upload", "admin"))
    first(sensor="left").raise_for_status()
    refused = other(sensor="right")
    assert (refused.status_code, refused.json()["type"]) == (403, "/problems/insufficient-scope")
    assert other().json()["sensor"] == "left"
    assert first(sensor="middle").json()["sensor"] == "middle"
    assert admin(sensor="right").json()["sensor"] == "right"


def test_a_log_is_looked_at_again_whatever_the_trail_holds_and_the_clocks_say(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, ramp: GraspLog
) -> None:
    few = ramp.displacement[60::15, 2:6, 2:6]
    send = lab_that_sends(reach, encode(GraspLog(ramp.time[60::15], ramp.position[2:6, 2:6], few, ramp.element_area)))
    reach("open").request("POST", "/v1/materials", json={"name": "paper"})
    asked = {"material": "paper", "sensor": "gel"}
    send(**asked).raise_for_status()
    run_next(database, blobs)
    assert send(**asked).json()["job"]["status"] == "refused"
    with database.write() as session:
        sensors.describe(session, "gel", Gel(**GEL))  # of which no entry tells
        ahead = datetime.now(UTC) + timedelta(hours=1)
        session.execute(update(JobRow).values(finished_at=ahead))
    assert send(**asked).json()["job"]["status"] == "queued"
    run_next(database, blobs)
    assert send(**asked).json()["job"]["status"] != "queued"


@pytest.mark.parametrize("missing", ["findings", "signature"])
def test_a_log_of_before_the_checks_is_looked_at_once_it_is_sent_again(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, content: bytes, missing: str
) -> None:
    """It had counted as sound for ever."""
    send = lab_that_sends(reach, content)
    reach("open").request("POST", "/v1/materials", json={"name": "paper"})
    log_id = send(material="paper").json()["id"]
    run_next(database, blobs)
    with database.write() as session:
        session.execute(update(DetectionRow).values({missing: None}))
    assert send(material="paper").json()["job"]["status"] == "queued"
    run_next(database, blobs)
    with database.read() as session:
        found = grasp_logs.get(session, log_id).detection
        assert detections.has_signature(session, log_id)
    assert found is not None
    assert found.findings is not None
    assert send(material="paper").json()["job"]["status"] == "done"


def test_a_log_that_nothing_touches_is_looked_at_once(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, ramp: GraspLog
) -> None:
    """Nothing is kept by which its grasp is known again, as of logs that a version before did not look at for that."""
    assert ramp.force is not None
    still = replace(ramp, displacement=0.0 * ramp.displacement, force=0.0 * ramp.force, object_pose=None, truth=None)
    send = lab_that_sends(reach, encode(still))
    send().raise_for_status()
    run_next(database, blobs)
    assert send().json()["job"]["status"] == "done"


def test_who_names_no_sensor_is_told_to_name_one(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, ramp: GraspLog
) -> None:
    blind = replace(ramp, force=None, normal=None, object_pose=None, truth=None, sensor=frames.UNNAMED)
    send = lab_that_sends(reach, encode(blind))
    reach("open").request("POST", "/v1/materials", json={"name": "paper"})
    send(material="paper").raise_for_status()
    run_next(database, blobs)
    reason = send(material="paper").json()["job"]["reason"]
    assert "send the log again with the sensor's name (`sensor=`)" in reason
    named = send(material="paper", sensor="gel").json()
    assert (named["sensor"], named["job"]["status"]) == ("gel", "queued")
    run_next(database, blobs)
    assert "describe the gel of sensor 'gel'" in send(material="paper").json()["job"]["reason"]


def test_a_new_name_has_no_spaces_at_its_ends(reach: Callable[..., Any], database: Database, ramp: GraspLog) -> None:
    lab, send = reach("open"), lab_that_sends(reach, encode(replace(ramp, sensor=" left  ")))
    for name in ("left ", " left"):
        refused = [send(sensor=name), lab.request("PUT", f"/v1/sensors/{quote(name)}", json=GEL)]
        assert {answer.status_code for answer in refused} == {422}
        assert refused[0].json()["allowed"] == refused[1].json()["allowed"] == "a name without spaces at its ends"
    assert send().json()["sensor"] == "left"
    with database.write() as session:
        sensors.find_or_add(session, "old ")  # by an earlier version
    assert lab.request("PUT", "/v1/sensors/old%20", json=GEL).json()["gel"] == GEL
    assert send(sensor="old ").json()["sensor"] == "old "


FAULTS = Faults(crosstalk=(0.08, 0.0), gain=1.1, marker_noise=1e-6, force_noise=2e-3)


def small(log: GraspLog) -> GraspLog:
    """Every other frame of the middle, so that a log is no large upload."""
    middle = np.s_[::2, 4:16, 4:16]
    fields = {name: getattr(log, name)[middle] for name in ("displacement", "force", "normal")}
    return replace(log, time=log.time[::2], position=log.position[middle[1:]], **fields)


@pytest.fixture(scope="module")
def ball() -> GraspLog:
    """A press of 2 N without fault."""
    return small(pressed())


def test_logs_are_corrected_by_the_calibration_that_was_there_when_they_came(
    client: httpx.Client, material: str, ball: GraspLog, upload: Any, wait: Any
) -> None:
    sensor = f"ball/{material}"

    def sent(seed: int) -> Any:
        log = upload(client, encode(FAULTS.put_into(ball, seed)), sensor=sensor).raise_for_status().json()
        wait(client, log["job"]["id"])
        return client.get(f"/v1/grasp-logs/{log['id']}").json()

    path = f"/v1/sensors/{quote(sensor, safe='')}/calibrations"
    before = sent(1)
    assert (before["detection"]["calibration"], before["detection"]["corrections"]) == (None, None)
    presses = [{"grasp_log": before["id"], "known_force": 2.0}]
    made = client.post(path, json={"presses": presses})
    assert made.status_code == httpx.codes.CREATED
    told = {each["name"]: each for each in made.json()["estimates"]}
    assert told["crosstalk_x"]["low"] < 0.08 < told["crosstalk_x"]["high"]
    assert told["gain"]["low"] < 1.0 / 1.1 < told["gain"]["high"]
    assert told["force_drift_x"]["not_identified"] is None
    assert made.json()["presses"] == presses
    log = sent(2)
    after = log["detection"]
    assert (
        "Corrected by the sensor's calibration</dt><dd>version 1: zero of each" in client.get(f"/logs/{log['id']}").text
    )
    assert after["calibration"] == 1
    assert any(text.startswith("crosstalk of 0.0") for text in after["corrections"])
    again = client.post(path, json={"presses": presses}).json()
    assert again["version"] == 2
    assert [each["version"] for each in client.get(path).json()["items"]] == [2, 1]
    assert client.get(f"{path}/1").json() == made.json()
    assert client.get(f"{path}/3").json()["type"] == "/problems/unknown-calibration"
    assert client.get(f"/v1/sensors/{quote(sensor, safe='')}").json()["calibration"] == 2
    entries = client.get("/v1/audit", params={"subject": sensor}).json()["items"]
    assert [entry["details"]["version"] for entry in entries if entry["action"] == "sensor.calibrated"] == [2, 1]
    assert sent(2)["detection"]["calibration"] == 2  # it is looked at again by the newest


def test_logs_that_are_no_pure_presses_are_refused_with_what_was_seen(
    client: httpx.Client, ball: GraspLog, upload: Any
) -> None:
    def sent(log: GraspLog, sensor: str) -> str:
        return str(upload(client, encode(log), sensor=sensor).raise_for_status().json()["id"])

    pure, sheared = (
        sent(FAULTS.put_into(ball, 11), "pushed"),
        sent(FAULTS.put_into(small(pressed(sideways=0.9)), 12), "pushed"),
    )
    elsewhere = sent(FAULTS.put_into(ball, 13), "another")
    path = "/v1/sensors/pushed/calibrations"

    def refusal(*logs: str) -> Any:
        answer = client.post(path, json={"presses": [{"grasp_log": log} for log in logs]})
        return answer.status_code, answer.json()["type"], answer.json()["detail"]

    status, kind, detail = refusal(pure, sheared)
    assert (status, kind) == (422, "/problems/invalid-request")
    assert f"{sheared}: the load sideways changes by" in detail
    assert pure not in detail
    assert f"{elsewhere}, of sensor another" in refusal(elsewhere)[2]
    assert refusal("0" * 32)[1] == "/problems/unknown-grasp-log"
    assert client.post(path, json={"presses": []}).status_code == httpx.codes.UNPROCESSABLE_ENTITY
    unheard = client.post("/v1/sensors/unheard of/calibrations", json={"presses": [{"grasp_log": pure}]})
    assert unheard.json()["type"] == client.get("/v1/sensors/unheard of/calibrations").json()["type"]
    assert client.get(path).json() == {"items": [], "next": None}


def test_a_sensor_is_calibrated_again_by_admins_only(
    database: Database, reach: Callable[..., Any], make: Callable[..., str]
) -> None:
    with database.write() as session:
        sensors.find_or_add(session, "shared")
    first, admin = (reach(key=make(scope)) for scope in ("upload", "admin"))
    path, body = "/v1/sensors/shared/calibrations", {"presses": [{"grasp_log": "0" * 32}]}
    allowed = (404, "/problems/unknown-grasp-log")

    def answered(caller: Any) -> tuple[int, str]:
        answer = caller.request("POST", path, json=body)
        return answer.status_code, answer.json()["type"]

    assert answered(first) == allowed
    with database.write() as session:
        calibrations.add(session, "shared", NewCalibration((), {}, None, None))
    assert answered(first) == (403, "/problems/insufficient-scope")
    assert answered(admin) == allowed
    assert answered(reach(key=make("read"))) == (403, "/problems/insufficient-scope")


def test_a_sensor_of_others_logs_is_calibrated_by_admins_only(
    reach: Callable[..., Any], make: Callable[..., str], ball: GraspLog
) -> None:
    """One key's presses had bent everybody's later logs of that sensor."""
    first, second = (reach(key=make("upload")) for _ in range(2))
    path, body = "/v1/sensors/both/calibrations", {"presses": [{"grasp_log": "0" * 32}]}

    def answered(caller: Any) -> int:
        return int(caller.request("POST", path, json=body).status_code)

    for caller, seed in ((first, 1), (second, 2)):
        content = encode(FAULTS.put_into(ball, seed))
        sent = caller.request("POST", "/v1/grasp-logs?sensor=both", content=content, headers={"content-type": NPZ})
        assert sent.status_code == httpx.codes.ACCEPTED
        assert [answered(each) for each in (first, second)] == ([404, 403] if caller is first else [403, 403])
    assert answered(reach(key=make("admin"))) == 404


def test_what_another_key_calibrated_is_told_of_a_log_and_its_material(
    database: Database, make: Callable[..., str], ball: GraspLog
) -> None:
    model = calibrate_sensor([FAULTS.put_into(ball, 1)])
    own, other = (keys.key_id(make("upload")) for _ in range(2))
    with database.write() as session:
        sensors.find_or_add(session, "theirs")
        stored = NewCalibration((), replace(model, offset=None).to_json(), None, other)
        calibrations.add(session, "theirs", stored)
        correction = corrected(session, ball, "theirs", 1, "filter")
    assert correction_findings(correction, other) == []
    (found,) = correction_findings(correction, own)
    assert f"stored by key {other}" in found.evidence
    assert correction_findings(correction._replace(by=None), own) == []
    assert correction_findings(correction._replace(changed=()), own) == []


def test_another_keys_log_keeps_its_calibration(
    reach: Callable[..., Any], make: Callable[..., str], database: Database, blobs: BlobStore, ball: GraspLog
) -> None:
    """Whoever sent it again had had it corrected anew. Its own key has, and the trail says by which."""
    content = encode(FAULTS.put_into(ball, 2))
    first, other = (lab_that_sends(reach, content, make("upload")) for _ in range(2))
    first(sensor="kept").raise_for_status()
    run_next(database, blobs)
    model = calibrate_sensor([FAULTS.put_into(ball, 1)])
    with database.write() as session:
        calibrations.add(session, "kept", NewCalibration((), replace(model, offset=None).to_json(), None, None))
    assert other().json()["job"]["status"] == "done"
    assert first().json()["job"]["status"] == "queued"
    entries = reach("open").get("/v1/audit?action=grasp_log.uploaded").json()["items"]
    told = [(entry["details"].get("calibration_before", "new"), entry["details"]["calibration"]) for entry in entries]
    assert told == [(None, 1), ("new", None)]


def test_a_log_of_another_lattice_stays_as_it_is_and_says_so(database: Database, ball: GraspLog) -> None:
    model = calibrate_sensor([FAULTS.put_into(ball, 1)])
    assert model.offset is not None
    new = NewCalibration((), replace(model, offset=None).to_json(), model.offset.astype(OFFSET).tobytes(), None)
    with database.write() as session:
        sensors.find_or_add(session, "cut")
        calibrations.add(session, "cut", new)
        whole = corrected(session, ball, "cut", 1, "filter")
        assert np.array_equal(np.asarray(whole.log.force), np.asarray(model.apply(ball).log.force))
        fields = {name: getattr(ball, name)[:, :10] for name in ("displacement", "force", "normal")}
        part = replace(ball, position=ball.position[:10], **fields)
        left = corrected(session, part, "cut", 1, "filter")
        assert (left.log, left.version) == (part, 1)
        assert left.changed == ("nothing: calibrated on 12 × 12 elements, and the log has 10 × 12",)
        assert corrected(session, part, "cut", None, "filter") == Correction(part, None, None, {})


def test_a_log_that_is_looked_at_again_is_corrected_as_it_was(
    reach: Callable[..., Any], database: Database, blobs: BlobStore, ball: GraspLog
) -> None:
    def calibrate(seed: int) -> None:
        model = calibrate_sensor([FAULTS.put_into(ball, seed)])
        with database.write() as session:
            sensors.find_or_add(session, "kept")
            calibrations.add(session, "kept", NewCalibration((), replace(model, offset=None).to_json(), None, None))

    def detected() -> Any:
        with database.write() as session:
            claim = jobs.claim(session, runners.add(session, "host:1"))
        assert claim is not None
        pipeline.run_job(database, blobs, claim)
        found = lab.request("GET", f"/v1/grasp-logs/{log['id']}").json()
        assert found["job"]["status"] == "done"
        return {name: value for name, value in found["detection"].items() if name != "seconds"}

    calibrate(1)
    lab, content = reach("open"), encode(FAULTS.put_into(ball, 2))
    sent = lab.request("POST", "/v1/grasp-logs?sensor=kept", content=content, headers={"content-type": NPZ})
    log = sent.raise_for_status().json()
    first = detected()
    assert first["calibration"] == 1
    calibrate(3)
    with database.write() as session:
        detections.remove(session, log["id"])
        jobs.requeue(session, log["job"]["id"])
    assert detected() == first


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_sensors_are_listed_by_name_with_their_gels(reach: Callable[..., Any], database: Database) -> None:
    with database.write() as session:
        sensors.find_or_add(session, "right")
        sensors.describe(session, "left", Gel(2e5, 0.48, None, 5e-4))
    told = reach("open").get("/v1/sensors").json()["items"]
    gel = GEL | {"young_modulus": 2e5, "thickness": None}
    assert told == [
        {"name": "left", "gel": gel, "calibration": None},
        {"name": "right", "gel": None, "calibration": None},
    ]
