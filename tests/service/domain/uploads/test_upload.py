import gzip
import hashlib
import io
import json
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import h5py
import httpx
import numpy as np
import pytest
from backports import zstd

from db.database import Database
from db.records import Claim
from db.repositories import jobs, materials, runners
from service.domain.access.principal import ANONYMOUS
from service.domain.errors import ResultsNotReady
from service.domain.uploads import sent_again
from service.formats import parquet
from slipcore import GraspLog
from slipcore.contact.tiers.ramp import tangential_ramp
from stiction_client.container import encode
from tests.service.grasps import another_grasp
from tests.service.stored import spool, stored_files, wait_for_empty_spool
from tests.waiting import wait_until

Upload = Callable[..., httpx.Response]
Wait = Callable[[httpx.Client, str], dict[str, Any]]
Repack = Callable[[dict[str, Any]], bytes]

NPZ = "application/vnd.stiction.grasp-log+npz"


def refusal(
    client: httpx.Client, upload: Upload, content: bytes, status: int, content_type: str = NPZ, **query: str
) -> dict[str, Any]:
    """The problem that an upload is answered with; nothing may stay of it."""
    before = stored_files(client)
    response = upload(client, content, content_type, **query)
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    assert stored_files(client) == before
    problem: dict[str, Any] = response.json()
    assert problem["detail"] == f"{problem['name']} is {problem['value']}; allowed: {problem['allowed']}"
    return problem


def changed(name: str, index: object, value: float) -> Callable[[dict[str, Any]], dict[str, Any]]:
    def change(members: dict[str, Any]) -> dict[str, Any]:
        array = members[name].copy()
        array[index] = value
        return members | {name: array}

    return change


@pytest.mark.parametrize(
    ("change", "name", "value", "allowed"),
    [
        (lambda m: m | {"force": m["force"][:, 1:]}, "force", "[82, 13, 14, 3]", "[82, 14, 14, 3]"),
        (lambda m: m | {"position": m["position"][0]}, "position", "[14, 3]", "[any, any, 3]"),
        (changed("displacement", (3, 1, 2, 0), np.nan), "displacement", "nan at index [3, 1, 2, 0]", "finite"),
        (changed("force", (3, 1, 2, 0), np.inf), "force", "inf", "finite"),
        (changed("time", 5, 0.0), "time", "at frame 5", "strictly increasing"),
        (lambda m: {k: v[:1] if k in PER_FRAME else v for k, v in m.items()}, "time", "1 frame", "at least 2"),
        (lambda m: m | {"position": m["position"] * 1e3}, "position", "5.85", "at most 1 m"),
        (lambda m: m | {"displacement": m["displacement"] * 1e3}, "displacement", "1.28 m", "at most 0."),
        (lambda m: m | {"force": m["force"] * 1e6}, "force", "N per element", "at most 10000 N"),
        (lambda m: m | {"time": m["time"] * 1e-9}, "time", "between frames", "is it in s?"),
        (lambda m: m | {"element_area": np.float64(1.0)}, "element_area", "1 m²", "to 0.01 m²"),
        (lambda m: {k: v for k, v in m.items() if k != "time"}, "members", "without time", "time, position"),
        (lambda m: m | {"sensor": np.str_("x" * 201)}, "sensor", "xxx", "1 to 200 printable characters"),
        (lambda m: m | {"sensor": np.str_("a\x01b")}, "sensor", "a\\x01b", "1 to 200 printable characters"),
    ],
    ids=[
        "wrong shape of force",
        "wrong shape of position",
        "NaN",
        "infinity",
        "time runs backwards",
        "a single frame",
        "positions in mm",
        "displacements in mm",
        "absurd forces",
        "time in another unit",
        "absurd element area",
        "no time",
        "long sensor name",
        "unprintable sensor name",
    ],
)
def test_a_log_that_cannot_be_is_refused_by_name(
    client: httpx.Client, upload: Upload, members: dict[str, Any], repack: Repack,
    change: Callable[[dict[str, Any]], dict[str, Any]], name: str, value: str, allowed: str,
) -> None:  # fmt: skip
    problem = refusal(client, upload, repack(change(members)), 422)
    assert (problem["type"], problem["name"]) == ("/problems/invalid-grasp-log", name)
    assert value in problem["value"]
    assert allowed in problem["allowed"]


