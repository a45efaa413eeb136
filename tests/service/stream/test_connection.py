"""The live stream over a real server."""

import asyncio
import json
import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import uvicorn
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from db import migrate
from db.database import Database
from db.repositories import access_keys
from service.domain.access import keys
from service.serving import configuration
from service.settings import Settings
from service.stream import connection as stream
from slipcore import GraspLog, detect_slip
from slipcore.contact import tangential_ramp
from stiction_client import AnswerTimedOut, Contact, ControlSettings, FrictionClient, FrictionModel
from stiction_client.errors import ConnectionFailed, InvalidArgument
from stiction_client.stream import SlipStream

FORCES = {"least_force": 1, "most_force": 30}


class Served:
    """A server with live streams, its address and its application."""

    def __init__(self, folder: Path, **settings: Any) -> None:
        self.config = configuration(Settings(data_folder=folder, port=0, **settings), log_level="warning")
        self.server = uvicorn.Server(self.config)
        self.thread = threading.Thread(target=self.server.run)
        self.thread.start()
        while not self.server.started:
            assert self.thread.is_alive()
            time.sleep(0.005)
        self.url = f"http://127.0.0.1:{self.server.servers[0].sockets[0].getsockname()[1]}"

    def stop(self) -> None:
        self.server.should_exit = True
        self.thread.join()

    @property
    def streams(self) -> Any:
        application: Any = self.config.loaded_app
        while not hasattr(application, "state"):
            application = application.app
        return application.state.context.streams

    def connect(self, headers: dict[str, str] | None = None) -> ClientConnection:
        return connect(f"{self.url.replace('http', 'ws')}/v1/stream", compression=None, additional_headers=headers)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    served = Served(tmp_path_factory.mktemp("streams"))
    yield served
    served.stop()


def opening(log: GraspLog, **said: Any) -> dict[str, Any]:
    position = log.position.tolist()
    return {"type": "open", "position": position, "grid": log.grid, "element_area": log.element_area} | said


def ask(socket: ClientConnection, message: dict[str, Any]) -> dict[str, Any]:
    """One message in JSON, and its answer."""
    socket.send(json.dumps(message))
    answer: dict[str, Any] = json.loads(socket.recv(30.0))
    return answer


def frame(log: GraspLog, k: int, **changes: Any) -> dict[str, Any]:
    found = {"type": "frame", "number": k, "time": log.time[k], "displacement": log.displacement[k].tolist()}
    return found | {"force": log.force[k].tolist()} | changes  # type: ignore[index]


def parts(log: GraspLog, k: int) -> list[np.ndarray | None]:
    arrays = (log.displacement, log.force, log.object_pose, log.normal)
    return [None if array is None else array[k] for array in arrays]


def test_the_streams_answers_are_the_batchs(served: Served, ramp: GraspLog, wait: Any) -> None:
    history = detect_slip(ramp)
    with httpx.Client(base_url=served.url) as client:
        client.post("/v1/materials", json={"name": "streamed"}).raise_for_status()
        with SlipStream(served.url, ramp.position, ramp.element_area, material="streamed", keep=True) as live:
            for k, time_ in enumerate(ramp.time):
                live.send(time_, *parts(ramp, k))
                if k % 10 == 9:
                    answers = list(live.answers())
                    assert [answer["number"] for answer in answers] == list(range(k - 9, k + 1))
                    for answer in answers:
                        assert answer["slip"] == np.flatnonzero(history.slip[answer["number"]]).tolist()
            log = live.finish(store=True)
        assert log is not None
        assert (log["format"], log["frames"], log["material"]) == ("stream", len(ramp), "streamed")
        assert wait(client, log["job"]["id"])["status"] == "done"
        assert client.get("/v1/materials/streamed").json()["models"]["ols"]["n"] > 0


