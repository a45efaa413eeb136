import asyncio
import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest
import uvicorn

from service.app import create_app
from service.settings import Settings
from slipcore import GraspLog
from slipcore.contact.tiers.ramp import RampSchedule, tangential_ramp
from stiction_client import AsyncFrictionClient, Cost, Domain, FrictionClient, FrictionModel, calls, exchange
from tests import forking

MODEL = {
    "material": "paper",
    "method": "ols",
    "version": 3,
    "current": True,
    "coefficients": [0.41, -0.8, -0.35],
    "covariance": [[1.0e-5, 0.0, 0.0], [0.0, 1.0e-2, 0.0], [0.0, 0.0, 4.0e-3]],
    "scale": 0.021,
    "n": 5120,
    "degrees_of_freedom": 11.0,
    "scatter_degrees_of_freedom": 5117.0,
    "domain": {"tangential_velocity": [0.0, 0.004], "normal_force": [0.002, 0.11]},
    "identifiable": [True, True, False],
    "element_area": 1.0e-6,
    "diagnostics": {"r_squared": 0.31, "cluster_kind": "grasp", "skipped": None},
    "cost": {"seconds": 0.012, "monte_carlo_error": 0.0},
    "created_at": "2026-11-21T08:41:00.123456Z",
}
MATERIAL = {
    "name": "paper",
    "description": "80 g/m²",
    "created_at": "2026-11-21T08:41:00Z",
    "grasp_logs": 12,
    "aliases": ["paper 80.g"],
    "models": {"ols": MODEL},
}
JOB = {
    "id": "j1",
    "kind": "ingest",
    "status": "done",
    "stage": None,
    "reason": None,
    "seconds": {"frames": 0.01},
    "grasp_log": "g1",
    "material": "paper",
    "model_version": 3,
    "created_at": "2026-11-21T08:41:00Z",
    "finished_at": "2026-11-21T08:41:01Z",
}
DETECTION = {
    "method": "strain_rate",
    "noise": 1.1e-6,
    "stick_ratio_min": None,
    "contact_frames": 240,
    "macro_slip_frames": 0,
    "events": {"onset": 181, "end": 40, "touch": 203, "release": 0},
    "samples": 1932,
    "seconds": 0.06,
}
GRASP_LOG = {
    "id": "g1",
    "sha256": "9f86d0",
    "bytes": 10,
    "format": "npz",
    "material": "paper",
    "sensor": "AD2",
    "frames": 250,
    "duration": 8.3,
    "grid": [20, 20],
    "created_at": "2026-11-21T08:41:00Z",
    "job": JOB,
    "detection": DETECTION,
}
FRICTION = {
    "material": "paper",
    "method": "ols",
    "version": 3,
    "tangential_velocity": 0.0,
    "normal_force": 0.05,
    "quantile": 0.05,
    "friction_coefficient": 0.36,
    "mean": 0.39,
    "within_domain": True,
    "warning": None,
}


@pytest.fixture
def answers() -> SimpleNamespace:
    """Answers as the service gives them, to be changed at will."""
    copied = json.loads(json.dumps([MODEL, MATERIAL, JOB, GRASP_LOG, FRICTION]))
    return SimpleNamespace(**dict(zip(("model", "material", "job", "grasp_log", "friction"), copied, strict=True)))


class Service:
    """A scripted service: gives its answers in order (the last one again and again) and remembers the requests."""

    def __init__(self, *answers: Any) -> None:
        self.answers = list(answers)
        self.requests: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        if isinstance(answer, httpx.Response):  # fresh, since a response's stream is bound to one client
            return httpx.Response(answer.status_code, headers=answer.headers, content=answer.content)
        return httpx.Response(200, json=answer)


@pytest.fixture
def service() -> Callable[..., Service]:
    return Service


Ask = Callable[..., Any]