PER_FRAME = {"time", "displacement", "force", "object_pose", "truth_contact", "truth_slip_kinematic"}
PER_FRAME |= {"truth_slip_contact_factor", "truth_stick_ratio"}


@pytest.mark.parametrize("kept", [0.02, 0.5, 0.999], ids=lambda kept: f"{kept:.1%} of the file")
def test_a_truncated_file_is_refused(client: httpx.Client, upload: Upload, content: bytes, kept: float) -> None:
    problem = refusal(client, upload, content[: int(kept * len(content))], 422)
    assert problem["type"] == "/problems/invalid-grasp-log"
    assert "complete zip" in problem["allowed"]


@pytest.mark.parametrize(
    ("content", "content_type", "allowed"),
    [
        (b"time,x,y\n0,1,2\n", "application/octet-stream", "a mapping that says which columns are what"),
        (b"", "application/octet-stream", "npz, tac3d, tracked markers"),
        (b"PK\x03\x04", "text/html", NPZ),
    ],
)
def test_what_is_no_log_at_all_is_refused(
    client: httpx.Client, upload: Upload, content: bytes, content_type: str, allowed: str
) -> None:
    problem = refusal(client, upload, content, 415, content_type)
    assert problem["type"] == "/problems/unsupported-format"
    assert allowed in problem["allowed"]


def test_an_empty_body_said_to_be_a_log_is_refused(client: httpx.Client, upload: Upload) -> None:
    assert refusal(client, upload, b"", 422)["type"] == "/problems/invalid-grasp-log"


@pytest.mark.parametrize(
    ("query", "status", "kind", "name"),
    [
        ({"material": "felt"}, 404, "unknown-material", "material"),
        ({"detector": "guess"}, 422, "invalid-request", "detector"),
        ({"sensor": "x" * 201}, 422, "invalid-grasp-log", "sensor"),
    ],
)
def test_a_wish_that_cannot_be_met_is_refused_by_name(
    client: httpx.Client, upload: Upload, content: bytes, query: dict[str, str], status: int, kind: str, name: str
) -> None:
    problem = refusal(client, upload, content, status, **query)
    assert (problem["type"], problem["name"]) == (f"/problems/{kind}", name)


DOTS = Path(__file__).parents[2] / "formats" / "tracked_dots.csv"


def unscaled() -> bytes:
    """A tracker's file that tells neither scale nor frame rate."""
    lines = DOTS.read_bytes().splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith((b"# scale", b"# frame_rate")))


def test_the_scale_given_with_an_upload_is_kept_with_it(client: httpx.Client, upload: Upload, wait: Wait) -> None:
    accepted = upload(client, unscaled(), "text/csv", scale="2.5e-5", frame_rate="30")
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    log = accepted.json()
    assert (log["format"], log["frames"], log["sensor"]) == ("tracked markers", 31, "fingertip camera")
    assert log["duration"] == pytest.approx(1.0)
    job = wait(client, log["job"]["id"])
    assert job["status"] == "done"  # without a material there is nothing to refuse
    assert client.get(accepted.headers["location"]).json()["detection"]["noise"] == pytest.approx(2e-6, rel=0.5)
    again = upload(client, unscaled(), "text/csv", scale="2.5e-5", frame_rate="30")
    assert again.status_code == httpx.codes.OK
    assert upload(client, unscaled(), "text/csv", scale="3e-5", frame_rate="30").json()["id"] != log["id"]