@pytest.mark.parametrize(
    ("named", "taken"), [({}, "coarse"), ({"detector": None}, "coarse"), ({"detector": "filter"}, "filter")]
)
def test_few_elements_have_the_detector_that_suits_them_unless_one_is_named(
    served: Served, wait: Any, named: dict[str, Any], taken: str
) -> None:
    """Also the log that is stored, and whoever comes back is told."""
    few = tangential_ramp(points=4, pitch=3e-3)
    with served.connect() as socket:
        opened = ask(socket, opening(few, keep=True) | named)
        assert opened["detector"] == named.get("detector")
        assert ask(socket, frame(few, 0))["detector"] == taken
    with served.connect() as socket:
        assert ask(socket, {"type": "resume", "session": opened["session"], "last": 0})["detector"] == taken
        ask(socket, frame(few, 1))
        log = ask(socket, {"type": "finish", "store": True})["grasp_log"]
    with httpx.Client(base_url=served.url) as client:
        assert wait(client, log["job"]["id"])["status"] == "done"
        assert client.get(f"/v1/grasp-logs/{log['id']}").json()["detection"]["method"] == taken


def test_json_is_for_trials_and_a_wrong_frame_is_answered_by_name(served: Served, ramp: GraspLog) -> None:
    with served.connect() as socket:
        assert ask(socket, opening(ramp))["next"] == 0
        assert ask(socket, frame(ramp, 0))["stick_ratio"] is None
        wrong = ask(socket, frame(ramp, 1, displacement=[[1, 2]]))
        assert (wrong["type"], wrong["number"], wrong["name"]) == ("error", 1, "displacement")
        late = ask(socket, frame(ramp, 2, time=-1.0))
        assert (late["type"], late["name"]) == ("error", "time")
        assert ask(socket, frame(ramp, 3))["type"] == "state"
        assert ask(socket, {"type": "finish"}) == {"type": "finished", "grasp_log": None, "findings": []}


def test_a_grip_controller_answers_and_begins_with_the_material_s_model(served: Served, ramp: GraspLog) -> None:
    settings = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=30.0)
    with FrictionClient(served.url) as client:
        client.ensure_material("gripped")
        client.wait(client.upload(ramp, material="gripped").job).raise_for_status()
    modes = {}
    for material, known in (("gripped", True), ("gripped", False), (None, True)):
        said = {"material": material, "control": settings, "known": known}
        with SlipStream(served.url, ramp.position, ramp.element_area, **said) as live:
            answers = [live.step(time_, *parts(ramp, k)) for k, time_ in enumerate(ramp.time[:5])]
            live.finish()
        assert all(0.5 <= answer["command"]["normal_force"] <= 30.0 for answer in answers)
        modes[material, known] = answers[0]["command"]["mode"]
    assert modes == {("gripped", True): "hold", ("gripped", False): "feel", (None, True): "feel"}


def test_a_grip_controller_goes_by_what_the_streams_sensor_shows(
    served: Served, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=30.0)
    with FrictionClient(served.url) as client:
        client.ensure_material("felt by two")
        client.wait(client.upload(ramp, material="felt by two").job).raise_for_status()
    asked: list[str] = []

    def of_sensor(model: FrictionModel, name: str) -> FrictionModel:
        asked.append(name)
        return model

    monkeypatch.setattr(FrictionModel, "of_sensor", of_sensor)
    begun: list[dict[str, Any]] = [{"sensor": "left", "material": "felt by two"}, {"materials": ["felt by two"]}]
    for said in begun:
        with SlipStream(served.url, ramp.position, ramp.element_area, control=settings, **said) as live:
            live.step(ramp.time[0], *parts(ramp, 0))
            live.finish()
    assert asked == ["left", "unknown"]  # all streams without a sensor's name count as one


def test_a_stream_takes_numpys_numbers_and_names_a_late_answer(served: Served, ramp: GraspLog) -> None:
    with SlipStream(served.url, ramp.position, np.float32(ramp.element_area)) as live:
        with pytest.raises(AnswerTimedOut, match=r"no answer within 0\.01 s; the session goes on") as late:
            live.receive(timeout=0.01)
        assert isinstance(late.value, TimeoutError)
        assert live.step(ramp.time[0], *parts(ramp, 0))["type"] == "state"
        live.finish()
    with pytest.raises(InvalidArgument, match="element_area is 'a'"):
        SlipStream(served.url, ramp.position, "a")  # type: ignore[arg-type]