@pytest.fixture(params=["sync", "async"])
def ask(request: pytest.FixtureRequest) -> Ask:
    """Call a method of either client on a scripted service: ``ask(service, "material", "paper")``."""

    def sync(service: Service, method: str, /, *args: Any, key: str | None = None, **kwargs: Any) -> Any:
        with FrictionClient("http://stiction", key=key, transport=httpx.MockTransport(service)) as client:
            return getattr(client, method)(*args, **kwargs)

    def awaited(service: Service, method: str, /, *args: Any, key: str | None = None, **kwargs: Any) -> Any:
        async def run() -> Any:
            transport = httpx.MockTransport(service)
            async with AsyncFrictionClient("http://stiction", key=key, transport=transport) as client:
                return await getattr(client, method)(*args, **kwargs)

        return asyncio.run(run())

    return sync if request.param == "sync" else awaited


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pauses of a microsecond, so that retries and polls take no time."""
    monkeypatch.setattr(exchange, "RETRY_PAUSE", 1e-6)
    for name in ("FIRST_POLL", "LONGEST_POLL"):
        monkeypatch.setattr(calls, name, 1e-6)


@pytest.fixture
def make_model() -> Callable[..., FrictionModel]:
    """A friction model of paper-like numbers, any part of which can be given."""

    def make(
        coefficients: Any = (0.41, -0.8, -0.35),
        covariance: Any = ((2e-5, 1e-4, -8e-5), (1e-4, 1e-2, -3e-4), (-8e-5, -3e-4, 4e-3)),
        scale: float = 0.021,
        degrees_of_freedom: float = 11.0,
        scatter_degrees_of_freedom: float = 5117.0,
        element_area: float = 1e-6,
        normal_force_domain: tuple[float, float] = (0.002, 0.3),
    ) -> FrictionModel:
        return FrictionModel(
            material="paper",
            method="ols",
            version=1,
            coefficients=np.array(coefficients, float),
            covariance=np.array(covariance, float),
            scale=scale,
            n=5120,
            degrees_of_freedom=degrees_of_freedom,
            scatter_degrees_of_freedom=scatter_degrees_of_freedom,
            domain=Domain((1e-5, 0.004), normal_force_domain),
            identifiable=np.ones(3, bool),
            element_area=element_area,
            cost=Cost(0.01),
        )

    return make


@dataclass
class PlainLog:
    """A grasp log that is no ``slipcore.GraspLog``: the client knows logs by their fields alone."""

    time: Any
    position: Any
    displacement: Any
    element_area: float
    force: Any
    normal: Any
    object_pose: Any
    sensor: str
    metadata: dict[str, str]
    truth: Any


@pytest.fixture
def log() -> PlainLog:
    generator = np.random.default_rng(2)
    shape = (4, 2, 3)
    truth = SimpleNamespace(
        contact=np.ones(shape, bool),
        slip_kinematic=np.zeros(shape, bool),
        slip_contact_factor=np.zeros(shape, bool),
        stick_ratio=np.ones(4),
        friction=SimpleNamespace(coefficients=(0.4, 0.1, -0.2), scale=0.03),
    )
    return PlainLog(
        time=np.arange(4) * 0.03,
        position=generator.normal(size=(2, 3, 3)),
        displacement=generator.normal(size=(*shape, 3)),
        element_area=1e-6,
        force=generator.normal(size=(*shape, 3)),
        normal=None,
        object_pose=generator.normal(size=(4, 3)),
        sensor="left",
        metadata={"b": "2", "a": "1"},
        truth=truth,
    )


@pytest.fixture(scope="session")
def grasp() -> GraspLog:
    """Pressed, then sheared with μ = 0.4: 82 frames of 14×14 markers."""
    schedule = RampSchedule(rest=0.2, press=0.5, settle=0.3, shear=1.5, hold=0.2)
    return tangential_ramp(points=14, pitch=0.9e-3, schedule=schedule, marker_noise=1e-7, force_noise=1e-6, seed=1)


@pytest.fixture(scope="session")
def service_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a real service on a free loopback port, in a thread (its workers are forked processes)."""
    forking.begin()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("service.processes.spawned.CONTEXT", forking.Context())
        yield from _served(Settings(data_folder=tmp_path_factory.mktemp("served"), poll_seconds=5.0))


def _served(settings: Settings) -> Iterator[str]:
    app = create_app(settings)
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="warning", ws="none"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive(), "the server did not start"
        time.sleep(0.005)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join()