def test_the_rest_given_with_an_upload_makes_another_log(client: httpx.Client, upload: Upload) -> None:
    ids = {rest: upload(client, DOTS.read_bytes(), "text/csv", rest=rest).json()["id"] for rest in ("first", "9")}
    assert ids["first"] == upload(client, DOTS.read_bytes(), "text/csv").json()["id"] != ids["9"]
    problem = refusal(client, upload, DOTS.read_bytes(), 422, "text/csv", rest="/etc/hostname")
    assert (problem["name"], problem["value"]) == ("rest", "'/etc/hostname'"), "a server opens no file by name"


def test_a_loggers_table_is_taken_by_its_mapping_with_its_forces(
    client: httpx.Client, upload: Upload, wait: Wait
) -> None:
    """Text with a mapping is a table of frames; without one it would be refused for having no markers."""
    names = [f"P{p}_{kind}{axis}" for p in range(4) for kind in "DF" for axis in "XYZ"]
    rows = [[str(10_000 * k), *(f"{0.001 * k}" if "D" in name else f"{-0.5 * k}" for name in names)] for k in range(4)]
    table = "\n".join(map(",".join, [["T_us", *names], *rows])).encode()
    mapping = {
        "grid": [2, 2],
        "pitch": 7e-3,
        "time": {"field": "T_us", "unit": "us"},
        "displacement": {"field": [f"P*_D{axis}" for axis in "XYZ"], "unit": "mm"},
        "force": [f"P*_F{axis}" for axis in "XYZ"],
    }
    accepted = upload(client, table, "text/csv", mapping=json.dumps(mapping))
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    assert (accepted.json()["format"], accepted.json()["frames"]) == ("frame table", 4)
    assert wait(client, accepted.json()["job"]["id"])["status"] == "done"
    with np.load(io.BytesIO(client.get(f"{accepted.headers['location']}/file").content)) as stored:
        np.testing.assert_allclose(stored["force"][3], np.full((2, 2, 3), -1.5), rtol=1e-12, err_msg="as in the table")
    assert upload(client, table, "text/csv").status_code == httpx.codes.UNPROCESSABLE_ENTITY


@pytest.mark.parametrize("beside", [{}, {"displacement": "u", "position": "x"}], ids=["alone", "markers"])
def test_maps_of_height_are_uploaded_with_their_mapping(
    client: httpx.Client, upload: Upload, wait: Wait, tmp_path: Path, ramp: GraspLog, beside: dict[str, str]
) -> None:
    """The log is there either way; slip is looked for where markers show motion along the surface."""
    level = -1e-4 * np.linspace(0.0, 1.0, len(ramp))
    flat = ramp.displacement * [1.0, 1.0, 0.0]
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.update({"time": ramp.time, "x": ramp.position, "u": flat - flat[0]})
        file["depth"] = 1e3 * level[:, None, None] * np.ones((40, 40))
    mapping = {"time": "time", "height": {"field": "depth", "unit": "mm"}, "pixel": 1e-3, "grid": [5, 8], **beside}
    content = (tmp_path / "log.h5").read_bytes()
    accepted = upload(client, content, "application/x-hdf5", mapping=json.dumps(mapping))
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    job = wait(client, accepted.json()["job"]["id"])
    reason = "displacement is along the normal; allowed: x and y of it"
    assert (job["status"], (job["reason"] or "")[: len(reason)]) == (("done", "") if beside else ("refused", reason))
    with np.load(io.BytesIO(client.get(f"{accepted.headers['location']}/file").content)) as stored:
        z = stored["displacement"][..., 2]
    assert z.shape[1:] == (ramp.grid if beside else (5, 8))
    np.testing.assert_allclose(z, np.broadcast_to(level[:, None, None], z.shape), rtol=1e-9, atol=1e-15)


def test_slip_is_detected_without_a_scale_but_no_friction_found(
    client: httpx.Client, material: str, upload: Upload, wait: Wait
) -> None:
    accepted = upload(client, unscaled(), "text/csv", material=material, frame_rate="30")
    job = wait(client, accepted.json()["job"]["id"])
    assert job["status"] == "refused"
    assert "scale is unknown" in job["reason"]
    detection = client.get(accepted.headers["location"]).json()["detection"]
    assert detection["noise"] is None
    assert detection["contact_frames"] > 0


