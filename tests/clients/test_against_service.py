"""Both clients against the real application: what they send and read is what the service takes and gives."""

import asyncio
from collections.abc import Awaitable, Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog
from stiction_client import (
    AsyncFrictionClient,
    ConnectionFailed,
    FrictionClient,
    NoModel,
    ProblemError,
    required_normal_force,
)

Call = Callable[..., Any]


@pytest.fixture(params=["sync", "async"])
def call(request: pytest.FixtureRequest, service_url: str) -> Call:
    """Run one call of either client: ``call("material", "paper")``."""

    def sync(method: str, /, *args: Any, **kwargs: Any) -> Any:
        with FrictionClient(service_url) as client:
            return getattr(client, method)(*args, **kwargs)

    def awaited(method: str, /, *args: Any, **kwargs: Any) -> Any:
        async def run() -> Any:
            async with AsyncFrictionClient(service_url) as client:
                pending: Awaitable[Any] = getattr(client, method)(*args, **kwargs)
                return await pending

        return asyncio.run(run())

    return sync if request.param == "sync" else awaited


@pytest.fixture
def name(request: pytest.FixtureRequest, call: Call) -> str:
    """A material of the test's own."""
    material = "".join(c if c.isalnum() else "-" for c in request.node.name)[-100:].lstrip("-")
    call("create_material", material, description="made by a test")
    return material


def test_a_grasp_becomes_a_model_that_both_sides_evaluate_alike(call: Call, name: str, grasp: GraspLog) -> None:
    receipt = call("upload", grasp, material=name, sensor="left")
    job = call("wait", receipt.job)
    assert job.status == "done", job.reason
    log = call("grasp_log", receipt.id)
    assert (log.material, log.sensor, log.format, log.frames) == (name, "left", "npz", len(grasp))
    assert log.grid == grasp.grid
    assert log.detection is not None
    assert log.detection.samples > 0
    material = call("material", name)
    assert (material.description, material.grasp_logs) == ("made by a test", 1)
    model = call("model", name)
    told = (model.material, model.method, model.version, model.current)
    assert told == (name, "hierarchical", job.model_version, True)
    assert model.scales is not None
    assert material.models["ols"].current
    force = float(np.mean(model.domain.normal_force))
    for quantile in (None, 0.05, 0.5):
        answer = call("friction", name, 0.0, force, quantile=quantile)
        assert answer.friction_coefficient == pytest.approx(float(model.predict(0.0, force, quantile)), rel=1e-12)
        assert answer.within_domain == (model.extrapolation(0.0, force) is None)
    grip = required_normal_force(model, 1.0, contact_area=6e-5)
    assert grip.normal_force > 1.0 / 0.45  # simulated with μ = 0.4
    call("rename_material", name, f"{name}2"[-100:])
    for of, elements, method, area in product(("element", "contact", None), (60, None), ("ols", "auto"), (1e-7, None)):
        if (of, elements) != ("contact", None):
            told = call("friction", name, 1e-3, force, 0.05, method, of=of, elements=elements, element_area=area)
            assert told.material == f"{name}2"[-100:], "it answers to its old name, and to every question"


def test_the_same_log_twice_is_one_log(call: Call, name: str, grasp: GraspLog) -> None:
    first = call("upload", grasp, material=name)
    assert call("upload", grasp, material=name).id == first.id
    assert call("wait", first).ended


def test_a_fit_is_asked_for_and_waited_for(call: Call, name: str, grasp: GraspLog) -> None:
    call("wait", call("upload", grasp, material=name))
    job = call("wait", call("fit", name, method="ols"))
    assert (job.kind, job.status, job.model_version) == ("fit", "done", 2)


def test_a_material_without_logs_has_no_model(call: Call, name: str) -> None:
    with pytest.raises(NoModel, match="fitted: none"):
        call("model", name)
    with pytest.raises(ProblemError) as caught:
        call("friction", name, 0.0, 0.1)
    assert (caught.value.type, caught.value.status) == ("/problems/no-model", 409)
    refused = call("wait", call("fit", name))
    assert refused.status == "refused"
    assert refused.reason


def test_materials_are_ensured_and_listed(call: Call, name: str) -> None:
    assert call("ensure_material", name, description="another").description == "made by a test"
    assert name in [material.name for material in call("materials")]


def test_refusals_name_what_is_wrong(call: Call, name: str, tmp_path: Path) -> None:
    with pytest.raises(ProblemError) as caught:
        call("friction", name, 0.0, 0.1, quantile=1.5)
    assert (caught.value.type, caught.value.name, caught.value.value) == (
        "/problems/invalid-request",
        "quantile",
        "1.5",
    )
    with pytest.raises(ProblemError, match="unknown-material"):
        call("material", "nothing of the kind")
    with pytest.raises(ProblemError, match="unknown-job"):
        call("wait", "nothing")
    path = tmp_path / "notes.txt"
    path.write_text("not a log")
    with pytest.raises(ProblemError) as caught:
        call("upload", path, material=name)
    assert (caught.value.type, caught.value.status) == ("/problems/unsupported-format", 415)
    with pytest.raises(ProblemError, match="material-exists"):
        call("create_material", name)


def test_a_real_recording_goes_in_as_a_folder(call: Call) -> None:
    folder = Path(__file__).parents[2] / ".cache/tac3d/PyTac3D/example_data/example_2/HDL1-GWH0021"
    if not folder.is_dir():
        pytest.skip("the Tac3D example recordings are not in .cache (make recordings)")
    receipt = call("upload", folder)
    assert (receipt.sensor, receipt.format, receipt.frames) == ("HDL1-GWH0021", "tac3d", 120)
    assert call("wait", receipt).status in {"done", "refused"}


def test_nobody_listening_is_a_failed_connection() -> None:
    with FrictionClient("http://127.0.0.1:9") as client, pytest.raises(ConnectionFailed, match="ConnectError"):
        client.materials()


def test_owners_are_shown_added_and_removed_and_the_trail_tells_so(call: Call, name: str) -> None:
    assert call("owners", name) == []
    assert call("add_owner", name, "group:lab 1") == ["group:lab 1"]
    assert call("remove_owner", name, "group:lab 1") is None
    removed, added, created = call("audit", subject=name)
    assert [entry.action for entry in (created, added, removed)] == [
        "material.created",
        "owner.added",
        "owner.removed",
    ]
    assert (removed.actor, removed.address, removed.details) == ("anybody", "127.0.0.1", {"owner": "group:lab 1"})
    assert call("audit", subject=name, action="owner.added", limit=1) == [added]


def test_a_material_renamed_or_emptied_while_a_client_holds_it_is_told_by_name(
    service_url: str, name: str, grasp: GraspLog
) -> None:
    """A held model goes on answering; what is asked anew comes under the name of now, or says that there is none."""
    with FrictionClient(service_url) as client, FrictionClient(service_url) as other:
        receipt = client.upload(grasp, material=name)
        client.wait(receipt.job).raise_for_status()
        held = client.model(name)
        renamed = f"{name[:90]}-now"
        other.rename_material(name, renamed)
        assert client.model(name).material == renamed
        assert float(held.predict(0.0, 0.1)) == float(client.model(renamed).predict(0.0, 0.1))
        other.withdraw(receipt.id, "of another material")
        for asked in (name, renamed):
            with pytest.raises(NoModel, match=asked):
                client.model(asked)
        with pytest.raises(ProblemError, match="nowhere"):
            client.model("nowhere")
    assert required_normal_force(held, 0.3, contact_area=6e-5).normal_force > 0.0