def test_a_grip_controller_recognises_one_of_the_service_s_materials(served: Served, ramp: GraspLog) -> None:
    settings = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=30.0)
    with FrictionClient(served.url) as client:
        client.ensure_material("recognised")
        client.wait(client.upload(ramp, material="recognised").job).raise_for_status()
    with SlipStream(served.url, ramp.position, ramp.element_area, control=settings, materials=["recognised"]) as live:
        commands = [live.step(time_, *parts(ramp, k))["command"] for k, time_ in enumerate(ramp.time)]
        live.finish()
    assert commands[0]["material"] is None
    assert "recognised" in {command["material"] for command in commands}
    with pytest.raises(ConnectionFailed, match="nothing"):
        SlipStream(served.url, ramp.position, ramp.element_area, control=settings, materials=["nothing"])


def test_a_sensor_whose_gel_is_known_needs_no_forces(served: Served, ramp: GraspLog) -> None:
    settings = ControlSettings(contact=Contact.round(6e-5, at_force=5.0), least_force=0.5, most_force=30.0)
    with FrictionClient(served.url) as client, served.connect() as before:
        ask(before, opening(ramp, sensor="gel"))
        client.describe_sensor("gel", 1e6, 0.5)
        assert "force" not in ask(before, frame(ramp, 0, force=None))  # as it was when the stream was opened
        with SlipStream(served.url, ramp.position, ramp.element_area, sensor="gel", control=settings) as live:
            answers = [live.step(ramp.time[k], ramp.displacement[k], gripper_force=0.5) for k in range(3)]
            with pytest.raises(InvalidArgument, match="gripper_force"):
                live.send(ramp.time[3], ramp.displacement[3], gripper_force=True)
        assert [answer["force"]["wait_for"] for answer in answers] == ["noise"] * 3
        assert all(answer["command"]["normal_force"] >= 0.5 for answer in answers)
        with SlipStream(served.url, ramp.position, ramp.element_area, sensor="gel") as live:
            assert "force" not in live.step(ramp.time[0], ramp.displacement[0], ramp.force[0])


def test_a_session_goes_on_after_a_reconnect(served: Served, ramp: GraspLog) -> None:
    history = detect_slip(ramp)
    live = SlipStream(served.url, ramp.position, ramp.element_area)
    numbers, slip = [], []
    for k, time_ in enumerate(ramp.time):
        live.send(time_, *parts(ramp, k))
        if k in (20, 45):
            live._connection.socket.close()  # no farewell, and a frame that was not answered
            time.sleep(0.2)
        answer = live.receive() if k not in (20, 45) else None
        if answer:
            numbers.append(answer["number"])
            slip.append(answer["slip"])
    for answer in live.answers():
        numbers.append(answer["number"])
        slip.append(answer["slip"])
    live.finish()
    assert numbers == list(range(len(ramp)))
    assert slip == [np.flatnonzero(each).tolist() for each in history.slip]


@pytest.mark.parametrize(
    ("message", "code", "reason"),
    [
        (b"\xc1", 1003, ""),
        ('{"type": "frame"}', 1003, "missing required field"),
        ('{"type": "resume", "session": "x"}', 4404, "no such session"),
        ('{"type": "finish"}', 1003, "must be of type open or resume"),
        ({"grid": [0, 1]}, 4422, "grid is [0, 1]"),
        ({"grid": [100, 100]}, 4422, "1 to 4096 markers"),
        ({"element_area": 1.0}, 4422, "element_area is 1 m²"),
        ({"material": "nothing"}, 4422, "no material 'nothing'"),
        ({"detector": "guess"}, 4422, "detector is guess"),
        ({"sensor": "tab\tbed", "keep": True}, 4422, "sensor is 'tab\\tbed'; allowed: 1 to 200 printable"),
        ({"control": {"contact_area": 6e-5}}, 1003, "missing required field `settings`"),
        ({"control": {"contact_area": 6e-5, "settings": {"least_force": 1}}}, 4422, "control: most_force is not given"),
        ({"control": {"contact_area": -1, "settings": FORCES}}, 4422, "control: area is -1.0"),
        ({"control": {"contact_area": 6e-5, "settings": FORCES | {"grip": 1}}}, 4422, "control: settings is grip"),
    ],
)
def test_what_cannot_be_is_closed_with_a_reason(
    served: Served, ramp: GraspLog, message: Any, code: int, reason: str
) -> None:
    with served.connect() as socket:
        socket.send(json.dumps(opening(ramp, **message)) if isinstance(message, dict) else message)
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv(30.0)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == code
    assert reason in closed.value.rcvd.reason