def test_a_frame_count_without_a_rate_is_refused(client: httpx.Client, upload: Upload) -> None:
    problem = refusal(client, upload, unscaled(), 422, "text/csv")
    assert (problem["type"], problem["name"], problem["value"]) == (
        "/problems/invalid-grasp-log",
        "frame_rate",
        "missing",
    )


def test_a_scale_beside_a_zip_is_refused(client: httpx.Client, upload: Upload, content: bytes) -> None:
    problem = refusal(client, upload, content, 422, scale="1e-5")
    assert (problem["type"], problem["value"]) == ("/problems/invalid-request", "1e-05 with npz")


def test_an_upload_over_the_limit_is_refused_by_its_length(client: httpx.Client, upload: Upload) -> None:
    problem = refusal(client, upload, bytes(2 * 2**20 + 1), 413)
    assert (problem["type"], problem["value"]) == ("/problems/upload-too-large", "2097153 bytes or more")
    assert problem["allowed"] == "at most 2097152 bytes"


def test_an_upload_of_just_the_limit_is_looked_at(client: httpx.Client, upload: Upload) -> None:
    assert refusal(client, upload, bytes(2 * 2**20), 422)["type"] == "/problems/invalid-grasp-log"


def test_an_upload_over_the_limit_is_refused_while_it_streams(client: httpx.Client) -> None:
    sent = 0

    def chunks() -> Iterator[bytes]:
        nonlocal sent
        for _ in range(400):
            sent += 2**16
            yield bytes(2**16)

    before = stored_files(client)
    response = client.post("/v1/grasp-logs", content=chunks(), headers={"content-type": NPZ})
    assert response.request.headers["transfer-encoding"] == "chunked"
    assert response.status_code == httpx.codes.REQUEST_ENTITY_TOO_LARGE
    assert response.json()["type"] == "/problems/upload-too-large"
    assert stored_files(client) == before