def test_a_stream_may_leave_its_sensors_name_empty(served: Served, ramp: GraspLog) -> None:
    with served.connect() as socket:
        assert ask(socket, opening(ramp, sensor="", keep=True))["type"] == "opened"


def test_a_reader_that_does_not_read_is_dropped(
    served: Served, ramp: GraspLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def stuck(_: Any) -> None:
        await asyncio.sleep(3600.0)

    monkeypatch.setattr(stream._Connection, "_write", stuck)
    with served.connect() as socket:
        ask(socket, opening(ramp))
        with pytest.raises(ConnectionClosed) as closed:
            send_all(socket, [frame(ramp, k % len(ramp), number=k) for k in range(1000)])
    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (4408, "64 answers wait to be read")


def send_all(socket: ClientConnection, frames: list[dict[str, Any]]) -> None:
    for each in frames:
        socket.send(json.dumps(each))
        time.sleep(0.002)


def test_a_session_is_told_that_its_detector_is_lost(served: Served, ramp: GraspLog) -> None:
    live = SlipStream(served.url, ramp.position, ramp.element_area)
    live.step(ramp.time[0], ramp.displacement[0])
    os.kill(served.streams._process._process.pid, signal.SIGKILL)
    with pytest.raises(ConnectionFailed, match=r"detector's process ended; open a new session \(1011\)"):
        [live.step(ramp.time[k], ramp.displacement[k]) for k in range(1, 20)]
    with SlipStream(served.url, ramp.position, ramp.element_area) as again:
        assert again.step(ramp.time[0], ramp.displacement[0])["type"] == "state"


def test_a_session_belongs_to_one_connection_at_a_time(served: Served, ramp: GraspLog) -> None:
    """The one that came last: a client whose network changed comes back before the end of the first is noticed."""
    history, slip = detect_slip(replace(ramp, object_pose=None, normal=None)), []
    with served.connect() as first, served.connect() as second:
        session = ask(first, opening(ramp))["session"]
        slip += [ask(first, frame(ramp, k))["slip"] for k in range(30)]
        first.send(json.dumps(frame(ramp, 30)))
        goes_on = ask(second, {"type": "resume", "session": session, "last": 29})
        assert goes_on["type"] == "opened"
        with pytest.raises(ConnectionClosed, match="goes on in another connection") as closed:
            [first.recv(30.0) for _ in range(2)]
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4409
        answers = [] if goes_on["next"] == 30 else [json.loads(second.recv(30.0))]
        answers += [ask(second, frame(ramp, k)) for k in range(goes_on["next"], len(ramp))]
        assert [answer["number"] for answer in answers] == list(range(30, len(ramp)))
    slip += [answer["slip"] for answer in answers]
    assert slip == [np.flatnonzero(each).tolist() for each in history.slip]


class Relay:
    """Passes connections on to a server, and lets its end of each live for as long as the relay itself."""

    def __init__(self, port: int) -> None:
        self._port, self.ends = port, list[socket.socket]()
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, far = self._listening.accept()[0], socket.create_connection(("127.0.0.1", self._port))
                self.ends += [near, far]
                for each, other in ((near, far), (far, near)):
                    threading.Thread(target=self._pass_on, args=(each, other), daemon=True).start()

    def _pass_on(self, near: socket.socket, far: socket.socket) -> None:
        with suppress(OSError):
            while content := near.recv(65536):
                far.sendall(content)

    def close(self) -> None:
        for each in (self._listening, *self.ends):
            each.close()


def test_a_stream_goes_on_whose_old_connection_nobody_saw_end(served: Served, ramp: GraspLog) -> None:
    """As of a robot that came to another network: for the service the first one lives for up to 40 s more."""
    with closing(Relay(int(served.url.rpartition(":")[2]))) as relay:
        live = SlipStream(f"http://127.0.0.1:{relay.port}", ramp.position, ramp.element_area)
        live.step(ramp.time[0], *parts(ramp, 0))
        live._url = served.url.replace("http", "ws") + "/v1/stream"
        relay.ends[0].shutdown(socket.SHUT_RDWR)
        assert [live.step(ramp.time[k], *parts(ramp, k))["number"] for k in range(1, 5)] == [1, 2, 3, 4]
        live.finish()


def test_a_service_that_is_not_there_is_named(ramp: GraspLog) -> None:
    with pytest.raises(ConnectionFailed, match=r"ws://127\.0\.0\.1:9/v1/stream: "):
        SlipStream("http://127.0.0.1:9", ramp.position, ramp.element_area)


def test_a_stream_needs_a_key_that_may_upload(ramp: GraspLog, tmp_path: Path) -> None:
    url, log = f"sqlite:///{tmp_path / 'stiction.sqlite3'}", ramp
    with closing(Database(url)) as database:
        migrate.upgrade(database)
        texts = {}
        for scope in ("read", "upload"):
            key_id, texts[scope] = keys.new_key()
            with database.write() as session:
                access_keys.add(session, key_id, scope, scope, keys.digest(texts[scope]))
    served = Served(tmp_path, access="keys")
    try:
        for key in (None, "nonsense", texts["read"]):
            with pytest.raises(ConnectionFailed, match=r"HTTP 40[13]"):
                SlipStream(served.url, log.position, log.element_area, key=key)
        with served.connect({"Authorization": f"Bearer {texts['upload']}"}) as socket:
            socket.send('{"type": "finish"}')
            with pytest.raises(ConnectionClosed, match="must be of type open or resume"):  # it was let in
                socket.recv(30.0)
        with SlipStream(served.url, log.position, log.element_area, keep=True, key=texts["upload"]) as live:
            for k in range(2):
                live.send(log.time[k], *parts(log, k))
            stored = live.finish(store=True)
        assert stored is not None
        assert (stored["uploaded_by"], stored["job"]["requested_by"]) == (key_id, key_id)
    finally:
        served.stop()


def test_a_stream_tells_whose_gel_it_is_by_which_forces_are_reconstructed(ramp: GraspLog, tmp_path: Path) -> None:
    """Uploads had the finding, streams went by another's gel without a word."""
    ids, texts = zip(*(keys.new_key() for _ in range(2)), strict=True)
    with closing(Database(f"sqlite:///{tmp_path / 'stiction.sqlite3'}")) as database:
        migrate.upgrade(database)
        with database.write() as session:
            for key_id, text in zip(ids, texts, strict=True):
                access_keys.add(session, key_id, "robot", "upload", keys.digest(text))
    served = Served(tmp_path, access="keys")
    try:
        with FrictionClient(served.url, texts[0]) as client:
            client.describe_sensor("gel", 1e6, 0.5)
        with SlipStream(served.url, ramp.position, ramp.element_area, sensor="gel", key=texts[0]) as own:
            assert own.findings == ()
        with SlipStream(served.url, ramp.position, ramp.element_area, sensor="gel", key=texts[1]) as live:
            (told,) = live.findings
        assert (told.name, ids[0] in told.evidence) == ("another's gel", True)
        with served.connect({"Authorization": f"Bearer {texts[1]}"}) as socket:
            answers = [ask(socket, each) for each in (opening(ramp, sensor="gel"), {"type": "finish"})]
        assert [[each["name"] for each in answer["findings"]] for answer in answers] == [["another's gel"]] * 2
    finally:
        served.stop()