def test_an_upload_that_breaks_off_leaves_nothing(client: httpx.Client, content: bytes) -> None:
    before = stored_files(client)
    with socket.create_connection((client.base_url.host, client.base_url.port or 0)) as connection:
        head = f"POST /v1/grasp-logs HTTP/1.1\r\nHost: localhost\r\nContent-Type: {NPZ}\r\n"
        connection.sendall(f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content[: len(content) // 2])
        wait_until(lambda: len(spool(client)) == 1, "the bytes to arrive")
    assert stored_files(client) == before


def still(frames: int = 30) -> dict[str, Any]:
    """A sensor at rest that measures nothing but noise."""
    log = tangential_ramp(points=8, pitch=1.5e-3)
    noise = np.random.default_rng(0).normal(0.0, 1e-7, (frames, 8, 8, 3))
    return {"time": np.arange(frames) / 30.0, "position": log.position, "displacement": noise, "force": noise * 0.0}


@pytest.mark.parametrize("case", ["no contact", "zero forces", "no slip", "no forces"])
def test_data_that_allow_no_fit_are_kept_and_the_job_is_refused(
    client: httpx.Client, material: str, upload: Upload, wait: Wait, ramp: GraspLog, members: dict[str, Any],
    repack: Repack, case: str,
) -> None:  # fmt: skip
    pressed_only = encode(tangential_ramp(points=8, pitch=1.5e-3, tangential_force=0.0, marker_noise=1e-7))
    cases: dict[str, tuple[Callable[[], bytes], str]] = {
        "no contact": (lambda: repack(members_of(members, still())), "no element was in contact in any of the 30"),
        "zero forces": (lambda: repack(members | {"force": ramp.force * 0.0}), "no element was in contact"),  # type: ignore[operator]
        "no slip": (lambda: pressed_only, "no slip gave a friction sample (0 slipping"),
        "no forces": (lambda: repack({k: v for k, v in members.items() if k != "force"}), "the log has no forces"),
    }
    make, reason = cases[case]
    accepted = upload(client, make(), material=material)
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    job = wait(client, accepted.json()["job"]["id"])
    assert (job["status"], job["model_version"]) == ("refused", None)
    assert reason in job["reason"]
    assert list(job["seconds"]) == ["frames", "slip_state", "samples"]
    log = client.get(accepted.headers["location"]).json()
    assert log["detection"]["samples"] == 0
    assert client.get(f"{accepted.headers['location']}/samples").json()["normal_force"] == []
    found = client.get(f"/v1/materials/{material}").json()
    assert (found["grasp_logs"], found["models"]) == (1, {})


def members_of(members: dict[str, Any], replaced: dict[str, Any]) -> dict[str, Any]:
    kept = {name: members[name] for name in ("format", "version", "element_area")}
    return kept | replaced


def test_a_refused_log_leaves_the_materials_model_as_it_was(
    client: httpx.Client, material: str, upload: Upload, wait: Wait, content: bytes, members: dict[str, Any],
    repack: Repack,
) -> None:  # fmt: skip
    wait(client, upload(client, content, material=material).json()["job"]["id"])
    before = client.get(f"/v1/materials/{material}").json()["models"]
    refused = upload(client, repack(members_of(members, still())), material=material)
    assert wait(client, refused.json()["job"]["id"])["status"] == "refused"
    assert client.get(f"/v1/materials/{material}").json()["models"] == before


def test_identical_uploads_at_once_are_one_log_and_one_blob(
    client: httpx.Client, material: str, upload: Upload, wait: Wait, members: dict[str, Any], repack: Repack
) -> None:
    content = repack(members | {"sensor": np.str_("uploaded by many")})
    together = threading.Barrier(8)

    def send(_: int) -> httpx.Response:
        with httpx.Client(base_url=client.base_url, timeout=60.0) as own:
            together.wait()
            return upload(own, content, material=material)

    with ThreadPoolExecutor(8) as threads:
        answers = list(threads.map(send, range(8)))
    assert sorted(answer.status_code for answer in answers) == [200] * 7 + [202]
    assert len({answer.headers["location"] for answer in answers}) == 1
    job = wait(client, answers[0].json()["job"]["id"])
    assert (job["status"], job["model_version"]) == ("done", 1)
    assert client.get(f"/v1/materials/{material}").json()["grasp_logs"] == 1
    sha256 = hashlib.sha256(content).hexdigest()
    assert len([path for path in stored_files(client) if path.endswith(sha256)]) == 1


def test_different_uploads_at_once_all_count(
    client: httpx.Client, material: str, upload: Upload, wait: Wait, content: bytes
) -> None:
    contents = [another_grasp(content, number) for number in range(5)]
    with ThreadPoolExecutor(5) as threads:
        answers = list(threads.map(lambda content: upload(client, content, material=material), contents))
    jobs = [wait(client, answer.json()["job"]["id"]) for answer in answers]
    assert [job["status"] for job in jobs] == ["done"] * 5
    assert sorted(job["model_version"] for job in jobs) == [1, 2, 3, 4, 5]
    samples = client.get(answers[0].headers["location"]).json()["detection"]["samples"]
    current = client.get(f"/v1/materials/{material}").json()["models"]["ols"]
    assert (current["version"], current["n"]) == (5, 5 * samples)


@pytest.mark.parametrize("encoding", ["gzip", "zstd"])
def test_a_body_packed_on_its_way_is_the_log_in_it(client: httpx.Client, content: bytes, encoding: str) -> None:
    packed = {"gzip": gzip.compress, "zstd": zstd.compress}[encoding](content)
    headers = {"content-type": NPZ, "content-encoding": encoding}
    detector = {"detector": "rigid_fit"}
    response = client.post("/v1/grasp-logs", params=detector, content=packed, headers=headers)
    assert response.status_code in (200, 202), response.text
    assert response.json()["sha256"] == hashlib.sha256(content).hexdigest()
    broken = client.post("/v1/grasp-logs", content=packed[:-20], headers=headers)
    assert (broken.status_code, broken.json()["type"]) == (422, "/problems/invalid-request")
    assert "complete" in broken.json()["value"]


def test_a_content_encoding_that_is_not_known_is_refused(client: httpx.Client, content: bytes) -> None:
    for encoding in ("br", "gzip, zstd"):
        headers = {"content-type": NPZ, "content-encoding": encoding}
        response = client.post("/v1/grasp-logs", content=content, headers=headers)
        assert (response.status_code, response.json()["name"]) == (415, "content encoding")


def test_a_compression_bomb_is_refused(client: httpx.Client) -> None:
    headers = {"content-type": NPZ, "content-encoding": "zstd"}
    refused = client.post("/v1/grasp-logs", content=zstd.compress(bytes(10**9)), headers=headers)
    assert (refused.status_code, refused.json()["type"]) == (413, "/problems/upload-too-large")
    assert refused.json()["allowed"] == "at most 2097152 bytes"
    wait_for_empty_spool(client)


def test_a_recording_is_kept_as_the_log_in_it(
    client: httpx.Client, upload: Upload, wait: Wait, ramp: GraspLog, tmp_path: Path
) -> None:
    recorded = replace(ramp, sensor="recorder")
    parquet.write(recorded, tmp_path / "log")
    accepted = upload(client, (tmp_path / "log").read_bytes(), "application/vnd.apache.parquet")
    assert accepted.status_code == httpx.codes.ACCEPTED, accepted.text
    found = accepted.json()
    assert (found["format"], found["frames"], found["sensor"]) == ("parquet", len(ramp), "recorder")
    assert found["sha256"] == hashlib.sha256(encode(recorded)).hexdigest()
    assert wait(client, found["job"]["id"])["status"] == "done"
    again = upload(client, (tmp_path / "log").read_bytes(), "application/octet-stream")
    assert (again.status_code, again.json()["id"]) == (200, found["id"])


@pytest.mark.parametrize(
    ("mapping", "status", "name"),
    [("{", 422, "mapping"), ('{"time": "clock"}', 422, "time"), ('{"forces": "f"}', 422, "mapping")],
)
def test_a_mapping_that_does_not_fit_is_refused(
    client: httpx.Client, upload: Upload, ramp: GraspLog, tmp_path: Path, mapping: str, status: int, name: str
) -> None:
    parquet.write(ramp, tmp_path / "log")
    problem = refusal(
        client, upload, (tmp_path / "log").read_bytes(), status, "application/octet-stream", mapping=mapping
    )
    assert problem["name"] == name


@pytest.mark.parametrize("status", ["queued", "running", "done"])
def test_a_log_is_another_sensors_unless_its_job_goes_by_the_one_before(
    database: Database, monkeypatch: pytest.MonkeyPatch, status: str
) -> None:
    changed: list[tuple[str, str]] = []
    monkeypatch.setattr(sent_again.grasp_logs, "change_sensor", lambda _, log, sensor: changed.append((log, sensor)))
    with database.write() as session:
        material = materials.create(session, "paper", "").id
        job = jobs.add(session, "fit", "ols", material_id=material)
        claim = None if status == "queued" else jobs.claim(session, runners.add(session, "host:1"))
        if status == "done":
            jobs.finish(session, cast(Claim, claim), "done")
    log: Any = SimpleNamespace(id="log", uploaded_by=None, job=SimpleNamespace(id=job))
    with database.write() as session, pytest.raises(ResultsNotReady) if status == "running" else nullcontext():
        sent_again._change_sensor(session, log, material, "left", ANONYMOUS)
    assert changed == ([] if status == "running" else [("log", "left")])
